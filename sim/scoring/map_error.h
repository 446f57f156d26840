#pragma once

#include <cstddef>
#include <limits>
#include <vector>

#include "math/pose.h"
#include "scoring/figures.h"
#include "sensors/scene.h"
#include "worlds/world.h"

namespace arex::sim {

struct MapErrorConfig {
  double outlier_m = 0.3;
  double foliage_m = 0.3;
  double max_distance_m = 5.0;
  int max_points = 200'000;

  void fields(auto& f) {
    f("outlier_m", outlier_m, "a map point further from every true surface is an outlier");
    f("foliage_m", foliage_m, "a map point nearest to foliage, and this near, is left out");
    f("max_distance_m", max_distance_m, "distances are clamped to this");
    f("max_points", max_points, "a larger cloud is sampled down to this");
    f.check(outlier_m > 0 && foliage_m >= 0, "outlier_m > 0, foliage_m >= 0");
    f.check(max_distance_m > outlier_m && max_distance_m > foliage_m,
            "max_distance_m > outlier_m, foliage_m");
    f.check(max_points >= 1 && max_points <= 10000000, "1 <= max_points <= 10000000");
  }
};

/// How far an estimated map lies from the true surfaces. Not a number: no point was measured.
struct MapScore {
  static constexpr double kUnknown = std::numeric_limits<double>::quiet_NaN();
  std::size_t points = 0;              ///< of the cloud
  std::size_t scored = 0;              ///< of those, measured
  std::size_t foliage = 0;             ///< of those looked at, left out as foliage
  double median_m = kUnknown;          ///< of the distances to the nearest true surface
  double p95_m = kUnknown;             ///< their 95th percentile
  double outlier_fraction = kUnknown;  ///< share further than outlier_m
};

/// Sets the figures `map.*`.
void add_figures(const MapScore& score, Figures& figures);

/// Surfaces to be mapped: all but leaves, shrubs and ferns.
inline constexpr worlds::ClassSet kWithoutFoliage = worlds::ClassSet::all()
                                                        .without(worlds::SurfaceClass::kLeaf)
                                                        .without(worlds::SurfaceClass::kShrub);

/// Exact distances of a cloud's points to the nearest true triangle, foliage included: a map point
/// on a leaf is no error of the map. Points that foliage explains (nearer to it than to any solid
/// surface, within foliage_m) are left out, so that its many small facets, to which any point in a
/// crown is near, do not flatter the figures. A point in mid-air is not excused by the leaf that
/// happens to be nearest: beyond foliage_m it counts.
/// @param cloud_O the map's points in O, m; @param X_WO O in W, usually aligned at the start
MapScore score_map(const std::vector<Vec3f>& cloud_O, const Pose& X_WO, const Scene& scene,
                   const MapErrorConfig& config = {});

}  // namespace arex::sim
