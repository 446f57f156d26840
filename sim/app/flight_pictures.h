#pragma once

#include <limits>
#include <memory>
#include <string>
#include <vector>

#include "report/run_record.h"
#include "sensors/picture.h"
#include "worlds/world.h"

namespace arex::app {

/// Draws a recorded flight in the world that it was flown in, at any moment.
class FlightPictures {
 public:
  enum class View : std::uint8_t { kChase, kTop, kBoth };

  /// @param truth poses of the flight, X_OB, in the order of time; not empty.
  FlightPictures(const worlds::World& world, const Pose& X_WO,
                 const std::vector<sim::StampedPose>& truth, View view,
                 const sim::PictureOptions& options);
  ~FlightPictures();

  /// The flight at a moment, its path drawn up to `path_until_s`. Moments that follow each other
  /// turn the chase camera smoothly.
  [[nodiscard]] sim::Picture at(double time_s, double path_until_s);

 private:
  [[nodiscard]] sim::Picture chase(double time_s, double path_until_s);
  [[nodiscard]] sim::Picture top(double time_s, double path_until_s,
                                 const sim::PictureOptions& options);
  [[nodiscard]] Pose vehicle_at(double time_s) const;
  [[nodiscard]] sim::PictureOverlay overlay(double time_s, double path_until_s,
                                            double radius_m) const;

  std::vector<sim::StampedPose> path_;  ///< X_WB, thinned
  View view_;
  sim::PictureOptions options_;
  // One each: what the top view cuts away is drawn into the shadows once, not once a frame.
  std::unique_ptr<sim::PictureRenderer> chase_;
  std::unique_ptr<sim::PictureRenderer> top_;
  double cut_above_m_ = std::numeric_limits<double>::quiet_NaN();  ///< none yet
  double heading_rad_ = 0;
  double heading_time_s_ = -1;  ///< negative: none yet
};

}  // namespace arex::app
