#include "exploration/exploration_space.h"

#include <gtest/gtest.h>

#include <queue>

#include "autonomy/exploration/test_map.h"
#include "exploration/frontier_search.h"
#include "planning/guide_path.h"

namespace arex {
namespace {

ExplorationBounds wide() { return {Vec2(-100, -100), Vec2(100, 100), {}}; }

Vec2 random_in(const OccupancyMap2D& map, RandomStream& random) {
  const double x = random.uniform(0, map.width * map.resolution);
  const double y = random.uniform(0, map.height * map.resolution);
  return map.origin + Vec2(x, y);
}

TEST(LineWalk, VisitsTheCellsThatDenseSamplingFinds) {
  const OccupancyMap2D map = test::make_map(60, 50, OccupancyMap2D::kFree);
  RandomStream random(1, "line_walk");
  for (int trial = 0; trial < 300; ++trial) {
    const Vec2 a = random_in(map, random);
    const Vec2 b =
        trial % 5 == 0 ? Vec2(a.x(), random_in(map, random).y()) : random_in(map, random);
    std::vector<Eigen::Vector2i> walked;
    walk_line(map, a, b, [&](const Eigen::Vector2i& cell) {
      walked.push_back(cell);
      return true;
    });
    EXPECT_EQ(walked.front(), map.cell_of(a));
    EXPECT_EQ(walked.back(), map.cell_of(b));
    for (std::size_t i = 1; i < walked.size(); ++i) {
      ASSERT_EQ((walked[i] - walked[i - 1]).cwiseAbs().sum(), 1);
    }
    constexpr int kSamples = 20000;
    std::size_t at = 0;
    for (int i = 0; i <= kSamples; ++i) {  // every sampled cell occurs, in the same order
      const Eigen::Vector2i cell = map.cell_of(a + (b - a) * (static_cast<double>(i) / kSamples));
      while (at < walked.size() && walked[at] != cell) ++at;
      ASSERT_LT(at, walked.size());
    }
    for (const Eigen::Vector2i& cell : walked) {  // and no cell that the segment does not touch
      const Vec2 centre = map.centre_of(cell);
      const double t = std::clamp((centre - a).dot(b - a) / (b - a).squaredNorm(), 0.0, 1.0);
      ASSERT_LE((a + t * (b - a) - centre).norm(), 0.1 * M_SQRT1_2 + 1e-9);
    }
  }
}

TEST(LineWalk, StopsWhereItIsTold) {
  const OccupancyMap2D map = test::make_map(20, 20, OccupancyMap2D::kFree);
  int visited = 0;
  walk_line(map, Vec2(-0.95, 0.05), Vec2(0.95, 0.05),
            [&](const Eigen::Vector2i&) { return ++visited < 7; });
  EXPECT_EQ(visited, 7);
}

TEST(ExplorationSpace, ClearanceIsTheDistanceToTheNearestOccupiedCentre) {
  for (std::uint64_t seed = 1; seed <= 4; ++seed) {
    RandomStream random(seed, "clearance");
    const OccupancyMap2D map = test::random_map(70, 50, random);
    const ExplorationSpace space(map, wide(), {}, Vec2::Zero());
    for (int y = 0; y < map.height; ++y) {
      for (int x = 0; x < map.width; ++x) {
        int best = 1 << 20;
        for (int v = 0; v < map.height; ++v) {
          for (int u = 0; u < map.width; ++u) {
            if (map.at({u, v}) == OccupancyMap2D::kOccupied) {
              best = std::min(best, (u - x) * (u - x) + (v - y) * (v - y));
            }
          }
        }
        ASSERT_NEAR(space.clearance({x, y}), 0.1 * std::sqrt(best), 1e-9) << x << " " << y;
      }
    }
  }
}

TEST(ExplorationSpace, WithoutObstaclesTheClearanceIsInfinite) {
  const OccupancyMap2D map = test::make_map(20, 20, OccupancyMap2D::kFree);
  const ExplorationSpace space(map, wide(), {}, Vec2::Zero());
  EXPECT_TRUE(std::isinf(space.clearance({3, 4})));
  EXPECT_TRUE(space.is_reachable({0, 0}));
}

/// Dijkstra over the free cells at the radius, diagonals only between two passable sides.
std::vector<double> brute_force_travel(const OccupancyMap2D& map, const ExplorationSpace& space,
                                       double radius, const Eigen::Vector2i& start) {
  const auto passable = [&](int x, int y) {
    return map.contains({x, y}) && map.at({x, y}) == OccupancyMap2D::kFree &&
           space.clearance({x, y}) >= radius - 1e-9;
  };
  std::vector<double> distance(map.cells.size(), 1e18);
  using Entry = std::pair<double, std::size_t>;
  std::priority_queue<Entry, std::vector<Entry>, std::greater<>> queue;
  distance[map.index(start)] = 0;
  queue.emplace(0, map.index(start));
  while (!queue.empty()) {
    const auto [d, i] = queue.top();
    queue.pop();
    if (d > distance[i]) continue;
    const int x = static_cast<int>(i) % map.width, y = static_cast<int>(i) / map.width;
    for (int dy = -1; dy <= 1; ++dy) {
      for (int dx = -1; dx <= 1; ++dx) {
        if ((dx == 0 && dy == 0) || !passable(x + dx, y + dy)) continue;
        if (!passable(x + dx, y) || !passable(x, y + dy)) continue;
        const double next = d + 0.1 * std::sqrt(static_cast<double>(dx * dx + dy * dy));
        const std::size_t to = map.index({x + dx, y + dy});
        if (next >= distance[to]) continue;
        distance[to] = next;
        queue.emplace(next, to);
      }
    }
  }
  return distance;
}

TEST(ExplorationSpace, TravelDistanceIsThatOfBruteForceDijkstra) {
  int reachable = 0;
  for (std::uint64_t seed = 1; seed <= 6; ++seed) {
    RandomStream random(seed, "travel");
    OccupancyMap2D map = test::random_map(90, 70, random);
    test::fill(map, {40, 30}, {50, 40}, OccupancyMap2D::kFree);
    SpaceConfig config;
    config.travel_radius_m = 0.25;
    const Vec2 robot = map.centre_of({45, 35});
    const ExplorationSpace space(map, wide(), config, robot);
    ASSERT_TRUE(space.has_start());
    const std::vector<double> expected =
        brute_force_travel(map, space, config.travel_radius_m, map.cell_of(space.start()));
    const double lead = (space.start() - robot).norm();
    for (int y = 0; y < map.height; ++y) {
      for (int x = 0; x < map.width; ++x) {
        const double want = expected[map.index({x, y})];
        ASSERT_EQ(space.is_reachable({x, y}), want < 1e17);
        if (want > 1e17) continue;
        ++reachable;
        // 99/70 for the square root of two, and the lead rounded to 1/70 of a cell.
        ASSERT_NEAR(space.travel_distance({x, y}), want + lead, 1e-4 * want + 0.1 / 70);
      }
    }
  }
  EXPECT_GT(reachable, 5000);
}

TEST(ExplorationSpace, UnknownAreaIsThatOfBruteForceInsideThePolygon) {
  for (std::uint64_t seed = 1; seed <= 4; ++seed) {
    RandomStream random(seed, "area");
    const OccupancyMap2D map = test::random_map(80, 60, random);
    ExplorationBounds bounds{Vec2(-3.5, -2.5), Vec2(3, 2.7), {}};
    // Not convex.
    if (seed % 2 == 0)
      bounds.polygon_m = {{-3, -2}, {3.3, -2.3}, {0.2, 0.1}, {2.9, 2.6}, {-3.2, 2}};
    SpaceConfig config;
    config.information_radius_m = random.uniform(0.4, 1.5);
    const ExplorationSpace space(map, bounds, config, Vec2::Zero());
    int different = 0;
    for (int trial = 0; trial < 200; ++trial) {
      const Vec2 p = trial % 2 == 0 ? map.centre_of(map.cell_of(random_in(map, random)))
                                    : random_in(map, random);
      int count = 0;
      for (int y = 0; y < map.height; ++y) {
        for (int x = 0; x < map.width; ++x) {
          const Vec2 centre = map.centre_of({x, y});
          count += map.at({x, y}) == OccupancyMap2D::kUnknown && bounds.contains(centre) &&
                   (centre - p).squaredNorm() <= std::pow(config.information_radius_m, 2) + 1e-9;
        }
      }
      ASSERT_NEAR(space.unknown_area(p), 0.01 * count, 1e-9);
      different += count > 0;
    }
    EXPECT_GT(different, 50);
  }
}

/// The unknown cells that another space would reach, were they all free: by the flood of a second
/// map; and pockets of the unknown by another.
TEST(ExplorationSpace, WhatIsLeftIsWhatItWouldReachIfTheUnknownWereFree) {
  double left = 0;
  int pockets = 0;
  for (std::uint64_t seed = 1; seed <= 12; ++seed) {
    RandomStream random(seed, "left");
    const OccupancyMap2D map = test::random_map(90, 70, random);
    ExplorationBounds bounds{Vec2(-4, -3), Vec2(4, 3.2), {}};
    if (seed % 2 == 0) bounds.polygon_m = {{-4, -3}, {4, -3.1}, {1.1, 0.4}, {3.9, 3}, {-4.2, 3}};
    SpaceConfig config;
    config.travel_radius_m = random.uniform(0.1, 0.4);
    const ExplorationSpace space(map, bounds, config, Vec2::Zero());
    if (!space.has_start()) continue;
    OccupancyMap2D hoped = map;
    for (int y = 0; y < map.height; ++y) {
      for (int x = 0; x < map.width; ++x) {
        std::int8_t& state = hoped.cells[map.index({x, y})];
        if (state == OccupancyMap2D::kUnknown) state = OccupancyMap2D::kFree;
      }
    }
    // Nor are the bounds an obstacle; the clearance is that of the map as it is.
    const auto may_pass = [&](const Eigen::Vector2i& cell) {
      return hoped.contains(cell) && hoped.at(cell) == OccupancyMap2D::kFree &&
             space.clearance(cell) >= config.travel_radius_m - 1e-9;
    };
    std::vector<int> piece(map.cells.size(), 0);
    const auto flood = [&](const Eigen::Vector2i& first, int name, auto&& passes) {
      std::vector<Eigen::Vector2i> open{first};
      piece[map.index(first)] = name;
      int unknown = 0;
      while (!open.empty()) {
        const Eigen::Vector2i cell = open.back();
        open.pop_back();
        unknown += map.at(cell) == OccupancyMap2D::kUnknown && bounds.contains(map.centre_of(cell));
        for (const Eigen::Vector2i& step : {Eigen::Vector2i(1, 0), Eigen::Vector2i(-1, 0),
                                            Eigen::Vector2i(0, 1), Eigen::Vector2i(0, -1)}) {
          const Eigen::Vector2i next = cell + step;
          if (!passes(next) || piece[map.index(next)] == name) continue;
          piece[map.index(next)] = name;
          open.push_back(next);
        }
      }
      return 0.01 * unknown;
    };
    double total = 0;
    for (int y = 0, known = 1; y < map.height && known == 1; ++y) {
      for (int x = 0; x < map.width && known == 1; ++x) {
        if (!space.is_reachable({x, y})) continue;
        total = flood({x, y}, 1, [&](const Eigen::Vector2i& cell) {
          return may_pass(cell) || space.is_reachable(cell);  // also the way that it came
        });
        known = 2;
      }
    }
    constexpr double kNone = std::numeric_limits<double>::infinity();
    EXPECT_NEAR(space.unknown_left(kNone), total, 1e-9) << "seed " << seed;
    EXPECT_NEAR(space.unknown_left(0.5 * total), 0.5 * total, 0.01);
    left += total;
    std::fill(piece.begin(), piece.end(), 0);
    for (int trial = 0; trial < 30; ++trial) {
      const Vec2 p = random_in(map, random);
      const auto hangs_together = [&](const Eigen::Vector2i& cell) {
        return map.contains(cell) && map.at(cell) == OccupancyMap2D::kUnknown &&
               bounds.contains(map.centre_of(cell));
      };
      const bool any = hangs_together(map.cell_of(p));
      const double pocket = any ? flood(map.cell_of(p), trial + 1, hangs_together) : 0;
      EXPECT_NEAR(space.unknown_pocket(p, kNone), pocket, 1e-9) << "seed " << seed;
      EXPECT_NEAR(space.unknown_pocket(p, 0.2), std::min(pocket, 0.2), 1e-9);
      pockets += pocket > 0.2;
    }
  }
  EXPECT_GT(left, 5);
  EXPECT_GT(pockets, 20);
}

TEST(ExplorationBounds, APolygonNarrowsTheBox) {
  const ExplorationBounds bounds{Vec2(-2, -2), Vec2(2, 2), {{-3, -3}, {3, -3}, {0, 1}}};
  EXPECT_TRUE(bounds.contains({0, 0}));
  EXPECT_FALSE(bounds.contains({0, 1.5}));   // above the triangle's tip
  EXPECT_FALSE(bounds.contains({0, -2.5}));  // in the triangle, out of the box
  EXPECT_FALSE(bounds.contains({1.5, 0}));   // in the box, right of the triangle
  EXPECT_TRUE((ExplorationBounds{Vec2(-2, -2), Vec2(2, 2), {}}.contains({1.5, 0})));
}

TEST(ExplorationSpace, StartsWhereTheKnownBeginsButNotBehindAWall) {
  OccupancyMap2D map = test::make_map(60, 60, OccupancyMap2D::kUnknown);
  test::fill(map, {40, 0}, {59, 59}, OccupancyMap2D::kFree);
  const Vec2 robot = map.centre_of({33, 30});
  const ExplorationSpace space(map, wide(), {}, robot);
  ASSERT_TRUE(space.has_start());
  EXPECT_EQ(map.cell_of(space.start()), Eigen::Vector2i(40, 30));
  EXPECT_NEAR(space.travel_distance({45, 30}), 1.2, 1e-3);
  test::fill(map, {38, 0}, {38, 59}, OccupancyMap2D::kOccupied);
  EXPECT_FALSE(ExplorationSpace(map, wide(), {}, robot).has_start());
}

TEST(ExplorationSpace, GapsNarrowerThanTheVehicleAreNoWay) {
  OccupancyMap2D map = test::make_map(60, 60, OccupancyMap2D::kFree);
  test::fill(map, {30, 0}, {30, 59}, OccupancyMap2D::kOccupied);
  const Vec2 robot = map.centre_of({10, 30});
  for (const int gap : {9, 11}) {  // cells; the centre keeps 0.5 m from both posts with 9 between
    OccupancyMap2D open = map;
    test::fill(open, {30, 20}, {30, 20 + gap - 1}, OccupancyMap2D::kFree);
    SpaceConfig config;
    config.travel_radius_m = 0.55;
    EXPECT_EQ(ExplorationSpace(open, wide(), config, robot).is_reachable({50, 30}), gap == 11);
  }
}

/// Two halves behind a wall, and the vehicle in the right one, having come through a gap that has
/// closed since.
OccupancyMap2D closed_behind(bool flown) {
  OccupancyMap2D map = test::make_map(60, 60, OccupancyMap2D::kFree);
  test::fill(map, {30, 0}, {31, 59}, OccupancyMap2D::kOccupied);
  test::fill(map, {32, 20}, {33, 40}, OccupancyMap2D::kUnknown);
  for (int x = 10; flown && x <= 45; ++x) {
    map.flown.push_back(static_cast<std::uint32_t>(map.index({x, 30})));
  }
  return map;
}

TEST(ExplorationSpace, TheWayThatTheVehicleCameStaysOpen) {
  for (const bool flown : {false, true}) {
    const OccupancyMap2D map = closed_behind(flown);
    const ExplorationSpace space(map, wide(), {}, map.centre_of({45, 30}));
    EXPECT_TRUE(space.is_reachable({55, 10}));
    EXPECT_EQ(space.is_reachable({5, 50}), flown);
    if (flown) {
      EXPECT_NEAR(space.travel_distance({10, 30}), 3.5, 1e-9);
    }
    // A way is no free space: nothing is seen across the wall, and the unknown beside the way is no
    // frontier of the way's own cells.
    EXPECT_FALSE(space.is_free({30, 30}));
    EXPECT_FALSE(space.sees(map.centre_of({40, 30}), {20, 30}));
    for (const Frontier& frontier : find_frontiers(space)) {
      for (const Eigen::Vector2i& cell : frontier.cells) EXPECT_TRUE(space.is_free(cell));
    }
  }
}

TEST(ExplorationSpace, LeavesAPocketByTheWayThatItCame) {
  // Flown into a gap between two cars that is narrower than the travel radius.
  OccupancyMap2D map = test::make_map(60, 60, OccupancyMap2D::kFree);
  test::fill(map, {30, 20}, {59, 25}, OccupancyMap2D::kOccupied);
  test::fill(map, {30, 31}, {59, 36}, OccupancyMap2D::kOccupied);
  const Vec2 robot = map.centre_of({50, 28});
  EXPECT_FALSE(ExplorationSpace(map, wide(), {}, robot).has_start());
  for (int x = 20; x <= 50; ++x) {
    map.flown.push_back(static_cast<std::uint32_t>(map.index({x, 28})));
  }
  const ExplorationSpace space(map, wide(), {}, robot);
  EXPECT_TRUE(space.has_start());
  EXPECT_NEAR(space.travel_distance({20, 28}), 3.0, 1e-9);
}

TEST(ExplorationSpace, KnowsThatItIsCutOffFromWhereItFlew) {
  // The map is older than the last metre that was flown: over a bonnet, into a gap.
  OccupancyMap2D map = test::make_map(60, 60, OccupancyMap2D::kFree);
  test::fill(map, {30, 0}, {59, 59}, OccupancyMap2D::kOccupied);
  test::fill(map, {44, 22}, {56, 34}, OccupancyMap2D::kFree);  // clear, but closed all around
  const Vec2 robot = map.centre_of({50, 28});
  std::vector<std::uint32_t> since;
  for (int x = 20; x <= 50; ++x) {
    (x <= 38 ? map.flown : since).push_back(static_cast<std::uint32_t>(map.index({x, 28})));
  }
  const ExplorationSpace stale(map, wide(), {}, robot);
  EXPECT_TRUE(stale.has_start());
  EXPECT_FALSE(stale.reaches_flown());
  EXPECT_FALSE(stale.is_reachable({10, 30}));
  const ExplorationSpace space(map, wide(), {}, robot, since);
  EXPECT_TRUE(space.reaches_flown());
  EXPECT_TRUE(space.is_reachable({10, 30}));
}

TEST(ExplorationSpace, TheGuideLeadsWhereverItReaches) {
  int narrow = 0;
  for (std::uint64_t seed = 1; seed <= 12; ++seed) {
    RandomStream random(seed, "agree");
    OccupancyMap2D map = test::random_map(120, 90, random);
    // A wall with a gap as wide as the explorer takes the vehicle for, or one flown through.
    test::fill(map, {60, 0}, {60, 89}, OccupancyMap2D::kOccupied);
    test::fill(map, {50, 35}, {70, 57}, OccupancyMap2D::kFree);
    test::fill(map, {60, 0}, {60, 89}, OccupancyMap2D::kOccupied);
    const bool flown = seed % 2 == 0;
    if (!flown) test::fill(map, {60, 42}, {60, 50}, OccupancyMap2D::kFree);  // 9 cells
    for (int x = 50; flown && x <= 70; ++x) {
      map.flown.push_back(static_cast<std::uint32_t>(map.index({x, 46})));
    }
    const Eigen::Vector2i start(52, 46);
    const ExplorationSpace space(map, wide(), {}, map.centre_of(start));
    for (int k = 0; k < 60; ++k) {
      const Vec2 goal = random_in(map, random);
      if (!space.is_reachable(map.cell_of(goal))) continue;
      narrow += map.cell_of(goal).x() > 60;
      const GuidePath guide = plan_guide(map, map.centre_of(start), goal, {});
      ASSERT_EQ(guide.status, GuideStatus::kFound) << "seed " << seed;
    }
  }
  EXPECT_GT(narrow, 50);
}

TEST(ExplorationSpace, AWayThatLeadsNowhereClearIsNoStart) {
  // Just taken off: nothing is known but that it stands here.
  OccupancyMap2D map = test::make_map(60, 60, OccupancyMap2D::kUnknown);
  map.flown = {static_cast<std::uint32_t>(map.index({30, 30})),
               static_cast<std::uint32_t>(map.index({31, 30}))};
  EXPECT_FALSE(ExplorationSpace(map, wide(), {}, map.centre_of({31, 30})).has_start());
}

}  // namespace
}  // namespace arex
