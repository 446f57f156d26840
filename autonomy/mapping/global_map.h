#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <vector>

#include "mapping/height_band.h"
#include "mapping/log_odds.h"
#include "mapping/mapping_config.h"
#include "mapping/occupancy_map_2d.h"
#include "mapping/ray_caster.h"
#include "mapping/state_tree.h"

namespace arex {

/// The map of the whole mission inside the exploration bounds, in O: log-odds of every voxel that
/// was seen, and the 2D occupancy of the exploration (paper,
/// Environmental Modelling). OctoMap's sensor model: same states after the same frames.
///
/// Log-odds lie in bricks of 8^3 voxels as 16-bit integers in units of 2^-12; only voxels whose
/// state (unknown, free, occupied) changes go into the 2D map.
class GlobalMap {
 public:
  GlobalMap(const GlobalMapConfig& config, double resolution_m);

  [[nodiscard]] const CellBox& box() const { return box_; }
  /// Takes one LiDAR frame. @pre rays were clipped to a box that holds what box() sees of it.
  void add_frame(const RayCaster& rays);
  /// Where the vehicle is, for a height band that stands on the floor under its way (HeightBand).
  void note_place(const Vec3& p_O) { band_.note_place(p_O); }

  /// -1 unknown, 0 free, 1 occupied; unknown outside the bounds.
  [[nodiscard]] int state(const Cell& cell) const;
  [[nodiscard]] const OccupancyMap2D& occupancy_2d() const { return refreshed_band().map(); }
  /// The states as OctoMap's tree.
  [[nodiscard]] StateTree octree() const;
  /// Volume known so far, m^3.
  [[nodiscard]] double known_volume() const;

  /// OctoMap's binary format. @throws DiskError.
  void write_octomap(const std::filesystem::path& file) const;

 private:
  struct alignas(64) Brick {  // each mask a cache line
    std::array<std::int16_t, kBrickVoxels> odds{};
    BrickMask known{};
    BrickMask occupied{};
    // Voxels at a clamp: one more look of the same kind moves nothing, so it costs nothing.
    BrickMask at_low{};
    BrickMask at_high{};
  };
  /// What a frame says about a brick.
  struct Look {
    Cell at;
    Brick* brick;
    BrickMask hit, passed;
    BrickMask moved;  ///< voxels whose log-odds this changes
  };
  [[nodiscard]] std::size_t slot_of(const Cell& brick) const;
  void apply_evidence(Look& look) const;
  void update(const Look& look);
  [[nodiscard]] const HeightBand& refreshed_band() const;

  double resolution_m_;
  CellBox box_;
  Cell brick_low_;
  Cell brick_count_;
  SensorModelConfig sensor_;
  LogOddsSteps steps_;
  std::vector<std::unique_ptr<Brick>> bricks_;  ///< null: nothing seen
  mutable HeightBand band_;                     ///< brought up to date when it is asked for
  std::size_t known_voxels_ = 0;
  std::vector<BrickChange> changes_;
};

}  // namespace arex
