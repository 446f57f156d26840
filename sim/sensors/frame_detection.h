#pragma once

#include <cstdint>
#include <vector>

#include "sensors/mid360.h"

/// Whether one frame of the LiDAR shows a thin obstacle: the paper's sparse frames, computed.
namespace arex::sim {

/// An upright bar before the vehicle, and the frames that may show it.
struct SparseQuery {
  double thickness_m = 0.01;  ///< diameter
  double distance_m = 3;      ///< from B to its axis, horizontally
  double length_m = 1;        ///< half of it above B, half below
  double reflectivity = 0.3;  ///< of bark, models/arex/README.md
  int frames = 40;            ///< consecutive ones
};

/// What became of all bars in all frames.
struct SparseAnswer {
  double returns_per_frame = 0;  ///< mean of a bar's
  double missed_one = 0;         ///< share of bars and frames without any return
  double missed_lone = 0;  ///< share with less than two: lone returns are taken for false ones
  double missed_five = 0;  ///< share of bars and fives of frames without any return
};

/// Bars stand every ten degrees within 50 to each side of the vehicle's nose, where it flies to,
/// nothing behind them, the vehicle at rest. The pattern does not repeat: consecutive frames are
/// independent looks. Returns are counted where they can only be a bar's, within 0.3 m of its axis.
/// @param lidar noise, rate and pattern; X_BL its mount
[[nodiscard]] SparseAnswer look_at_bars(const SparseQuery& query, const Mid360Config& lidar,
                                        const Pose& X_BL, std::uint64_t seed);

/// The directions in which the bars stand, rad from the nose.
[[nodiscard]] std::vector<double> bar_headings();

}  // namespace arex::sim
