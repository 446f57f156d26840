#pragma once

#include <array>
#include <string_view>

#include "files/png.h"
#include "run/snapshot.h"

namespace arex::sim {

/// What of a snapshot is shown.
enum class SnapshotPart { kScan, kCloud, kGrid, kInflatedGrid };
inline constexpr std::array<std::string_view, 4> kSnapshotParts{"scan", "cloud", "grid",
                                                                "inflated_grid"};

/// A picture of a part, coloured by height, seen from behind the vehicle. Of the points those about
/// the grid's heights: crowns would hide everything below them.
[[nodiscard]] RgbImage draw_snapshot(const Snapshot& snapshot, SnapshotPart part);

/// As the paper's figure of its maps, (a) to (d): above the newest LiDAR frame alone, below all
/// that the grid holds; on the left what the planner may not enter, on the right the points
/// themselves.
[[nodiscard]] RgbImage draw_snapshot(const Snapshot& snapshot);

}  // namespace arex::sim
