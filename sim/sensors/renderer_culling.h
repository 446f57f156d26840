#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "math/pose.h"
#include "messages/sensors.h"
#include "sensors/renderer_detail.h"
#include "worlds/world.h"

namespace arex::sim {

/// The part of space a camera can see: the pyramid through the outer borders of its border pixels,
/// cut at a greatest depth.
class ViewVolume {
 public:
  ViewVolume(const PinholeCamera& camera, const Pose& X_WC, double far_m);

  /// False only if no point of the box (in W) lies inside. May err on the side of true.
  [[nodiscard]] bool touches(const Eigen::AlignedBox3f& box) const;
  /// Smallest depth (z in C) of any point of the box, m; negative behind the camera.
  [[nodiscard]] double nearest_depth(const Eigen::AlignedBox3f& box) const;

 private:
  struct Plane {
    Vec3 normal;  ///< in W, points inwards
    double offset = 0;
  };
  std::vector<Plane> planes_;  ///< left, right, top, bottom, back, far
};

/// For each triangle: +1 if it belongs to a closed surface and its corners run counter-clockwise
/// seen from outside, -1 if clockwise, 0 if its surface is open (a leaf, the terrain). A surface is
/// what hangs together by shared vertices; it is closed if each of its edges bounds exactly two
/// triangles and it has an inside. The mesh's own winding does not matter.
std::vector<std::int8_t> outward_winding(const worlds::Mesh& mesh);

/// What a cluster's triangles are.
enum class ClusterKind : std::uint8_t {
  kSolid,  ///< they bound solids: of each its far side is never seen
  kOpen,
  kLeaves,  ///< pairs, each a leaf, in the order in which leaves are drawn
};

/// A chunk of a mesh cut finer, for culling: a view touches the clusters it needs and few more.
struct ClusteredChunk {
  /// The chunk's own, grouped by cluster, corners as in the mesh; those of closed surfaces
  /// counter-clockwise from outside.
  std::vector<std::array<std::uint32_t, 3>> triangles;
  std::vector<std::uint32_t> source;    ///< of each triangle: its index in the mesh
  std::vector<worlds::Chunk> clusters;  ///< cover the chunk's triangles once, in order
  std::vector<ClusterKind> kind;        ///< of each cluster
  std::vector<float> width_m;           ///< of each cluster, of its widest piece: DetailOfMesh
};

/// The chunk's triangles, those of one kind and of about one width along a Morton curve, cut into
/// runs of at most `max_triangles`.
/// @param winding that of the mesh
/// @pre max_triangles is even
ClusteredChunk cluster_chunk(const worlds::Mesh& mesh, const worlds::Chunk& chunk,
                             const std::vector<std::int8_t>& winding, std::uint32_t max_triangles,
                             const DetailOfMesh& detail = {});

/// Indices of the chunks or clusters that may be seen, nearest first (ties by index).
std::vector<std::uint32_t> visible_chunks(const std::vector<worlds::Chunk>& chunks,
                                          const ViewVolume& view);

}  // namespace arex::sim
