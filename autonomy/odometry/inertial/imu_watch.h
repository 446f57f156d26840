#pragma once

#include <string>
#include <vector>

#include "odometry/inertial/navigation_state.h"

namespace arex {

/// When an IMU is called wrong.
struct ImuWatchConfig {
  double gyro_scale = 0.02;
  double time_offset_s = 0.005;
  double sure_sigma = 4;

  void fields(auto& f) {
    f("gyro_scale", gyro_scale, "a larger error of scale is told (ICM-42688-P: 0.5 %)");
    f("time_offset_s", time_offset_s, "so is a clock further off than this");
    f("sure_sigma", sure_sigma, "once the estimate is so many sigma beyond that");
    f.check(gyro_scale > 0 && time_offset_s > 0, "gyro_scale, time_offset_s > 0");
    f.check(sure_sigma >= 0, "sure_sigma >= 0");
  }
};

/// Tells, once each, what an odometry has found to be wrong with its IMU: it is corrected for, but
/// whoever built the vehicle will want to know.
class ImuWatch {
 public:
  /// @param delay_s as configured
  ImuWatch(const ImuWatchConfig& config, double delay_s) : config_(config), delay_s_(delay_s) {}

  /// @return what is new, for events: "imu gyro scale 4.8 % off", "imu clock 20 ms ahead".
  std::vector<std::string> update(const NavigationState& state, const ErrorMatrix& covariance);

 private:
  ImuWatchConfig config_;
  double delay_s_;
  bool scale_told_ = false, clock_told_ = false;
};

}  // namespace arex
