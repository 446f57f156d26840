// In the place of pcl_models.cpp where PCL is not installed.
#include <stdexcept>

#include "semantics/pcl_models.h"

namespace arex {

bool has_pcl() { return false; }

std::optional<Vec3> ransac_circle(const std::vector<Vec2>& /*points*/, double /*tolerance*/,
                                  const Vec2& /*radii*/) {
  throw std::runtime_error(kNoPcl);
}

std::vector<std::vector<std::uint32_t>> euclidean_clusters(const std::vector<Vec3f>& /*points*/,
                                                           double /*tolerance*/, int /*fewest*/) {
  throw std::runtime_error(kNoPcl);
}

}  // namespace arex
