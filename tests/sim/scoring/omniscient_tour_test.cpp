#include "scoring/omniscient_tour.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>
#include <numeric>

#include "math/random.h"
#include "scoring/flight_ways.h"
#include "scoring/sight_map.h"
#include "scoring/tour_order.h"
#include "worlds/mesh_builder.h"

namespace arex::sim {
namespace {

using worlds::MeshBuilder;
using worlds::SurfaceClass;
using worlds::World;

constexpr double kRadius = 0.3;
constexpr double kHeight = 1.5;  // of the take-off
constexpr double kCeiling = 3.0;
constexpr double kUpAndDown = 2 * kHeight;

struct Block {
  Vec2 low, high;
  double height = kCeiling;
};

// A closed hall [0, size] with blocks in it.
World hall(const Vec2& size, const std::vector<Block>& blocks) {
  MeshBuilder builder;
  const auto floor = builder.add_object(SurfaceClass::kFloor, 0.3);
  const auto wall = builder.add_object(SurfaceClass::kWall, 0.3);
  const Vec3 middle(0.5 * size.x(), 0.5 * size.y(), 0.5 * kCeiling);
  builder.add_box(floor, {Mat3::Identity(), middle}, middle);
  for (const Block& block : blocks) {
    const Vec3 half(0.5 * (block.high.x() - block.low.x()), 0.5 * (block.high.y() - block.low.y()),
                    0.5 * block.height);
    const Vec3 at(block.low.x() + half.x(), block.low.y() + half.y(), half.z());
    builder.add_box(wall, {Mat3::Identity(), at}, half);
  }
  World world = builder.finish();
  world.bounds = {{-1, -1, -1}, {size.x() + 1, size.y() + 1, kCeiling + 1}};
  return world;
}

Pose on_floor(double x, double y) { return {Mat3::Identity(), {x, y, 0.15}}; }

const ScoredRegion kAnywhere{{{-200, -200}, {200, 200}, {}}, 0, 2.5, Vec3::Zero()};

// Columns with reachable cells, at their mean height: what a scorer with a wide band counts.
std::vector<Vec3f> area_of(const World& world, const Pose& X_WO) {
  const ReachableSpace space = find_reachable_space(world, X_WO, kAnywhere, kRadius);
  std::vector<Vec3f> area;
  for (int y = 0; y < space.grid.size.y(); ++y) {
    for (int x = 0; x < space.grid.size.x(); ++x) {
      double sum = 0;
      int count = 0;
      for (int z = 0; z < space.grid.size.z(); ++z) {
        if (!space.reachable[space.grid.index({x, y, z})]) continue;
        sum += space.grid.centre({x, y, z}).z();
        ++count;
      }
      const Vec3 c = space.grid.centre({x, y, 0});
      if (count > 0) area.push_back(Vec3(c.x(), c.y(), sum / count).cast<float>());
    }
  }
  return area;
}

OmniscientTour tour_of(const World& world, const Pose& X_WO, const OmniscientTourConfig& config,
                       bool returns = true) {
  TourMission mission;
  mission.takeoff_height_m = kHeight;
  mission.returns = returns;
  const auto tour =
      plan_omniscient_tour(config, world, X_WO, kAnywhere, kRadius, area_of(world, X_WO), mission);
  EXPECT_TRUE(tour);
  return tour.value_or(OmniscientTour());
}

TEST(OmniscientTour, AnEmptyRoomIsSeenFromTheStart) {
  const World world = hall({12, 8}, {});
  for (const bool returns : {true, false}) {
    const OmniscientTour tour = tour_of(world, on_floor(6, 4), {}, returns);
    EXPECT_TRUE(tour.viewpoints_W.empty());
    EXPECT_NEAR(tour.path_m, kUpAndDown, 1e-9);
    EXPECT_EQ(tour.area_fraction, 1);
    // Up at 0.8 m/s and down at 0.4 m/s; 3 m/s^2.
    EXPECT_NEAR(tour.time_s, kHeight / 0.8 + 0.8 / 3 + kHeight / 0.4 + 0.4 / 3, 1e-9);
  }
}

TEST(OmniscientTour, ACorridorIsFlownUntilItsEndIsInSight) {
  const World world = hall({60, 2}, {});
  OmniscientTourConfig config;
  config.area_share = 1;
  config.range_m = 15;
  config.viewpoint_spacing_m = 0.5;
  const double start = 2.05, last = 60 - 0.4;
  const double there = last - config.range_m - start;
  for (const bool returns : {true, false}) {
    const OmniscientTour tour = tour_of(world, on_floor(start, 1.05), config, returns);
    const double flown = tour.path_m - kUpAndDown;
    EXPECT_NEAR(flown, returns ? 2 * there : there, returns ? 1.2 : 0.6);
    EXPECT_EQ(tour.area_fraction, 1);
    // At 2 m/s and 3 m/s^2, from rest to rest; and a turn on the spot.
    const double legs = returns ? 2 : 1;
    const double up_and_down = kHeight / 0.8 + 0.8 / 3 + kHeight / 0.4 + 0.4 / 3;
    EXPECT_NEAR(tour.time_s, flown / 2 + legs * 2.0 / 3 + up_and_down, 0.3);
  }
}

// Whoever sees 4 m only has to go all the way round; what is tight runs along the block.
TEST(OmniscientTour, ARingIsFlownRoundItsBlockTightly) {
  const World world = hall({20, 20}, {{{4, 4}, {16, 16}}});
  OmniscientTourConfig config;
  config.range_m = 5;
  config.area_share = 0.97;
  const OmniscientTour tour = tour_of(world, on_floor(10.05, 3.25), config);
  // A string round the block at the distance that the cells allow, 0.3 to 0.6 m.
  const double flown = tour.path_m - kUpAndDown;
  EXPECT_GT(flown, 4 * 12 + 8 * 0.3 - 1);
  EXPECT_LT(flown, 1.05 * (4 * 12 + 8 * 0.6));
  EXPECT_GT(tour.area_fraction, 0.96);
  for (const Vec3& p : with_points_between(tour.path_W, 0.05)) {
    const Vec2 inside = (p.head<2>() - Vec2(10, 10)).cwiseAbs();
    EXPECT_GT(inside.maxCoeff(), 6 + 0.25) << p.transpose();
  }
}

TEST(OmniscientTour, IsTheSameEveryTime) {
  const World world = hall({30, 20}, {{{5, 4}, {6, 16}}, {{12, 0}, {13, 15}}, {{20, 6}, {28, 7}}});
  OmniscientTourConfig config;
  config.range_m = 8;
  const OmniscientTour first = tour_of(world, on_floor(2, 2), config);
  const OmniscientTour second = tour_of(world, on_floor(2, 2), config);
  EXPECT_GT(first.viewpoints_W.size(), 2U);
  EXPECT_EQ(first.path_W, second.path_W);
  EXPECT_EQ(first.time_s, second.time_s);
}

TEST(OmniscientTour, IsLedInAndOutWhereTheMissionSaysSo) {
  const World world = hall({20, 6}, {});
  TourMission mission;
  mission.entry_O = {{5, 0, 1.5}, {10, 0, 1.0}};
  const Pose X_WO = on_floor(2.05, 3.05);
  const std::vector<Vec3f> area = area_of(world, X_WO);
  const double in = 5 + std::hypot(5, 0.5);
  for (const bool returns : {true, false}) {
    mission.returns = returns;
    const auto tour = plan_omniscient_tour({}, world, X_WO, kAnywhere, kRadius, area, mission);
    ASSERT_TRUE(tour);
    EXPECT_NEAR(tour->path_m, kUpAndDown + (returns ? 2 * in : in), 1e-9);
  }
}

TEST(OmniscientTour, ThereIsNoneWithoutAnAreaOrRoom) {
  const World world = hall({6, 4}, {});
  const std::vector<Vec3f> area = area_of(world, on_floor(3, 2));
  EXPECT_FALSE(plan_omniscient_tour({}, world, on_floor(3, 2), kAnywhere, kRadius, {}, {}));
  EXPECT_FALSE(plan_omniscient_tour({}, world, on_floor(3, 0.05), kAnywhere, kRadius, area, {}));
  OmniscientTourConfig small;
  small.max_area_m2 = 10;
  EXPECT_FALSE(plan_omniscient_tour(small, world, on_floor(3, 2), kAnywhere, kRadius, area, {}));
  small.max_area_m2 = 20;  // 5.2 m x 3.2 m
  EXPECT_TRUE(plan_omniscient_tour(small, world, on_floor(3, 2), kAnywhere, kRadius, area, {}));
}

TEST(OmniscientTour, OnlyAFlightThatSucceededHasARatio) {
  OmniscientTour tour;
  tour.path_m = 40;
  tour.time_s = 20;
  Figures figures;
  add_figures(tour, 100, 30, figures);
  auto json = figures.json();
  EXPECT_EQ(json["tour"]["path_ratio"], 2.5);
  EXPECT_EQ(json["tour"]["time_ratio"], 1.5);
  EXPECT_EQ(json["exploration"]["omniscient_ratio"], 2.5);
  Figures failed;
  add_figures(tour, std::nan(""), std::nan(""), failed);
  json = failed.json();
  EXPECT_EQ(json["tour"]["path_m"], 40);
  EXPECT_TRUE(json["tour"]["path_ratio"].is_null());
  EXPECT_TRUE(json["exploration"].is_null());
}

// Whether nothing opaque lies on the line between the middles of two columns.
bool sees_by_line(const SightMap& sight, const Vec2& from, const Vec2& to) {
  const double length = (to - from).norm();
  const int steps = static_cast<int>(std::ceil(length / 0.01));
  for (int i = 1; i < steps; ++i) {
    if (sight.is_opaque(from + (static_cast<double>(i) / steps) * (to - from))) return false;
  }
  return true;
}

std::vector<Block> random_blocks(std::uint64_t seed, const Vec2& size) {
  RandomStream random(seed, "blocks");
  std::vector<Block> blocks;
  for (int i = 0; i < 25; ++i) {
    const Vec2 low(random.uniform(3, size.x() - 2), random.uniform(1, size.y() - 2));
    blocks.push_back({low, low + Vec2(random.uniform(0.2, 1.2), random.uniform(0.2, 1.2))});
  }
  return blocks;
}

// By straight lines to the middles of all columns that belong to a patch.
TEST(SightMap, SeesWhatBruteForceSees) {
  const Vec2 size(24, 16);
  for (std::uint64_t seed = 1; seed <= 3; ++seed) {
    const World world = hall(size, random_blocks(seed, size));
    const std::vector<Vec3f> area = area_of(world, on_floor(1.5, 8));
    constexpr double kRange = 10;
    const SightMap sight(world, area, kRange, 0.5);
    RandomStream random(seed, "places");
    for (int n = 0; n < 5; ++n) {
      const int last = static_cast<int>(area.size()) - 1;
      const auto chosen = static_cast<std::size_t>(random.uniform_int(0, last));
      const Vec2 from = sight.origin_W(area[chosen].head<2>().cast<double>());
      const SightMap::Bits seen = sight.seen_from(from);
      SightMap::Bits expected(seen.size(), 0);
      for (double y = 0.05; y < size.y(); y += SightMap::kColumn_m) {
        for (double x = 0.05; x < size.x(); x += SightMap::kColumn_m) {
          const Vec2 to(x, y);
          if (sight.is_opaque(to) || !has_bit(sight.area(), sight.patch(to))) continue;
          if ((to - from).norm() > kRange || !sees_by_line(sight, from, to)) continue;
          expected[sight.patch(to) / 64] |= std::uint64_t{1} << (sight.patch(to) % 64);
        }
      }
      const auto count = static_cast<double>(count_bits(expected));
      EXPECT_GT(count, 500);
      // A ray at the edge of a shadow is half a column off at most: the same patch, or the next.
      EXPECT_LT(static_cast<double>(count_new(seen, expected)), 0.03 * count);
      EXPECT_LT(static_cast<double>(count_new(expected, seen)), 0.03 * count);
    }
  }
}

// What stands lower than the line of sight hides nothing.
TEST(SightMap, LooksOverWhatIsLow) {
  for (const auto& [height, hidden] : {std::pair(kCeiling, true), std::pair(0.8, false)}) {
    const World world = hall({10, 6}, {{{5, 2}, {5.4, 6}, height}});
    const std::vector<Vec3f> area = area_of(world, on_floor(2, 5));
    const SightMap sight(world, area, 20, 0.5);
    const std::size_t patch = sight.patch({9.05, 5.05});
    ASSERT_TRUE(has_bit(sight.area(), patch));
    EXPECT_NE(has_bit(sight.seen_from({2.05, 5.05}), patch), hidden);
  }
}

// The share that the tour claims, by straight lines from its path.
TEST(OmniscientTour, CoversWhatItSaysByBruteForce) {
  const Vec2 size(24, 16);
  for (std::uint64_t seed = 1; seed <= 3; ++seed) {
    const World world = hall(size, random_blocks(seed, size));
    const Pose X_WO = on_floor(1.5, 8);
    OmniscientTourConfig config;
    config.range_m = 6;
    const OmniscientTour tour = tour_of(world, X_WO, config);
    const std::vector<Vec3f> area = area_of(world, X_WO);
    const SightMap sight(world, area, config.range_m, config.slab_m);
    const std::vector<Vec3> looks = with_points_between(tour.path_W, 0.3);
    std::size_t seen = 0;
    for (const Vec3f& cell : area) {
      const Vec2 to = cell.head<2>().cast<double>();
      seen += std::ranges::any_of(looks, [&](const Vec3& p) {
        return (to - p.head<2>()).norm() <= config.range_m && sees_by_line(sight, p.head<2>(), to);
      });
    }
    const double share = static_cast<double>(seen) / static_cast<double>(area.size());
    EXPECT_GT(share, 0.97) << seed;
    EXPECT_NEAR(share, tour.area_fraction, 0.015) << seed;
  }
}

TEST(FlightWays, RoundsACornerAsAStringDoes) {
  const World world = hall({20, 20}, {{{0, 8}, {12, 9}}});
  const FlightWays ways(find_reachable_space(world, on_floor(2, 4), kAnywhere, kRadius, {0.2}));
  const auto from = ways.nearest({3.1, 5.1, 1.5}, 0.3), to = ways.nearest({3.1, 12.1, 1.5}, 0.3);
  ASSERT_TRUE(from && to);
  const auto distances = ways.distances_from(*from);
  const std::vector<Vec3> way = ways.way_W(distances, *to, 1.5);
  // Past both corners of the wall's end, at 0.3 to 0.6 m from it.
  const auto string = [&](double gap) {
    const Vec2 a(12 + gap, 8 - gap), b(12 + gap, 9 + gap);
    return (a - Vec2(3.1, 5.1)).norm() + 1 + 2 * gap + (Vec2(3.1, 12.1) - b).norm();
  };
  EXPECT_GT(polyline_length(way), string(0.2));
  EXPECT_LT(polyline_length(way), 1.01 * string(0.6));
  // On the lattice it is up to 8 % longer.
  const double lattice = ways.unit_m() * distances[*to];
  EXPECT_GT(lattice, polyline_length(way) - 0.4);
  EXPECT_LT(lattice, 1.09 * polyline_length(way));
}

TEST(FlightWays, ClimbsOverWhatItCannotPass) {
  const World world = hall({12, 4}, {{{6, 0}, {6.5, 4}, 1.6}});
  const FlightWays ways(find_reachable_space(world, on_floor(2, 2), kAnywhere, kRadius, {0.2}));
  const auto from = ways.nearest({2.1, 2.1, 1.0}, 0.3), to = ways.nearest({10.1, 2.1, 1.0}, 0.3);
  ASSERT_TRUE(from && to);
  const std::vector<Vec3> way = ways.way_W(ways.distances_from(*from), *to, 1.0);
  double highest = 0;
  for (const Vec3& p : way) highest = std::max(highest, p.z());
  EXPECT_GT(highest, 1.6 + 0.3);
  EXPECT_LT(highest, 1.6 + 0.8);
  EXPECT_GT(polyline_length(way), 2 * std::hypot(4, 0.9) - 0.2);
  EXPECT_LT(polyline_length(way), 8 + 1.6);
}

TEST(FlightWays, SaysWhereThereIsNoWay) {
  const World world = hall({12, 4}, {{{6, 0}, {6.5, 4}, kCeiling}});
  const FlightWays ways(find_reachable_space(world, on_floor(2, 2), kAnywhere, kRadius, {0.2}));
  EXPECT_TRUE(ways.nearest({2, 2, 1}, 0.3));
  EXPECT_FALSE(ways.nearest({10, 2, 1}, 0.3)) << "cut off: not reachable";
}

Eigen::MatrixXd random_places(std::uint64_t seed, int count) {
  RandomStream random(seed, "places");
  std::vector<Vec2> places;
  for (int i = 0; i < count; ++i) places.emplace_back(random.uniform(), random.uniform());
  Eigen::MatrixXd distance(count, count);
  for (int i = 0; i < count; ++i) {
    for (int j = 0; j < count; ++j) {
      distance(i, j) =
          (places[static_cast<std::size_t>(i)] - places[static_cast<std::size_t>(j)]).norm();
    }
  }
  return distance;
}

TEST(TourOrder, IsTheBestOfAllUpToEightPlaces) {
  int best_of_all = 0, asked = 0;
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    for (const bool closed : {true, false}) {
      const int count = 1 + static_cast<int>(seed % 8);
      const Eigen::MatrixXd distance = random_places(seed, count);
      const auto order = order_tour(distance, closed, 200);
      std::vector<std::size_t> every(static_cast<std::size_t>(count));
      std::iota(every.begin(), every.end(), std::size_t{0});
      ASSERT_TRUE(std::ranges::is_permutation(order, every));
      ASSERT_EQ(order.front(), 0U);
      double least = std::numeric_limits<double>::infinity();
      do {
        least = std::min(least, tour_length(distance, every, closed));
      } while (std::next_permutation(every.begin() + 1, every.end()));
      const double length = tour_length(distance, order, closed);
      EXPECT_LE(length, 1.05 * least + 1e-12) << seed;
      EXPECT_GE(length, least - 1e-9);
      best_of_all += length <= least + 1e-9;
      ++asked;
    }
  }
  EXPECT_GE(best_of_all, asked - 1);
}

// The longest edge of a random uniform instance is short: 0.7124 sqrt(n A) plus a rim (Johnson and
// McGeoch, for n of some hundred 0.7124 sqrt(n A) (1 + 0.33 / n) on a torus).
TEST(TourOrder, IsNearTheRandomUniformConstantForManyPlaces) {
  double closed = 0, open = 0;
  constexpr int kSeeds = 5, kPlaces = 100;
  for (std::uint64_t seed = 1; seed <= kSeeds; ++seed) {
    const Eigen::MatrixXd distance = random_places(seed, kPlaces);
    closed += tour_length(distance, order_tour(distance, true, 200), true);
    open += tour_length(distance, order_tour(distance, false, 200), false);
  }
  const double constant = 0.7124 * std::sqrt(kPlaces);
  EXPECT_LT(closed / kSeeds, 1.17 * constant);
  EXPECT_GT(closed / kSeeds, 0.95 * constant);
  EXPECT_LT(open, closed);
}

TEST(FlightTime, IsThatOfTheTrapezoid) {
  const auto time = [](std::vector<Vec3> path) { return flight_time(path, 2, 3, 0.2); };
  EXPECT_EQ(time({}), 0);
  EXPECT_EQ(time({{1, 2, 3}}), 0);
  EXPECT_NEAR(time({{0, 0, 0}, {10, 0, 0}}), 10.0 / 2 + 2.0 / 3, 1e-12);
  EXPECT_NEAR(time({{0, 0, 0}, {0.5, 0, 0}}), 2 * std::sqrt(0.5 / 3), 1e-12) << "never at speed";
  EXPECT_NEAR(time({{0, 0, 0}, {4, 0, 0}, {4, 0, 0}, {10, 0, 0}}), 10.0 / 2 + 2.0 / 3, 1e-12);
  EXPECT_NEAR(time({{0, 0, 0}, {10, 0, 0}, {0, 0, 0}}), 2 * (10.0 / 2 + 2.0 / 3), 1e-3);
  // A right angle: the arc that leaves the corner by 0.2 m has a radius of 0.483 m.
  const double corner = std::sqrt(3 * 0.2 / (std::sqrt(2.0) - 1));
  const double slowed = (2 - corner) * (2 - corner) / (2 * 3);  // lost against passing at 2 m/s
  EXPECT_NEAR(time({{0, 0, 0}, {10, 0, 0}, {10, 10, 0}}), 20.0 / 2 + 2.0 / 3 + 2 * slowed / 2,
              1e-9);
}

}  // namespace
}  // namespace arex::sim
