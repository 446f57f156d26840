#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "physics/triangle_tree.h"
#include "worlds/world.h"

namespace arex::sim {

/// A point where a solid of the airframe touches a triangle.
struct MeshTouch {
  std::uint32_t shape = 0;       ///< index into the airframe's shapes
  std::uint32_t triangle = 0;    ///< index into Mesh::triangles
  Vec3 p_W = Vec3::Zero();       ///< midway between the two surfaces, m
  Vec3 normal_W = Vec3::Zero();  ///< out of the world, towards the vehicle
  double depth_m = 0;            ///< > 0
};

/// Contacts between the airframe's solids and triangles, which have no thickness and no inside.
///
/// A solid is a skeleton of points and edges with a radius: exact for capsules, a box's edges and a
/// disc's rim rounded by at most 4 mm. A point touches a triangle at the triangle's nearest point,
/// an edge crosses a triangle's edge at the two nearest points. A contact counts only where it is
/// nearest in its surroundings, so that edges between triangles of one surface are not felt.
///
/// On which side of a surface the vehicle is cannot be seen from the surface. So the middle of the
/// vehicle is followed: a point on it that never passes through a triangle. From there a line leads
/// within the airframe to each solid's root, and on to the points of its skeleton. What it meets on
/// its way holds the point back, however deep it is: walls without thickness cannot be passed at
/// any speed.
class MeshContacts {
 public:
  /// @param world, airframe: must outlive this object; X_WS of a shape is its pose in B
  MeshContacts(const worlds::World& world, const std::vector<worlds::CollisionShape>& airframe);

  [[nodiscard]] bool empty() const { return tree_.empty(); }
  /// Distance from a point to the nearest triangle that can be touched, at most `max_m`.
  [[nodiscard]] double distance(const Vec3& p_W, double max_m) const {
    return tree_.distance(p_W, max_m);
  }

  /// The vehicle is put somewhere: where its middle is now counts as being on the right side.
  void reset(const Vec3& p_WB) {
    middle_ = p_WB;
    held_ = false;
  }
  /// Whether the vehicle has gone so deep that its middle is on the wrong side.
  [[nodiscard]] bool held() const { return held_; }
  /// What touches at a pose that the vehicle has moved to since the last call, at most kMost.
  [[nodiscard]] std::span<const MeshTouch> find(const Pose& X_WB);

  static constexpr std::size_t kMost = 40;

 private:
  struct Skeleton {
    std::vector<Vec3> points_B;
    std::vector<std::array<std::uint32_t, 2>> edges;  ///< of points
    Vec3 root_B = Vec3::Zero();  ///< where the solid meets the rest of the airframe
    double radius_m = 0;
    bool is_disc = false;
    Vec3 centre_B = Vec3::Zero(), axis_B = Vec3::UnitZ();
    double rim_m = 0, half_m = 0;  ///< of a disc's rim, without the radius
  };
  /// A triangle with what every test of it needs.
  struct Face {
    std::uint32_t triangle = 0;
    std::array<Vec3, 3> corners;
    Vec3 normal = Vec3::Zero();  ///< unit, any of the two
    Eigen::AlignedBox3d box;
  };

  static Skeleton skeleton_of(const worlds::CollisionShape& shape);
  void follow_middle(const Vec3& p_WB);
  void gather(const Eigen::AlignedBox3d& box);
  void touch(std::uint32_t shape, const Pose& X_WB);
  /// The first triangle on the way from a to b; nullptr: none.
  [[nodiscard]] const Face* first_between(const Vec3& a, const Vec3& b) const;
  /// @return whether the point is behind a triangle
  bool touch_point(std::uint32_t shape, const Vec3& p);
  void touch_rim(std::uint32_t shape, const Pose& X_WB);
  void touch_edge(std::uint32_t shape, const Vec3& a, const Vec3& b);
  void touch_corners(std::uint32_t shape, const Pose& X_WB);
  [[nodiscard]] bool is_nearest(const Vec3& on_skeleton, const Vec3& on_face,
                                double distance) const;
  void add(const MeshTouch& touch);
  void keep_deepest();

  const worlds::World& world_;
  const std::vector<worlds::CollisionShape>& airframe_;
  TriangleTree tree_;
  std::vector<Skeleton> skeletons_;
  Vec3 middle_ = Vec3::Zero();
  bool held_ = false;
  std::vector<MeshTouch> touches_;
  // Scratch, of one shape.
  std::vector<std::uint32_t> found_;
  std::vector<Face> faces_;
  std::vector<Vec3> points_W_;
  std::vector<std::uint8_t> behind_;
  std::size_t first_of_shape_ = 0;
  Vec3 root_W_ = Vec3::Zero();
  const Face* wall_of_root_ = nullptr;  ///< between the middle and the root
};

}  // namespace arex::sim
