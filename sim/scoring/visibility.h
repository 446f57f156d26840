#pragma once

#include <cstdint>
#include <vector>

#include "scoring/reachable_space.h"
#include "scoring/surface_samples.h"
#include "sensors/scene.h"

namespace arex::sim {

struct VisibilityConfig {
  double range_m = 20.0;
  double max_incidence_deg = 82.5;
  double viewpoint_spacing_m = 1.0;

  void fields(auto& f) {
    f("range_m", range_m, "a surface is seen from at most this far away (map's ray length)");
    f("max_incidence_deg", max_incidence_deg,
      "nor flatter than this: half of the LiDAR's beams return");
    f("viewpoint_spacing_m", viewpoint_spacing_m, "one viewpoint in each cube of this side");
    f.check(range_m > 0 && range_m <= 200, "0 < range_m <= 200");
    f.check(max_incidence_deg > 0 && max_incidence_deg <= 90, "0 < max_incidence_deg <= 90");
    f.check(viewpoint_spacing_m >= 0.2 && viewpoint_spacing_m <= 100,
            "0.2 <= viewpoint_spacing_m <= 100");
  }
};

/// Places from which the world is looked at: in each cube of a coarse grid the reachable cell
/// nearest to its middle.
class Viewpoints {
 public:
  Viewpoints(const ReachableSpace& space, double spacing_m);

  /// The viewpoints that are met first from the cube of `p` in the 26 directions to its neighbours,
  /// its own before them all; nearest first.
  [[nodiscard]] std::vector<Vec3> around(const Vec3& p_W, double range_m) const;

  [[nodiscard]] Eigen::Vector3i cube_of(const Vec3& p_W) const { return grid_.cell_of(p_W); }
  [[nodiscard]] const std::vector<Vec3>& all() const { return points_W_; }

 private:
  [[nodiscard]] const Vec3* in_cube(const Eigen::Vector3i& cube) const;

  worlds::GridGeometry grid_;
  std::vector<std::int32_t> point_of_cube_;  ///< -1 where nothing is reachable
  std::vector<Vec3> points_W_;
};

/// Whether nothing stands between a viewpoint and a sample that lies in range and not too flat.
/// Foliage blocks the view.
bool sees(const Scene& scene, const Vec3& viewpoint_W, const SurfaceSample& sample,
          const VisibilityConfig& config);

/// 1 for every sample that one of the viewpoints around it sees. Each answer of 1 has a witness. A
/// few samples that only some further viewpoint sees (0.3 % in the forest, 3 % in the garage, by
/// trying them all) get 0, and then count neither as to be seen nor as seen.
std::vector<std::uint8_t> find_visible(const Scene& scene, const Viewpoints& viewpoints,
                                       const std::vector<SurfaceSample>& samples,
                                       const VisibilityConfig& config);

}  // namespace arex::sim
