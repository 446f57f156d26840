#include "scoring/odometry_error.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "math/random.h"

namespace arex::sim {
namespace {

// A level figure of eight of about 60 m at constant heading along the path.
std::vector<PosePair> figure_of_eight(const Pose& X_WO) {
  std::vector<PosePair> pairs;
  for (int i = 0; i <= 4000; ++i) {
    const double s = 2 * std::numbers::pi * i / 4000;
    PosePair pair;
    pair.stamp = i * 5 * kNanosecondsPerTick;
    pair.X_WB.p = {10 * std::sin(s), 5 * std::sin(2 * s), 1.5};
    pair.X_WB.R = so3::from_yaw(std::atan2(10 * std::cos(2 * s), 10 * std::cos(s)));
    pair.X_OB = X_WO.inverse() * pair.X_WB;
    pairs.push_back(pair);
  }
  return pairs;
}

TEST(OdometryScore, APerfectEstimateScoresZeroInAnyFrame) {
  for (std::uint64_t seed = 1; seed <= 3; ++seed) {
    RandomStream random(seed, "frame");
    const Pose X_WO{so3::Exp(random.normal3()), 10 * random.normal3()};
    const OdometryScore score = score_odometry(figure_of_eight(X_WO));
    EXPECT_LT(score.ate_rmse_m, 1e-10);
    EXPECT_LT(score.ate_se3_rmse_m, 1e-10);
    EXPECT_LT(score.rpe_10m_m, 1e-10);
    EXPECT_LT(score.yaw_error_max_deg, 1e-10);
  }
}

// A constant offset of the estimate after the first pose is all start-aligned error, and none after
// the rigid alignment.
TEST(OdometryScore, SeparatesAlignmentAtStartFromTheRigidOne) {
  auto pairs = figure_of_eight({});
  for (std::size_t i = 1; i < pairs.size(); ++i) pairs[i].X_OB.p += Vec3(0.3, 0, 0.4);
  const OdometryScore score = score_odometry(pairs);
  EXPECT_NEAR(score.ate_rmse_m, 0.5, 1e-3);
  EXPECT_NEAR(score.ate_max_m, 0.5, 1e-9);
  EXPECT_LT(score.ate_se3_rmse_m, 0.01);
}

// A scale error of 1 % is 1 cm per metre and 10 cm per ten metres of straight path.
// The centimetres by which a hover sways and its estimate errs tell no rotation: here the fit would
// turn the map by a right angle.
TEST(OdometryScore, AHoverPlacesTheMapByItsStart) {
  std::vector<PosePair> hover(2000);
  for (std::size_t i = 1; i < hover.size(); ++i) {
    const double a = 0.01 * static_cast<double>(i);
    hover[i].X_WB.p = {0.01 * std::cos(a), 0.005 * std::sin(a), 1.5};
    hover[i].X_OB.p = {-0.005 * std::sin(a), 0.01 * std::cos(a), 1.5};
  }
  EXPECT_LT(so3::angle(align_map(hover).R), 1e-12);
  EXPECT_GT(so3::angle(align_rigid(hover).R), 1.0);
  const Pose X_WO{so3::Exp({0.02, -0.03, 0.5}), {1, 2, 3}};
  const Pose placed = align_map(figure_of_eight(X_WO));
  EXPECT_LT(so3::angle(placed.R.transpose() * X_WO.R), 1e-9);
}

TEST(OdometryScore, RelativeErrorMeasuresDriftPerPath) {
  std::vector<PosePair> pairs;
  for (int i = 0; i <= 3000; ++i) {
    PosePair pair;
    pair.X_WB.p = {0.01 * i, 0, 0};
    pair.X_OB.p = {0.0101 * i, 0, 0};
    pairs.push_back(pair);
  }
  const OdometryScore score = score_odometry(pairs);
  EXPECT_NEAR(score.rpe_1m_m, 0.01, 2e-4);
  EXPECT_NEAR(score.rpe_10m_m, 0.10, 2e-4);
  EXPECT_NEAR(score.ate_max_m, 0.30, 1e-9);
}

TEST(OdometryScore, ReportsTheLargestHeadingError) {
  auto pairs = figure_of_eight({});
  pairs[1234].X_OB.R = pairs[1234].X_OB.R * so3::from_yaw(2 * std::numbers::pi / 180);
  EXPECT_NEAR(score_odometry(pairs).yaw_error_max_deg, 2.0, 1e-9);
}

// Errors drawn from the covariance have a NEES of one per dimension; of twice the size, of four.
TEST(Nees, IsOneIfTheErrorsAreAsLargeAsTheCovarianceSays) {
  for (const double factor : {1.0, 2.0}) {
    RandomStream random(3, "nees");
    Eigen::Matrix<double, 6, 6> L = Eigen::Matrix<double, 6, 6>::Zero();
    for (int i = 0; i < 6; ++i) {
      for (int j = 0; j <= i; ++j) L(i, j) = 1e-3 * random.normal();
      L(i, i) += 3e-3;
    }
    const PosePair first{0, {so3::Exp({0.1, 0.2, 1}), {3, 2, 1}}, {so3::Exp({0, 0, 0.3}), {}}};
    Nees nees;
    nees.add(first, first, Eigen::Matrix<double, 6, 6>::Zero());  // no covariance: not counted
    for (int i = 0; i < 20'000; ++i) {
      Eigen::Matrix<double, 6, 1> e;
      for (int k = 0; k < 6; ++k) e[k] = factor * random.normal();
      e = L * e;
      const Pose X_OB{so3::Exp(random.normal3()), 5 * random.normal3()};
      PosePair now;
      now.X_WB = first.X_WB * first.X_OB.inverse() * X_OB;
      now.X_OB = {X_OB.R * so3::Exp(e.head<3>()), X_OB.p + e.tail<3>()};
      nees.add(first, now, L * L.transpose());
    }
    // The mean of n chi-square variables of 3 dimensions, each over 3, has sigma sqrt(2 / 3n).
    EXPECT_NEAR(nees.rotation(), factor * factor, 0.03 * factor * factor);
    EXPECT_NEAR(nees.position(), factor * factor, 0.03 * factor * factor);
  }
  EXPECT_TRUE(std::isnan(Nees{}.rotation()));
}

TEST(OdometryError, WhatWasNotFlownIsNotScored) {
  const OdometryScore none = score_odometry({});
  for (const double figure : {none.ate_rmse_m, none.ate_max_m, none.ate_se3_rmse_m,
                              none.yaw_error_max_deg, none.start_tilt_deg, none.rpe_1m_m}) {
    EXPECT_TRUE(std::isnan(figure));
  }
  std::vector<PosePair> pairs;
  for (int i = 0; i <= 500; ++i) {  // 5 m straight on, without error
    const Pose X{Mat3::Identity(), {0.01 * i, 0, 0}};
    pairs.push_back({Stamp{i} * 5'000'000, X, X});
  }
  const OdometryScore score = score_odometry(pairs);
  EXPECT_LT(score.ate_max_m, 1e-9);
  EXPECT_LT(score.rpe_1m_m, 1e-9);
  EXPECT_TRUE(std::isnan(score.rpe_10m_m)) << "the path is shorter";
}

}  // namespace
}  // namespace arex::sim
