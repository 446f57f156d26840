#include "math/vibration_watch.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

namespace arex {

VibrationWatch::VibrationWatch(const VibrationWatchConfig& config, double sample_hz)
    : config_(config),
      sample_hz_(sample_hz),
      share_(1 - std::exp(-2 * std::numbers::pi * kHighPass_hz / sample_hz)),
      window_(std::max(1, static_cast<int>(std::lround(config.window_s * sample_hz)))) {}

void VibrationWatch::add(const Vec3& gyro_radps, const Vec3& accel_mps2) {
  if (!primed_) {
    gyro_mean_ = gyro_radps;
    accel_mean_ = accel_mps2;
    primed_ = true;
  }
  gyro_mean_ += share_ * (gyro_radps - gyro_mean_);
  accel_mean_ += share_ * (accel_mps2 - accel_mean_);
  const Vec3 gyro = gyro_radps - gyro_mean_;
  gyro_squares_ += gyro.cwiseAbs2();
  accel_squares_ += (accel_mps2 - accel_mean_).cwiseAbs2();
  for (int i = 0; i < 3; ++i) {
    crossings_[static_cast<std::size_t>(i)] += gyro[i] * gyro_before_[i] < 0;
  }
  gyro_before_ = gyro;
  if (++samples_ >= window_) close_window();
}

void VibrationWatch::close_window() {
  int strongest = 0;
  // The high-pass passes half the sample rate by 2 (1 - share) / (2 - share).
  const double gain = (2 - share_) / (2 * (1 - share_));
  newest_.gyro_radps = gain * std::sqrt(gyro_squares_.maxCoeff(&strongest) / samples_);
  newest_.accel_mps2 = gain * std::sqrt(accel_squares_.maxCoeff() / samples_);
  newest_.frequency_hz =
      0.5 * crossings_[static_cast<std::size_t>(strongest)] * sample_hz_ / samples_;
  gyro_squares_.setZero();
  accel_squares_.setZero();
  crossings_ = {};
  samples_ = 0;
  fresh_ = true;
}

double VibrationWatch::excess() const {
  return std::max(newest_.gyro_radps / config_.gyro_limit_radps,
                  newest_.accel_mps2 / config_.accel_limit_mps2);
}

std::optional<std::string> VibrationWatch::update() {
  if (!fresh_) return std::nullopt;
  fresh_ = false;
  const double now = excess();
  constexpr double kOver = 0.7;  // below this share of the limit it has ended
  if (told_ > 0 && now < kOver) {
    told_ = 0;
    return "over";
  }
  if (now <= std::max(1.0, 2 * told_)) return std::nullopt;
  told_ = now;
  return fmt::format("gyro {:.2f} rad/s RMS at {:.0f} Hz, accelerometer {:.1f} m/s^2 RMS",
                     newest_.gyro_radps, newest_.frequency_hz, newest_.accel_mps2);
}

}  // namespace arex
