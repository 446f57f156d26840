#include "odometry/error_state_filter.h"

#include <gtest/gtest.h>

#include <Eigen/Dense>

#include "math/random.h"
#include "math/so3.h"
#include "odometry/registration.h"
#include "support/analytic_motion.h"

namespace arex {
namespace {

ErrorMatrix random_covariance(RandomStream& random, double size) {
  ErrorMatrix A;
  for (int i = 0; i < kErrorDim; ++i) {
    for (int j = 0; j < kErrorDim; ++j) A(i, j) = random.normal();
  }
  return size * size / kErrorDim * A * A.transpose();
}

// One iteration against the textbook's gain K = P H^T (H P H^T + V)^-1 with all residuals stacked.
TEST(ErrorStateFilter, InformationFormIsTheTextbookUpdate) {
  constexpr int kRows = 40;
  constexpr std::array<int, 4> kBlocks{kRotation, kPosition, kExtrinsicRotation,
                                       kExtrinsicPosition};
  for (std::uint64_t seed = 1; seed <= 5; ++seed) {
    RandomStream random(seed, "update");
    ErrorStateFilter filter(ImuNoiseConfig{});
    const ErrorMatrix P = random_covariance(random, 0.1);
    const NavigationState x0;
    filter.reset(x0, P);
    Eigen::Matrix<double, kRows, kErrorDim> H = Eigen::Matrix<double, kRows, kErrorDim>::Zero();
    Eigen::Matrix<double, kRows, 1> r, v;
    PoseInformation information;
    for (int i = 0; i < kRows; ++i) {
      PoseInformation::Vector h;
      for (int k = 0; k < 12; ++k) h[k] = random.normal();
      r[i] = 0.01 * random.normal();
      v[i] = random.uniform(1e-4, 1e-3);
      information.A += h * h.transpose() / v[i];
      information.b += h * r[i] / v[i];
      for (int b = 0; b < 4; ++b) {
        H.block<1, 3>(i, kBlocks[static_cast<std::size_t>(b)]) = h.segment<3>(3 * b).transpose();
      }
    }
    const Eigen::Matrix<double, kRows, kRows> S =
        H * P * H.transpose() + Eigen::Matrix<double, kRows, kRows>(v.asDiagonal());
    const Eigen::Matrix<double, kErrorDim, kRows> K = P * H.transpose() * S.inverse();
    const NavigationState x = filter.iterate(x0, information);
    EXPECT_LT((local(x0, x) + K * r).cwiseAbs().maxCoeff(), 1e-9);
    filter.finish(x0, information);
    const ErrorMatrix expected = (ErrorMatrix::Identity() - K * H) * P;
    EXPECT_LT((filter.covariance() - expected).cwiseAbs().maxCoeff(), 1e-10);
    EXPECT_EQ((filter.covariance() - filter.covariance().transpose()).cwiseAbs().maxCoeff(), 0);
  }
}

TEST(ErrorStateFilter, WithoutDoubtTheExtrinsicsStay) {
  RandomStream random(1, "update");
  ErrorStateFilter filter(ImuNoiseConfig{});
  ErrorMatrix P = random_covariance(random, 0.1);
  P.middleRows<6>(kExtrinsicRotation).setZero();
  P.middleCols<6>(kExtrinsicRotation).setZero();
  filter.reset(NavigationState{}, P);
  PoseInformation information;
  for (int i = 0; i < 50; ++i) {
    PoseInformation::Vector h;
    for (int k = 0; k < 12; ++k) h[k] = random.normal();
    information.A += 1e4 * h * h.transpose();
    information.b += 100 * h * random.normal();
  }
  const NavigationState x = filter.iterate(filter.state(), information);
  EXPECT_EQ(x.X_BL.p, Vec3::Zero().eval());
  EXPECT_EQ(x.X_BL.R, Mat3::Identity().eval());
  EXPECT_GT(x.p_OB.norm(), 0);
}

// A known map of planes, a moving vehicle, noise exactly as the filter believes: its errors must be
// as large as its covariance says.
class KnownMap {
 public:
  KnownMap() : motion_(test::loop_points(20, 12, 1.0, 1.5, 0.8, 1), 0.8, 0.3) {
    noise_.gyro_noise_density = 2e-3;
    noise_.accel_noise_density = 0.02;
    noise_.gyro_scale_noise_density = 0;
    noise_.gyro_walk_density = 1e-3;
    noise_.accel_walk_density = 1e-2;
  }

  /// e^T P^-1 e of the 18 states after a second with ten scans.
  double nees(std::uint64_t run) const {
    RandomStream random(run, "nees");
    const ErrorMatrix P0 = prior();
    NavigationState x = truth(1.0, Vec3(0.01, -0.02, 0.015), Vec3(0.1, 0.05, -0.08));
    ErrorVector d;
    for (int i = 0; i < kErrorDim; ++i) d[i] = std::sqrt(P0(i, i)) * random.normal();
    Vec3 b_g = x.b_g, b_a = x.b_a;
    ErrorStateFilter filter(noise_);
    filter.reset(retract(x, d), P0);

    constexpr double kRate = 200;
    ImuSample before = measure(1.0, b_g, b_a, kRate, random);
    for (int k = 1; k <= 200; ++k) {
      const double t = 1.0 + k / kRate;
      b_g += noise_.gyro_walk_density / std::sqrt(kRate) * random.normal3();
      b_a += noise_.accel_walk_density / std::sqrt(kRate) * random.normal3();
      const ImuSample after = measure(t, b_g, b_a, kRate, random);
      filter.predict({before.stamp, after.stamp, before.gyro_radps, after.gyro_radps,
                      before.accel_mps2, after.accel_mps2});
      before = after;
      if (k % 20 == 0) correct(truth(t, b_g, b_a), random, filter);
    }
    const Eigen::Matrix<double, 18, 1> e = local(filter.state(), truth(2.0, b_g, b_a)).head<18>();
    const Eigen::Matrix<double, 18, 18> P = filter.covariance().topLeftCorner<18, 18>();
    return e.dot(P.ldlt().solve(e));
  }

 private:
  static ErrorMatrix prior() {
    ErrorMatrix P = ErrorMatrix::Zero();
    const auto set = [&P](int block, double std) {
      P.diagonal().segment<3>(block).setConstant(std * std);
    };
    set(kRotation, 0.01);
    set(kPosition, 0.05);
    set(kVelocity, 0.05);
    set(kGyroBias, 0.005);
    set(kAccelBias, 0.05);
    set(kGravityBlock, 0.05);
    return P;
  }

  [[nodiscard]] NavigationState truth(double t, const Vec3& b_g, const Vec3& b_a) const {
    const test::MotionState m = motion_.at(t);
    NavigationState x;
    x.R_OB = m.X_OB.R;
    x.p_OB = m.X_OB.p;
    x.v_OB = m.v_OB;
    x.b_g = b_g;
    x.b_a = b_a;
    x.X_BL = {so3::Exp({0, 0.7, 0}), {0.15, 0, 0.01}};
    return x;
  }

  [[nodiscard]] ImuSample measure(double t, const Vec3& b_g, const Vec3& b_a, double rate,
                                  RandomStream& random) const {
    ImuSample sample = motion_.imu(from_seconds(t));
    sample.gyro_radps += b_g + noise_.gyro_noise_density * std::sqrt(rate) * random.normal3();
    sample.accel_mps2 += b_a + noise_.accel_noise_density * std::sqrt(rate) * random.normal3();
    return sample;
  }

  static void correct(const NavigationState& truth, RandomStream& random,
                      ErrorStateFilter& filter) {
    LidarNoiseConfig noise;
    struct Seen {
      ScanPoint point;
      SurfelMatch surface;
    };
    std::vector<Seen> seen;
    for (int i = 0; i < 60; ++i) {
      Seen s;
      const Vec3 p_L = random.uniform(2, 15) * random.normal3().normalized();
      s.point.p_L = p_L.cast<float>();
      s.point.range_m = static_cast<float>(p_L.norm());
      s.surface.normal = random.normal3().normalized();
      s.surface.variance_m2 = 1e-4;
      s.surface.mean = truth.R_OB * (truth.X_BL * s.point.p_L.cast<double>()) + truth.p_OB;
      const double sigma = std::sqrt(plane_residual(truth, s.point, s.surface, noise).variance_m2);
      s.surface.mean += sigma * random.normal() * s.surface.normal;
      seen.push_back(s);
    }
    NavigationState x = filter.state();
    PoseInformation information;
    for (int iteration = 0; iteration < 3; ++iteration) {
      information = {};
      for (const Seen& s : seen) {
        const PlaneResidual r = plane_residual(x, s.point, s.surface, noise);
        information.A += r.h * r.h.transpose() / r.variance_m2;
        information.b += r.h * r.r / r.variance_m2;
      }
      x = filter.iterate(x, information);
    }
    filter.finish(x, information);
  }

  ImuNoiseConfig noise_;
  test::AnalyticMotion motion_;
};

TEST(ErrorStateFilter, NeesLiesInItsBandOnAKnownMap) {
  constexpr int kRuns = 150;
  constexpr double kStates = 18;
  const KnownMap problem;
  double sum = 0;
  for (std::uint64_t run = 1; run <= kRuns; ++run) sum += problem.nees(run);
  // The mean of chi-square variables: its 95 % band.
  const double band = 1.96 * std::sqrt(2 * kStates / kRuns);
  EXPECT_NEAR(sum / kRuns, kStates, band);
}

// A vehicle that speeds up its turn by 10 rad/s^2 after the last reading is a t^2 / 2 off, and one
// that changes its acceleration by 30 m/s^3 a t^3 / 6, of which the filter, which asks for the
// velocity's error over the whole interval, makes somewhat more.
TEST(ErrorStateFilter, AHeldReadingAges) {
  for (const double held_s : {0.005, 0.02, 0.1}) {
    ImuInterval imu;
    imu.end = from_seconds(held_s);
    imu.held = true;
    imu.gyro_begin = imu.gyro_end = Vec3::Zero();
    imu.accel_begin = imu.accel_end = Vec3(0, 0, kGravity);
    ImuNoiseConfig noise;
    noise.gyro_noise_density = noise.accel_noise_density = 1e-9;
    ErrorStateFilter filter(noise);
    filter.reset(NavigationState{}, ErrorMatrix::Zero());
    filter.predict(imu);
    const auto std_of = [&](int index) { return std::sqrt(filter.covariance()(index, index)); };
    EXPECT_NEAR(std_of(kRotation), 5 * held_s * held_s, 0.01 * 5 * held_s * held_s);
    EXPECT_NEAR(std_of(kVelocity + 2), 15 * held_s * held_s, 0.01 * 15 * held_s * held_s);
    EXPECT_GE(std_of(kPosition + 2), 5 * held_s * held_s * held_s);
    EXPECT_LT(std_of(kPosition + 2), 10 * held_s * held_s * held_s);
  }
}

TEST(ErrorStateFilter, AClippedGyroAxisIsDoubted) {
  ImuNoiseConfig noise;
  ErrorStateFilter filter(noise);
  filter.reset(NavigationState{}, ErrorMatrix::Zero());
  ImuInterval imu;
  imu.end = 5'000'000;
  imu.accel_begin = imu.accel_end = Vec3(0, 0, kGravity);
  imu.gyro_begin = imu.gyro_end = imu.gyro_level = Vec3(0, 0, 4);
  imu.gyro_clipped = {false, false, true};
  filter.predict(imu);
  EXPECT_NEAR(std::sqrt(filter.covariance()(2, 2)),
              noise.clipped_gyro_noise_density * std::sqrt(0.005), 1e-4);
  EXPECT_NEAR(
      std::sqrt(filter.covariance()(0, 0)),
      std::hypot(noise.gyro_noise_density, 4 * noise.gyro_scale_noise_density) * std::sqrt(0.005),
      2e-5);
}

}  // namespace
}  // namespace arex
