#include "math/so3.h"

#include <cmath>
#include <numbers>

namespace arex::so3 {
namespace {
// Below this squared angle the closed forms lose digits and the series are exact to double.
constexpr double kSmallAngleSquared = 1e-8;
}  // namespace

Mat3 hat(const Vec3& a) {
  Mat3 m;
  m << 0, -a.z(), a.y(), a.z(), 0, -a.x(), -a.y(), a.x(), 0;
  return m;
}

Mat3 Exp(const Vec3& phi) {
  const double theta2 = phi.squaredNorm();
  double a = 1 - theta2 / 6;     // sin(theta) / theta
  double b = 0.5 - theta2 / 24;  // (1 - cos(theta)) / theta^2
  if (theta2 > kSmallAngleSquared) {
    const double theta = std::sqrt(theta2);
    const double half_sine = std::sin(theta / 2);
    a = std::sin(theta) / theta;
    b = 2 * half_sine * half_sine / theta2;
  }
  const Mat3 K = hat(phi);
  return Mat3::Identity() + a * K + b * K * K;
}

Vec3 Log(const Mat3& R) {
  Quat q(R);
  if (q.w() < 0) q.coeffs() = -q.coeffs();
  const double s = q.vec().norm();
  if (s < 1e-9) return 2 * q.vec() / q.w();
  return 2 * std::atan2(s, q.w()) / s * q.vec();
}

Mat3 right_jacobian(const Vec3& phi) {
  const double theta2 = phi.squaredNorm();
  double b = 0.5 - theta2 / 24;       // (1 - cos(theta)) / theta^2
  double c = 1.0 / 6 - theta2 / 120;  // (theta - sin(theta)) / theta^3
  if (theta2 > kSmallAngleSquared) {
    const double theta = std::sqrt(theta2);
    const double half_sine = std::sin(theta / 2);
    b = 2 * half_sine * half_sine / theta2;
    c = theta < 0.05 ? 1.0 / 6 - theta2 / 120 + theta2 * theta2 / 5040
                     : (theta - std::sin(theta)) / (theta2 * theta);
  }
  const Mat3 K = hat(phi);
  return Mat3::Identity() - b * K + c * K * K;
}

Mat3 right_jacobian_inverse(const Vec3& phi) {
  const double theta2 = phi.squaredNorm();
  double d = 1.0 / 12 + theta2 / 720;
  if (theta2 > kSmallAngleSquared) {
    const double theta = std::sqrt(theta2);
    d = 1 / theta2 - (1 + std::cos(theta)) / (2 * theta * std::sin(theta));
    if (theta < 0.05) d = 1.0 / 12 + theta2 / 720 + theta2 * theta2 / 30240;
  }
  const Mat3 K = hat(phi);
  return Mat3::Identity() + 0.5 * K + d * K * K;
}

double yaw(const Mat3& R) { return std::atan2(R(1, 0), R(0, 0)); }

Mat3 from_yaw(double yaw_rad) {
  return Eigen::AngleAxisd(yaw_rad, Vec3::UnitZ()).toRotationMatrix();
}

double angle(const Mat3& R) { return Log(R).norm(); }

double wrap(double angle_rad) {
  constexpr double kPi = std::numbers::pi;
  const double wrapped = std::remainder(angle_rad, 2 * kPi);
  return wrapped <= -kPi ? wrapped + 2 * kPi : wrapped;
}

}  // namespace arex::so3
