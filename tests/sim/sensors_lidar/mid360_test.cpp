#include "sensors/mid360.h"

#include <gtest/gtest.h>

#include <cmath>
#include <thread>

#include "messages/vehicle.h"
#include "physics/airframe.h"
#include "sim/sensors_lidar/test_world.h"

namespace arex::sim {
namespace {

using test::rest;
using test::room;
using test::to_wall;
using test::WorldMaker;
using worlds::CollisionShape;

Mid360Config exact() {
  Mid360Config config;
  config.noise_free = true;
  return config;
}

std::int64_t firing_of(const LidarScan& scan, const LidarPoint& point) {
  return (scan.stamp + point.offset_ns) / Mid360Pattern::kFiringPeriod;
}

TEST(Mid360, FiresTwentyThousandTimesAFrameAtExactTimes) {
  const worlds::World world = room();
  const Scene scene(world);
  const Pose X_BL = VehicleConfig{}.X_BL();
  const Mid360 lidar(exact(), scene, X_BL, {}, 1);
  for (const Stamp start : {Stamp{0}, Stamp{100'000'000}, Stamp{1'799'900'000'000}}) {
    const LidarScan scan = lidar.scan(rest(Pose{}, 100, start));
    ASSERT_EQ(scan.points.size(), 20'000U);
    EXPECT_EQ(scan.stamp, start);
    EXPECT_EQ(scan.end, start + 100'000'000);
    const Mid360Pattern pattern(PatternMode::kDevice);
    for (std::size_t i = 0; i < scan.points.size(); ++i) {
      const LidarPoint& point = scan.points[i];
      ASSERT_EQ(point.offset_ns, 5'000 * i);
      ASSERT_EQ(point.line, i % 4);
      const Vec3 expected = pattern.direction(firing_of(scan, point));
      ASSERT_LT((point.p_L.cast<double>().normalized() - expected).norm(), 3e-7);
    }
  }
}

TEST(Mid360, RangesAPlaneUpToItsReflectivitysLimit) {
  const float reflectivity = 0.12F;
  const worlds::World world =
      WorldMaker().object(reflectivity).quad({-90, -90, 0}, {180, 0, 0}, {0, 180, 0}).world();
  const Scene scene(world);
  const Pose X_BL = VehicleConfig{}.X_BL();
  const Pose X_WB{so3::from_yaw(0.4), {3, -2, 6}};
  const Mid360 lidar(exact(), scene, X_BL, {}, 1);
  const LidarScan scan = lidar.scan(rest(X_WB));
  const Pose X_WL = X_WB * X_BL;
  const Mid360Pattern pattern(PatternMode::kDevice);
  std::size_t next = 0;
  for (std::int64_t i = 0; i < 20'000; ++i) {
    const Vec3 d_W = X_WL.R * pattern.direction(i);
    const double range = -X_WL.p.z() / d_W.z();
    const double limit =
        std::min(70.0, 40 * std::pow(reflectivity * std::abs(d_W.z()) / 0.1, 0.269));
    const bool returned = next < scan.points.size() && firing_of(scan, scan.points[next]) == i;
    if (d_W.z() >= 0 || range > limit + 0.02) {
      ASSERT_FALSE(returned) << i;
    } else if (range < limit - 0.02) {
      ASSERT_TRUE(returned) << i;
    }
    if (!returned) continue;
    const LidarPoint& point = scan.points[next++];
    ASSERT_NEAR(point.p_L.cast<double>().norm(), range, 1e-3);
    ASSERT_NEAR(point.intensity, 150 * reflectivity * std::abs(d_W.z()), 0.51);
  }
  EXPECT_EQ(next, scan.points.size());
  EXPECT_GT(next, 4'000U);
}

TEST(Mid360, RangesASphereFromInside) {
  const Vec3 centre(0.3, -0.2, 0.1);
  const double radius = 5;
  const worlds::World world = WorldMaker().object(0.5F).sphere(centre, radius, 400, 200).world();
  const Scene scene(world);
  const Mid360 lidar(exact(), scene, Pose{}, {}, 1);
  const LidarScan scan = lidar.scan(rest(Pose{}));
  ASSERT_EQ(scan.points.size(), 20'000U);
  for (const LidarPoint& point : scan.points) {
    const double b = centre.dot(point.p_L.cast<double>().normalized());
    const double range = b + std::sqrt(b * b - centre.squaredNorm() + radius * radius);
    ASSERT_NEAR(point.p_L.cast<double>().norm(), range, 1e-3);
  }
}

TEST(Mid360, RangesACylinder) {
  const double radius = 0.3;
  const Vec3 axis(4, 1, 0);
  const worlds::World world =
      WorldMaker().object(0.5F).tube({Mat3::Identity(), axis}, radius, 6, 3000).world();
  const Scene scene(world);
  const Mid360 lidar(exact(), scene, Pose{}, {}, 1);
  const LidarScan scan = lidar.scan(rest(Pose{}, 400));
  ASSERT_GT(scan.points.size(), 800U);
  int compared = 0;
  for (const LidarPoint& point : scan.points) {
    const Vec3 d = point.p_L.cast<double>().normalized();
    const double a = d.head<2>().squaredNorm(), b = d.head<2>().dot(axis.head<2>());
    const double discriminant = b * b - a * (axis.head<2>().squaredNorm() - radius * radius);
    ASSERT_GT(discriminant, -1e-6);
    const double range = (b - std::sqrt(std::max(discriminant, 0.0))) / a;
    const Vec3 normal = (range * d - axis).cwiseProduct(Vec3(1, 1, 0)) / radius;
    if (-normal.dot(d) < 0.05) continue;  // the outline, where facets are seen edge on
    ++compared;
    ASSERT_NEAR(point.p_L.cast<double>().norm(), range, 1e-3);
  }
  EXPECT_GT(compared, 700);
}

// The vehicle turns and moves inside the frame: every point has its own pose, in closed form.
class Motion {
 public:
  Vec3 v_WB{1.5, -0.8, 0.4};
  Vec3 w_B{0, 0, 3};
  Pose start{so3::Exp({0.1, -0.2, 0.3}), {0.5, 0.4, -0.3}};

  [[nodiscard]] Pose at(double time_s) const {
    return {start.R * so3::Exp(w_B * time_s), start.p + v_WB * time_s};
  }
  [[nodiscard]] std::vector<Truth> ticks(int count) const {
    std::vector<Truth> out = rest(start, count);
    for (Truth& truth : out) truth.X_WB = at(to_seconds(truth.stamp));
    return out;
  }
};

TEST(Mid360, DistortsAFrameAsTheMotionInsideItSays) {
  const worlds::World world = room();
  const Scene scene(world);
  const Pose X_BL = VehicleConfig{}.X_BL();
  const Mid360 lidar(exact(), scene, X_BL, {}, 1);
  const Mid360Pattern pattern(PatternMode::kDevice);
  for (const Vec3& rate : {Vec3(0, 0, 3), Vec3(4, -3, 6)}) {
    Motion motion;
    motion.w_B = rate;
    const LidarScan scan = lidar.scan(motion.ticks(100));
    ASSERT_EQ(scan.points.size(), 20'000U);
    double worst = 0, worst_undistorted = 0;
    for (const LidarPoint& point : scan.points) {
      const Vec3 d_L = pattern.direction(firing_of(scan, point));
      const Pose X_WL = motion.at(1e-9 * point.offset_ns) * X_BL;
      const Vec3 expected_L = to_wall(X_WL.p, X_WL.R * d_L) * d_L;
      worst = std::max(worst, (point.p_L.cast<double>() - expected_L).norm());
      const Pose X_WL0 = motion.at(0) * X_BL;
      const Vec3 frozen_L = to_wall(X_WL0.p, X_WL0.R * d_L) * d_L;
      worst_undistorted = std::max(worst_undistorted, (point.p_L.cast<double>() - frozen_L).norm());
    }
    EXPECT_LT(worst, 1e-3);
    EXPECT_GT(worst_undistorted, 1.0);  // the distortion that was to be modelled
  }
}

TEST(Mid360, SeesItsAirframeBeyondTheBlindZoneAndNothingBehindIt) {
  const worlds::World world = room();
  const Scene scene(world);
  const Pose X_BL = VehicleConfig{}.X_BL();
  CollisionShape near_part, far_part;
  near_part.kind = CollisionShape::Kind::kBox;  // within 0.1 m of the LiDAR
  near_part.X_WS = X_BL * Pose{Mat3::Identity(), {0.06, 0, 0.02}};
  near_part.size = {0.01, 0.02, 0.02};
  far_part.kind = CollisionShape::Kind::kBox;
  far_part.X_WS = X_BL * Pose{Mat3::Identity(), {-0.3, 0, 0.05}};
  far_part.size = {0.02, 0.1, 0.05};
  Mid360Config config = exact();
  const Mid360 lidar(config, scene, X_BL, {near_part, far_part}, 1);
  const LidarScan scan = lidar.scan(rest(Pose{}));
  const Mid360Pattern pattern(PatternMode::kDevice);
  std::size_t next = 0;
  int silent = 0, own = 0;
  for (std::int64_t i = 0; i < 20'000; ++i) {
    const Vec3 d = pattern.direction(i);
    const bool returned = next < scan.points.size() && firing_of(scan, scan.points[next]) == i;
    // Front face of each box: x = 0.05 within |y| < 0.02, 0 < z < 0.04; x = -0.28 likewise.
    const Vec3 at_near = 0.05 / d.x() * d, at_far = -0.28 / d.x() * d;
    const bool meets_near =
        d.x() > 0 && std::abs(at_near.y()) < 0.0199 && std::abs(at_near.z() - 0.02) < 0.0199;
    const bool meets_far =
        d.x() < 0 && std::abs(at_far.y()) < 0.0999 && std::abs(at_far.z() - 0.05) < 0.0499;
    if (meets_near) {
      ++silent;
      ASSERT_FALSE(returned);
    } else if (meets_far) {
      ++own;
      ASSERT_TRUE(returned);
      ASSERT_NEAR(scan.points[next].p_L.norm(), at_far.norm(), 1e-5);
      ASSERT_NEAR(scan.points[next].intensity, 150 * 0.1 * std::abs(d.x()), 0.51);
    } else if (returned && scan.points[next].p_L.norm() > 1) {
      const Pose X_WL = X_BL;
      ASSERT_NEAR(scan.points[next].p_L.norm(), to_wall(X_WL.p, X_WL.R * d), 1e-3);
    }
    next += returned ? 1 : 0;
  }
  EXPECT_GT(silent, 100);
  EXPECT_GT(own, 100);
}

TEST(Mid360, TurningRotorsStopTheirSolidityOfTheBeams) {
  const worlds::World world = room();
  const Scene scene(world);
  CollisionShape disc;
  disc.kind = CollisionShape::Kind::kCylinder;
  disc.X_WS = {Mat3::Identity(), {0, 0, 0.2}};
  disc.size = {0.3, 0.005, 0};
  disc.object = static_cast<std::uint32_t>(AirframePart::kRotor);
  Mid360Config config;
  config.echo.dropout_probability = 0;
  const Mid360 lidar(config, scene, Pose{}, {disc}, 3);
  int stopped = 0, passed = 0;
  for (const LidarPoint& point : lidar.scan(rest(Pose{}, 1000)).points) {
    const Vec3 d = point.p_L.cast<double>().normalized();
    if (d.head<2>().norm() / d.z() * 0.195 > 0.295 || d.z() <= 0) continue;
    (point.p_L.norm() < 1 ? stopped : passed) += 1;
  }
  ASSERT_GT(stopped + passed, 20'000);
  EXPECT_NEAR(static_cast<double>(stopped) / (stopped + passed), config.rotor_solidity,
              0.05 * config.rotor_solidity);
}

TEST(Mid360, ExtrinsicErrorMovesTheTrueMounting) {
  const worlds::World world = room();
  const Scene scene(world);
  const Pose X_BL = VehicleConfig{}.X_BL();
  Mid360Config config = exact();
  config.extrinsic_rotation_error_rad = {0.01, -0.02, 0.017};
  config.extrinsic_position_error_m = {0.01, 0.02, -0.03};
  const LidarScan scan = Mid360(config, scene, X_BL, {}, 1).scan(rest(Pose{}, 10));
  const Pose X_true = X_BL * Pose{so3::Exp({0.01, -0.02, 0.017}), {0.01, 0.02, -0.03}};
  for (const LidarPoint& point : scan.points) {
    const Vec3 d = point.p_L.cast<double>().normalized();
    ASSERT_NEAR(point.p_L.norm(), to_wall(X_true.p, X_true.R * d), 1e-3);
  }
}

std::vector<float> flatten(const LidarScan& scan) {
  std::vector<float> out;
  for (const LidarPoint& p : scan.points) {
    out.insert(out.end(), {p.p_L.x(), p.p_L.y(), p.p_L.z(), p.intensity,
                           static_cast<float>(scan.stamp / 1'000'000),
                           static_cast<float>(p.offset_ns), static_cast<float>(p.line)});
  }
  return out;
}

TEST(Mid360, SameFrameOnAnyThreadInAnyOrderInAnyParts) {
  const worlds::World world = room();
  const Scene scene(world);
  const Mid360 lidar({}, scene, VehicleConfig{}.X_BL(), {}, 5);
  const std::vector<Truth> ticks = Motion{}.ticks(200);
  const std::span<const Truth> first(ticks.data(), 101), second(ticks.data() + 100, 101);
  const std::vector<float> a = flatten(lidar.scan(first)), b = flatten(lidar.scan(second));
  std::vector<float> threaded_a, threaded_b;
  std::thread other([&] { threaded_b = flatten(lidar.scan(second)); });
  threaded_a = flatten(lidar.scan(first));
  other.join();
  EXPECT_EQ(a, threaded_a);
  EXPECT_EQ(b, threaded_b);
  EXPECT_NE(a, b);

  std::size_t next = 0;
  const LidarScan whole = lidar.scan(first);
  for (std::size_t part = 0; part < 10; ++part) {
    for (const LidarPoint& point : lidar.scan(first.subspan(10 * part, 11)).points) {
      ASSERT_LT(next, whole.points.size());
      ASSERT_EQ(point.p_L, whole.points[next++].p_L);
    }
  }
  EXPECT_EQ(next, whole.points.size());

  const Mid360 another({}, scene, VehicleConfig{}.X_BL(), {}, 6);
  EXPECT_NE(flatten(another.scan(first)), a);
}

TEST(Mid360, RefusesTicksThatAreNotConsecutive) {
  const worlds::World world = room();
  const Scene scene(world);
  const Mid360 lidar({}, scene, Pose{}, {}, 1);
  std::vector<Truth> ticks = rest(Pose{}, 3);
  EXPECT_THROW((void)lidar.scan(std::span(ticks).first(1)), std::invalid_argument);
  ticks[2].stamp += 1;
  EXPECT_THROW((void)lidar.scan(ticks), std::invalid_argument);
  EXPECT_THROW((void)lidar.scan(rest(Pose{}, 4300)), std::invalid_argument);  // offsets of 32 bits
}

}  // namespace
}  // namespace arex::sim
