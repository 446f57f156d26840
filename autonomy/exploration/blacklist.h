#pragma once

#include <vector>

#include "math/types.h"

namespace arex {

struct BlacklistConfig {
  double radius_m = 0.7;
  double duration_s = 30;
  int max_strikes = 3;

  void fields(auto& f) {
    f("radius_m", radius_m, "candidates this near to a failed target fail with it");
    f("duration_s", duration_s, "of the first strike; doubles with each further one");
    f("max_strikes", max_strikes, "a target that failed so often is given up for the mission");
    f.check(radius_m >= 0, "radius_m >= 0");
    f.check(duration_s >= 0, "duration_s >= 0");
    f.check(max_strikes >= 1 && max_strikes <= 1000, "1 <= max_strikes <= 1000");
  }
};

/// Targets that proved unreachable. A strike is forgiven after a while of mission time, each at the
/// same place after twice the while of the one before; the last never.
class Blacklist {
 public:
  explicit Blacklist(const BlacklistConfig& config) : config_(config) {}

  void strike(const Vec2& target, Stamp now);
  /// Whether a target here is barred now.
  [[nodiscard]] bool bars(const Vec2& target, Stamp now) const;
  /// Whether a target here has failed so often that it is never tried again.
  [[nodiscard]] bool gave_up(const Vec2& target) const;

 private:
  struct Entry {
    Vec2 place = Vec2::Zero();
    int strikes = 0;
    Stamp until = 0;
  };
  BlacklistConfig config_;
  std::vector<Entry> entries_;
};

}  // namespace arex
