#include <gtest/gtest.h>

#include <algorithm>

#include "autonomy/exploration/test_map.h"
#include "exploration/frontier_detector.h"
#include "exploration/mean_shift.h"

namespace arex {
namespace {

struct Scene {
  OccupancyMap2D map;
  ExplorationBounds bounds;
  Vec2 robot = Vec2::Zero();

  [[nodiscard]] ExplorationSpace space() const { return {map, bounds, {}, robot}; }
};

/// A maze seen from a few places on the way.
Scene half_seen_maze(std::uint64_t seed) {
  RandomStream random(seed, "maze");
  const OccupancyMap2D truth = test::maze(4, 3, 40, 16, random);
  Scene scene{test::unknown_like(truth), {}, test::maze_start(truth, 4, 3, 40)};
  scene.bounds.low_m = truth.origin;
  scene.bounds.high_m = -truth.origin;
  test::reveal(truth, scene.robot, 4, scene.map);
  for (int k = 0; k < 3; ++k) {  // further places that can be reached
    const ExplorationSpace space = scene.space();
    for (int trial = 0; trial < 1000; ++trial) {
      const double x = random.uniform(truth.origin.x(), -truth.origin.x());
      const double y = random.uniform(truth.origin.y(), -truth.origin.y());
      if (!space.is_reachable(truth.cell_of({x, y}))) continue;
      test::reveal(truth, {x, y}, 3, scene.map);
      break;
    }
  }
  return scene;
}

TEST(MeanShift, FindsBlobsThatAreApart) {
  RandomStream random(1, "blobs");
  const std::vector<Vec2> centres{{0, 0}, {1, 0}, {0, 1.5}};
  std::vector<Vec2> points;
  for (int i = 0; i < 300; ++i) {
    const double dx = 0.04 * random.normal(), dy = 0.04 * random.normal();
    points.push_back(centres[static_cast<std::size_t>(i % 3)] + Vec2(dx, dy));
  }
  const Clusters clusters = mean_shift(points, 0.3);
  ASSERT_EQ(clusters.modes.size(), 3u);
  for (std::size_t i = 0; i < points.size(); ++i) {
    // The mean of 100 points of 4 cm: 4 mm; four sigma.
    EXPECT_NEAR((clusters.modes[clusters.label[i]] - centres[i % 3]).norm(), 0, 0.016);
  }
}

TEST(MeanShift, ModesAreFixedPointsMoreThanABandwidthApart) {
  RandomStream random(2, "modes");
  std::vector<Vec2> points;
  for (int i = 0; i < 200; ++i) points.emplace_back(random.uniform(0, 2), random.uniform(0, 2));
  const Clusters clusters = mean_shift(points, 0.3);
  for (std::size_t m = 0; m < clusters.modes.size(); ++m) {
    Vec2 sum = Vec2::Zero();
    int count = 0;
    for (const Vec2& p : points) {
      if ((p - clusters.modes[m]).norm() > 0.3) continue;
      sum += p;
      ++count;
    }
    ASSERT_GT(count, 0);
    EXPECT_LT((sum / count - clusters.modes[m]).norm(), 0.01);
    for (std::size_t n = 0; n < m; ++n) {
      EXPECT_GT((clusters.modes[m] - clusters.modes[n]).norm(), 0.3);
    }
  }
  for (std::size_t i = 0; i < points.size(); ++i) {
    for (const Vec2& mode : clusters.modes) {
      EXPECT_LE((clusters.modes[clusters.label[i]] - points[i]).norm(), (mode - points[i]).norm());
    }
  }
  EXPECT_TRUE(mean_shift({}, 0.3).modes.empty());
}

TEST(VertexSet, NearestIsThatOfBruteForce) {
  RandomStream random(3, "vertices");
  VertexSet set(1.0);
  for (int round = 0; round < 3; ++round) {
    set.reset({-10, -8}, {10, 8});
    for (int i = 0; i < 400; ++i) {
      set.add({random.uniform(-10, 10), random.uniform(-8, 8) * (i % 3) / 2});
      const Vec2 p(random.uniform(-11, 11), random.uniform(-9, 9));
      double best = 1e9;
      for (const Vec2& q : set.points()) best = std::min(best, (q - p).norm());
      ASSERT_NEAR((set.nearest(p) - p).norm(), best, 1e-12);
    }
  }
}

TEST(FrontierSearch, FindsEveryReachableBorderCellOnceInSeparatePieces) {
  for (std::uint64_t seed = 1; seed <= 5; ++seed) {
    const Scene scene = half_seen_maze(seed);
    const ExplorationSpace space = scene.space();
    std::vector<int> owner(scene.map.cells.size(), -1);
    const std::vector<Frontier> frontiers = find_frontiers(space);
    for (std::size_t f = 0; f < frontiers.size(); ++f) {
      EXPECT_NEAR(frontiers[f].length_m, 0.1 * static_cast<double>(frontiers[f].cells.size()),
                  1e-9);
      double most = 0;
      for (const FrontierPoint& p : frontiers[f].points) {
        EXPECT_TRUE(space.is_frontier(scene.map.cell_of(p.point)));
        most = std::max(most, space.unknown_area(p.point));
      }
      EXPECT_NEAR(most, frontiers[f].unknown_area_m2, 1e-12);
      for (const auto& cell : frontiers[f].cells) {
        EXPECT_EQ(owner[scene.map.index(cell)], -1);
        owner[scene.map.index(cell)] = static_cast<int>(f);
      }
    }
    int borders = 0;
    for (int y = 0; y < scene.map.height; ++y) {
      for (int x = 0; x < scene.map.width; ++x) {
        bool border = false;
        for (const auto& [dx, dy] : {std::pair(1, 0), {-1, 0}, {0, 1}, {0, -1}}) {
          border |= space.is_unknown({x + dx, y + dy});
        }
        border &= space.is_reachable({x, y});
        const int mine = owner[scene.map.index({x, y})];
        ASSERT_EQ(mine >= 0, border) << x << " " << y;
        borders += border;
        for (int dy = -1; dy <= 1 && border; ++dy) {
          for (int dx = -1; dx <= 1; ++dx) {
            if (!scene.map.contains({x + dx, y + dy})) continue;
            const int other = owner[scene.map.index({x + dx, y + dy})];
            EXPECT_TRUE(other < 0 || other == mine);
          }
        }
      }
    }
    EXPECT_GT(borders, 0);
  }
}

TEST(FrontierSearch, PointsCoverTheFrontier) {
  const Scene scene = half_seen_maze(3);
  const ExplorationSpace space = scene.space();
  for (const Frontier& frontier : find_frontiers(space)) {
    for (const auto& cell : frontier.cells) {
      double nearest = 1e9;
      for (const FrontierPoint& p : frontier.points) {
        nearest = std::min(nearest, (p.point - scene.map.centre_of(cell)).norm());
      }
      EXPECT_LE(nearest, space.information_radius_m() + 0.1 + 1e-9);
    }
  }
}

TEST(FrontierDetector, PointsAreUnknownCellsAtTheEndOfAFreeLine) {
  for (std::uint64_t seed = 1; seed <= 5; ++seed) {
    const Scene scene = half_seen_maze(seed);
    const ExplorationSpace space = scene.space();
    FrontierDetector detector({}, seed);
    const auto& points = detector.update(space);
    ASSERT_FALSE(points.empty());
    for (const FrontierPoint& p : points) {
      const Eigen::Vector2i cell = scene.map.cell_of(p.point);
      EXPECT_EQ(scene.map.at(cell), OccupancyMap2D::kUnknown);
      EXPECT_TRUE(space.is_frontier(cell));
      EXPECT_TRUE(scene.bounds.contains(p.point));
      EXPECT_TRUE(space.is_reachable(scene.map.cell_of(p.seen_from)));
    }
  }
}

TEST(FrontierDetector, GrowthLinesEndWhereTheirPiecesSaySo) {
  int frontier = 0, blocked = 0, free = 0;
  RandomStream random(9, "lines");
  const Scene scene = half_seen_maze(2);
  const ExplorationSpace space = scene.space();
  for (int trial = 0; trial < 1500; ++trial) {
    const Vec2 a = scene.robot;
    const double angle = random.uniform(-M_PI, M_PI), length = random.uniform(0.5, 6);
    const Vec2 b = a + length * Vec2(std::cos(angle), std::sin(angle));
    const Growth growth = grow_line(space, a, b);
    // Every piece between two crossings of grid lines, by its middle.
    std::vector<double> cuts{0, 1};
    for (int k = 0; k < 2; ++k) {
      for (int line = -100; line <= 300; ++line) {
        const double t = (0.1 * line + scene.map.origin[k] - a[k]) / (b[k] - a[k]);
        if (t > 0 && t < 1) cuts.push_back(t);
      }
    }
    std::sort(cuts.begin(), cuts.end());
    Growth::End expected = Growth::End::kFree;
    for (std::size_t i = 1; i < cuts.size() && expected == Growth::End::kFree; ++i) {
      const Eigen::Vector2i cell = scene.map.cell_of(a + (b - a) * (cuts[i - 1] + cuts[i]) / 2);
      const std::int8_t state = scene.map.at(cell);
      if (state == OccupancyMap2D::kOccupied) expected = Growth::End::kBlocked;
      if (state == OccupancyMap2D::kUnknown) {
        expected = scene.bounds.contains(scene.map.centre_of(cell)) ? Growth::End::kFrontier
                                                                    : Growth::End::kBlocked;
      }
    }
    EXPECT_EQ(growth.end, expected);
    frontier += expected == Growth::End::kFrontier;
    blocked += expected == Growth::End::kBlocked;
    free += expected == Growth::End::kFree;
  }
  EXPECT_GT(frontier, 20);
  EXPECT_GT(blocked, 20);
  EXPECT_GT(free, 20);
}

TEST(FrontierDetector, FindsWhatTheExhaustiveSearchFinds) {
  int all = 0;
  for (std::uint64_t seed = 1; seed <= 16; ++seed) {
    const Scene scene = half_seen_maze(seed);
    const ExplorationSpace space = scene.space();
    FrontierDetector detector({}, seed);
    for (int call = 0; call < 5; ++call) detector.update(space);
    for (const Frontier& frontier : find_frontiers(space)) {
      if (frontier.unknown_area_m2 < 0.2 || frontier.length_m < 0.3) continue;
      ++all;
      double nearest = 1e9;
      for (const FrontierPoint& p : detector.points()) {
        for (const auto& cell : frontier.cells) {
          nearest = std::min(nearest, (p.point - scene.map.centre_of(cell)).norm());
        }
      }
      EXPECT_LE(nearest, 0.3) << "seed " << seed << ", length " << frontier.length_m;
    }
  }
  EXPECT_GT(all, 15);
}

TEST(FrontierDetector, KeepsPointsWhileTheyAreFrontiers) {
  Scene scene = half_seen_maze(4);
  FrontierDetectorConfig config;
  FrontierDetector detector(config, 4);
  const std::vector<FrontierPoint> before = detector.update(scene.space());
  ASSERT_GT(before.size(), 3u);
  // Half of the unknown becomes known.
  const Vec2 middle = before[before.size() / 2].point;
  for (int y = 0; y < scene.map.height; ++y) {
    for (int x = 0; x < scene.map.width; ++x) {
      auto& cell = scene.map.cells[scene.map.index({x, y})];
      if (cell == OccupancyMap2D::kUnknown && scene.map.centre_of({x, y}).y() <= middle.y()) {
        cell = OccupancyMap2D::kFree;
      }
    }
  }
  const ExplorationSpace space = scene.space();
  const std::vector<FrontierPoint> after = detector.update(space);
  for (const FrontierPoint& p : after) EXPECT_TRUE(space.is_frontier(scene.map.cell_of(p.point)));
  // Those that are frontiers still are represented within a bandwidth.
  for (const FrontierPoint& p : before) {
    if (!space.is_frontier(scene.map.cell_of(p.point))) continue;
    double nearest = 1e9;
    for (const FrontierPoint& q : after) nearest = std::min(nearest, (p.point - q.point).norm());
    EXPECT_LE(nearest, 2 * config.cluster_bandwidth_m);
  }
}

TEST(FrontierDetector, IsAPureFunctionOfSeedAndHistory) {
  const Scene scene = half_seen_maze(5);
  const auto run = [&](std::uint64_t seed) {
    FrontierDetector detector({}, seed);
    detector.update(scene.space());
    return std::vector<FrontierPoint>(detector.update(scene.space()));
  };
  const auto same = [](const auto& a, const auto& b) {
    return std::equal(a.begin(), a.end(), b.begin(), b.end(), [](const auto& p, const auto& q) {
      return p.point == q.point && p.seen_from == q.seen_from;
    });
  };
  EXPECT_TRUE(same(run(1), run(1)));
  EXPECT_FALSE(same(run(1), run(2)));
}

TEST(FrontierDetector, StaysInsideTheBounds) {
  OccupancyMap2D map = test::make_map(200, 100, OccupancyMap2D::kUnknown);
  test::fill(map, {20, 20}, {180, 80}, OccupancyMap2D::kFree);
  const ExplorationBounds bounds{Vec2(-4, -5), Vec2(4, 2), {}};
  const ExplorationSpace space(map, bounds, {}, Vec2::Zero());
  FrontierDetector detector({}, 1);
  const auto& points = detector.update(space);
  ASSERT_FALSE(points.empty());
  for (const FrontierPoint& p : points) {
    EXPECT_TRUE(bounds.contains(p.point));
    EXPECT_LT(p.point.y(), -2.9);  // the only unknown inside the bounds
  }
}

}  // namespace
}  // namespace arex
