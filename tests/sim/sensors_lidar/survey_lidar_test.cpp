#include "sensors/survey_lidar.h"

#include <gtest/gtest.h>

#include <cmath>

#include "math/random.h"
#include "math/so3.h"
#include "sim/sensors_lidar/test_world.h"

namespace arex::sim {
namespace {

using test::kRoomHalf;
using test::rest;
using test::room;
using test::to_wall;
using test::WorldMaker;

/// A frame of the survey from a pose at rest, as its device makes it: in parts of 20 ms.
LidarScan frame_of(const SurveyLidar& survey, const Pose& X_WB, Stamp begin = 0) {
  const Stamp end = begin + survey.period();
  std::vector<LidarScan> parts;
  for (Stamp part = begin; part < end; part += 20 * kNanosecondsPerTick) {
    parts.push_back(survey.scan(rest(X_WB, 20, part), begin));
  }
  return survey.frame(begin, end, parts);
}

/// Points on the walls of the room, evenly.
std::vector<Vec3f> on_walls(double spacing) {
  std::vector<Vec3f> points;
  for (int axis = 0; axis < 3; ++axis) {
    const int u = (axis + 1) % 3, v = (axis + 2) % 3;
    for (double a = -kRoomHalf[u] + 0.05; a < kRoomHalf[u]; a += spacing) {
      for (double b = -kRoomHalf[v] + 0.05; b < kRoomHalf[v]; b += spacing) {
        for (const double side : {-1.0, 1.0}) {
          Vec3 p;
          p[axis] = side * kRoomHalf[axis];
          p[u] = a;
          p[v] = b;
          points.push_back(p.cast<float>());
        }
      }
    }
  }
  return points;
}

TEST(SurveyLidar, ReportsEveryPointInRangeExactlyFromWhereverItStands) {
  const worlds::World world = room();
  const Scene scene(world);
  SurveyConfig config;
  config.range_m = 8;
  const std::vector<Vec3f> points = on_walls(0.5);
  const Pose X_BS{so3::Exp({0.3, -0.2, 0.1}), {0.1, 0, 0.05}};
  const SurveyLidar survey(config, scene, points, X_BS);
  RandomStream random(1, "poses");
  for (int trial = 0; trial < 10; ++trial) {
    const Pose X_WB{so3::Exp(0.5 * random.normal3()),
                    {random.uniform(-7, 7), random.uniform(-5, 5), random.uniform(-3, 3)}};
    const Pose X_WS = X_WB * X_BS;
    const LidarScan scan = frame_of(survey, X_WB, trial * survey.period());
    std::size_t in_range = 0;
    for (const Vec3f& p : points) in_range += (p.cast<double>() - X_WS.p).norm() <= config.range_m;
    EXPECT_NEAR(static_cast<double>(scan.points.size()), static_cast<double>(in_range),
                2e-3 * static_cast<double>(in_range) + 1);  // rounding at the edge
    for (const LidarPoint& point : scan.points) {
      const Vec3 p_S = point.p_L.cast<double>();
      ASSERT_NEAR(p_S.norm(), to_wall(X_WS.p, X_WS.R * p_S.normalized()), 1e-3);
    }
  }
}

TEST(SurveyLidar, SeesNoPointBehindSomething) {
  // A board of 2 m x 2 m before the wall at x = 9.
  WorldMaker maker;
  maker.object(0.6F).box(Pose{}, kRoomHalf);
  maker.object(0.3F).quad({4, -1, -1}, {0, 2, 0}, {0, 0, 2});
  const worlds::World world = maker.world();
  const Scene scene(world);
  SurveyConfig config;
  config.range_m = 30;
  const std::vector<Vec3f> points = on_walls(0.25);
  const SurveyLidar survey(config, scene, points, Pose{});
  std::size_t hidden = 0;
  for (const Vec3f& p : points) {
    const Vec3 at = p.cast<double>() * (4 / std::max(1e-9, static_cast<double>(p.x())));
    hidden += p.x() > 4 && std::abs(at.y()) < 1 && std::abs(at.z()) < 1;
  }
  EXPECT_GT(hidden, 50U);
  const LidarScan scan = frame_of(survey, Pose{});
  EXPECT_EQ(scan.points.size(), points.size() - hidden);
}

TEST(SurveyLidar, IsOneMomentOfEachFrame) {
  const worlds::World world = room();
  const Scene scene(world);
  const SurveyLidar survey({}, scene, on_walls(0.5), Pose{});
  const LidarScan scan = frame_of(survey, Pose{}, 3 * survey.period());
  EXPECT_EQ(scan.end, 4 * survey.period());
  EXPECT_EQ(scan.end - scan.stamp, kNanosecondsPerTick);
  ASSERT_FALSE(scan.points.empty());
  for (const LidarPoint& point : scan.points) {
    EXPECT_EQ(scan.stamp + point.offset_ns, scan.end);
  }
  EXPECT_TRUE(survey.scan(rest(Pose{}, 20, 0), 0).points.empty());  // only the last part has it
}

TEST(SurveyLidar, OfAnEmptyWorldIsEmpty) {
  const worlds::World world = room();
  const Scene scene(world);
  const SurveyLidar survey({}, scene, {}, Pose{});
  EXPECT_TRUE(frame_of(survey, Pose{}).points.empty());
}

}  // namespace
}  // namespace arex::sim
