#pragma once

#include <vector>

#include "math/types.h"
#include "worlds/world.h"

namespace arex::sim {

/// A point of a true surface that stands for an area around it.
struct SurfaceSample {
  Vec3f p_W = Vec3f::Zero();
  Vec3f normal_W = Vec3f::UnitZ();  ///< unit, of either side
  worlds::SurfaceClass surface_class = worlds::SurfaceClass::kGround;
};

struct SurfaceSampleConfig {
  double sample_area_m2 = 0.02;
  double sample_height_m = 4.0;

  void fields(auto& f) {
    f("sample_area_m2", sample_area_m2, "true surface for each sample");
    f("sample_height_m", sample_height_m, "surfaces higher than this above the ground don't count");
    f.check(sample_area_m2 >= 0.002 && sample_area_m2 <= 10, "0.002 <= sample_area_m2 <= 10");
    f.check(sample_height_m > 0, "sample_height_m > 0");
  }
};

/// Samples of all surfaces but foliage, even over the area: strata of the cumulated area of the
/// triangles in order, and inside a triangle the R2 sequence, so that a large triangle is as evenly
/// covered as many small ones (M. Roberts, The unreasonable effectiveness of quasirandom sequences,
/// 2018). A pure function of the world.
/// @param region_W in W; samples outside it are dropped. Ground, floor and ramp count as ground.
std::vector<SurfaceSample> sample_surfaces(const worlds::World& world,
                                           const worlds::Bounds& region_W,
                                           const SurfaceSampleConfig& config = {});

/// Where the samples lie, of all that share a cube of this edge in W only the first.
std::vector<Vec3f> one_per_cube(const std::vector<SurfaceSample>& samples, double edge_m);

}  // namespace arex::sim
