#pragma once

#include <array>
#include <cstdint>
#include <deque>
#include <limits>
#include <memory>
#include <vector>

#include "mapping/buffer_pool.h"
#include "mapping/grid_view.h"
#include "mapping/inflation.h"
#include "mapping/mapping_config.h"
#include "mapping/ray_caster.h"

namespace arex {

/// The grid at one moment; never changes once made.
struct GridSnapshot {
  Stamp stamp = 0;             ///< of the newest frame in it
  Vec3 centre = Vec3::Zero();  ///< p_OB when it was made, m
  std::vector<std::uint8_t> cells;
  GridView view;  ///< of `cells`
};

/// The rolling local grid (paper, Environment Representation): a dense box of cells about the
/// vehicle in one array, addressed modulo its size, so that it moves by whole cells without
/// copying.
///
/// What is an obstacle: a voxel hit in one of the frames held (the newest `lidar_frames` LiDAR
/// frames and the newest depth frame): the paper's map. Moreover, with `remember`, a voxel that was
/// hit in `confirm_frames` of the frames held at one time stays an obstacle while OctoMap's sensor
/// model says occupied. So
/// - a thin branch stays for all the frames held though most rays pass beside it;
/// - a trunk that a sparse pattern misses for longer than the frames held does not flicker;
/// - a ghost (mixed pixel, false alarm) is hit once and gone with its frame;
/// - one frame without depth never confirms anything: the paper's sparse case as it is.
/// What is known: obstacles, and voxels that the sensor model calls free. A voxel hit once whose
/// frame is gone is neither, until rays have passed it. Evidence decays, so that what is not seen
/// any more becomes unknown again.
class LocalGrid {
 public:
  LocalGrid(const LocalGridConfig& config, double inflation_m, double resolution_m);

  /// Bars what lies below and above these heights in O, m, to the planner.
  void bar_outside(double floor_m, double ceiling_m) {
    floor_m_ = floor_m;
    ceiling_m_ = ceiling_m;
  }

  /// Moves the box to the vehicle by whole cells; cells that stay keep their state.
  void recentre(const Vec3& p_OB);
  [[nodiscard]] CellBox box() const { return {low_, low_ + size_}; }

  enum class FrameKind { kLidar, kDepth };
  /// Takes one frame's hits and misses. @pre rays were clipped to a box that holds box().
  void add_frame(const RayCaster& rays, FrameKind kind, Stamp stamp);

  /// Forgets everything: the pose has jumped, what was seen lies elsewhere.
  void clear();

  /// The grid as it is now. Buffers that nobody holds any more are used again.
  [[nodiscard]] std::shared_ptr<const GridSnapshot> snapshot();

 private:
  struct Held {
    std::vector<std::array<int, 3>> hits;  ///< cells
  };

  void release(const Held& frame);
  void pass(const BrickRays& rays, const BrickMask& inside);
  void pass_one(std::size_t cell);
  void pass_eight(std::size_t first, unsigned bits);
  void hit(const BrickRays& rays, const BrickMask& inside, Held& frame);
  void decay_until(Stamp stamp);
  void forget(const CellBox& cells);
  [[nodiscard]] std::shared_ptr<GridSnapshot> free_snapshot();
  void bar_heights(std::vector<std::uint8_t>& cells) const;
  void address_brick(const Cell& brick);
  [[nodiscard]] std::size_t voxel_in_brick(std::size_t voxel) const;
  [[nodiscard]] std::size_t address(int x, int y, int z) const;

  LocalGridConfig config_;
  double resolution_m_;
  Cell size_;
  int hit_units_, miss_units_, min_units_, max_units_, decay_units_;
  Cell low_;                           ///< lattice cell of the box's lower corner
  std::vector<std::int8_t> evidence_;  ///< log-odds in units; kUnseen; a block longer, as frames_
  std::vector<std::uint8_t> frames_;   ///< frames held that hit it, and kConfirmed
  std::deque<Held> lidar_;
  Held depth_;
  Stamp stamp_ = 0;
  std::int64_t decayed_slices_ = 0;
  Vec3 centre_ = Vec3::Zero();
  double floor_m_ = -std::numeric_limits<double>::infinity();
  double ceiling_m_ = std::numeric_limits<double>::infinity();
  std::array<std::array<std::size_t, 8>, 3> brick_address_{};  ///< of the brick at hand
  Inflation inflation_;
  BitGrid occupied_;
  BitGrid known_;
  BitGrid inflated_;
  BufferPool<GridSnapshot> snapshots_;
};

}  // namespace arex
