#include "math/so3.h"

#include <gtest/gtest.h>

#include <numbers>
#include <unsupported/Eigen/MatrixFunctions>

#include "math/pose.h"
#include "math/random.h"

namespace arex {
namespace {

// Angles that cross every branch of the closed forms: series, near the switch, ordinary, near pi.
constexpr double kAngles[] = {0, 1e-12, 1e-6, 0.9e-4, 1.1e-4, 1e-3, 0.049, 0.051, 0.5, 2.0, 3.1};

TEST(So3, ExponentialMatchesTheMatrixExponential) {
  RandomStream random(1, "so3");
  for (const double angle : kAngles) {
    const Vec3 phi = angle * random.normal3().normalized();
    const Mat3 oracle = so3::hat(phi).exp();
    EXPECT_LT((so3::Exp(phi) - oracle).norm(), 1e-13) << angle;
  }
}

TEST(So3, LogarithmInvertsTheExponential) {
  RandomStream random(2, "so3");
  for (const double angle : kAngles) {
    const Vec3 phi = angle * random.normal3().normalized();
    EXPECT_LT((so3::Log(so3::Exp(phi)) - phi).norm(), 1e-12) << angle;
  }
}

TEST(So3, RightJacobianMatchesNumericalDifferences) {
  RandomStream random(3, "so3");
  constexpr double kStep = 1e-6;
  for (const double angle : kAngles) {
    const Vec3 phi = angle * random.normal3().normalized();
    Mat3 numeric;
    for (int i = 0; i < 3; ++i) {
      const Vec3 d = kStep * Vec3::Unit(i);
      numeric.col(i) = (so3::Log(so3::Exp(phi).transpose() * so3::Exp(phi + d)) -
                        so3::Log(so3::Exp(phi).transpose() * so3::Exp(phi - d))) /
                       (2 * kStep);
    }
    EXPECT_LT((so3::right_jacobian(phi) - numeric).norm(), 1e-8) << angle;
    EXPECT_LT(
        (so3::right_jacobian(phi) * so3::right_jacobian_inverse(phi) - Mat3::Identity()).norm(),
        1e-9)
        << angle;
  }
}

TEST(So3, WrapsAnglesIntoTheHalfOpenInterval) {
  constexpr double kPi = std::numbers::pi;
  EXPECT_DOUBLE_EQ(so3::wrap(kPi), kPi);
  EXPECT_DOUBLE_EQ(so3::wrap(-kPi), kPi);
  EXPECT_NEAR(so3::wrap(7.0), 7.0 - 2 * kPi, 1e-15);
  EXPECT_NEAR(so3::wrap(-7.0), -7.0 + 2 * kPi, 1e-15);
}

TEST(Pose, InverseAndInterpolationAgreeWithComposition) {
  RandomStream random(4, "pose");
  for (int i = 0; i < 20; ++i) {
    const Pose X_AB{so3::Exp(random.normal3()), random.normal3()};
    const Pose X_BC{so3::Exp(random.normal3()), random.normal3()};
    const Vec3 p = random.normal3();
    EXPECT_LT(((X_AB * X_BC) * p - X_AB * (X_BC * p)).norm(), 1e-13);
    EXPECT_LT((X_AB.inverse() * (X_AB * p) - p).norm(), 1e-13);
    const Pose middle = interpolate(X_AB, X_BC, 0.5);
    EXPECT_LT((middle.R.transpose() * X_BC.R - X_AB.R.transpose() * middle.R).norm(), 1e-9);
    EXPECT_LT((interpolate(X_AB, X_BC, 1.0).R - X_BC.R).norm(), 1e-9);
  }
}

}  // namespace
}  // namespace arex
