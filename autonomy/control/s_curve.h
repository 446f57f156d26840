#pragma once

#include <array>

namespace arex {

/// Limits of a motion along a line or about an axis: units are m or rad.
struct SCurveLimits {
  double speed = 0;
  double acceleration = 0;
  double jerk = 0;
};

/// The fastest motion from rest to rest over a distance under limits of speed, acceleration and
/// jerk: seven pieces of constant jerk. Position, speed and acceleration are continuous.
/// Source: Biagiotti and Melchiorri, Trajectory planning for automatic machines and robots, 3.4.
class SCurve {
 public:
  SCurve() = default;
  /// @pre distance >= 0, limits > 0.
  SCurve(double distance, const SCurveLimits& limits);

  struct State {
    double position = 0;
    double speed = 0;
    double acceleration = 0;
  };
  /// At `time_s` after the start; at rest before and after.
  [[nodiscard]] State sample(double time_s) const;
  [[nodiscard]] double duration_s() const { return duration_; }
  [[nodiscard]] double distance() const { return distance_; }

 private:
  struct Piece {
    double begin = 0;
    State state;
    double jerk = 0;
  };
  std::array<Piece, 7> pieces_{};
  double duration_ = 0;
  double distance_ = 0;
};

}  // namespace arex
