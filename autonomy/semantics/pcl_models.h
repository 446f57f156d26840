#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "math/types.h"

/// What PCL does for this room. Its types stay in pcl_models.cpp.
namespace arex {

/// Whether this build has PCL. Without it the functions below throw std::runtime_error.
[[nodiscard]] bool has_pcl();
inline constexpr const char* kNoPcl =
    "built without PCL, which semantic maps need: install libpcl-dev and build again";

/// The circle (x, y, radius) with most points within `tolerance`, refined on those; nothing if no
/// circle of a radius in `radii` has at least six. RANSAC with a fixed seed, so the answer is a
/// function of the points in their order.
std::optional<Vec3> ransac_circle(const std::vector<Vec2>& points, double tolerance,
                                  const Vec2& radii);

/// Groups of points that can be reached from each other by steps of at most `tolerance`; indices
/// into `points`, each group in rising order, the groups by their first point.
std::vector<std::vector<std::uint32_t>> euclidean_clusters(const std::vector<Vec3f>& points,
                                                           double tolerance, int fewest);

}  // namespace arex
