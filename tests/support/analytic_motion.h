#pragma once

#include <vector>

#include "math/pose.h"
#include "math/types.h"
#include "messages/sensors.h"

/// A smooth motion in closed form: position and yaw are quintic B-splines of time, roll and pitch
/// those of a vehicle whose thrust makes the acceleration. The oracle of the inertial tests.
namespace arex::test {

struct MotionState {
  Pose X_OB;
  Vec3 v_OB = Vec3::Zero();
  Vec3 a_OB = Vec3::Zero();
  Vec3 w_OB_B = Vec3::Zero();
};

class AnalyticMotion {
 public:
  /// Rests at the first control point for `rest_s`, follows the control points `knot_s` apart, and
  /// rests at the last. A control point is (x, y, z, yaw).
  AnalyticMotion(std::vector<Vec4> control_points, double knot_s, double rest_s);

  [[nodiscard]] MotionState at(double time_s) const;
  /// A noise-free IMU at this time.
  [[nodiscard]] ImuSample imu(Stamp stamp) const;
  [[nodiscard]] double end_s() const;  ///< of the moving part

 private:
  [[nodiscard]] Vec4 derivative(double time_s, int order) const;
  [[nodiscard]] Mat3 attitude(double time_s) const;

  std::vector<std::vector<Vec4>> differences_;  ///< by order of derivative
  double knot_s_;
  double rest_s_;
};

/// Control points of a loop of the given size about the origin, starting and ending there at
/// `height_m` after a climb from the ground, at about `speed_mps`; yaw follows the path.
std::vector<Vec4> loop_points(double length_x_m, double length_y_m, double height_m,
                              double speed_mps, double knot_s, int rounds);

}  // namespace arex::test
