#pragma once

#include <array>
#include <string_view>

#include "planning/uniform_bspline.h"

namespace arex {

enum class YawMode { kAlongPath, kTowardsTarget };
constexpr std::array<std::string_view, 2> enum_names(YawMode) {
  return {"along_path", "towards_target"};
}

struct YawConfig {
  YawMode mode = YawMode::kAlongPath;
  double max_rate_radps = 1.5;
  double max_acceleration_radps2 = 4.0;
  double look_ahead_s = 0.6;    ///< the heading is that of the path this much later
  double min_reach_m = 0.15;    ///< nearer points give no heading
  double max_offset_rad = 0.8;  ///< between heading and flight when a flight begins

  void fields(auto& f) {
    f("mode", mode,
      "along_path, within the limits below; or towards_target, at once, as the paper's PD turns");
    f("max_rate_radps", max_rate_radps, "limit of the yaw rate");
    f("max_acceleration_radps2", max_acceleration_radps2, "limit of the yaw acceleration");
    f("look_ahead_s", look_ahead_s, "the heading is that of the path this much later");
    f("min_reach_m", min_reach_m, "nearer points give no heading");
    f("max_offset_rad", max_offset_rad, "a flight begins when the sensor looks this near to it");
    f.check(max_rate_radps > 0, "max_rate_radps > 0");
    f.check(max_acceleration_radps2 > 0, "max_acceleration_radps2 > 0");
    f.check(max_offset_rad > 0, "max_offset_rad > 0");
  }
};

struct Heading {
  double yaw_rad = 0;
  double rate_radps = 0;
};

/// Yaw along the path: the tilted LiDAR sees forward from 52 deg below to 7 deg above the horizon
/// and sideways, but not low behind (models/arex/README.md), so the vehicle looks where it flies.
class YawPlanner {
 public:
  explicit YawPlanner(const YawConfig& config) : config_(config) {}

  /// Heading of the path from time t on; `fallback` where it stands still.
  [[nodiscard]] double wanted(const UniformBspline& spline, double t_s, double fallback_rad) const;

  /// Heading from p to a target; `fallback` once it is too near to have one.
  [[nodiscard]] double towards(const Vec3& p, const Vec3& target, double fallback_rad) const;

  [[nodiscard]] YawMode mode() const { return config_.mode; }

  /// One step of dt_s towards a wanted yaw within the limits on rate and acceleration: the fastest
  /// that still stops on it.
  [[nodiscard]] Heading step(const Heading& now, double wanted_rad, double dt_s) const;

  /// Time (s) that a turn at rest takes until the offset is at most max_offset_rad.
  [[nodiscard]] double turn_time_s(double yaw_rad, double wanted_rad) const;

 private:
  YawConfig config_;
};

}  // namespace arex
