#include "mapping/floor_sheet.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <span>
#include <utility>

#include "mapping/bits.h"

namespace arex {
namespace {

constexpr std::array<int, 8> kDx{1, 0, -1, 0, 1, -1, -1, 1}, kDy{0, 1, 0, -1, 1, 1, -1, -1};
/// Cost of a step between tiles: 7/5 is the square root of 2 to 1 %.
constexpr std::size_t kStraight = 5, kDiagonal = 7;
constexpr std::size_t kFar = ~std::size_t{0};
/// On top of that for each layer up or down: a metre of height like two more of way, so that
/// another storey is always further than this one's far end under it. Of a step, up to so much.
constexpr double kPerLayer = 1.25;
constexpr std::size_t kMostClimb = 16;
/// O's origin is the standing vehicle's body, a leg above the ground.
constexpr int kStandLayers = 3;
/// Between the plane that a tile is expected to have and its floor: half a layer of noise, and what
/// a crest or a foot of a ramp bends within a tile.
constexpr int kTolerance = 1;
/// A plane that went on over the unseen may be further off by a layer each so many tiles, up to so
/// many layers: O's tilt, half a degree, is one in ten metres.
constexpr int kGuessedPerLayer = 4, kMostGuessedLayers = 2;
/// Planes that differ by less at a tile's corners say the same: the 2D map is not made anew.
constexpr double kSame = 1.0;
/// Neighbours whose floors are further apart than this do not meet; half a band, that what is free
/// over one is free over the other.
constexpr double kBrink = 10;
/// Along the way the floor of neighbours is the same storey within what the steepest ramp rises.
constexpr double kStorey = 14;
constexpr int kLeastForSlope = 12;          ///< columns
constexpr double kLeastSpread = 1.5;        ///< variance of their places, columns^2
constexpr double kLeastIndependence = 0.3;  ///< of those along x and y: 1 - squared correlation
constexpr double kOutlier_layers = 1.5;
/// Feet further than this from all that is expected of a tile are none of its floor: it rises by a
/// layer a column at most, from somewhere within the tolerance.
constexpr int kReach = kBrickCells + kTolerance + kMostGuessedLayers;
constexpr std::size_t kMostLayers = 2 * kReach + 2 * kBrickCells;

/// Masks of the columns whose x (in bits 0, 2, 4 of the index) is 0 mod 2, 1 mod 4, and 3.
constexpr std::uint64_t columns_where(int modulus, int rest, int bit) {
  std::uint64_t out = 0;
  for (int i = 0; i < 64; ++i) {
    const int c = (i >> bit & 1) | (i >> (bit + 2) & 1) << 1 | (i >> (bit + 4) & 1) << 2;
    if (c % modulus == rest) out |= std::uint64_t{1} << i;
  }
  return out;
}

/// The columns one further on along an axis (bit 0: x, bit 1: y); from 7 on they are lost. In
/// Morton order a step from an even column is 1 bit, from 1 or 5 it is 3, from 3 it is 11.
template <int kAxis>
std::uint64_t shift_up(std::uint64_t columns) {
  constexpr std::uint64_t even = columns_where(2, 0, kAxis), one = columns_where(4, 1, kAxis);
  constexpr std::uint64_t three = columns_where(8, 3, kAxis);
  return (columns & even) << (1 << kAxis) | (columns & one) << (3 << kAxis) |
         (columns & three) << (11 << kAxis);
}
template <int kAxis>
std::uint64_t shift_down(std::uint64_t columns) {
  constexpr std::uint64_t odd = columns_where(2, 1, kAxis), two = columns_where(4, 2, kAxis);
  constexpr std::uint64_t four = columns_where(8, 4, kAxis);
  return (columns & odd) >> (1 << kAxis) | (columns & two) >> (3 << kAxis) |
         (columns & four) >> (11 << kAxis);
}

/// The columns and their eight neighbours.
std::uint64_t with_neighbours(std::uint64_t columns) {
  columns |= shift_up<0>(columns) | shift_down<0>(columns);
  return columns | shift_up<1>(columns) | shift_down<1>(columns);
}

int x_of(int bit) { return static_cast<int>(gather_bits(static_cast<std::uint64_t>(bit), 0x15)); }
int y_of(int bit) { return static_cast<int>(gather_bits(static_cast<std::uint64_t>(bit), 0x2a)); }

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

/// Least squares; along axes on which the samples say nothing, with the rise expected there.
TilePlane fit_plane(const Samples& samples, const Vec2& expected_rise) {
  const auto n = static_cast<double>(samples.count);
  Sample mean;
  for (const Sample& s : samples.all()) {
    mean.x += s.x / n;
    mean.y += s.y / n;
    mean.layer += s.layer / n;
  }
  double xx = 0, yy = 0, xy = 0, xz = 0, yz = 0;
  for (const Sample& s : samples.all()) {
    const double x = s.x - mean.x, y = s.y - mean.y, z = s.layer - mean.layer;
    xx += x * x / n;
    yy += y * y / n;
    xy += x * y / n;
    xz += x * z / n;
    yz += y * z / n;
  }
  TilePlane plane;
  plane.rise = expected_rise;
  const double determinant = xx * yy - xy * xy;
  const bool tells = samples.count >= kLeastForSlope && std::min(xx, yy) >= kLeastSpread &&
                     determinant >= kLeastIndependence * xx * yy;
  if (tells) plane.rise = Vec2(yy * xz - xy * yz, xx * yz - xy * xz) / determinant;
  plane.height = mean.layer + plane.rise.x() * (TilePlane::kMiddle - mean.x) +
                 plane.rise.y() * (TilePlane::kMiddle - mean.y);
  return plane;
}

TilePlane shifted(const TilePlane& plane, const Eigen::Vector2i& step) {
  TilePlane there = plane;
  there.height += kBrickCells * (plane.rise.x() * step.x() + plane.rise.y() * step.y());
  return there;
}

bool say_the_same(const TilePlane& a, const TilePlane& b) {
  constexpr double kEnd = kBrickCells - 1;
  for (const double x : {0.0, kEnd}) {
    for (const double y : {0.0, kEnd}) {
      if (std::abs(a.at(x, y) - b.at(x, y)) >= kSame) return false;
    }
  }
  return true;
}

}  // namespace

ColumnLayers::ColumnLayers(const TilePlane& plane) {
  std::array<int, 64> layers{};
  for (int i = 0; i < 64; ++i) {
    layers[static_cast<std::size_t>(i)] = static_cast<int>(std::lround(plane.at(x_of(i), y_of(i))));
  }
  low_ = *std::min_element(layers.begin(), layers.end());
  count_ = *std::max_element(layers.begin(), layers.end()) - low_ + 1;
  for (std::size_t i = 0; i < 64; ++i) {
    columns_[static_cast<std::size_t>(layers[i] - low_)] |= std::uint64_t{1} << i;
  }
}

FloorSheet::FloorSheet(int width, int height, double tile_m, double max_slope, int support)
    : width_(width),
      height_(height),
      max_slope_(std::min(max_slope, ColumnLayers::kSteepest)),
      support_(support),
      corridor_(static_cast<std::size_t>(std::lround(kStraight * kCorridor_m / tile_m))),
      tiles_(static_cast<std::size_t>(width * height)) {}

void FloorSheet::set_feet(std::size_t tile, std::vector<Feet> feet) {
  tiles_[tile].feet = std::move(feet);
  changed_ = true;
}

void FloorSheet::note_place(const Eigen::Vector2i& tile) {
  if (!contains(tile)) return;
  if (way_.empty()) {
    way_.push_back(tile);
    changed_ = true;
    return;
  }
  while (way_.back() != tile) {
    const Eigen::Vector2i left = tile - way_.back();
    step_to(way_.back() + left.cwiseSign());
    changed_ = true;
  }
}

/// A loop is cut where the way comes beside itself on the same storey.
void FloorSheet::step_to(const Eigen::Vector2i& tile) {
  const double here = tiles_[index(way_.back())].shown.plane.height;
  const auto again = std::find_if(way_.begin(), way_.end() - 1, [&](const Eigen::Vector2i& p) {
    return (p - tile).cwiseAbs().maxCoeff() <= 1 &&
           std::abs(tiles_[index(p)].shown.plane.height - here) <= kStorey;
  });
  if (again != way_.end() - 1) way_.erase(again + 1, way_.end());
  if (way_.back() != tile) way_.push_back(tile);
}

std::optional<TilePlane> FloorSheet::plane(std::size_t tile) const {
  const Label& label = tiles_[tile].shown;
  if (!label.known) return std::nullopt;
  return label.plane;
}

std::vector<std::size_t> FloorSheet::spread() {
  if (!std::exchange(changed_, false) || way_.empty()) return {};
  for (Tile& tile : tiles_) {
    tile.label = {};
    tile.pinned = tile.done = false;
  }
  follow_way();
  pin_corridor();
  flood();
  std::vector<std::size_t> changed;
  std::vector<std::uint64_t> brinks(tiles_.size(), 0);
  for (std::size_t t = 0; t < tiles_.size(); ++t) {
    Tile& tile = tiles_[t];
    const bool same =
        tile.label.known == tile.shown.known && say_the_same(tile.label.plane, tile.shown.plane);
    tile.shown.seen = tile.label.seen;
    if (same) continue;
    tile.shown = tile.label;
    changed.push_back(t);
  }
  find_brinks(brinks);
  for (std::size_t t = 0; t < tiles_.size(); ++t) {
    if (brinks[t] == tiles_[t].brinks) continue;
    tiles_[t].brinks = brinks[t];
    changed.push_back(t);
  }
  return changed;
}

void FloorSheet::follow_way() {
  Label label;
  label.known = true;
  label.plane.height = -0.5 * kStandLayers;
  label.guessed = kMostGuessedLayers * kGuessedPerLayer;  // the leg's length is not known here
  for (std::size_t k = 0; k < way_.size(); ++k) {
    const Eigen::Vector2i step = way_[k] - way_[k == 0 ? 0 : k - 1];
    const std::size_t t = index(way_[k]);
    label = go_on(label, step, t);
    tiles_[t].label = label;
    tiles_[t].pinned = true;
  }
}

void FloorSheet::pin_corridor() {
  std::vector<std::vector<std::size_t>> open(corridor_ + kDiagonal + 1);
  for (auto place = way_.rbegin(); place != way_.rend(); ++place) open[0].push_back(index(*place));
  for (std::size_t cost = 0; cost <= corridor_; ++cost) {
    for (std::size_t k = 0; k < open[cost].size(); ++k) {
      const std::size_t t = open[cost][k];
      if (std::exchange(tiles_[t].done, true)) continue;
      for (std::size_t s = 0; s < kDx.size(); ++s) {
        const Eigen::Vector2i step(kDx[s], kDy[s]);
        if (!contains(tile_of(t) + step)) continue;
        const std::size_t there = index(tile_of(t) + step);
        const std::size_t reached = cost + (s < 4 ? kStraight : kDiagonal);
        if (tiles_[there].pinned || reached > corridor_) continue;
        const Label label = go_on(tiles_[t].label, step, there);
        if (!label.seen) continue;
        tiles_[there].label = label;
        tiles_[there].pinned = true;
        open[reached].push_back(there);
      }
    }
  }
  for (Tile& tile : tiles_) tile.done = false;
}

/// From the vehicle outwards, nearest tiles first. What is pinned is passed through where it is the
/// floor that leads there.
void FloorSheet::flood() {
  std::vector<std::size_t> costs(tiles_.size(), kFar), parents(tiles_.size(), kFar);
  std::vector<std::vector<std::size_t>> open(kDiagonal + kMostClimb + 1);  // a ring
  const std::size_t first = index(way_.back());
  costs[first] = 0;
  open[0].push_back(first);
  std::size_t waiting = 1;
  for (std::size_t cost = 0; waiting > 0; ++cost) {
    std::vector<std::size_t>& bucket = open[cost % open.size()];
    for (std::size_t k = 0; k < bucket.size(); ++k) {
      const std::size_t t = bucket[k];
      --waiting;
      if (tiles_[t].done || costs[t] != cost) continue;
      if (!tiles_[t].pinned) settle(t, parents[t]);
      tiles_[t].done = true;
      for (std::size_t s = 0; s < kDx.size(); ++s) {
        const Eigen::Vector2i step(kDx[s], kDy[s]);
        if (!contains(tile_of(t) + step)) continue;
        const std::size_t there = index(tile_of(t) + step);
        const Tile& next = tiles_[there];
        const double expected = shifted(tiles_[t].label.plane, step).height;
        const double climb = kPerLayer * std::abs(expected - tiles_[t].label.plane.height);
        const std::size_t reached = cost + (s < 4 ? kStraight : kDiagonal) +
                                    std::min(static_cast<std::size_t>(climb), kMostClimb);
        if (next.done || reached >= costs[there]) continue;
        if (next.pinned && std::abs(expected - next.label.plane.height) > kBrink) continue;
        costs[there] = reached;
        parents[there] = t;
        open[reached % open.size()].push_back(there);
        ++waiting;
      }
    }
    bucket.clear();
  }
}

/// A tile takes the floor that it has if any neighbour's that is nearer goes on into it; otherwise
/// the nearest one's, gone on.
void FloorSheet::settle(std::size_t t, std::size_t parent) {
  const Eigen::Vector2i here = tile_of(t);
  tiles_[t].label = go_on(tiles_[parent].label, here - tile_of(parent), t);
  if (tiles_[t].label.seen || tiles_[t].feet.empty()) return;
  for (std::size_t s = 0; s < kDx.size(); ++s) {
    const Eigen::Vector2i step(kDx[s], kDy[s]);
    if (!contains(here - step)) continue;
    const std::size_t from = index(here - step);
    if (from == parent || !tiles_[from].done || !tiles_[from].label.seen) continue;
    const Label label = go_on(tiles_[from].label, step, t);
    if (!label.seen) continue;
    tiles_[t].label = label;
    return;
  }
}

FloorSheet::Label FloorSheet::go_on(const Label& from, const Eigen::Vector2i& step,
                                    std::size_t tile) const {
  Label label;
  label.known = true;
  const TilePlane expected = shifted(from.plane, step);
  const int most = kTolerance + std::min(from.guessed / kGuessedPerLayer, kMostGuessedLayers);
  for (int tolerance = kTolerance; tolerance <= most; ++tolerance) {  // the nearest one first
    if (const auto floor = find_floor(tiles_[tile].feet, expected, tolerance)) {
      label.plane = *floor;
      label.seen = true;
      return label;
    }
  }
  label.plane = expected;
  label.plane.rise *= 0.5;
  label.guessed = from.guessed + 1;
  return label;
}

std::optional<TilePlane> FloorSheet::find_floor(const std::vector<Feet>& feet,
                                                const TilePlane& expected, int tolerance) const {
  const ColumnLayers layers(expected);
  const int low = layers.lowest() - kReach, high = layers.highest() + kReach;
  const auto from = [](const Feet& f, int layer) { return f.layer < layer; };
  const auto begin = std::lower_bound(feet.begin(), feet.end(), low, from);
  const std::span<const Feet> near(begin, std::lower_bound(begin, feet.end(), high, from));
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
  return plane;
}

void FloorSheet::find_brinks(std::vector<std::uint64_t>& brinks) const {
  constexpr double kEnd = kBrickCells - 1;
  constexpr std::array<std::uint64_t, 4> kSide{columns_where(8, 7, 0), columns_where(8, 7, 1),
                                               columns_where(8, 0, 0), columns_where(8, 0, 1)};
  for (std::size_t t = 0; t < tiles_.size(); ++t) {
    const Label& here = tiles_[t].shown;
    if (!here.known || !here.seen) continue;
    for (std::size_t s = 0; s < kSide.size(); ++s) {
      const Eigen::Vector2i step(kDx[s], kDy[s]);
      if (!contains(tile_of(t) + step)) continue;
      const Label& there = tiles_[index(tile_of(t) + step)].shown;
      if (!there.known) continue;
      const auto edge = [&](const TilePlane& plane, int side) {
        const double half = 0.5 * kEnd * side;
        return plane.height + half * (plane.rise.x() * step.x() + plane.rise.y() * step.y());
      };
      if (edge(here.plane, 1) - edge(there.plane, -1) > kBrink) brinks[t] |= kSide[s];
    }
  }
}

}  // namespace arex
