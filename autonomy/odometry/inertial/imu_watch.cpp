#include "odometry/inertial/imu_watch.h"

#include <fmt/format.h>

#include <cmath>

namespace arex {

std::vector<std::string> ImuWatch::update(const NavigationState& state,
                                          const ErrorMatrix& covariance) {
  std::vector<std::string> told;
  const auto sure = [&](double error, int index, double limit) {
    return std::abs(error) > limit + config_.sure_sigma * std::sqrt(covariance(index, index));
  };
  for (int i = 0; i < 3 && !scale_told_; ++i) {
    if (!sure(state.s_g[i], kGyroScale + i, config_.gyro_scale)) continue;
    scale_told_ = true;
    told.push_back(fmt::format("imu gyro scale {:.1f} % off about {}", 100 * std::abs(state.s_g[i]),
                               "xyz"[i]));
  }
  const double offset = state.t_d - delay_s_;
  if (!clock_told_ && sure(offset, kTimeOffset, config_.time_offset_s)) {
    clock_told_ = true;
    told.push_back(fmt::format("imu clock {:.0f} ms {}", 1e3 * std::abs(offset),
                               offset > 0 ? "ahead" : "behind"));
  }
  return told;
}

}  // namespace arex
