#include "odometry/scan_placement.h"

#include <cstdint>
#include <memory>

namespace arex {

RegisteredScan place_scan(const LidarScan& raw, const PoseHistory& poses, const Pose& X_BL) {
  RegisteredScan scan;
  scan.begin = raw.stamp;
  scan.stamp = raw.end;
  scan.p_OB = poses.at(raw.end).p;
  scan.origin_end_O = (poses.at(raw.end) * X_BL).p;
  scan.origin_begin_O = (poses.at(raw.stamp) * X_BL).p;
  auto points = std::make_shared<std::vector<Vec3f>>();
  auto fractions = std::make_shared<std::vector<float>>();
  points->reserve(raw.points.size());
  fractions->reserve(raw.points.size());
  std::int64_t millisecond = -1;
  Pose X_OL;
  for (const LidarPoint& point : raw.points) {
    if (point.offset_ns / kNanosecondsPerTick != millisecond) {
      millisecond = point.offset_ns / kNanosecondsPerTick;
      X_OL = poses.at(raw.stamp + point.offset_ns) * X_BL;
    }
    points->push_back((X_OL * point.p_L.cast<double>()).cast<float>());
    fractions->push_back(static_cast<float>(point.offset_ns) /
                         static_cast<float>(raw.end - raw.stamp));
  }
  scan.points_O = points;
  scan.fractions = fractions;
  return scan;
}

}  // namespace arex
