#pragma once

#include <functional>
#include <optional>
#include <span>
#include <vector>

#include "planning/uniform_bspline.h"

namespace arex {

/// Limits on norms.
struct MotionLimits {
  double max_speed_mps = 2.0;
  double max_acceleration_mps2 = 3.0;
  double max_jerk_mps3 = 30.0;  ///< of the speed profile: how fast acceleration builds up
};

/// Highest allowed speed (m/s) at an arc length (m) from the path's start.
using SpeedCap = std::function<double(double)>;

/// Flies a path: a spline that follows the polyline `path` (dense, from start.p to where it comes
/// to rest) as fast as the limits allow, beginning exactly in `start`. Speed follows from the
/// curvature (v^2 kappa), from braking for what comes (backwards pass) and from the jerk limit
/// (forward simulation). The control points are the positions of that motion, one knot span apart:
/// A_i and V_i are averages of its acceleration and velocity, so the limits hold by construction up
/// to the joint with the start, and the spline stays within a dt^2 / 6 of the path. The caller
/// checks limits and collisions of the result.
[[nodiscard]] UniformBspline time_path(std::span<const Vec3> path, const MotionState& start,
                                       const MotionLimits& limits, double knot_span_s,
                                       const SpeedCap& speed_cap = {});

/// Points along a spline, at most `spacing_m` apart.
[[nodiscard]] std::vector<Vec3> sample_path(const UniformBspline& spline, double spacing_m,
                                            double from_s = 0.0);

/// The polyline with its corners rounded: the cubic B-spline whose control points lie `spacing_m`
/// apart along it, sampled densely. It leaves the polyline by at most 0.24 spacing_m.
[[nodiscard]] std::vector<Vec3> round_corners(std::span<const Vec3> polyline, double spacing_m);

/// The polyline's points at equal arc-length steps of about `spacing_m`, ends included.
[[nodiscard]] std::vector<Vec3> resample(std::span<const Vec3> polyline, double spacing_m);

}  // namespace arex
