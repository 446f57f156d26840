#include "planning/guide_path.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "math/random.h"

namespace arex {
namespace {

OccupancyMap2D empty_map(int width, int height, std::int8_t value = OccupancyMap2D::kFree) {
  OccupancyMap2D map;
  map.resolution = 0.1;
  map.width = width;
  map.height = height;
  map.cells.assign(static_cast<std::size_t>(width * height), value);
  return map;
}

void fill(OccupancyMap2D& map, int x0, int y0, int x1, int y1, std::int8_t value) {
  for (int y = y0; y <= y1; ++y) {
    for (int x = x0; x <= x1; ++x) map.cells[map.index({x, y})] = value;
  }
}

double nearest_occupied(const OccupancyMap2D& map, const Vec2& p) {
  double best = std::numeric_limits<double>::infinity();
  for (int y = 0; y < map.height; ++y) {
    for (int x = 0; x < map.width; ++x) {
      if (map.at({x, y}) != OccupancyMap2D::kOccupied) continue;
      best = std::min(best, (map.centre_of({x, y}) - p).norm());
    }
  }
  return best;
}

double length(std::span<const Vec2> path) {
  double sum = 0;
  for (std::size_t i = 0; i + 1 < path.size(); ++i) sum += (path[i + 1] - path[i]).norm();
  return sum;
}

TEST(GuidePath, GoesStraightWhereNothingIsInTheWay) {
  const OccupancyMap2D map = empty_map(200, 100);
  const GuidePath path = plan_guide(map, {1.03, 2.02}, {18.0, 8.0}, {});
  EXPECT_EQ(path.status, GuideStatus::kFound);
  EXPECT_NEAR(length(path.points), (Vec2(18.0, 8.0) - Vec2(1.03, 2.02)).norm(), 0.05);
  EXPECT_EQ(path.points.front(), Vec2(1.03, 2.02));
  EXPECT_EQ(path.points.back(), Vec2(18.0, 8.0));
}

TEST(GuidePath, KeepsItsDistanceAroundAWall) {
  OccupancyMap2D map = empty_map(200, 150);
  fill(map, 100, 0, 101, 90, OccupancyMap2D::kOccupied);
  GuideConfig config;
  const GuidePath path = plan_guide(map, {5.0, 3.0}, {15.0, 3.0}, config);
  ASSERT_EQ(path.status, GuideStatus::kFound);
  // Shortest possible: round the end of the wall at the kept distance.
  const Vec2 corner(10.1, 9.1 + config.obstacle_distance_m);
  const double shortest = 2 * (corner - Vec2(5.0, 3.0)).norm() - 0.6;
  EXPECT_GT(length(path.points), shortest);
  EXPECT_LT(length(path.points), shortest + 3.0);
  for (std::size_t i = 0; i + 1 < path.points.size(); ++i) {
    for (double u = 0; u <= 1; u += 0.01) {
      const Vec2 p = path.points[i] + u * (path.points[i + 1] - path.points[i]);
      EXPECT_GT(nearest_occupied(map, p), config.obstacle_distance_m - 0.1);
    }
  }
}

TEST(GuidePath, PaysForTheUnknown) {
  OccupancyMap2D map = empty_map(200, 200);
  fill(map, 60, 0, 140, 140, OccupancyMap2D::kUnknown);  // the direct way is unknown
  GuideConfig config;
  const auto unknown_length = [&](const GuidePath& path) {
    double sum = 0;
    for (std::size_t i = 0; i + 1 < path.points.size(); ++i) {
      const Vec2 d = path.points[i + 1] - path.points[i];
      for (int k = 0; k < 100; ++k) {
        const Vec2 p = path.points[i] + d * ((k + 0.5) / 100);
        if (map.at(map.cell_of(p)) == OccupancyMap2D::kUnknown) sum += d.norm() / 100;
      }
    }
    return sum;
  };
  config.unknown_weight = 0.1;
  EXPECT_GT(unknown_length(plan_guide(map, {3, 10}, {17, 10}, config)), 7.0);
  config.unknown_weight = 10;
  const GuidePath around = plan_guide(map, {3, 10}, {17, 10}, config);
  EXPECT_EQ(around.status, GuideStatus::kFound);
  EXPECT_LT(unknown_length(around), 0.3);
  // And beyond the map's edge everything is unknown, but can be crossed.
  EXPECT_EQ(plan_guide(map, {3, 10}, {25, 10}, config).status, GuideStatus::kFound);
}

TEST(GuidePath, EndsNearestToATargetThatIsWalledIn) {
  OccupancyMap2D map = empty_map(200, 100);
  fill(map, 120, 20, 160, 80, OccupancyMap2D::kOccupied);
  fill(map, 130, 30, 150, 70, OccupancyMap2D::kFree);
  const GuidePath path = plan_guide(map, {2, 5}, {14, 5}, {});
  EXPECT_EQ(path.status, GuideStatus::kPartial);
  EXPECT_LT((path.points.back() - Vec2(14, 5)).norm(), 3.5);
}

TEST(GuidePath, LeavesAStartBesideAnObstacle) {
  OccupancyMap2D map = empty_map(200, 100);
  fill(map, 20, 0, 21, 99, OccupancyMap2D::kOccupied);
  const GuidePath path = plan_guide(map, {2.35, 5.0}, {15, 5}, {});
  EXPECT_EQ(path.status, GuideStatus::kFound);
}

TEST(GuidePath, LeavesAPocketByTheWayThatItCame) {
  OccupancyMap2D map = empty_map(200, 100);
  fill(map, 20, 20, 120, 80, OccupancyMap2D::kOccupied);
  EXPECT_EQ(plan_guide(map, {7, 5}, {15, 5}, {}).status, GuideStatus::kPartial);
  for (int y = 5; y <= 50; ++y) map.flown.push_back(static_cast<std::uint32_t>(map.index({70, y})));
  const GuidePath path = plan_guide(map, map.centre_of({70, 50}), {15, 5}, {});
  EXPECT_EQ(path.status, GuideStatus::kFound);
  for (const Vec2& p : path.points) {
    if (p.y() > 2 && p.y() < 8 && p.x() < 12) {
      EXPECT_NEAR(p.x(), 7.05, 1e-9);
    }
  }
}

TEST(GuidePath, StraightModeDoesNotSearch) {
  OccupancyMap2D map = empty_map(50, 50);
  fill(map, 20, 0, 21, 49, OccupancyMap2D::kOccupied);
  GuideConfig config;
  config.mode = GuideMode::kStraight;
  const GuidePath path = plan_guide(map, {1, 1}, {4, 4}, config);
  EXPECT_EQ(path.points.size(), 2u);
  EXPECT_EQ(path.expansions, 0);
}

TEST(PointAhead, WalksOnFromTheNearestPoint) {
  const std::vector<Vec3> path = lift_path(std::vector<Vec2>{{0, 0}, {4, 0}, {4, 6}}, 1.0, 2.0);
  EXPECT_NEAR(path[1].z(), 1.4, 1e-12);
  const Vec3 ahead = point_ahead(path, {2.0, 0.3, 1.2}, 3.0);
  EXPECT_NEAR(ahead.x(), 4.0, 1e-9);
  EXPECT_NEAR(ahead.y(), 1.0, 0.1);
  EXPECT_EQ(point_ahead(path, {3.9, 5.0, 1.9}, 30.0), path.back());
}

TEST(LiftPath, KeepsItsHeightAboveARamp) {
  GroundHeights ground;
  ground.origin = {0, -0.8};
  ground.width = 10;
  const double slope = -std::tan(M_PI / 6);
  for (int y = 0; y < 2; ++y) {
    for (int x = 0; x < 10; ++x) {  // level up to 2.4 m, unseen from 7.2 m on
      const bool ramp = x >= 3;
      const double middle = ramp ? slope * (0.8 * x + 0.4 - 2.4) : 0.0;
      ground.heights.push_back(x < 9 ? static_cast<float>(middle) : std::nanf(""));
      ground.rises.emplace_back(ramp ? static_cast<float>(slope) : 0.F, 0.F);
    }
  }
  const std::vector<Vec2> flat{{0.1, 0}, {6.3, 0}, {7.1, 0.4}, {7.9, 0.4}};
  const std::vector<Vec3> path = lift_path(flat, 1.5, slope * (7.1 - 2.4) + 2.5, ground);
  double walked = 0;
  double length = 0;
  for (std::size_t i = 1; i < flat.size(); ++i) length += (flat[i] - flat[i - 1]).norm();
  for (std::size_t i = 0; i < path.size(); ++i) {
    if (i > 0) {
      const double step = (path[i] - path[i - 1]).head<2>().norm();
      EXPECT_LE(step, 0.5 + 1e-9);
      walked += step;
    }
    if (path[i].x() > 7.2) continue;
    const double floor = std::min(0.0, slope * (path[i].x() - 2.4));
    EXPECT_NEAR(path[i].z() - floor, 1.5 + walked / length, 0.03) << path[i].transpose();
  }
  EXPECT_EQ(path.back().head<2>(), flat.back());
  EXPECT_TRUE(std::isfinite(path.back().z()));
}

// A goal in a wall is as near from either side: the guide stays on the vehicle's, whichever face
// looks nearer, and leaves it where the other side is nearer by more than the wall.
TEST(GuidePath, APartialGuideKeepsItsSideOfAWall) {
  OccupancyMap2D map = empty_map(200, 150);
  fill(map, 97, 0, 103, 110, OccupancyMap2D::kOccupied);
  const Vec2 goal(10.05, 5.05);
  for (const Vec2& from : {Vec2(5, 5), Vec2(15, 5), Vec2(9, 11), Vec2(11, 11)}) {
    for (const int face : {96, 104}) {  // one face or the other is a cell further off
      OccupancyMap2D seen = map;
      fill(seen, face, 0, face, 110, OccupancyMap2D::kOccupied);
      const GuidePath path = plan_guide(seen, from, goal, {});
      ASSERT_EQ(path.status, GuideStatus::kPartial);
      EXPECT_EQ(path.points.back().x() < goal.x(), from.x() < goal.x()) << from.transpose();
      // Half the wall, the distance kept from it, the cells that both are rounded to.
      EXPECT_LT((path.points.back() - goal).norm(), 0.4 + GuideConfig().obstacle_distance_m + 0.15);
    }
  }
  fill(map, 60, 0, 96, 90, OccupancyMap2D::kOccupied);  // this side is 4 m thick now
  EXPECT_GT(plan_guide(map, {5.0, 5.0}, goal, {}).points.back().x(), goal.x());
}

TEST(GuidePath, WhatIsLeftOfAPathCountsTheWayToIt) {
  const std::vector<Vec3> path{{0, 0, 0}, {4, 0, 0}, {4, 3, 0}};
  EXPECT_DOUBLE_EQ(length_ahead(path, {0, 0, 0}), 7);
  EXPECT_DOUBLE_EQ(length_ahead(path, {1, 2, 0}), 2 + 3 + 3);
  EXPECT_DOUBLE_EQ(length_ahead(path, {4, 3, 2}), 2);
  EXPECT_DOUBLE_EQ(length_ahead(std::vector<Vec3>{{1, 1, 1}}, {1, 1, 2}), 1);
  EXPECT_EQ(length_ahead({}, {1, 1, 2}), 0);
}

}  // namespace
}  // namespace arex
