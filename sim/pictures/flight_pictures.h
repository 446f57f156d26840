#pragma once

#include <limits>
#include <memory>
#include <string>
#include <vector>

#include "pictures/picture.h"
#include "report/run_record.h"
#include "worlds/world.h"

namespace arex::sim {

/// Draws a recorded flight in the world that it was flown in, at any moment.
class FlightPictures {
 public:
  enum class View : std::uint8_t { kChase, kTop, kBoth };

  /// @param truth poses of the flight, X_OB, in the order of time; not empty.
  FlightPictures(const worlds::World& world, const Pose& X_WO, const std::vector<TimedPose>& truth,
                 View view, const PictureOptions& options);
  ~FlightPictures();

  /// The flight at a moment, its path drawn up to `path_until_s`. Moments that follow each other
  /// turn the chase camera smoothly.
  [[nodiscard]] Picture at(double time_s, double path_until_s);

 private:
  [[nodiscard]] Picture chase(double time_s, double path_until_s);
  [[nodiscard]] Picture top(double time_s, double path_until_s, const PictureOptions& options);
  [[nodiscard]] Pose vehicle_at(double time_s) const;
  [[nodiscard]] PictureOverlay overlay(double time_s, double path_until_s, double radius_m) const;

  std::vector<TimedPose> path_;  ///< X is X_WB; downsampled
  View view_;
  PictureOptions options_;
  // One each: what the top view cuts away is drawn into the shadows once, not once a frame.
  std::unique_ptr<PictureRenderer> chase_;
  std::unique_ptr<PictureRenderer> top_;
  double cut_above_m_ = std::numeric_limits<double>::quiet_NaN();  ///< none yet
  double heading_rad_ = 0;
  double heading_time_s_ = -1;  ///< negative: none yet
};

}  // namespace arex::sim
