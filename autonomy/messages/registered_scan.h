#pragma once

#include <memory>
#include <optional>
#include <vector>

#include "math/pose.h"
#include "math/types.h"
#include "messages/sensors.h"

/// Measurements placed in O by the odometry: what the maps are made from.
namespace arex {

/// One LiDAR frame, undistorted, in O: what an odometry gives the maps. Its points are shared, not
/// copied; there are none where they are not to be trusted.
struct RegisteredScan {
  Stamp begin = 0;                                     ///< of the frame
  Stamp stamp = 0;                                     ///< end of the frame
  Vec3 origin_begin_O = Vec3::Zero();                  ///< p_OL when the frame began
  Vec3 origin_end_O = Vec3::Zero();                    ///< p_OL at `stamp`
  Vec3 p_OB = Vec3::Zero();                            ///< the vehicle at `stamp`
  std::shared_ptr<const std::vector<Vec3f>> points_O;  ///< in firing order, m
  /// When each point was fired, 0 at the frame's begin, 1 at its end; null: evenly spread.
  std::shared_ptr<const std::vector<float>> fractions;
  /// The pose was found again and may have jumped: what was mapped before lies elsewhere.
  bool jumped = false;
  std::optional<double> matched_share;  ///< of its points, where they were matched to a map

  [[nodiscard]] std::size_t size() const { return points_O ? points_O->size() : 0; }
  /// The LiDAR's position when point i was fired.
  [[nodiscard]] Vec3 origin_of(std::size_t i) const {
    const double fraction = fractions
                                ? static_cast<double>((*fractions)[i])
                                : (static_cast<double>(i) + 0.5) / static_cast<double>(size());
    return origin_begin_O + fraction * (origin_end_O - origin_begin_O);
  }
};

/// One depth frame with the camera's pose in O at its stamp.
struct RegisteredDepth {
  Pose X_OC;
  DepthImagePtr image;
};

/// The newest frames that the local grid was given, the oldest first: as many as it holds, and
/// those whose grid is still being made.
struct MappedFrames {
  std::vector<RegisteredScan> scans;
  std::optional<RegisteredDepth> depth;
};

}  // namespace arex
