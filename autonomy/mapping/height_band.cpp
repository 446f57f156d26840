#include "mapping/height_band.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>

#include "mapping/bits.h"

namespace arex {
namespace {

/// A floor on the border between two layers has returns in both, and its noise in a third.
constexpr int kFloorLayers = 2;
/// Above the floor: what a vehicle descends through that hovers at the paper's flight height.
constexpr double kAir_m = 1.5;

}  // namespace

HeightBand::HeightBand(const GlobalMapConfig& config, double resolution_m, const CellBox& box,
                       const Cell& brick_low, const Cell& brick_count)
    : reference_(config.band),
      resolution_m_(resolution_m),
      band_low_(static_cast<int>(std::lround(config.band_low_m / resolution_m))),
      band_high_(static_cast<int>(std::lround(config.band_high_m / resolution_m))),
      min_free_(config.min_free_cells),
      slope_(config.ground_max_slope * kBrickCells),
      support_(config.ground_support),
      relief_((config.band == BandReference::kFloor ? 1 : static_cast<int>(std::ceil(slope_))) +
              kFloorLayers),
      air_(static_cast<int>(std::lround(kAir_m / resolution_m))),
      box_(box),
      brick_low_(brick_low),
      brick_count_(brick_count),
      tiles_(static_cast<std::size_t>(brick_count.x() * brick_count.y())),
      column_(static_cast<std::size_t>(brick_count.z())) {
  for (Tile& tile : tiles_) tile.lowest = tile.ground = kNoGround;
  map_ = map_geometry(box, resolution_m);
  const auto count = static_cast<std::size_t>(map_.width) * static_cast<std::size_t>(map_.height);
  map_.cells.assign(count, OccupancyMap2D::kUnknown);
  map_.floor.top.assign(count, FloorMap::kUnknown);
  map_.floor.overhead.assign(count, FloorMap::kNothing);
  if (reference_ == BandReference::kAbsolute) return;
  map_.ground.tile_m = resolution_m * kBrickCells;
  map_.ground.origin = brick_low.head<2>().cast<double>() * map_.ground.tile_m;
  map_.ground.width = brick_count.x();
  map_.ground.heights.assign(tiles_.size(), std::numeric_limits<float>::quiet_NaN());
  if (reference_ != BandReference::kFloor) return;
  sheet_.emplace(brick_count.x(), brick_count.y(), map_.ground.tile_m, config.ground_max_slope,
                 config.ground_support);
  map_.ground.rises.assign(tiles_.size(), Eigen::Vector2f::Zero());
}

void HeightBand::note(const BrickChange& change) {
  const Cell at = change.brick - brick_low_;
  dirty_ = true;
  tiles_[static_cast<std::size_t>(at.y() * brick_count_.x() + at.x())].dirty = true;
}

void HeightBand::note_place(const Vec3& p_O) {
  if (!sheet_) return;
  const double tile_m = map_.ground.tile_m;
  const Vec2 at = (p_O.head<2>() - map_.ground.origin) / tile_m;
  sheet_->note_place(at.array().floor().cast<int>(),
                     static_cast<int>(std::floor(p_O.z() / resolution_m_)));
  dirty_ = true;
}

std::uint64_t HeightBand::layer(const BrickMask& mask, int z) {
  // Inside a word the bits of one layer are x0 y0 - x1 y1 -; words of a layer are quadrants.
  const int shift = (z & 1) * 4 + (z >> 1 & 1) * 32;
  const std::size_t half = z >= 4 ? 4 : 0;
  std::uint64_t out = 0;
  for (std::size_t quadrant = 0; quadrant < 4; ++quadrant) {
    out |= gather_bits(mask[half + quadrant] >> shift, 0x0f0f0f0fU) << (16 * quadrant);
  }
  return out;
}

void HeightBand::find_ground(Tile& tile) {
  int found = kNoGround;
  int below = 0;  // occupied in the layer below
  for (int k = 0; k < brick_count_.z() && found == kNoGround; ++k) {
    const BrickMask* const occupied = column_[static_cast<std::size_t>(k)].occupied;
    if (occupied == nullptr || *occupied == BrickMask{}) {
      below = 0;
      continue;
    }
    for (int z = 0; z < kBrickCells; ++z) {
      const int here = std::popcount(layer(*occupied, z));
      if (here + below >= support_) {
        found = (brick_low_.z() + k) * kBrickCells + z - (below > 0 ? 1 : 0);
        break;
      }
      below = here;
    }
  }
  if (found != tile.lowest) {
    tile.lowest = found;
    ground_changed_ = true;
  }
}

void HeightBand::find_feet(std::size_t t) {
  std::vector<FloorSheet::Feet> feet;
  std::uint64_t below = 0;  // occupied in the layer below
  for (int k = 0; k < brick_count_.z(); ++k) {
    const BrickMask* const occupied = column_[static_cast<std::size_t>(k)].occupied;
    if (occupied == nullptr || *occupied == BrickMask{}) {
      below = 0;
      continue;
    }
    for (int z = 0; z < kBrickCells; ++z) {
      const std::uint64_t here = layer(*occupied, z);
      const int at = (brick_low_.z() + k) * kBrickCells + z;
      if ((here & ~below) != 0) feet.push_back({at, here & ~below});
      below = here;
    }
  }
  sheet_->set_feet(t, std::move(feet));
}

void HeightBand::spread_sheet() {
  for (const std::size_t t : sheet_->spread()) {
    tiles_[t].dirty = true;
    const auto plane = sheet_->plane(t);
    map_.ground.heights[t] = plane ? static_cast<float>(plane->height * resolution_m_)
                                   : std::numeric_limits<float>::quiet_NaN();
    if (plane) map_.ground.rises[t] = plane->rise.cast<float>();
  }
}

std::optional<ColumnLayers> HeightBand::ground_of(std::size_t t) const {
  if (reference_ == BandReference::kAbsolute) return ColumnLayers(0);
  if (sheet_) {
    const auto plane = sheet_->plane(t);
    return plane ? std::optional(ColumnLayers(*plane)) : std::nullopt;
  }
  if (tiles_[t].ground >= kNoGround / 2) return std::nullopt;
  return ColumnLayers(tiles_[t].ground);
}

void HeightBand::spread_ground() {
  ground_changed_ = false;
  // Lower envelope of cones, one on each tile's lowest point: two sweeps over the tiles.
  const int nx = brick_count_.x();
  const int ny = brick_count_.y();
  const double diagonal = slope_ * std::sqrt(2.0);
  std::vector<double> height(tiles_.size());
  std::transform(tiles_.begin(), tiles_.end(), height.begin(),
                 [](const Tile& tile) { return static_cast<double>(tile.lowest); });
  const auto relax = [&](int x, int y, int dx, int dy) {
    const int u = x + dx;
    const int v = y + dy;
    if (u < 0 || v < 0 || u >= nx || v >= ny) return;
    const double rise = dx != 0 && dy != 0 ? diagonal : slope_;
    double& here = height[static_cast<std::size_t>(y * nx + x)];
    here = std::min(here, height[static_cast<std::size_t>(v * nx + u)] + rise);
  };
  for (int y = 0; y < ny; ++y) {
    for (int x = 0; x < nx; ++x) {
      for (const auto& [dx, dy] : {std::pair{-1, 0}, {-1, -1}, {0, -1}, {1, -1}}) {
        relax(x, y, dx, dy);
      }
    }
  }
  for (int y = ny - 1; y >= 0; --y) {
    for (int x = nx - 1; x >= 0; --x) {
      for (const auto& [dx, dy] : {std::pair{1, 0}, {1, 1}, {0, 1}, {-1, 1}}) {
        relax(x, y, dx, dy);
      }
    }
  }
  for (std::size_t t = 0; t < tiles_.size(); ++t) {
    const int ground = static_cast<int>(std::lround(height[t]));
    if (ground == tiles_[t].ground) continue;
    tiles_[t].ground = ground;
    tiles_[t].dirty = true;
    if (map_.ground.heights.empty()) continue;
    map_.ground.heights[t] = ground < kNoGround / 2 ? static_cast<float>(ground * resolution_m_)
                                                    : std::numeric_limits<float>::quiet_NaN();
  }
}

std::size_t HeightBand::cell_of_bit(std::size_t t, unsigned bit) const {
  const Eigen::Vector2i tile(static_cast<int>(t) % brick_count_.x(),
                             static_cast<int>(t) / brick_count_.x());
  const Eigen::Vector2i in(static_cast<int>(gather_bits(bit, 0x15)),
                           static_cast<int>(gather_bits(bit, 0x2a)));
  const Eigen::Vector2i cell =
      (brick_low_.head<2>() + tile) * kBrickCells + in - box_.low.head<2>();
  return map_.contains(cell) ? map_.index(cell) : map_.cells.size();
}

void HeightBand::evaluate(std::size_t t) {
  const std::optional<ColumnLayers> base =
      reference_ == BandReference::kAbsolute ? std::optional(ColumnLayers(0)) : ground_of(t);
  std::uint64_t occupied = sheet_ ? sheet_->brinks(t) : 0;
  std::array<std::uint64_t, 9> free{};  // free[n]: columns with at least n free cells
  free[0] = ~std::uint64_t{0};
  if (base) {
    const int low = std::max(base->lowest() + band_low_, box_.low.z());
    const int high = std::min(base->highest() + band_high_, box_.high.z());
    for (int z = low; z < high; ++z) {
      const int in = z - brick_low_.z() * kBrickCells;
      const States& states = column_[static_cast<std::size_t>(in / kBrickCells)];
      if (states.known == nullptr) continue;
      const std::uint64_t band = base->between(z - band_high_ + 1, z - band_low_ + 1);
      const std::uint64_t full = layer(*states.occupied, in % kBrickCells) & band;
      const std::uint64_t empty = layer(*states.known, in % kBrickCells) & band & ~full;
      occupied |= full;
      for (int n = min_free_; n > 0; --n) {
        free[static_cast<std::size_t>(n)] |= free[static_cast<std::size_t>(n - 1)] & empty;
      }
    }
  }
  // By a floor that was guessed too high, what hangs over a ramp would bar it.
  if (sheet_ && sheet_->is_unseen_ramp(t)) occupied = 0;
  const bool leads_on_unseen = sheet_ && sheet_->is_mouth(t);
  const std::uint64_t enough = leads_on_unseen ? 0 : free[static_cast<std::size_t>(min_free_)];
  for (unsigned i = 0; i < 64; ++i) {
    const std::size_t cell = cell_of_bit(t, i);
    if (cell == map_.cells.size()) continue;
    const std::uint64_t bit = std::uint64_t{1} << i;
    map_.cells[cell] = (occupied & bit) != 0 ? OccupancyMap2D::kOccupied
                       : (enough & bit) != 0 ? OccupancyMap2D::kFree
                                             : OccupancyMap2D::kUnknown;
  }
}

void HeightBand::survey_floor(std::size_t t) {
  std::array<std::int16_t, 64> top{}, overhead{};
  top.fill(FloorMap::kUnseen);
  overhead.fill(FloorMap::kNothing);
  const auto set = [](std::uint64_t bits, int z, std::array<std::int16_t, 64>& layers) {
    for (; bits != 0; bits &= bits - 1) {
      layers[static_cast<std::size_t>(std::countr_zero(bits))] = static_cast<std::int16_t>(z);
    }
  };
  const std::optional<ColumnLayers> ground = ground_of(t);
  std::uint64_t covered = 0, unknown = ground ? 0 : ~std::uint64_t{0};
  for (int z = ground ? std::max(ground->lowest() - 1, box_.low.z()) : box_.high.z();
       z < box_.high.z(); ++z) {
    const int in = z - brick_low_.z() * kBrickCells;
    const States& states = column_[static_cast<std::size_t>(in / kBrickCells)];
    if (z >= ground->highest() + air_ &&
        (states.known == nullptr || *states.occupied == BrickMask{})) {
      z += kBrickCells - 1 - in % kBrickCells;  // nothing hangs in this brick
      continue;
    }
    const std::uint64_t known = states.known ? layer(*states.known, in % kBrickCells) : 0;
    const std::uint64_t full = states.known ? layer(*states.occupied, in % kBrickCells) : 0;
    const std::uint64_t on_floor = ground->between(z - relief_ + 1, z + 2);
    const std::uint64_t above = ground->between(ground->lowest(), z - relief_ + 1);
    const std::uint64_t in_air = above & ground->between(z - air_ + 1, z + 1);
    set(full & on_floor, z, top);
    set(full & above & ~covered, z, overhead);
    covered |= full & above;
    unknown |= ~known & in_air;
  }
  set(unknown & ~covered, FloorMap::kUnknown, top);
  for (unsigned i = 0; i < 64; ++i) {
    const std::size_t cell = cell_of_bit(t, i);
    if (cell == map_.cells.size()) continue;
    map_.floor.top[cell] = top[i];
    map_.floor.overhead[cell] = overhead[i];
  }
}

}  // namespace arex
