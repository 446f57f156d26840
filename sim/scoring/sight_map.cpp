#include "scoring/sight_map.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>
#include <numbers>
#include <utility>

#include "mapping/line_walk.h"
#include "worlds/occupancy.h"

namespace arex::sim {

namespace {

constexpr std::size_t kWord = 64;

void set_bit(SightMap::Bits& bits, std::size_t patch) {
  bits[patch / kWord] |= std::uint64_t{1} << (patch % kWord);
}

}  // namespace

SightMap::SightMap(const worlds::World& world, std::span<const Vec3f> area_cells_W, double range_m,
                   double slab_m) {
  place(area_cells_W, range_m);
  find_opaque(world, heights(area_cells_W), slab_m);
  lay_rays(range_m);
}

void SightMap::place(std::span<const Vec3f> area_cells_W, double range_m) {
  Eigen::AlignedBox2d box;
  for (const Vec3f& cell : area_cells_W) box.extend(cell.head<2>().cast<double>());
  const double side = kPatch * kColumn_m;
  low_ = side * (box.min() / side).array().floor();
  size_ = kPatch * (column_of(box.max()) / kPatch + Eigen::Vector2i::Ones());
  rim_ = static_cast<int>(std::ceil(range_m / kColumn_m)) + 1;
  const auto patches = static_cast<std::size_t>(size_.prod() / (kPatch * kPatch));
  area_.assign((patches + kWord - 1) / kWord, 0);
  for (const Vec3f& cell : area_cells_W) set_bit(area_, patch(cell.head<2>().cast<double>()));
}

Eigen::Vector2i SightMap::column_of(const Vec2& p_W) const {
  return ((p_W - low_) / kColumn_m).array().floor().cast<int>();
}

bool SightMap::in_box(const Eigen::Vector2i& column) const {
  return (column.array() >= 0).all() && (column.array() < size_.array()).all();
}

std::size_t SightMap::column_index(const Eigen::Vector2i& column) const {
  return static_cast<std::size_t>(column.y() + rim_) *
             static_cast<std::size_t>(size_.x() + 2 * rim_) +
         static_cast<std::size_t>(column.x() + rim_);
}

std::size_t SightMap::patch_index(const Eigen::Vector2i& column) const {
  return static_cast<std::size_t>(column.y() / kPatch) *
             static_cast<std::size_t>(size_.x() / kPatch) +
         static_cast<std::size_t>(column.x() / kPatch);
}

// The area's own, and outwards from it over the sides of columns.
std::vector<float> SightMap::heights(std::span<const Vec3f> area_cells_W) const {
  constexpr float kNone = std::numeric_limits<float>::infinity();
  const auto width = static_cast<std::size_t>(size_.x());
  std::vector<float> height(width * static_cast<std::size_t>(size_.y()), kNone);
  std::vector<Eigen::Vector2i> reached;
  const auto at = [&](const Eigen::Vector2i& c) -> float& {
    return height[static_cast<std::size_t>(c.y()) * width + static_cast<std::size_t>(c.x())];
  };
  for (const Vec3f& cell : area_cells_W) {
    reached.push_back(column_of(cell.head<2>().cast<double>()));
    at(reached.back()) = cell.z();
  }
  for (std::size_t next = 0; next < reached.size(); ++next) {
    const Eigen::Vector2i here = reached[next];
    for (const auto& [dx, dy] :
         {std::pair(1, 0), std::pair(-1, 0), std::pair(0, 1), std::pair(0, -1)}) {
      const Eigen::Vector2i beside = here + Eigen::Vector2i(dx, dy);
      if (!in_box(beside) || at(beside) != kNone) continue;
      at(beside) = at(here);
      reached.push_back(beside);
    }
  }
  return height;
}

void SightMap::find_opaque(const worlds::World& world, const std::vector<float>& heights,
                           double slab_m) {
  const auto [lowest, highest] = std::ranges::minmax(heights);
  const Vec2 high = low_ + kColumn_m * size_.cast<double>();
  const worlds::Bounds box{{low_.x(), low_.y(), static_cast<double>(lowest) - 0.5 * slab_m},
                           {high.x(), high.y(), static_cast<double>(highest) + 0.5 * slab_m}};
  const auto occupancy = voxelize(world, worlds::make_grid(box, kColumn_m),
                                  worlds::ClassSet::all().without(worlds::SurfaceClass::kLeaf));
  const auto columns = static_cast<std::size_t>(size_.x() + 2 * rim_) *
                       static_cast<std::size_t>(size_.y() + 2 * rim_);
  opaque_.assign(columns, 1);
  const int layers = std::max(1, static_cast<int>(std::lround(slab_m / kColumn_m)));
  std::size_t at = 0;
  for (int y = 0; y < size_.y(); ++y) {
    for (int x = 0; x < size_.x(); ++x, ++at) {
      const Vec2 p = low_ + kColumn_m * Vec2(x + 0.5, y + 0.5);
      const double z = static_cast<double>(heights[at]) - 0.5 * slab_m;
      Eigen::Vector3i cell = occupancy.grid.cell_of({p.x(), p.y(), z + 0.5 * kColumn_m});
      int filled = 0;
      for (int k = 0; k < layers; ++k, ++cell.z()) {
        filled += occupancy.grid.contains(cell) && occupancy.at(cell);
      }
      opaque_[column_index({x, y})] = 2 * filled >= layers;
    }
  }
}

void SightMap::lay_rays(double range_m) {
  const int rays =
      static_cast<int>(std::ceil(2 * std::numbers::pi * range_m / (kPatch * kColumn_m)));
  OccupancyMap2D columns;  // column (0, 0) has its middle at the origin
  columns.origin = Vec2::Constant(-0.5 * kColumn_m);
  columns.resolution = kColumn_m;
  const auto patches_off = [](int columns_off) {  // rounded down, as the start is a patch's first
    return (columns_off - (columns_off < 0 ? kPatch - 1 : 0)) / kPatch;
  };
  for (int r = 0; r < rays; ++r) {
    const double angle = 2 * std::numbers::pi * r / rays;
    const Vec2 end = range_m * Vec2(std::cos(angle), std::sin(angle));
    walk_line(columns, Vec2::Zero(), end, [&](const Eigen::Vector2i& c) {
      steps_.push_back({c.y() * (size_.x() + 2 * rim_) + c.x(),
                        patches_off(c.y()) * (size_.x() / kPatch) + patches_off(c.x())});
      return true;
    });
    ray_ends_.push_back(steps_.size());
  }
}

SightMap::Bits SightMap::seen_from(const Vec2& p_W) const {
  Bits seen(area_.size(), 0);
  const Eigen::Vector2i column = column_of(p_W);
  if (!in_box(column)) return seen;
  const Eigen::Vector2i start = column / kPatch * kPatch;
  const std::uint8_t* const opaque = &opaque_[column_index(start)];
  const auto patch = static_cast<std::ptrdiff_t>(patch_index(start));
  std::size_t step = 0;
  for (const std::size_t end : ray_ends_) {
    for (; step < end && !opaque[steps_[step].column]; ++step) {
      set_bit(seen, static_cast<std::size_t>(patch + steps_[step].patch));
    }
    step = end;
  }
  for (std::size_t i = 0; i < seen.size(); ++i) seen[i] &= area_[i];
  return seen;
}

Vec2 SightMap::origin_W(const Vec2& p_W) const {
  const Eigen::Vector2i start = column_of(p_W) / kPatch * kPatch;
  return low_ + kColumn_m * (start.cast<double>() + Vec2::Constant(0.5));
}

bool SightMap::is_opaque(const Vec2& p_W) const {
  const Eigen::Vector2i column = column_of(p_W);
  return !in_box(column) || opaque_[column_index(column)] != 0;
}

std::size_t SightMap::patch(const Vec2& p_W) const { return patch_index(column_of(p_W)); }

bool has_bit(const SightMap::Bits& bits, std::size_t patch) {
  return (bits[patch / kWord] >> (patch % kWord) & 1) != 0;
}

std::size_t count_bits(const SightMap::Bits& bits) {
  std::size_t count = 0;
  for (const std::uint64_t word : bits) count += static_cast<std::size_t>(std::popcount(word));
  return count;
}

std::size_t count_new(const SightMap::Bits& known, const SightMap::Bits& bits) {
  std::size_t count = 0;
  for (std::size_t i = 0; i < bits.size(); ++i) {
    count += static_cast<std::size_t>(std::popcount(bits[i] & ~known[i]));
  }
  return count;
}

void add_bits(SightMap::Bits& known, const SightMap::Bits& bits) {
  for (std::size_t i = 0; i < bits.size(); ++i) known[i] |= bits[i];
}

}  // namespace arex::sim
