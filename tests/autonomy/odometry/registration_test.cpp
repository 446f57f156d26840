#include "odometry/registration.h"

#include <gtest/gtest.h>

#include <set>
#include <tuple>

#include "math/random.h"
#include "math/so3.h"

namespace arex {
namespace {

TEST(PlaneResidual, JacobianIsTheDerivativeInEveryBlock) {
  constexpr double h = 1e-6;
  constexpr std::array<int, 4> kBlocks{kRotation, kPosition, kExtrinsicRotation,
                                       kExtrinsicPosition};
  for (std::uint64_t seed = 1; seed <= 10; ++seed) {
    RandomStream random(seed, "residual");
    NavigationState x;
    x.R_OB = so3::Exp(random.normal3());
    x.p_OB = random.normal3();
    x.X_BL = {so3::Exp(random.normal3()), random.normal3()};
    ScanPoint point;
    point.p_L = (5 * random.normal3()).cast<float>();
    point.range_m = point.p_L.norm();
    SurfelMatch match;
    match.normal = random.normal3().normalized();
    match.mean = random.normal3();
    const LidarNoiseConfig noise;
    const PlaneResidual residual = plane_residual(x, point, match, noise);
    for (int b = 0; b < 4; ++b) {
      for (int i = 0; i < 3; ++i) {
        const ErrorVector e = h * ErrorVector::Unit(kBlocks[static_cast<std::size_t>(b)] + i);
        const double numeric = (plane_residual(retract(x, e), point, match, noise).r -
                                plane_residual(retract(x, -e), point, match, noise).r) /
                               (2 * h);
        EXPECT_NEAR(residual.h[3 * b + i], numeric, 1e-7) << "block " << b;
      }
    }
  }
}

TEST(PlaneResidual, VarianceIsThatOfANoisyBeam) {
  RandomStream random(2, "beam");
  const LidarNoiseConfig noise;
  NavigationState x;
  SurfelMatch match;
  match.normal = Vec3(0.3, 0.2, 1).normalized();
  const Vec3 beam = Vec3(1, 0.2, -0.4).normalized();
  constexpr double kRange = 12;
  ScanPoint point;
  point.range_m = kRange;
  double sum = 0;
  constexpr int kSamples = 20000;
  for (int i = 0; i < kSamples; ++i) {
    const Vec3 across = noise.angle_std_rad * kRange * random.normal3();
    const Vec3 p = beam * (kRange + std::sqrt(noise.range_variance(kRange)) * random.normal()) +
                   across - beam * beam.dot(across);
    const double r = match.normal.dot(p - kRange * beam);
    sum += r * r;
  }
  point.p_L = (kRange * beam).cast<float>();
  const double told = plane_residual(x, point, match, noise).variance_m2;
  EXPECT_NEAR(sum / kSamples / told, 1, 0.04);  // 4 sigma of the estimate
}

TEST(Thin, KeepsTheFirstPointOfEveryCell) {
  RandomStream random(1, "thin");
  std::vector<ScanPoint> points;
  for (std::uint32_t i = 0; i < 5000; ++i) {
    ScanPoint point;
    point.p_L = (3 * random.normal3()).cast<float>();
    point.index = i;
    points.push_back(point);
  }
  std::set<std::tuple<int, int, int>> cells;
  std::vector<std::uint32_t> expected;
  for (const ScanPoint& point : points) {
    const auto c = (point.p_L / 0.5F).array().floor().cast<int>().eval();
    if (cells.insert({c.x(), c.y(), c.z()}).second) expected.push_back(point.index);
  }
  const auto kept = voxel_downsample(points, 0.5, 100000);
  ASSERT_EQ(kept.size(), expected.size());
  for (std::size_t i = 0; i < kept.size(); ++i) EXPECT_EQ(kept[i].index, expected[i]);
  EXPECT_EQ(voxel_downsample(points, 0.5, 500).size(), 500U);
  EXPECT_TRUE(voxel_downsample({}, 0.5, 500).empty());
}

/// A corner of three walls (or a single one), a vehicle 2 m off each.
struct Corner {
  explicit Corner(bool all_walls) : map(SurfelMapConfig{}) {
    RandomStream random(1, "corner");
    std::vector<Vec3f> cloud;
    for (int i = 0; i < 60000; ++i) {
      const int wall = all_walls ? i % 3 : 2;
      Vec3 p(random.uniform(-6, 6), random.uniform(-6, 6), random.uniform(-6, 6));
      p[wall] = -2.1 + 0.005 * random.normal();
      cloud.emplace_back(p.cast<float>());
      if (i % 20 == 0) {
        ScanPoint point;
        point.p_L = p.cast<float>();
        point.range_m = static_cast<float>(p.norm());
        points.push_back(point);
      }
    }
    map.insert(cloud, std::vector<float>(cloud.size(), 1e-4F));
  }
  SurfelMap map;
  std::vector<ScanPoint> points;
};

ErrorMatrix pose_doubt() {
  ErrorMatrix P = 1e-6 * ErrorMatrix::Identity();
  P.diagonal().head<3>().setConstant(1e-3);
  P.diagonal().segment<3>(kPosition).setConstant(1e-2);
  P.bottomRightCorner<6, 6>().setZero();
  return P;
}

TEST(RegisterScan, FindsThePoseInACorner) {
  const Corner corner(true);
  const LidarInertialConfig config;
  for (std::uint64_t seed = 1; seed <= 5; ++seed) {
    RandomStream random(seed, "prior");
    NavigationState x;
    x.R_OB = so3::Exp(0.02 * random.normal3());
    x.p_OB = 0.06 * random.normal3();
    ErrorStateFilter filter(config.imu);
    filter.reset(x, pose_doubt());
    const RegistrationReport report = register_scan(corner.points, corner.map, config, 0, filter);
    EXPECT_TRUE(report.accepted);
    EXPECT_LT(filter.state().p_OB.norm(), 0.003);
    EXPECT_LT(so3::angle(filter.state().R_OB), 0.001);
    EXPECT_LT(report.position_std_m[0], 0.005);
  }
}

TEST(RegisterScan, NamesTheDirectionsThatOneWallLeavesOpen) {
  const Corner wall(false);
  const LidarInertialConfig config;
  ErrorStateFilter filter(config.imu);
  filter.reset(NavigationState{}, pose_doubt());
  const RegistrationReport report = register_scan(wall.points, wall.map, config, 0, filter);
  EXPECT_GT(report.position_std_m[1], 50 * report.position_std_m[2]);  // two of three are open
  EXPECT_LT(std::abs(report.worst_position_axis_O.z()), 0.05);
  EXPECT_GT(std::abs(report.worst_rotation_axis_B.z()), 0.95);
  // And the filter knows, however the scatter of the fitted normals feigns a hold.
  EXPECT_GT(filter.covariance()(kPosition, kPosition), 0.9e-2);
  EXPECT_LT(filter.covariance()(kPosition + 2, kPosition + 2), 1e-5);
}

/// Flat ground 2 m below, mapped up to y = 0 but seen up to y = 2: what lies ahead falls into cells
/// that were filled on the near side only. With a wall at x = 13.5, y alone is left open. The
/// points err by half of what is told of them, so that a surfel's normal errs by no more than its
/// covariance says.
struct Ground {
  Ground(bool with_wall, std::uint64_t seed) : map(SurfelMapConfig{}) {
    constexpr double kNoise = 0.005, kHalf = 12, kWall = 13.5;
    RandomStream random(seed, "ground");
    const auto draw = [&](double y_end) {
      const bool wall = with_wall && random.uniform(0, 1) < 0.3;
      const double y = random.uniform(-kHalf, y_end);
      const Vec3 p =
          wall ? Vec3(kWall, y, random.uniform(1, 5)) : Vec3(random.uniform(-kHalf, kHalf), y, -2);
      return Vec3(p + kNoise * random.normal3());
    };
    std::vector<Vec3f> cloud;
    for (int i = 0; i < 60000; ++i) cloud.emplace_back(draw(0).cast<float>());
    map.insert(cloud, std::vector<float>(cloud.size(), 1e-4F));
    for (int i = 0; i < 6000; ++i) {
      ScanPoint point;
      point.p_L = draw(2).cast<float>();
      point.range_m = point.p_L.norm();
      points.push_back(point);
    }
  }
  SurfelMap map;
  std::vector<ScanPoint> points;
};

// The fits' scatter tilts each normal by a few milliradians, 6,000 of which would hold to
// 4 cm along the ground.
TEST(RegisterScan, FlatGroundSaysNothingAlongItHoweverItsNormalsErr) {
  const LidarInertialConfig config;
  for (std::uint64_t seed = 1; seed <= 10; ++seed) {
    const Ground ground(false, seed);
    ErrorStateFilter filter(config.imu);
    filter.reset(NavigationState{}, pose_doubt());
    const RegistrationReport report = register_scan(ground.points, ground.map, config, 0, filter);
    ASSERT_TRUE(report.accepted);
    EXPECT_GT(report.position_std_m[1], config.health.lost_position_std_m) << seed;
    EXPECT_GT(report.rotation_std_rad[0], config.health.lost_rotation_std_rad) << seed;
    EXPECT_LT(report.position_std_m[2], 0.01);
    // The filter believes along the ground what it believed before, to a fifth of the variance:
    // what the normals feign scatters so, the points of one surfel sharing its normal.
    EXPECT_GT(filter.covariance()(kPosition, kPosition), 0.8e-2);
    EXPECT_GT(filter.covariance()(kPosition + 1, kPosition + 1), 0.8e-2);
  }
}

// Priors in pairs of opposite errors: what is left in the mean is the registration's own.
TEST(RegisterScan, IsNeitherPulledNorSureWhereNoSurfaceFaces) {
  constexpr int kPairs = 20;
  const LidarInertialConfig config;
  const ErrorMatrix P = pose_doubt();
  double nees = 0, nees_along = 0, sum_along = 0, variance_along = 0;
  for (std::uint64_t seed = 1; seed <= kPairs; ++seed) {
    const Ground ground(true, seed);
    RandomStream random(seed, "prior");
    ErrorVector e = ErrorVector::Zero();
    e.segment<3>(kRotation) = std::sqrt(P(kRotation, kRotation)) * random.normal3();
    e.segment<3>(kPosition) = std::sqrt(P(kPosition, kPosition)) * random.normal3();
    for (const double sign : {1.0, -1.0}) {
      const NavigationState truth;
      ErrorStateFilter filter(config.imu);
      filter.reset(retract(truth, sign * e), P);
      const RegistrationReport report = register_scan(ground.points, ground.map, config, 0, filter);
      ASSERT_TRUE(report.accepted);
      const Eigen::Matrix<double, 6, 1> d = local(truth, filter.state()).head<6>();
      const PoseCovariance C = filter.covariance().topLeftCorner<6, 6>();
      nees += d.dot(C.ldlt().solve(d)) / (6 * 2 * kPairs);
      nees_along += d[4] * d[4] / C(4, 4) / (2 * kPairs);
      sum_along += d[4];
      variance_along += C(4, 4);
      EXPECT_LT((report.covariance + report.carried - C).norm(), 1e-9);
    }
  }
  // The mean of 20 squares of a normal variable has a deviation of sqrt(2 / 20).
  EXPECT_GT(nees_along, 0.5);
  EXPECT_LT(nees_along, 2);
  EXPECT_LT(nees, 2);
  // Were it not pulled, a sum of so many errors would be within 3 sigma.
  EXPECT_LT(std::abs(sum_along), 3 * std::sqrt(variance_along));
}

// A third of the points floats in the room, all on one side of every wall, under a prior that
// doubts 10 cm: the gate is wide open, the weights must do it.
TEST(RegisterScan, OutliersHardlyMoveIt) {
  const Corner corner(true);
  const LidarInertialConfig config;
  RandomStream random(4, "outliers");
  std::vector<ScanPoint> points = corner.points;
  for (std::size_t i = 0; i < points.size(); i += 3) {
    points[i].p_L = (random.uniform(0.5, 4) * random.normal3().normalized()).cast<float>();
    points[i].range_m = points[i].p_L.norm();
  }
  ErrorStateFilter filter(config.imu);
  filter.reset(NavigationState{}, pose_doubt());
  const RegistrationReport report = register_scan(points, corner.map, config, 0, filter);
  EXPECT_TRUE(report.accepted);
  EXPECT_LT(filter.state().p_OB.norm(), 0.02);
}

// Half of what the scan sees of one wall is a patch of it that the map holds 1.5 cm askew, met by a
// thousand points: it is one witness, not a thousand.
TEST(RegisterScan, HowManyPointsMeetASurfelDoesNotMakeItSurer) {
  const Corner corner(true);
  const LidarInertialConfig config;
  RandomStream random(6, "patch");
  std::vector<ScanPoint> points = corner.points;
  for (int i = 0; i < 1000; ++i) {
    const Vec3 p(random.uniform(0, 0.2), random.uniform(0, 0.2), -2.085 + 0.005 * random.normal());
    ScanPoint point;
    point.p_L = p.cast<float>();
    point.range_m = static_cast<float>(p.norm());
    points.push_back(point);
  }
  const auto pulled = [&](const std::vector<ScanPoint>& scan) {
    ErrorStateFilter filter(config.imu);
    filter.reset(NavigationState{}, pose_doubt());
    EXPECT_TRUE(register_scan(scan, corner.map, config, 0, filter).accepted);
    return filter.state().p_OB.z();
  };
  EXPECT_LT(std::abs(pulled(points) - pulled(corner.points)), 5e-4);
}

// A prior that knows nothing leaves the scan's own covariance, and the shaking beside it.
TEST(RegisterScan, WhatShakesTheImuIsNotKnownBetterForManyPoints) {
  const Corner corner(true);
  const LidarInertialConfig config;
  const auto registered = [&](double shaken_rad) {
    ErrorStateFilter filter(config.imu);
    ErrorMatrix P = pose_doubt();
    P.diagonal().head<6>().setConstant(1);
    filter.reset(NavigationState{}, P);
    EXPECT_TRUE(register_scan(corner.points, corner.map, config, shaken_rad, filter).accepted);
    return Mat3(filter.covariance().topLeftCorner<3, 3>());
  };
  const Mat3 still = registered(0);
  for (const double shaken_rad : {2e-4, 1e-3, 5e-3}) {
    const Mat3 expected = still + shaken_rad * shaken_rad * Mat3::Identity();
    EXPECT_LT((registered(shaken_rad) - expected).norm(), 0.01 * expected.norm()) << shaken_rad;
  }
}

// The IMU is shaken by 0.5 mrad against the LiDAR: the scan tells where the LiDAR is, and moves the
// filter, which follows the IMU, hardly.
TEST(RegisterScan, PlacesTheScanWhereTheLidarIs) {
  const Corner corner(true);
  const LidarInertialConfig config;
  constexpr double kShaken = 5e-4;
  for (std::uint64_t seed = 1; seed <= 5; ++seed) {
    RandomStream random(seed, "shaken");
    const auto registered = [&](const Vec3& off, double shaken_rad, Pose& X_OB) {
      ErrorStateFilter filter(config.imu);
      NavigationState x;
      x.R_OB = so3::Exp(off);
      ErrorMatrix P = pose_doubt();
      P.diagonal().head<3>().setConstant(1e-8);
      P.diagonal().segment<6>(kExtrinsicRotation).setZero();
      filter.reset(x, P);
      const RegistrationReport report =
          register_scan(corner.points, corner.map, config, shaken_rad, filter);
      EXPECT_TRUE(report.accepted);
      X_OB = report.X_OB;
      return filter.state().X_OB();
    };
    const Vec3 off = kShaken * random.normal3().normalized();
    Pose by_lidar;
    const Pose by_filter = registered(off, kShaken, by_lidar);
    EXPECT_GT(so3::angle(by_filter.R), 0.8 * kShaken) << seed;
    EXPECT_LT(so3::angle(by_lidar.R), 0.4 * kShaken) << seed;
    EXPECT_LT(by_lidar.p.norm(), 0.002) << seed;
    // With nothing shaken they are one, to what the iterations leave.
    const Pose unshaken = registered(off, 0, by_lidar);
    EXPECT_LT(so3::angle(unshaken.R.transpose() * by_lidar.R), 1e-6) << seed;
    EXPECT_LT((unshaken.p - by_lidar.p).norm(), 1e-5) << seed;
  }
}

TEST(RegisterScan, RefusesWhatDoesNotFit) {
  const Corner corner(true);
  const LidarInertialConfig config;
  ErrorStateFilter filter(config.imu);
  NavigationState x;
  x.p_OB = Vec3(30, 30, 30);
  filter.reset(x, pose_doubt());
  const ErrorMatrix before = filter.covariance();
  const RegistrationReport report = register_scan(corner.points, corner.map, config, 0, filter);
  EXPECT_FALSE(report.accepted);
  EXPECT_EQ(filter.state().p_OB, x.p_OB);
  EXPECT_EQ(filter.covariance(), before);
  EXPECT_FALSE(register_scan({}, corner.map, config, 0, filter).accepted);
}

}  // namespace
}  // namespace arex
