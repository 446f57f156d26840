#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "math/types.h"

namespace arex {

struct PointCloudMapConfig {
  double voxel_m = 0.08;
  int max_points = 3000000;

  void fields(auto& f) {
    f("voxel_m", voxel_m, "one point, the mean of what fell in, per such cell");
    f("max_points", max_points, "cells kept; later ones are left out (about 70 MB at the default)");
    f.check(voxel_m >= 0.005 && voxel_m <= 10, "0.005 <= voxel_m <= 10");
    f.check(max_points > 0 && max_points <= 100000000, "0 < max_points <= 100000000");
  }
};

/// The global point cloud of a mission: undistorted points in O (paper, eq. (23)), one mean per
/// voxel. Memory grows with what is seen up to a bound, not with time.
class PointCloudMap {
 public:
  explicit PointCloudMap(const PointCloudMapConfig& config);

  void insert(std::span<const Vec3f> points_O);

  [[nodiscard]] std::size_t size() const { return voxels_.size(); }
  /// Points that found no room.
  [[nodiscard]] std::uint64_t refused() const { return refused_; }
  /// One point per voxel in O, m, in the order of their first sight, from the `first` on.
  [[nodiscard]] std::vector<Vec3f> points(std::size_t first = 0) const;

 private:
  struct Voxel {
    std::uint64_t key = 0;
    Vec3f mean = Vec3f::Zero();
    std::uint32_t count = 0;
  };
  void insert(std::uint64_t key, const Vec3f& p);
  [[nodiscard]] std::size_t slot_of(std::uint64_t key) const;
  void grow();

  PointCloudMapConfig config_;
  std::vector<Voxel> voxels_;
  std::vector<std::uint32_t> slots_;  ///< open addressing: 1 + index into voxels_, 0 empty
  std::uint64_t refused_ = 0;
};

}  // namespace arex
