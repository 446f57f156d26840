#pragma once

#include <array>
#include <string_view>

#include "math/types.h"

namespace arex {

/// How much one look says about a voxel.
struct SensorModelConfig {
  double hit_probability = 0.7;
  double miss_probability = 0.4;
  double min_probability = 0.12;
  double max_probability = 0.97;

  void fields(auto& f) {
    f("hit_probability", hit_probability, "occupancy that a hit speaks for (OctoMap)");
    f("miss_probability", miss_probability, "occupancy that a ray passing speaks for (OctoMap)");
    f("min_probability", min_probability, "lower clamp of the occupancy (OctoMap)");
    f("max_probability", max_probability, "upper clamp of the occupancy (OctoMap)");
    f.check(hit_probability > 0.5 && hit_probability < 1, "0.5 < hit_probability < 1");
    f.check(miss_probability > 0 && miss_probability < 0.5, "0 < miss_probability < 0.5");
    f.check(min_probability >= 0.01 && min_probability < 0.5, "0.01 <= min_probability < 0.5");
    f.check(max_probability > 0.5 && max_probability <= 0.99, "0.5 < max_probability <= 0.99");
  }
};

enum class InflationShape { kCubic, kSpherical, kPrinted };
constexpr std::array<std::string_view, 3> enum_names(InflationShape) {
  return {"cubic", "spherical", "printed"};
}

/// The rolling grid that the local planner flies in (paper, Environment Representation).
struct LocalGridConfig {
  int lidar_frames = 5;
  bool use_depth = true;
  bool remember = true;
  int confirm_frames = 2;
  Vec3 size_m{30, 30, 3};
  InflationShape inflation_shape = InflationShape::kCubic;
  double decay_per_s = 0.2;
  double lone_range_m = 1.5;  ///< a 1 cm twig there has 5 returns per frame on each 30 cm
  double depth_min_m = 0.3;
  double depth_max_m = 5.0;
  int depth_hit_stride_px = 4;
  int depth_ray_stride_px = 8;
  SensorModelConfig sensor;

  void fields(auto& f) {
    f("lidar_frames", lidar_frames, "newest LiDAR frames whose points are obstacles (paper: 5)");
    f("use_depth", use_depth, "the newest depth frame's points are obstacles too (paper)");
    f("remember", remember, "obstacles hit in confirm_frames frames stay while evidence lasts");
    f("confirm_frames", confirm_frames, "of the frames held: hits in so many confirm an obstacle");
    f("size_m", size_m, "extent along x, y, z, centred on the vehicle (paper)");
    f("inflation_shape", inflation_shape,
      "cubic (as the paper means it), spherical, or printed: its offsets to the letter, one "
      "octant");
    f("decay_per_s", decay_per_s, "log-odds per second by which what is not seen is forgotten");
    f("lone_range_m", lone_range_m,
      "nearer than this a LiDAR return without another beside it is false");
    f("depth_min_m", depth_min_m, "nearer depth is not used");
    f("depth_max_m", depth_max_m, "farther depth only says what is free (sigma 0.09 m there)");
    f("depth_hit_stride_px", depth_hit_stride_px, "every n-th pixel of every n-th row is a point");
    f("depth_ray_stride_px", depth_ray_stride_px, "every n-th pixel of every n-th row is a ray");
    f("sensor", sensor, "evidence of hits and misses, in the local grid and in the OctoMap");
    f.check(lidar_frames >= 1 && lidar_frames <= 10, "1 <= lidar_frames <= 10");
    f.check(confirm_frames >= 2 && confirm_frames <= 11, "2 <= confirm_frames <= 11");
    f.check(size_m.minCoeff() >= 1 && size_m.maxCoeff() <= 40, "1 <= size_m <= 40");
    f.check(decay_per_s >= 0 && decay_per_s <= 1000, "0 <= decay_per_s <= 1000");
    f.check(lone_range_m >= 0 && lone_range_m <= 5, "0 <= lone_range_m <= 5");
    f.check(depth_min_m > 0 && depth_min_m < depth_max_m, "0 < depth_min_m < depth_max_m");
    f.check(depth_max_m <= 20, "depth_max_m <= 20");
    f.check(depth_hit_stride_px >= 1 && depth_hit_stride_px <= 4096,
            "1 <= depth_hit_stride_px <= 4096");
    f.check(depth_ray_stride_px >= 1 && depth_ray_stride_px <= 4096,
            "1 <= depth_ray_stride_px <= 4096");
    f.check(depth_hit_stride_px < 1 || depth_ray_stride_px % depth_hit_stride_px == 0,
            "depth_ray_stride_px a multiple of depth_hit_stride_px");
  }
};

enum class BandReference { kGround, kAbsolute, kFloor };
constexpr std::array<std::string_view, 3> enum_names(BandReference) {
  return {"ground", "absolute", "floor"};
}

/// The map of the whole mission: OctoMap and the 2D occupancy of the exploration.
struct GlobalMapConfig {
  Vec3 low_m{-30, -25, -3};
  Vec3 high_m{30, 25, 9};
  double margin_m = 5;
  double range_m = 20;
  BandReference band = BandReference::kFloor;
  double band_low_m = 0.4;
  double band_high_m = 2.0;
  int min_free_cells = 3;
  double ground_max_slope = 0.7;  ///< a ramp of 35 degrees
  int ground_support = 3;
  SensorModelConfig sensor;  ///< handed down from mapping.sensor

  void fields(auto& f) {
    f("low_m", low_m, "lower corner of the mapped box in O; unless given, around where it flies");
    f("high_m", high_m, "upper corner of the mapped box in O; unless given, around where it flies");
    f("margin_m", margin_m,
      "of a box that is not given, along x and y beyond exploration bounds, entry and waypoints");
    f("range_m", range_m, "LiDAR rays count up to here");
    f("band", band,
      "what the height band of the 2D map stands on: floor, what goes on from under the vehicle's "
      "way, down ramps and in one of several storeys; ground, the lowest that was seen; absolute, "
      "O's origin (paper)");
    f("band_low_m", band_low_m,
      "lower edge of the band; over the ground's relief within a tile of 8 cells");
    f("band_high_m", band_high_m, "upper edge of the band (paper: 2 m above ground)");
    f("min_free_cells", min_free_cells, "a column is free when so many of its band are");
    f("ground_max_slope", ground_max_slope, "steeper rises are objects, not ground");
    f("ground_support", ground_support, "occupied voxels in two layers of a tile that make ground");
    f.check((low_m.array() < high_m.array()).all(), "low_m < high_m");
    f.check((high_m - low_m).maxCoeff() <= 400, "high_m - low_m <= 400 m along each axis");
    f.check(margin_m >= 0 && margin_m <= 50, "0 <= margin_m <= 50");
    f.check(range_m > 0 && range_m <= 24, "0 < range_m <= 24");
    f.check(band_low_m < band_high_m, "band_low_m < band_high_m");
    f.check(min_free_cells >= 1 && min_free_cells <= 8, "1 <= min_free_cells <= 8");
    f.check(ground_max_slope > 0, "ground_max_slope > 0");
    f.check(ground_support >= 1 && ground_support <= 64, "1 <= ground_support <= 64");
  }
};

}  // namespace arex
