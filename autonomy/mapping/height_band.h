#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <vector>

#include "mapping/brick.h"
#include "mapping/floor_sheet.h"
#include "mapping/mapping_config.h"
#include "mapping/occupancy_map_2d.h"

namespace arex {

/// Where the 2D map of a box lies; without cells.
[[nodiscard]] inline OccupancyMap2D map_geometry(const CellBox& box, double resolution_m) {
  OccupancyMap2D map;
  map.origin = box.low.head<2>().cast<double>() * resolution_m;
  map.resolution = resolution_m;
  map.width = box.size().x();
  map.height = box.size().y();
  return map;
}

/// The 2D occupancy of the exploration from a height band of the voxel map (paper, Environmental
/// Modelling: points 0-2 m above ground).
///
/// A column is occupied when a voxel of it in the band is, free when at least `min_free_cells` of
/// the band are known free, else unknown. With BandReference::kGround the band stands on the
/// ground, estimated from the map itself per tile of 8 x 8 columns: the lowest two layers with
/// `ground_support` occupied voxels, limited by what the neighbours allow at `ground_max_slope`, so
/// that a tile in which only a trunk was seen takes its neighbours' ground. No tile, no ground: the
/// tile stays unknown. With BandReference::kFloor it stands, column by column, on the floor that
/// goes on from under the vehicle's way (FloorSheet), whatever lies above or below: on ramps and in
/// several storeys. Works on 64 columns at a time.
///
/// Beside the band it says what it would be to land on a column (FloorMap): all that is occupied
/// within a tile's relief about the ground is floor, with two layers for its noise; what is
/// occupied above that hangs over it or stands on it.
class HeightBand {
 public:
  /// The states of a brick; null pointers: nothing known.
  struct States {
    const BrickMask* known = nullptr;
    const BrickMask* occupied = nullptr;
  };

  HeightBand(const GlobalMapConfig& config, double resolution_m, const CellBox& box,
             const Cell& brick_low, const Cell& brick_count);

  [[nodiscard]] const OccupancyMap2D& map() const { return map_; }

  /// Marks the tile of a brick that changed.
  void note(const BrickChange& change);
  /// Where the vehicle is: with BandReference::kFloor, from where its floor goes on.
  void note_place(const Vec3& p_O);

  /// Brings the map up to date. `states_of(brick)` gives a brick's States.
  template <class StatesOf>
  void refresh(const StatesOf& states_of) {
    if (!dirty_) return;
    dirty_ = false;
    for (std::size_t t = 0; t < tiles_.size(); ++t) {
      if (!tiles_[t].dirty) continue;
      load(t, states_of);
      sheet_ ? find_feet(t) : find_ground(tiles_[t]);
    }
    if (sheet_) spread_sheet();
    if (ground_changed_) spread_ground();
    for (std::size_t t = 0; t < tiles_.size(); ++t) {
      if (!tiles_[t].dirty) continue;
      load(t, states_of);
      evaluate(t);
      survey_floor(t);
      tiles_[t].dirty = false;
    }
  }

 private:
  struct Tile {
    bool dirty = false;
    int lowest = 0;  ///< cell of the ground as seen in this tile
    int ground = 0;  ///< as the neighbours allow
  };
  static constexpr int kNoGround = 1 << 20;

  template <class StatesOf>
  void load(std::size_t tile, const StatesOf& states_of) {
    Cell brick = brick_low_;
    brick.x() += static_cast<int>(tile) % brick_count_.x();
    brick.y() += static_cast<int>(tile) / brick_count_.x();
    for (int k = 0; k < brick_count_.z(); ++k, ++brick.z()) {
      column_[static_cast<std::size_t>(k)] = states_of(brick);
    }
  }
  void find_ground(Tile& tile);
  void spread_ground();
  void find_feet(std::size_t tile);
  void spread_sheet();
  /// The layer of the ground in each column of a tile; none: not known.
  [[nodiscard]] std::optional<ColumnLayers> ground_of(std::size_t tile) const;
  void evaluate(std::size_t tile);
  /// The floor's top, and what hangs over it, of the loaded column.
  void survey_floor(std::size_t tile);
  [[nodiscard]] std::size_t cell_of_bit(std::size_t tile, unsigned bit) const;
  /// The 8 x 8 voxels of a layer of the loaded column, bit = 2D Morton order.
  [[nodiscard]] static std::uint64_t layer(const BrickMask& mask, int z);

  BandReference reference_;
  double resolution_m_;
  int band_low_, band_high_;  ///< cells, above the ground or in O
  int min_free_;
  double slope_;
  int support_;
  int relief_;  ///< cells above the ground of a tile that are still its floor
  int air_;     ///< cells above the ground that are to be known free
  CellBox box_;
  Cell brick_low_, brick_count_;
  std::vector<Tile> tiles_;
  std::vector<States> column_;  ///< bricks of the tile at hand
  bool dirty_ = false;          ///< some tile is
  bool ground_changed_ = false;
  std::optional<FloorSheet> sheet_;  ///< with BandReference::kFloor
  OccupancyMap2D map_;
};

}  // namespace arex
