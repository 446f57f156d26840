#include "odometry/visual/factors.h"

#include <gtest/gtest.h>

#include <vector>

#include "math/random.h"

namespace arex {
namespace {

FrameState some_state(RandomStream& random) {
  return {so3::Exp(0.3 * random.normal3()), 2 * random.normal3(), random.normal3(),
          0.01 * random.normal3(), 0.1 * random.normal3()};
}

Preintegration some_imu(RandomStream& random) {
  Preintegration imu({}, 0.01 * random.normal3(), 0.1 * random.normal3());
  for (int i = 0; i < 20; ++i) {
    ImuInterval interval;
    interval.begin = i * 5'000'000;
    interval.end = (i + 1) * 5'000'000;
    interval.gyro_begin = interval.gyro_end = 0.5 * random.normal3();
    interval.accel_begin = interval.accel_end = Vec3(0, 0, kGravity) + random.normal3();
    imu.add(interval);
  }
  return imu;
}

FrameError unit(int i, double h) {
  FrameError d = FrameError::Zero();
  d[i] = h;
  return d;
}

TEST(ImuFactor, DerivativesAreThoseOfTheResidual) {
  constexpr double h = 1e-6;
  for (const std::uint64_t seed : {1, 2, 3}) {
    RandomStream random(seed, "imu factor");
    const Preintegration imu = some_imu(random);
    const FrameState a = some_state(random), b = some_state(random);
    const ImuJacobians J = imu_jacobians(imu, a, b);
    for (int i = 0; i < kFrameDim; ++i) {
      const ImuResidual from = (imu_residual(imu, retract(a, unit(i, h)), b) -
                                imu_residual(imu, retract(a, unit(i, -h)), b)) /
                               (2 * h);
      const ImuResidual to = (imu_residual(imu, a, retract(b, unit(i, h))) -
                              imu_residual(imu, a, retract(b, unit(i, -h)))) /
                             (2 * h);
      EXPECT_LT((from - J.from.col(i)).norm(), 1e-6) << i;
      EXPECT_LT((to - J.to.col(i)).norm(), 1e-6) << i;
    }
  }
}

TEST(ImuFactor, VanishesWhereTheMeasurementLeads) {
  RandomStream random(4, "imu factor");
  const Preintegration imu = some_imu(random);
  FrameState a = some_state(random), b;
  a.b_g = imu.b_g();
  a.b_a = imu.b_a();
  const double dt = imu.dt_s();
  const Vec3 g(0, 0, -kGravity);
  b = a;
  b.R_OB = a.R_OB * imu.dR();
  b.v_OB = a.v_OB + dt * g + a.R_OB * imu.dv();
  b.p_OB = a.p_OB + dt * a.v_OB + 0.5 * dt * dt * g + a.R_OB * imu.dp();
  EXPECT_LT(imu_residual(imu, a, b).norm(), 1e-12);
}

TEST(ImuFactor, WhitensToUnitVariance) {
  RandomStream random(5, "imu factor");
  const Preintegration imu = some_imu(random);
  const ImuJacobian W = imu_whitening(imu);
  const Eigen::Matrix<double, 9, 9> one =
      W.topLeftCorner<9, 9>() * imu.covariance() * W.topLeftCorner<9, 9>().transpose();
  EXPECT_TRUE(one.isIdentity(1e-3));
}

/// Two frames that look at a point ahead.
struct Scene {
  explicit Scene(std::uint64_t seed) : random(seed, "sight") {
    camera.X_BC = {so3::Exp({0, 0.1, 0}) * MatForward(), Vec3(0.14, 0, 0.07)};
    camera.t_d = 0.004;
    a = {so3::Exp(0.1 * random.normal3()), random.normal3(), {}, {}, {}};
    b = {a.R_OB * so3::Exp(0.05 * random.normal3()), a.p_OB + 0.3 * random.normal3(), {}, {}, {}};
    anchor = {0, Vec2(0.3 * random.normal(), 0.2 * random.normal()), std::nullopt};
    seen = {1, Vec2(0.1, 0.2), Vec2(0.05, 0.2)};
    a.v_OB = random.normal3();
    b.v_OB = random.normal3();
    of_a = {0.001, random.normal3()};
    of_b = {0.007, random.normal3()};
    point = {anchor.left, random.uniform(0.05, 0.4)};
  }
  static Mat3 MatForward() {
    Mat3 R;
    R << 0, 0, 1, -1, 0, 0, 0, -1, 0;
    return R;
  }
  RandomStream random;
  CameraState camera;
  FrameState a, b;
  Observation anchor, seen;
  FrameTiming of_a, of_b;
  LandmarkState point;
};

TEST(SightFactor, DerivativesAreThoseOfTheResidual) {
  constexpr double h = 1e-6;
  for (const std::uint64_t seed : {1, 2, 3, 4}) {
    const Scene s(seed);
    for (const bool right : {false, true}) {
      const Sight sight{s.seen, false, right, 0.05};
      const auto r = [&](const FrameState& a, const FrameState& b, const CameraState& c,
                         const LandmarkState& point) {
        return *sight_residual(sight, {a, s.of_a, c.t_d}, {b, s.of_b, c.t_d}, c, point);
      };
      const SightJacobians J = sight_jacobians(sight, {s.a, s.of_a, s.camera.t_d},
                                               {s.b, s.of_b, s.camera.t_d}, s.camera, s.point);
      for (int i = 0; i < kPoseDim; ++i) {
        const Vec2 by_a = (r(retract(s.a, unit(i, h)), s.b, s.camera, s.point) -
                           r(retract(s.a, unit(i, -h)), s.b, s.camera, s.point)) /
                          (2 * h);
        const Vec2 by_b = (r(s.a, retract(s.b, unit(i, h)), s.camera, s.point) -
                           r(s.a, retract(s.b, unit(i, -h)), s.camera, s.point)) /
                          (2 * h);
        EXPECT_LT((by_a - J.anchor.col(i)).norm(), 1e-7) << i;
        EXPECT_LT((by_b - J.seen.col(i)).norm(), 1e-7) << i;
      }
      for (int i = 0; i < kCameraDim; ++i) {
        CameraError d = CameraError::Zero();
        d[i] = h;
        const Vec2 by = (r(s.a, s.b, retract(s.camera, d), s.point) -
                         r(s.a, s.b, retract(s.camera, -d), s.point)) /
                        (2 * h);
        EXPECT_LT((by - J.camera.col(i)).norm(), 1e-6) << i;
      }
      for (int i = 0; i < kLandmarkDim; ++i) {
        const Vec3 d = h * Vec3::Unit(i);
        const LandmarkState plus{s.point.ray + d.head<2>(), s.point.inverse_depth + d.z()};
        const LandmarkState minus{s.point.ray - d.head<2>(), s.point.inverse_depth - d.z()};
        const Vec2 by = (r(s.a, s.b, s.camera, plus) - r(s.a, s.b, s.camera, minus)) / (2 * h);
        EXPECT_LT((by - J.landmark.col(i)).norm(), 1e-7) << i;
      }
    }
  }
}

TEST(SightFactor, OfTheAnchorHangsOnTheLandmarkAlone) {
  Scene s(5);
  s.anchor.right = s.anchor.left - Vec2(0.2 * 0.05, 0);
  const Exposure placed(s.a, s.of_a, s.camera.t_d);
  const LandmarkState point{s.anchor.left, 0.2};
  for (const bool right : {false, true}) {
    const Sight sight{s.anchor, true, right, 0.05};
    EXPECT_LT(sight_residual(sight, placed, placed, s.camera, point)->norm(), 1e-12);
    const SightJacobians J = sight_jacobians(sight, placed, placed, s.camera, point);
    // Where it stands in the image, both eyes share; how far it is, what they differ by tells.
    EXPECT_TRUE(right ? J.landmark.leftCols<2>().isZero(0)
                      : J.landmark.leftCols<2>().isIdentity(0));
    EXPECT_DOUBLE_EQ(J.landmark(0, 2), right ? 0.05 : 0);
  }
}

// A track that has slipped along its surface's image takes the right eye's with it.
TEST(SightFactor, OfTheRightEyeIsFreeOfWhatTheTrackHasDriftedBy) {
  Scene s(7);
  const Exposure a(s.a, s.of_a, s.camera.t_d), b(s.b, s.of_b, s.camera.t_d);
  const Sight sight{s.seen, false, true, 0.05};
  const Vec2 before = *sight_residual(sight, a, b, s.camera, s.point);
  const Vec2 slip(0.01, -0.02);
  s.seen.left += slip;
  *s.seen.right += slip;
  const Vec2 after = *sight_residual(sight, a, b, s.camera, s.point);
  EXPECT_LT((after - before).norm(), 1e-12);
  s.seen.right->x() -= 0.003;  // further apart: nearer than it was
  EXPECT_NEAR(sight_residual(sight, a, b, s.camera, s.point)->x(), after.x() - 0.003, 1e-12);
}

TEST(SightFactor, RefusesWhatLiesBehindTheCamera) {
  const Scene s(6);
  FrameState turned = s.b;
  turned.R_OB = s.a.R_OB * so3::from_yaw(3.0);
  const Sight sight{s.seen, false, false, 0.05};
  EXPECT_FALSE(sight_residual(sight, {s.a, s.of_a, s.camera.t_d}, {turned, s.of_b, s.camera.t_d},
                              s.camera, s.point));
}

/// A landmark as both frames of the scene see it.
Landmark seen_by_both(const Scene& s, double inverse_depth, bool stereo) {
  Landmark landmark{7, {s.anchor, s.seen}, {}};
  Observation& anchor = landmark.seen[0];
  Observation& other = landmark.seen[1];
  anchor.right.reset();
  other.left.setZero();
  other.right = Vec2::Zero();
  const Exposure a(s.a, {}, 0), b(s.b, {}, 0);
  const LandmarkState point{anchor.left, inverse_depth};
  const Vec2 l = *sight_residual({other, false, false, 0.05}, a, b, s.camera, point);
  const Vec2 disparity = *sight_residual({other, false, true, 0.05}, a, b, s.camera, point);
  other.left = l;
  other.right = l - disparity;
  if (stereo) {
    anchor.right = anchor.left - inverse_depth * 0.05 * Vec2::UnitX();
  } else {
    other.right.reset();
  }
  return landmark;
}

TEST(Triangulation, FindsThePointWhereItIs) {
  for (const std::uint64_t seed : {1, 2, 3}) {
    const Scene s(seed);
    for (const bool stereo : {false, true}) {
      const Landmark landmark = seen_by_both(s, 0.25, stereo);
      const auto rho = triangulate(landmark, {&s.a, &s.b}, s.camera, 0.05);
      ASSERT_TRUE(rho);
      EXPECT_NEAR(*rho, 0.25, 1e-9);
    }
  }
}

TEST(Triangulation, HasNoDepthFromOneRay) {
  const Scene s(1);
  Landmark landmark{7, {s.anchor}, {}};
  landmark.seen[0].right.reset();
  EXPECT_FALSE(triangulate(landmark, {&s.a}, s.camera, 0.05));
}

TEST(Triangulation, TakesNoiseBeyondInfinityForTheBackdropAndMoreForAMismatch) {
  const Scene s(1);
  Landmark landmark{7, {s.anchor}, {}};
  landmark.seen[0].right = landmark.seen[0].left + Vec2(0.5 / 423, 0);
  EXPECT_DOUBLE_EQ(*triangulate(landmark, {&s.a}, s.camera, 0.05), 1 / kBackdrop);
  landmark.seen[0].right = landmark.seen[0].left + Vec2(5.0 / 423, 0);
  EXPECT_FALSE(triangulate(landmark, {&s.a}, s.camera, 0.05));
}

}  // namespace
}  // namespace arex
