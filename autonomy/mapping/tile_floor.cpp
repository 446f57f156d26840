// What is one tile's own of the floor: which of its columns are floor, and the plane through them.
#include <algorithm>
#include <bit>
#include <cmath>
#include <span>

#include "mapping/floor_sheet.h"
#include "mapping/morton_columns.h"

namespace arex {
namespace {

constexpr int kLeastForSlope = 12;  ///< columns
/// What the expected rise weighs against the samples, columns^2: a layer's noise (0.5) over what
/// the rise changes from one tile to the next (0.1 layers per column), squared.
constexpr double kExpectedRise = 25;
constexpr double kOutlier_layers = 1.5;
/// Feet further than this from all that is expected of a tile are none of its floor: it rises by a
/// layer a column at most, from somewhere within the tolerance.
constexpr int kReach = kBrickCells + FloorSheet::kMostTolerance;
constexpr std::size_t kMostLayers = 2 * kReach + 2 * kBrickCells;

/// A column of a floor: its place in the tile, and the layer in which it lies there.
struct Sample {
  double x = 0, y = 0, layer = 0;
};
struct Samples {
  std::array<Sample, 64> of;
  int count = 0;

  [[nodiscard]] std::span<const Sample> all() const {
    return std::span(of).first(static_cast<std::size_t>(count));
  }
  void drop(const auto& is_off) {
    const auto end = std::remove_if(of.begin(), of.begin() + count, is_off);
    count = static_cast<int>(end - of.begin());
  }
};

/// From the columns that are floor to their neighbours, by a layer at most, until there are no
/// more.
void go_on_column_by_column(std::span<const FloorSheet::Feet> feet,
                            std::array<std::uint64_t, kMostLayers>& floor) {
  for (bool grows = true; grows;) {
    grows = false;
    for (std::size_t k = 0; k < feet.size(); ++k) {
      std::uint64_t near = floor[k];
      if (k > 0 && feet[k - 1].layer == feet[k].layer - 1) near |= floor[k - 1];
      if (k + 1 < feet.size() && feet[k + 1].layer == feet[k].layer + 1) near |= floor[k + 1];
      if (near == 0) continue;
      const std::uint64_t more = with_neighbours(near) & feet[k].columns & ~floor[k];
      grows |= more != 0;
      floor[k] |= more;
    }
  }
}

/// Of each column the lowest.
Samples samples_of(std::span<const FloorSheet::Feet> feet,
                   const std::array<std::uint64_t, kMostLayers>& floor) {
  Samples samples;
  std::uint64_t taken = 0;
  for (std::size_t k = 0; k < feet.size(); ++k) {
    for (std::uint64_t bits = floor[k] & ~taken; bits != 0; bits &= bits - 1) {
      const int i = std::countr_zero(bits);
      samples.of[static_cast<std::size_t>(samples.count++)] = {static_cast<double>(x_of(i)),
                                                               static_cast<double>(y_of(i)),
                                                               static_cast<double>(feet[k].layer)};
    }
    taken |= floor[k];
  }
  return samples;
}

/// Least squares, with the rise expected before the samples are looked at: a few of them, or a row
/// along one axis, tell a height and no slope.
TilePlane fit_plane(const Samples& samples, const Vec2& expected_rise) {
  const auto n = static_cast<double>(samples.count);
  Sample mean;
  for (const Sample& s : samples.all()) {
    mean.x += s.x / n;
    mean.y += s.y / n;
    mean.layer += s.layer / n;
  }
  double xx = kExpectedRise, yy = kExpectedRise, xy = 0, xz = 0, yz = 0;
  for (const Sample& s : samples.all()) {
    const double x = s.x - mean.x, y = s.y - mean.y;
    const double z = s.layer - mean.layer - expected_rise.x() * x - expected_rise.y() * y;
    xx += x * x;
    yy += y * y;
    xy += x * y;
    xz += x * z;
    yz += y * z;
  }
  TilePlane plane;
  plane.rise = expected_rise + Vec2(yy * xz - xy * yz, xx * yz - xy * xz) / (xx * yy - xy * xy);
  plane.height = mean.layer + plane.rise.x() * (TilePlane::kMiddle - mean.x) +
                 plane.rise.y() * (TilePlane::kMiddle - mean.y);
  return plane;
}

/// To the nearest, halves away from zero.
int layer_of(double height) { return static_cast<int>(height + std::copysign(0.5, height)); }

// A plane is lowest and highest at corners.
int lowest_layer(const TilePlane& plane) {
  constexpr double kEnd = kBrickCells - 1;
  return layer_of(plane.at(plane.rise.x() > 0 ? 0 : kEnd, plane.rise.y() > 0 ? 0 : kEnd));
}
int highest_layer(const TilePlane& plane) {
  constexpr double kEnd = kBrickCells - 1;
  return layer_of(plane.at(plane.rise.x() > 0 ? kEnd : 0, plane.rise.y() > 0 ? kEnd : 0));
}

/// The places of a tile's columns.
constexpr std::array<double, 64> column_places(int axis) {
  std::array<double, 64> places{};
  for (int i = 0; i < 64; ++i) {
    const int along = (i >> axis & 1) | (i >> (axis + 2) & 1) << 1 | (i >> (axis + 4) & 1) << 2;
    places[static_cast<std::size_t>(i)] = along;
  }
  return places;
}
constexpr std::array<double, 64> kColumnX = column_places(0), kColumnY = column_places(1);

}  // namespace

ColumnLayers::ColumnLayers(const TilePlane& plane) {
  low_ = lowest_layer(plane);
  count_ = highest_layer(plane) - low_ + 1;
  if (count_ == 1) {  // of a level floor
    columns_[0] = ~std::uint64_t{0};
    return;
  }
  for (unsigned i = 0; i < 64; ++i) {
    const int layer = layer_of(plane.at(kColumnX[i], kColumnY[i]));
    columns_[static_cast<std::size_t>(layer - low_)] |= std::uint64_t{1} << i;
  }
}

std::optional<TilePlane> FloorSheet::find_floor(const std::vector<Feet>& feet,
                                                const TilePlane& expected, int tolerance) const {
  const int low = lowest_layer(expected) - kReach, high = highest_layer(expected) + kReach;
  const auto from = [](const Feet& f, int layer) { return f.layer < layer; };
  const auto begin = std::lower_bound(feet.begin(), feet.end(), low, from);
  const std::span<const Feet> near(begin, std::lower_bound(begin, feet.end(), high, from));
  if (near.empty()) return std::nullopt;
  const ColumnLayers layers(expected);
  std::array<std::uint64_t, kMostLayers> floor{};
  for (std::size_t k = 0; k < near.size(); ++k) {
    const int layer = near[k].layer;
    floor[k] = near[k].columns & layers.between(layer - tolerance, layer + tolerance + 1);
  }
  go_on_column_by_column(near, floor);
  Samples samples = samples_of(near, floor);
  if (samples.count < support_) return std::nullopt;
  // Twice: the second time without what stands on it or leans against it.
  TilePlane plane = fit_plane(samples, expected.rise);
  samples.drop(
      [&](const Sample& s) { return std::abs(s.layer - plane.at(s.x, s.y)) > kOutlier_layers; });
  if (samples.count < support_) return std::nullopt;
  plane = fit_plane(samples, expected.rise);
  if (plane.rise.norm() > max_slope_) return std::nullopt;
  // A ramp shows its slope; what only lies near where it would go on is the foot of a wall.
  const bool shown = samples.count >= kLeastForSlope || plane.rise.norm() < kLevel;
  return shown ? std::optional(plane) : std::nullopt;
}

}  // namespace arex
