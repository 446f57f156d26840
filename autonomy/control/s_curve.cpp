#include "control/s_curve.h"

#include <algorithm>
#include <cmath>

namespace arex {
namespace {

/// Lengths of the pieces: constant jerk, constant acceleration, constant speed.
struct Lengths {
  double jerk = 0, acceleration = 0, speed = 0;
};

Lengths piece_lengths(double distance, const SCurveLimits& limits) {
  const double v = limits.speed, a = limits.acceleration, j = limits.jerk;
  Lengths t;
  // Up to the speed limit and down again.
  t.jerk = v * j >= a * a ? a / j : std::sqrt(v / j);
  t.acceleration = v * j >= a * a ? v / a - t.jerk : 0;
  const double ramps = v * (2 * t.jerk + t.acceleration);
  if (ramps <= distance) {
    t.speed = (distance - ramps) / v;
    return t;
  }
  // Too short for the speed limit: distance = a (tj + ta)(2 tj + ta) at full acceleration.
  t.jerk = a / j;
  t.acceleration = (std::sqrt(t.jerk * t.jerk + 4 * distance / a) - 3 * t.jerk) / 2;
  if (t.acceleration >= 0) return t;
  // Nor for the acceleration limit: distance = 2 j tj^3.
  t.acceleration = 0;
  t.jerk = std::cbrt(distance / (2 * j));
  return t;
}

SCurve::State advance(const SCurve::State& s, double jerk, double t) {
  return {s.position + t * (s.speed + t * (s.acceleration / 2 + t * jerk / 6)),
          s.speed + t * (s.acceleration + t * jerk / 2), s.acceleration + t * jerk};
}

}  // namespace

SCurve::SCurve(double distance, const SCurveLimits& limits) : distance_(distance) {
  const Lengths t = piece_lengths(distance, limits);
  const std::array<double, 7> lengths{t.jerk, t.acceleration, t.jerk, t.speed,
                                      t.jerk, t.acceleration, t.jerk};
  const double j = limits.jerk;
  const std::array<double, 7> jerks{j, 0, -j, 0, -j, 0, j};
  State state;
  for (std::size_t i = 0; i < pieces_.size(); ++i) {
    pieces_[i] = {duration_, state, jerks[i]};
    state = advance(state, jerks[i], lengths[i]);
    duration_ += lengths[i];
  }
}

SCurve::State SCurve::sample(double time_s) const {
  if (time_s <= 0) return {};
  if (time_s >= duration_) return {distance_, 0, 0};
  const auto after =
      std::upper_bound(pieces_.begin(), pieces_.end(), time_s,
                       [](double time, const Piece& piece) { return time < piece.begin; });
  const Piece& piece = *(after - 1);
  return advance(piece.state, piece.jerk, time_s - piece.begin);
}

}  // namespace arex
