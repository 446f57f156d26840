#include "exploration/landing.h"

#include <gtest/gtest.h>

#include "autonomy/exploration/test_map.h"

namespace arex {
namespace {

using PlaceKind = LandingPlace::Kind;

constexpr double kRadius = 0.305;
constexpr double kFooting = kRadius + 0.3;

/// A hall of 20 x 8 m with a wall around it, its floor in layer 0, all of it known.
struct Hall {
  OccupancyMap2D map = test::make_map(200, 80, OccupancyMap2D::kOccupied);
  ExplorerConfig explorer;

  Hall() {
    map.floor.top.assign(map.cells.size(), 0);
    map.floor.overhead.assign(map.cells.size(), 0);
    test::fill(map, {1, 1}, {198, 78}, OccupancyMap2D::kFree);
    each({1, 1}, {198, 78}, [&](std::size_t i) { map.floor.overhead[i] = FloorMap::kNothing; });
    explorer.bounds = {map.origin, -map.origin, {}};
  }
  template <class Change>
  void each(const Eigen::Vector2i& low, const Eigen::Vector2i& high, const Change& change) {
    for (int y = low.y(); y <= high.y(); ++y) {
      for (int x = low.x(); x <= high.x(); ++x) change(map.index({x, y}));
    }
  }
  /// Something as high as this; the band of the 2D map begins at 0.4 m.
  void put(const Eigen::Vector2i& low, const Eigen::Vector2i& high, std::int16_t layers) {
    if (layers >= 4) test::fill(map, low, high, OccupancyMap2D::kOccupied);
    each(low, high, [&](std::size_t i) { map.floor.overhead[i] = layers; });
  }
  [[nodiscard]] Vec3 at(int x, int y, double z = 1.5) const {
    const Vec2 p = map.centre_of({x, y});
    return {p.x(), p.y(), z};
  }
  [[nodiscard]] LandingFinder finder() const { return {{}, explorer, kRadius}; }
  [[nodiscard]] std::optional<LandingPlace> find(const Vec3& from, LandingQuery query = {}) const {
    return finder().find(map, from, query, {});
  }
};

TEST(Landing, NeedsTheWholeVehicleAndItsMarginOverClearGround) {
  Hall hall;
  hall.put({100, 40}, {100, 40}, 3);  // a kerb: 0.3 m, below the band of the 2D map
  ASSERT_EQ(hall.map.at({100, 40}), OccupancyMap2D::kFree);
  for (int dx = 0; dx <= 12; ++dx) {
    const bool beside = 0.1 * dx <= kFooting;
    EXPECT_EQ(hall.finder().assess(hall.map, hall.at(100 + dx, 40)),
              beside ? LandingGround::kObstructed : LandingGround::kClear)
        << dx;
  }
  // What hangs above the vehicle does not count; from above it, it does.
  hall.put({50, 40}, {50, 40}, 25);
  test::fill(hall.map, {50, 40}, {50, 40}, OccupancyMap2D::kFree);
  EXPECT_EQ(hall.finder().assess(hall.map, hall.at(50, 40, 1.5)), LandingGround::kClear);
  EXPECT_EQ(hall.finder().assess(hall.map, hall.at(50, 40, 3.5)), LandingGround::kObstructed);
}

TEST(Landing, NeedsGroundThatIsFlatAndSeen) {
  Hall hall;
  hall.each({100, 30}, {120, 50}, [&](std::size_t i) { hall.map.floor.top[i] = 2; });
  EXPECT_EQ(hall.finder().assess(hall.map, hall.at(110, 40)), LandingGround::kClear);
  EXPECT_EQ(hall.finder().assess(hall.map, hall.at(100, 40)), LandingGround::kClear);  // 0.2 m
  hall.each({100, 30}, {120, 50}, [&](std::size_t i) { hall.map.floor.top[i] = 3; });
  EXPECT_EQ(hall.finder().assess(hall.map, hall.at(110, 40)), LandingGround::kClear);
  EXPECT_EQ(hall.finder().assess(hall.map, hall.at(100, 40)), LandingGround::kObstructed);
  // One return from the floor in three is not enough, two are; air that is not known never is.
  for (const int seen : {1, 2}) {
    int k = 0;
    hall.each({20, 20}, {60, 60}, [&](std::size_t i) {
      hall.map.floor.top[i] = k++ % 3 < seen ? std::int16_t{0} : FloorMap::kUnseen;
    });
    EXPECT_EQ(hall.finder().assess(hall.map, hall.at(40, 40)),
              seen == 2 ? LandingGround::kClear : LandingGround::kUnknown);
  }
  hall.map.floor.top[hall.map.index({44, 40})] = FloorMap::kUnknown;
  EXPECT_EQ(hall.finder().assess(hall.map, hall.at(40, 40)), LandingGround::kUnknown);
  EXPECT_EQ(hall.finder().assess(hall.map, {100, 100, 1.5}), LandingGround::kUnknown);
}

TEST(Landing, TakesTheNearestPlaceWithRoomElseTheNearestClearOne) {
  Hall hall;
  const auto from = hall.at(4, 40);  // near the wall
  const auto wide = hall.find(from);
  ASSERT_TRUE(wide);
  EXPECT_EQ(wide->kind, PlaceKind::kClear);
  EXPECT_NEAR(wide->p_O.x(), hall.map.centre_of({0, 0}).x() + 1.0, 0.051);
  EXPECT_EQ(wide->p_O.z(), hall.explorer.flight_height_m);
  // A passage in which nothing is a metre from the walls, but the margin fits.
  hall.put({1, 1}, {198, 31}, 20);
  hall.put({1, 49}, {198, 78}, 20);
  const auto narrow = hall.find(from);
  ASSERT_TRUE(narrow);
  EXPECT_EQ(narrow->kind, PlaceKind::kClear);
  EXPECT_NEAR(narrow->p_O.x(), hall.map.centre_of({0, 0}).x() + kFooting, 0.11);
}

TEST(Landing, MeansTheSameInAHallBelowTheStart) {
  Hall hall;
  hall.put({100, 40}, {100, 40}, 3);
  for (std::size_t i = 0; i < hall.map.cells.size(); ++i) {
    hall.map.floor.top[i] -= 80;
    std::int16_t& overhead = hall.map.floor.overhead[i];
    overhead = overhead == FloorMap::kNothing ? -50 : static_cast<std::int16_t>(overhead - 80);
  }
  hall.map.ground = {hall.map.origin, 20, 1, {-8.0F}, {}};  // and a ceiling 3 m above it
  hall.explorer.follow_ground = true;
  EXPECT_EQ(hall.finder().assess(hall.map, hall.at(50, 40, -6.5)), LandingGround::kClear);
  EXPECT_EQ(hall.finder().assess(hall.map, hall.at(100, 40, -6.5)), LandingGround::kObstructed);
  const auto place = hall.find(hall.at(101, 40, -6.5));
  ASSERT_TRUE(place);
  EXPECT_EQ(place->kind, PlaceKind::kClear);
  EXPECT_EQ(place->p_O.z(), hall.explorer.flight_height_m - 8);
}

TEST(Landing, NeverChoosesAPlaceBesideAThingThatOnlyThe3DMapKnows) {
  for (std::uint64_t seed = 1; seed <= 10; ++seed) {
    Hall hall;
    RandomStream random(seed, "kerbs");
    for (int k = 0; k < 60; ++k) {
      const Eigen::Vector2i low(random.uniform_int(2, 195), random.uniform_int(2, 75));
      hall.put(low, low + Eigen::Vector2i(2, 2),
               static_cast<std::int16_t>(random.uniform_int(2, 3)));
    }
    const auto place = hall.find(hall.at(random.uniform_int(20, 180), random.uniform_int(20, 60)));
    ASSERT_TRUE(place);
    for (int y = 0; place->kind == PlaceKind::kClear && y < hall.map.height; ++y) {
      for (int x = 0; x < hall.map.width; ++x) {
        if (hall.map.floor.overhead[hall.map.index({x, y})] == FloorMap::kNothing) continue;
        EXPECT_GT((hall.map.centre_of({x, y}) - place->p_O.head<2>()).norm(), kFooting);
      }
    }
  }
}

TEST(Landing, LooksForAPlaceWhereNoneIsKnown) {
  Hall hall;
  hall.each({1, 1}, {198, 78}, [&](std::size_t i) { hall.map.floor.top[i] = FloorMap::kUnseen; });
  auto place = hall.find(hall.at(100, 40));
  ASSERT_TRUE(place);
  EXPECT_EQ(place->kind, PlaceKind::kToBeSeen);
  // Those that were looked at in vain give way to others.
  std::vector<Vec2> tried{place->p_O.head<2>()};
  place = hall.find(hall.at(100, 40), {tried, false});
  ASSERT_TRUE(place);
  EXPECT_GE((place->p_O.head<2>() - tried.front()).norm(), LandingConfig().apart_m);
  // Known ground further on is better.
  hall.each({10, 10}, {60, 70}, [&](std::size_t i) { hall.map.floor.top[i] = 0; });
  place = hall.find(hall.at(100, 40));
  ASSERT_TRUE(place);
  EXPECT_EQ(place->kind, PlaceKind::kClear);
  EXPECT_LE(hall.map.cell_of(place->p_O.head<2>()).x(), 60);
}

TEST(Landing, TakesTheWidestPlaceWhereNothingIsClear) {
  Hall hall;
  for (int x = 6; x < 195; x += 5) hall.put({x, 1}, {x, 78}, 3);  // wheel stops all over
  hall.put({96, 1}, {96, 78}, FloorMap::kNothing);                // but one: 0.9 m between two
  test::fill(hall.map, {96, 1}, {96, 78}, OccupancyMap2D::kFree);
  const auto place = hall.find(hall.at(30, 40));
  ASSERT_TRUE(place);
  EXPECT_EQ(place->kind, PlaceKind::kWidest);
  EXPECT_EQ(hall.map.cell_of(place->p_O.head<2>()).x(), 96);
  hall.put({1, 1}, {198, 78}, 20);
  EXPECT_FALSE(hall.find(hall.at(30, 40)));
}

TEST(Landing, ComesOutOfAPocketByTheWayThatItFlew) {
  Hall hall;
  hall.put({20, 1}, {60, 78}, 20);
  hall.each({38, 38}, {42, 42}, [&](std::size_t i) {
    hall.map.floor.overhead[i] = FloorMap::kNothing;
    hall.map.cells[i] = OccupancyMap2D::kFree;
  });
  EXPECT_FALSE(hall.find(hall.at(40, 40)));
  for (int x = 40; x <= 70; ++x) {
    hall.map.flown.push_back(static_cast<std::uint32_t>(hall.map.index({x, 40})));
  }
  const auto place = hall.find(hall.at(40, 40));
  ASSERT_TRUE(place);
  EXPECT_EQ(place->kind, PlaceKind::kClear);
  EXPECT_GE(hall.map.cell_of(place->p_O.head<2>()).x(), 69);
}

}  // namespace
}  // namespace arex
