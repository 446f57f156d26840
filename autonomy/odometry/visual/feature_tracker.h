#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "messages/stereo_image.h"
#include "odometry/visual/visual_inertial_config.h"
#include "odometry/visual/window_state.h"

namespace arex {

/// A feature as the image shows it.
struct ImageFeature {
  std::int64_t id = 0;
  Vec2 left_px = Vec2::Zero();
  std::optional<Vec2> right_px;
  int age = 1;  ///< exposures that have seen it
};

/// Front end: corners of the left image, spread over its cells, followed from exposure to exposure
/// and into the right image by pyramidal Lucas-Kanade. The gyro says where to look first; what does
/// not find back, fits no common translation or has no place in the other eye is dropped.
///
/// Sources: Shi and Tomasi, CVPR 1994; Bouguet, Pyramidal implementation of the Lucas Kanade
/// feature tracker, 2000 (OpenCV's); the outlier test: two points, as in Kneip et al., BMVC 2011.
class FeatureTracker {
 public:
  /// @param seed of the outlier test's random stream
  FeatureTracker(const FeatureTrackerConfig& config, std::uint64_t seed);
  ~FeatureTracker();
  FeatureTracker(FeatureTracker&&) noexcept;
  FeatureTracker& operator=(FeatureTracker&&) noexcept;

  /// @param turn of the left eye since the exposure before: takes a ray of this one to the other's
  FeatureFrame track(const StereoImage& images, const Mat3& turn);
  /// Stops following these.
  void forget(std::span<const std::int64_t> ids);

  /// Of the newest exposure, in order of id.
  [[nodiscard]] const std::vector<ImageFeature>& features() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace arex
