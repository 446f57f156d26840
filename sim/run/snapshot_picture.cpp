#include "run/snapshot_picture.h"

#include <algorithm>
#include <iterator>
#include <vector>

#include "pictures/cloud_picture.h"

namespace arex::sim {
namespace {

// The points shown, above and below the vehicle.
constexpr double kShownAbove_m = 1.6, kShownBelow_m = 3;
constexpr double kReach_m = 10;  // of a picture

std::vector<Vec3f> shown(const std::vector<Vec3f>& points, const Snapshot& snapshot) {
  std::vector<Vec3f> near;
  const auto z = static_cast<float>(snapshot.X_OB.p.z());
  std::copy_if(points.begin(), points.end(), std::back_inserter(near), [&](const Vec3f& p) {
    return p.z() <= z + static_cast<float>(kShownAbove_m) &&
           p.z() >= z - static_cast<float>(kShownBelow_m);
  });
  return near;
}

RgbImage draw_points_of(const Snapshot& snapshot, const std::vector<Vec3f>& points) {
  return draw_points(shown(points, snapshot), view_behind(snapshot.X_OB, kReach_m),
                     {snapshot.X_OB, snapshot.radius_m});
}

RgbImage draw_cells_of(const Snapshot& snapshot, const std::vector<Vec3f>& cells) {
  return draw_cells(cells, snapshot.resolution_m, view_behind(snapshot.X_OB, kReach_m),
                    {snapshot.X_OB, snapshot.radius_m});
}

}  // namespace

RgbImage draw_snapshot(const Snapshot& snapshot, SnapshotPart part) {
  switch (part) {
    case SnapshotPart::kScan:
      return draw_points_of(snapshot, snapshot.scan);
    case SnapshotPart::kCloud:
      return draw_points_of(snapshot, snapshot.cloud);
    case SnapshotPart::kGrid:
      return draw_cells_of(snapshot, snapshot.grid);
    case SnapshotPart::kInflatedGrid:
      return draw_cells_of(snapshot, snapshot.inflated);
  }
  return {};
}

RgbImage draw_snapshot(const Snapshot& snapshot) {
  return tile_of_four(
      draw_cells_of(snapshot, snapshot.scan_alone), draw_points_of(snapshot, snapshot.scan),
      draw_cells_of(snapshot, snapshot.inflated), draw_points_of(snapshot, snapshot.cloud));
}

}  // namespace arex::sim
