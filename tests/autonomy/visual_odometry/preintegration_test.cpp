#include "odometry/visual/preintegration.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "math/random.h"
#include "math/so3.h"
#include "support/analytic_motion.h"

namespace arex {
namespace {

const test::AnalyticMotion& motion() {
  static const test::AnalyticMotion moving{test::loop_points(24, 16, 1.5, 2, 0.8, 1), 0.8, 0.5};
  return moving;
}

/// The intervals of a motion sampled at `rate_hz`, its readings changed by `spoil`.
template <class Spoil>
std::vector<ImuInterval> intervals(double from_s, double to_s, double rate_hz, const Spoil& spoil) {
  std::vector<ImuSample> samples;
  const Stamp period = from_seconds(1 / rate_hz);
  for (Stamp t = from_seconds(from_s); t <= from_seconds(to_s); t += period) {
    samples.push_back(motion().imu(t));
    spoil(samples.back());
  }
  return imu_intervals(samples, samples.front().stamp, samples.back().stamp, 1);
}

std::vector<ImuInterval> intervals(double from_s, double to_s, double rate_hz) {
  return intervals(from_s, to_s, rate_hz, [](ImuSample&) {});
}

Preintegration integrate(const std::vector<ImuInterval>& all, const Vec3& b_g = Vec3::Zero(),
                         const Vec3& b_a = Vec3::Zero(), const ImuNoiseConfig& noise = {}) {
  Preintegration imu(noise, b_g, b_a);
  for (const ImuInterval& interval : all) imu.add(interval);
  return imu;
}

TEST(Preintegration, FollowsAnAnalyticMotionAt10kHz) {
  for (const double begin_s : {1.0, 4.0, 9.0}) {
    const double end_s = begin_s + 0.5;
    const Preintegration imu = integrate(intervals(begin_s, end_s, 1e4));
    const test::MotionState a = motion().at(begin_s), b = motion().at(end_s);
    const Vec3 g(0, 0, -kGravity);
    const double dt = imu.dt_s();
    EXPECT_NEAR(dt, 0.5, 1e-12);
    const Mat3 R = a.X_OB.R.transpose();
    EXPECT_LT(so3::angle(imu.dR().transpose() * R * b.X_OB.R), 2e-6);
    EXPECT_LT((imu.dv() - R * (b.v_OB - a.v_OB - dt * g)).norm(), 1e-5);
    EXPECT_LT((imu.dp() - R * (b.X_OB.p - a.X_OB.p - dt * a.v_OB - 0.5 * dt * dt * g)).norm(),
              1e-5);
  }
}

TEST(Preintegration, KnowsHowItHangsOnTheBiases) {
  const auto all = intervals(3, 3.3, 200);
  const Vec3 b_g(0.01, -0.02, 0.015), b_a(0.1, 0.05, -0.2);
  const Preintegration at = integrate(all, b_g, b_a);
  constexpr double h = 1e-5;
  for (int i = 0; i < 6; ++i) {
    Eigen::Matrix<double, 6, 1> d = Eigen::Matrix<double, 6, 1>::Zero();
    d[i] = h;
    const Preintegration plus = at.relinearised(b_g + d.head<3>(), b_a + d.tail<3>());
    const Preintegration minus = at.relinearised(b_g - d.head<3>(), b_a - d.tail<3>());
    Eigen::Matrix<double, 9, 1> numeric;
    numeric << (so3::Log(at.dR().transpose() * plus.dR()) -
                so3::Log(at.dR().transpose() * minus.dR())) /
                   (2 * h),
        (plus.dv() - minus.dv()) / (2 * h), (plus.dp() - minus.dp()) / (2 * h);
    EXPECT_LT((numeric - at.bias_jacobian().col(i)).norm(), 1e-6) << i;
  }
}

TEST(Preintegration, JoinsToWhatItWouldHaveBeenInOnePiece) {
  const auto all = intervals(2, 2.4, 200);
  const Vec3 b_g(0.01, 0, 0), b_a(0, 0.1, 0);
  const Preintegration whole = integrate(all, b_g, b_a);
  const auto middle = all.begin() + static_cast<std::ptrdiff_t>(all.size() / 2);
  Preintegration first = integrate({all.begin(), middle}, b_g, b_a);
  first.join(integrate({middle, all.end()}, Vec3::Zero(), Vec3::Zero()));
  EXPECT_EQ(first.dp(), whole.dp());
  EXPECT_EQ(first.dR(), whole.dR());
  EXPECT_EQ(first.covariance(), whole.covariance());
}

TEST(Preintegration, HasTheCovarianceOfItsNoise) {
  ImuNoiseConfig noise;
  noise.gyro_noise_density = 2e-3;
  noise.accel_noise_density = 0.05;
  noise.gyro_scale_noise_density = 0;
  constexpr double kRate = 200;
  const auto clean = intervals(3, 3.5, kRate);
  const Preintegration exact = integrate(clean, Vec3::Zero(), Vec3::Zero(), noise);
  Preintegration::Covariance P = Preintegration::Covariance::Zero();
  RandomStream random(7, "monte carlo");
  constexpr int kTrials = 3000;
  for (int trial = 0; trial < kTrials; ++trial) {
    std::vector<ImuInterval> all = clean;
    for (ImuInterval& imu : all) {  // what the mean of the interval's readings errs by
      const Vec3 gyro = noise.gyro_noise_density * std::sqrt(kRate) * random.normal3();
      const Vec3 accel = noise.accel_noise_density * std::sqrt(kRate) * random.normal3();
      imu.gyro_begin += gyro;
      imu.gyro_end += gyro;
      imu.accel_begin += accel;
      imu.accel_end += accel;
    }
    const Preintegration noisy = integrate(all, Vec3::Zero(), Vec3::Zero(), noise);
    Eigen::Matrix<double, 9, 1> error;
    error << so3::Log(exact.dR().transpose() * noisy.dR()), noisy.dv() - exact.dv(),
        noisy.dp() - exact.dp();
    P += error * error.transpose() / kTrials;
  }
  for (int i = 0; i < 9; ++i) {
    EXPECT_NEAR(P(i, i) / exact.covariance()(i, i), 1, 0.1) << i;
    for (int j = 0; j < i; ++j) {
      const double scale = std::sqrt(exact.covariance()(i, i) * exact.covariance()(j, j));
      EXPECT_NEAR(P(i, j) / scale, exact.covariance()(i, j) / scale, 0.08) << i << ' ' << j;
    }
  }
}

}  // namespace
}  // namespace arex
