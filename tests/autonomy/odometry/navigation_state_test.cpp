#include "odometry/inertial/navigation_state.h"

#include <gtest/gtest.h>

#include "math/random.h"
#include "math/so3.h"
#include "support/analytic_motion.h"

namespace arex {
namespace {

NavigationState random_state(RandomStream& random) {
  NavigationState x;
  x.R_OB = so3::Exp(random.normal3());
  x.p_OB = 5 * random.normal3();
  x.v_OB = random.normal3();
  x.b_g = 0.05 * random.normal3();
  x.b_a = 0.3 * random.normal3();
  x.g_O = Vec3(0, 0, -kGravity) + 0.2 * random.normal3();
  x.X_BL = {so3::Exp(random.normal3()), 0.2 * random.normal3()};
  x.s_g = 0.05 * random.normal3();
  x.t_d = 0.02 * random.normal();
  return x;
}

ErrorVector random_error(RandomStream& random, double size) {
  ErrorVector d;
  for (int i = 0; i < kErrorDim; ++i) d[i] = size * random.normal();
  return d;
}

ImuInterval random_interval(RandomStream& random, Stamp dt) {
  ImuInterval imu;
  imu.end = dt;
  imu.gyro_begin = 2 * random.normal3();
  imu.gyro_end = imu.gyro_begin + 0.2 * random.normal3();
  imu.accel_begin = Vec3(0, 0, kGravity) + 3 * random.normal3();
  imu.accel_end = imu.accel_begin + 0.5 * random.normal3();
  imu.gyro_level = imu.mean_gyro();
  imu.gyro_slope = (imu.gyro_end - imu.gyro_begin) / imu.dt_s();
  imu.accel_slope = (imu.accel_end - imu.accel_begin) / imu.dt_s();
  return imu;
}

/// What the readings of an interval are if they are taken that much later: they change as they do
/// inside it.
ImuInterval later(ImuInterval imu, double seconds) {
  const Vec3 gyro = imu.gyro_slope * seconds, accel = imu.accel_slope * seconds;
  imu.gyro_begin += gyro;
  imu.gyro_end += gyro;
  imu.accel_begin += accel;
  imu.accel_end += accel;
  return imu;
}

TEST(NavigationState, LocalUndoesRetract) {
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    RandomStream random(seed, "state");
    const NavigationState x = random_state(random);
    const ErrorVector d = random_error(random, 0.4);
    EXPECT_LT((local(x, retract(x, d)) - d).norm(), 1e-12);
    const NavigationState y = random_state(random);
    EXPECT_LT(local(y, retract(x, local(x, y))).norm(), 1e-12);
  }
}

TEST(NavigationState, LocalJacobianIsTheDerivative) {
  constexpr double h = 1e-6;
  for (std::uint64_t seed = 1; seed <= 5; ++seed) {
    RandomStream random(seed, "state");
    const NavigationState x = random_state(random);
    const NavigationState y = retract(x, random_error(random, 0.5));
    const ErrorMatrix J = local_jacobian(x, y);
    for (int i = 0; i < kErrorDim; ++i) {
      const ErrorVector e = h * ErrorVector::Unit(i);
      const ErrorVector numeric = (local(x, retract(y, e)) - local(x, retract(y, -e))) / (2 * h);
      EXPECT_LT((J.col(i) - numeric).cwiseAbs().maxCoeff(), 1e-8) << "column " << i;
    }
    EXPECT_LT((J * local_jacobian_inverse(x, y) - ErrorMatrix::Identity()).cwiseAbs().maxCoeff(),
              1e-12);
  }
}

TEST(NavigationState, EveryBlockOfFIsTheDerivative) {
  constexpr double h = 1e-6;
  for (std::uint64_t seed = 1; seed <= 5; ++seed) {
    RandomStream random(seed, "state");
    const NavigationState x = random_state(random);
    const ImuInterval imu = random_interval(random, 50'000'000);  // long: the small terms count
    const NavigationState y = propagate(x, imu);
    const ErrorMatrix F = propagation_jacobians(x, imu).F;
    for (int i = 0; i < kErrorDim; ++i) {
      const ErrorVector e = h * ErrorVector::Unit(i);
      const auto end = [&](const ErrorVector& error) {
        return local(y, propagate(retract(x, error), later(imu, error[kTimeOffset])));
      };
      const ErrorVector numeric = (end(e) - end(-e)) / (2 * h);
      EXPECT_LT((F.col(i) - numeric).cwiseAbs().maxCoeff(), 1e-8) << "column " << i;
    }
  }
}

TEST(NavigationState, NoiseJacobianIsTheDerivativeByTheReadings) {
  constexpr double h = 1e-6;
  RandomStream random(3, "state");
  const NavigationState x = random_state(random);
  const ImuInterval imu = random_interval(random, 20'000'000);
  const NavigationState y = propagate(x, imu);
  const NoiseJacobian G = propagation_jacobians(x, imu).G;
  for (int i = 0; i < 6; ++i) {
    // Noise is subtracted from the reading, as the bias is.
    const auto shifted = [&](double step) {
      ImuInterval moved = imu;
      const Vec3 d = step * Vec3::Unit(i % 3);
      if (i < 3) {
        moved.gyro_begin -= d;
        moved.gyro_end -= d;
      } else {
        moved.accel_begin -= d;
        moved.accel_end -= d;
      }
      return local(y, propagate(x, moved));
    };
    const ErrorVector numeric = (shifted(h) - shifted(-h)) / (2 * h);
    EXPECT_LT((G.col(i) - numeric).cwiseAbs().maxCoeff(), 1e-8) << "column " << i;
  }
  EXPECT_TRUE((G.block<3, 3>(kGyroBias, 6).isApprox(0.02 * Mat3::Identity())));
  EXPECT_TRUE((G.block<3, 3>(kAccelBias, 9).isApprox(0.02 * Mat3::Identity())));
}

// The paper's eq. (3) as printed, with A(u)^T the right Jacobian: the first order in dt of ours.
TEST(NavigationState, JacobianIsThePapersToFirstOrder) {
  RandomStream random(5, "state");
  NavigationState x = random_state(random);
  x.s_g.setZero();
  for (const Stamp dt_ns : {1'000'000, 100'000}) {
    RandomStream same(6, "imu");
    ImuInterval imu = random_interval(same, dt_ns);
    imu.gyro_end = imu.gyro_begin;
    imu.accel_end = imu.accel_begin;
    const double dt = imu.dt_s();
    const Vec3 u = (imu.gyro_begin - x.b_g) * dt;
    ErrorMatrix paper = ErrorMatrix::Identity();  // it knows neither a scale nor a delay
    paper.block<3, 3>(kRotation, kRotation) = so3::Exp(-u);
    paper.block<3, 3>(kRotation, kGyroBias) = -so3::right_jacobian(u) * dt;
    paper.block<3, 3>(kPosition, kVelocity) = Mat3::Identity() * dt;
    paper.block<3, 3>(kVelocity, kRotation) = -x.R_OB * so3::hat(imu.accel_begin - x.b_a) * dt;
    paper.block<3, 3>(kVelocity, kAccelBias) = -x.R_OB * dt;
    paper.block<3, 3>(kVelocity, kGravityBlock) = Mat3::Identity() * dt;
    const double difference = (propagation_jacobians(x, imu).F - paper)
                                  .topLeftCorner<kGyroScale, kGyroScale>()
                                  .cwiseAbs()
                                  .maxCoeff();
    EXPECT_LT(difference, 30 * dt * dt);
    EXPECT_GT(difference, 0);
  }
}

TEST(NavigationState, IntegratesAnAnalyticMotion) {
  const test::AnalyticMotion motion(test::loop_points(30, 16, 1.5, 2.0, 0.8, 1), 0.8, 0.5);
  std::vector<ImuSample> samples;
  for (Stamp t = 0; t <= 10 * kNanosecondsPerSecond; t += 5'000'000) {
    samples.push_back(motion.imu(t));
  }
  NavigationState x;
  // Cut points that are no sample times: intervals are interpolated.
  for (Stamp t = 0; t < 10 * kNanosecondsPerSecond; t += 100'000'000) {
    const Stamp from = t == 0 ? 0 : t + 1'700'000;
    for (const ImuInterval& imu : imu_intervals(samples, from, t + 101'700'000, 1.0)) {
      x = propagate(x, imu);
    }
  }
  const test::MotionState truth = motion.at(10.0017);
  EXPECT_LT((x.p_OB - truth.X_OB.p).norm(), 0.005);
  EXPECT_LT((x.v_OB - truth.v_OB).norm(), 0.002);
  EXPECT_LT(so3::angle(x.R_OB.transpose() * truth.X_OB.R), 1e-4);
}

TEST(ImuIntervals, CoverTheSpanOnce) {
  std::vector<ImuSample> samples;
  for (int i = 0; i < 10; ++i) {
    samples.push_back({Stamp{i} * 5'000'000, Vec3::Constant(i), Vec3::Constant(-i)});
  }
  const auto intervals = imu_intervals(samples, 2'500'000, 52'000'000, 2.0);
  EXPECT_EQ(intervals.front().begin, 2'500'000);
  EXPECT_EQ(intervals.back().end, 52'000'000);
  for (std::size_t i = 0; i + 1 < intervals.size(); ++i) {
    EXPECT_EQ(intervals[i].end, intervals[i + 1].begin);
  }
  EXPECT_DOUBLE_EQ(intervals.front().gyro_begin.x(), 0.5);    // interpolated
  EXPECT_DOUBLE_EQ(intervals.front().accel_begin.x(), -1.0);  // and scaled
  EXPECT_DOUBLE_EQ(intervals.back().gyro_end.x(), 9.0);       // held
  EXPECT_TRUE(imu_intervals(samples, 10, 10, 1.0).empty());
}

}  // namespace
}  // namespace arex
