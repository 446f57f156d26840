#include "scoring/sight_map.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <limits>
#include <numbers>

#include "worlds/occupancy.h"

namespace arex::sim {

using worlds::SurfaceClass;

SightMap::SightMap(const worlds::World& world, std::span<const Vec3f> area_cells_W, double range_m,
                   double slab_m) {
  place(area_cells_W, range_m);
  find_opaque(world, heights(area_cells_W), slab_m);
  number_patches(area_cells_W);
  lay_rays(range_m);
}

void SightMap::place(std::span<const Vec3f> area_cells_W, double range_m) {
  Eigen::AlignedBox2d box;
  for (const Vec3f& cell : area_cells_W) box.extend(cell.head<2>().cast<double>());
  // On multiples of a patch, as the map's cells are.
  const double side = kPatch * kColumn_m;
  low_ = side * (box.min() / side).array().floor();
  size_ = column_of(box.max()) + Eigen::Vector2i::Ones();
  steps_ = static_cast<std::size_t>(std::lround(range_m / kColumn_m));
  rim_ = static_cast<int>(steps_) + 1;
}

Eigen::Vector2i SightMap::column_of(const Vec2& p_W) const {
  return ((p_W - low_) / kColumn_m).array().floor().cast<int>();
}

bool SightMap::in_box(const Eigen::Vector2i& column) const {
  return (column.array() >= 0).all() && (column.array() < size_.array()).all();
}

std::size_t SightMap::index(const Eigen::Vector2i& column) const {
  return static_cast<std::size_t>(column.y() + rim_) *
             static_cast<std::size_t>(size_.x() + 2 * rim_) +
         static_cast<std::size_t>(column.x() + rim_);
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
                                  worlds::ClassSet::all().without(SurfaceClass::kLeaf));
  const auto columns = static_cast<std::size_t>(size_.x() + 2 * rim_) *
                       static_cast<std::size_t>(size_.y() + 2 * rim_);
  column_.assign(columns, kOpaque);
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
      if (2 * filled < layers) column_[index({x, y})] = kNoPatch;
    }
  }
}

void SightMap::number_patches(std::span<const Vec3f> area_cells_W) {
  for (const Vec3f& cell : area_cells_W) {
    const Eigen::Vector2i own = column_of(cell.head<2>().cast<double>());
    std::array<std::size_t, kPatch * kPatch> square{};
    for (int i = 0; i < kPatch * kPatch; ++i) {
      square[static_cast<std::size_t>(i)] =
          index(own / kPatch * kPatch + Eigen::Vector2i(i % kPatch, i / kPatch));
    }
    std::int32_t patch = kNoPatch;
    for (const std::size_t at : square) patch = std::max(patch, column_[at]);
    if (patch == kNoPatch) patch = static_cast<std::int32_t>(patches_++);
    for (const std::size_t at : square) {
      if (column_[at] == kNoPatch) column_[at] = patch;
    }
    column_[index(own)] = patch;  // the vehicle fits there, at some height
  }
}

void SightMap::lay_rays(double range_m) {
  const int rays =
      static_cast<int>(std::ceil(2 * std::numbers::pi * range_m / (kPatch * kColumn_m)));
  const std::int32_t row = size_.x() + 2 * rim_;
  for (int r = 0; r < rays; ++r) {
    const double angle = 2 * std::numbers::pi * r / rays;
    const Vec2 direction(std::cos(angle), std::sin(angle));
    for (std::size_t s = 1; s <= steps_; ++s) {
      const Vec2 p = static_cast<double>(s) * direction;
      rays_.push_back(static_cast<std::int32_t>(std::lround(p.y())) * row +
                      static_cast<std::int32_t>(std::lround(p.x())));
    }
  }
}

SightMap::Bits SightMap::seen_from(const Vec2& p_W) const {
  constexpr std::size_t kWord = 64;
  Bits seen((patches_ + kWord - 1) / kWord, 0);
  const Eigen::Vector2i column = column_of(p_W);
  if (!in_box(column)) return seen;
  const auto mark = [&](std::int32_t patch) {
    if (patch < 0) return;
    seen[static_cast<std::size_t>(patch) / kWord] |= std::uint64_t{1}
                                                     << (static_cast<std::size_t>(patch) % kWord);
  };
  const std::size_t start = index(column);
  mark(column_[start]);
  for (std::size_t ray = 0; ray < rays_.size(); ray += steps_) {
    for (std::size_t s = 0; s < steps_; ++s) {
      const std::size_t at =
          start + static_cast<std::size_t>(static_cast<std::ptrdiff_t>(rays_[ray + s]));
      if (column_[at] == kOpaque) break;
      mark(column_[at]);
    }
  }
  return seen;
}

std::int32_t SightMap::at(const Vec2& p_W) const {
  const Eigen::Vector2i column = column_of(p_W);
  return in_box(column) ? column_[index(column)] : kOpaque;
}

Vec2 SightMap::middle_W(const Vec2& p_W) const {
  return low_ + kColumn_m * (column_of(p_W).cast<double>() + Vec2::Constant(0.5));
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
