#include <gtest/gtest.h>

#include "autonomy/exploration/test_map.h"
#include "exploration/nearest_explorer.h"
#include "exploration/revenue_explorer.h"

namespace arex {
namespace {

/// A vehicle with a disc sensor in a maze, flying its explorer's goals cell by cell through the
/// known-free space.
class GridWorld {
 public:
  GridWorld(std::uint64_t seed, ExplorerConfig config) : config_(std::move(config)) {
    RandomStream random(seed, "world");
    truth_ = test::maze(kColumns, kRows, kRoom, 16, random);
    map_ = test::unknown_like(truth_);
    home_ = p_ = test::maze_start(truth_, kColumns, kRows, kRoom);
    config_.bounds.low_m = truth_.origin;
    config_.bounds.high_m = -truth_.origin;
    test::reveal(truth_, p_, kRange, map_);
  }

  [[nodiscard]] const OccupancyMap2D& map() const { return map_; }
  [[nodiscard]] const ExplorerConfig& config() const { return config_; }
  [[nodiscard]] double flown_m() const { return flown_; }

  [[nodiscard]] ExplorerInput input() const {
    ExplorerInput in;
    in.now = now_;
    in.p_OB = {p_.x(), p_.y(), 1.5};
    in.home_O = {home_.x(), home_.y(), 0};
    in.progress = progress_;
    return in;
  }

  /// One metre towards the goal.
  void fly(const Vec2& goal) {
    const ExplorationSpace field(map_, config_.bounds, config_.space, goal);
    progress_ = TargetProgress::kUnderWay;
    now_ += kNanosecondsPerSecond;
    for (int step = 0; step < 10; ++step) {
      const Eigen::Vector2i here = map_.cell_of(p_);
      const Eigen::Vector2i next = test::next_towards(field, here);
      if (next == here) {
        progress_ =
            here == map_.cell_of(goal) ? TargetProgress::kReached : TargetProgress::kUnreachable;
        break;
      }
      flown_ += (map_.centre_of(next) - p_).norm();
      p_ = map_.centre_of(next);
    }
    test::reveal(truth_, p_, kRange, map_);
  }

  /// Share of the truly reachable cells that the map knows.
  [[nodiscard]] double known_fraction() const {
    const ExplorationSpace truth(truth_, config_.bounds, config_.space, home_);
    int reachable = 0, known = 0;
    for (int y = 0; y < truth_.height; ++y) {
      for (int x = 0; x < truth_.width; ++x) {
        if (!truth.is_reachable({x, y})) continue;
        ++reachable;
        known += map_.at({x, y}) != OccupancyMap2D::kUnknown;
      }
    }
    return static_cast<double>(known) / reachable;
  }

 private:
  static constexpr int kColumns = 4, kRows = 3, kRoom = 40;
  static constexpr double kRange = 5;
  ExplorerConfig config_;
  OccupancyMap2D truth_, map_;
  Vec2 p_ = Vec2::Zero(), home_ = Vec2::Zero();
  Stamp now_ = 0;
  TargetProgress progress_ = TargetProgress::kUnderWay;
  double flown_ = 0;
};

/// Explores to the end: whatever is worth a target is flown to.
ExplorerConfig light() {
  ExplorerConfig config;
  config.stop.left_fraction = 0;
  config.detector.local_iterations = 300;
  config.detector.global_iterations = 500;
  return config;
}

struct Flight {
  std::vector<Vec2> targets;
  Decision last;
  double known = 0, flown_m = 0;
  double open_area_m2 = 0;  ///< the largest frontier of the exhaustive search at the end
};

Flight explore(GridWorld& world, Explorer& explorer) {
  Flight flight;
  for (int i = 0; i < 600; ++i) {
    flight.last = explorer.decide(world.map(), world.input());
    if (flight.last.kind == DecisionKind::kStop) break;
    if (flight.last.kind == DecisionKind::kNewTarget) flight.targets.push_back(flight.last.target);
    if (flight.last.kind != DecisionKind::kWait) world.fly(flight.last.goal_O.head<2>());
  }
  flight.known = world.known_fraction();
  flight.flown_m = world.flown_m();
  const ExplorationSpace space(world.map(), world.config().bounds, world.config().space,
                               world.input().p_OB.head<2>());
  for (const Frontier& f : find_frontiers(space)) {
    flight.open_area_m2 = std::max(flight.open_area_m2, f.unknown_area_m2);
  }
  return flight;
}

Flight explore(std::uint64_t seed, const ExplorerConfig& config) {
  GridWorld world(seed, config);
  RevenueExplorer explorer(world.config(), world.map().resolution, seed);
  return explore(world, explorer);
}

TEST(Explorer, TheNearestFrontierExploresRandomMazesToTheEnd) {
  for (std::uint64_t seed = 1; seed <= 6; ++seed) {
    GridWorld world(seed, light());
    NearestExplorer explorer(world.config(), world.map().resolution);
    const Flight flight = explore(world, explorer);
    EXPECT_EQ(flight.last.kind, DecisionKind::kStop);
    EXPECT_GE(flight.known, 0.99) << "seed " << seed;
    EXPECT_LT(flight.open_area_m2, light().stop.min_area_m2) << "seed " << seed;
  }
}

TEST(Explorer, ExploresRandomMazesToTheEnd) {
  for (std::uint64_t seed = 1; seed <= 6; ++seed) {
    ExplorerConfig config = light();
    config.revenue.direction_aware = seed % 2 == 0;
    const Flight flight = explore(seed, config);
    EXPECT_EQ(flight.last.kind, DecisionKind::kStop);
    EXPECT_TRUE(flight.last.stop_reason == StopReason::kNoCandidates ||
                flight.last.stop_reason == StopReason::kLittleLeft);
    EXPECT_GE(flight.known, 0.99) << "seed " << seed;
    EXPECT_LT(flight.open_area_m2, config.stop.min_area_m2) << "seed " << seed;
    EXPECT_EQ(flight.last.open_frontier_m2, flight.open_area_m2);
    RecordProperty("flown_m_" + std::to_string(seed), std::to_string(flight.flown_m));
  }
}

TEST(Explorer, SameSeedSameFlight) {
  const Flight a = explore(3, light()), b = explore(3, light());
  EXPECT_EQ(a.targets, b.targets);
  EXPECT_EQ(a.flown_m, b.flown_m);
}

TEST(Explorer, TheExhaustiveSearchHasTheLastWord) {
  ExplorerConfig config = light();
  config.detector.local_iterations = 0;  // trees that find nothing
  config.detector.global_iterations = 0;
  const Flight flight = explore(2, config);
  EXPECT_EQ(flight.last.kind, DecisionKind::kStop);
  EXPECT_GE(flight.known, 0.99);
  EXPECT_GT(flight.targets.size(), 2u);
}

TEST(Explorer, AsPrintedTheTreesWordEndsIt) {
  ExplorerConfig config = light();
  config.stop.exhaustive = false;
  config.detector.local_iterations = 0;
  config.detector.global_iterations = 0;
  const Flight flight = explore(2, config);
  EXPECT_EQ(flight.last.stop_reason, StopReason::kNoCandidates);
  EXPECT_TRUE(flight.targets.empty());
  EXPECT_GT(flight.last.open_frontier_m2, 1);  // and says what it left
}

/// A free hall whose far end is unknown.
struct Hall {
  OccupancyMap2D map = test::make_map(200, 80, OccupancyMap2D::kUnknown);
  ExplorerConfig config = light();
  ExplorerInput input;

  Hall() {
    test::fill(map, {0, 0}, {199, 79}, OccupancyMap2D::kOccupied);
    test::fill(map, {1, 1}, {198, 78}, OccupancyMap2D::kFree);
    test::fill(map, {150, 1}, {198, 78}, OccupancyMap2D::kUnknown);
    config.bounds = {map.origin, -map.origin, {}};
    input.p_OB = {-6, 0, 1.5};
  }
};

TEST(Explorer, RecordsTheTermsOfEveryCandidate) {
  Hall hall;
  hall.config.flight_height_m = 1.2;
  RevenueExplorer explorer(hall.config, 0.1, 1);
  const Decision d = explorer.decide(hall.map, hall.input);
  ASSERT_EQ(d.kind, DecisionKind::kNewTarget);
  EXPECT_EQ(d.source, "trees");
  ASSERT_TRUE(d.winner);
  const ExplorationSpace space(hall.map, hall.config.bounds, hall.config.space, {-6, 0});
  for (const Candidate& c : d.candidates) {
    EXPECT_NEAR(c.information_m2, space.unknown_area(c.point), 1e-12);
    if (c.verdict != Verdict::kKept) continue;
    EXPECT_FALSE(c.angle_rad);
    // Octile ways are at most 8.3 % longer than straight ones.
    const double straight = (c.point - Vec2(-6, 0)).norm();
    EXPECT_GE(c.distance_m, straight - 0.1);
    EXPECT_LE(c.distance_m, 1.083 * straight + 0.1);
    EXPECT_NEAR(c.revenue, 3 * c.information_m2 - c.distance_m - 1, 1e-12);
    EXPECT_LE(c.revenue, d.candidates[*d.winner].revenue);
  }
  EXPECT_EQ(d.target, d.candidates[*d.winner].point);
  EXPECT_EQ(d.goal_O.z(), 1.2);
  EXPECT_EQ(Vec2(d.goal_O.head<2>()), d.candidates[*d.winner].viewpoint);
}

TEST(Explorer, TheNearestFrontierIsTheOneToWhichTheWayIsShortest) {
  Hall hall;
  test::fill(hall.map, {1, 1}, {12, 78}, OccupancyMap2D::kUnknown);  // behind it, and nearer
  NearestExplorer explorer(hall.config, 0.1);
  const Decision d = explorer.decide(hall.map, hall.input);
  ASSERT_EQ(d.kind, DecisionKind::kNewTarget);
  for (const Candidate& c : d.candidates) {
    if (c.verdict == Verdict::kKept && c.information_m2 >= hall.config.stop.min_area_m2) {
      EXPECT_GE(c.distance_m, d.candidates[*d.winner].distance_m);
    }
  }
  EXPECT_LT(d.target.x(), -6);
}

TEST(Explorer, DropsATargetThatWasSeenFromAfar) {
  for (const bool reevaluate : {true, false}) {
    Hall hall;
    hall.config.reevaluate = reevaluate;
    RevenueExplorer explorer(hall.config, 0.1, 1);
    const Decision first = explorer.decide(hall.map, hall.input);
    EXPECT_EQ(explorer.decide(hall.map, hall.input).kind, DecisionKind::kKeepTarget);
    test::fill(hall.map, {150, 1}, {170, 78}, OccupancyMap2D::kFree);
    const Decision d = explorer.decide(hall.map, hall.input);
    EXPECT_EQ(d.kind, reevaluate ? DecisionKind::kNewTarget : DecisionKind::kKeepTarget);
    EXPECT_EQ(d.previous_end, reevaluate ? TargetEnd::kSeen : TargetEnd::kNone);
    EXPECT_EQ(d.target == first.target, !reevaluate);
  }
}

TEST(Explorer, UnreachableTargetsAreLeftForAWhile) {
  Hall hall;
  RevenueExplorer explorer(hall.config, 0.1, 1);
  const Decision first = explorer.decide(hall.map, hall.input);
  hall.input.progress = TargetProgress::kUnreachable;
  const Decision second = explorer.decide(hall.map, hall.input);
  ASSERT_EQ(second.kind, DecisionKind::kNewTarget);
  EXPECT_EQ(second.previous_end, TargetEnd::kUnreachable);
  EXPECT_GT((second.target - first.target).norm(), hall.config.blacklist.radius_m);
}

TEST(Explorer, GivesUpAfterTheLastStrikeAndSaysSo) {
  Hall hall;
  hall.config.blacklist.radius_m = 20;  // one place
  RevenueExplorer explorer(hall.config, 0.1, 1);
  EXPECT_EQ(explorer.decide(hall.map, hall.input).kind, DecisionKind::kNewTarget);
  hall.input.progress = TargetProgress::kUnreachable;
  for (int strike = 1; strike < hall.config.blacklist.max_strikes; ++strike) {
    const Decision d = explorer.decide(hall.map, hall.input);
    EXPECT_EQ(d.kind, DecisionKind::kNewTarget);
    EXPECT_EQ(d.source, "forgiving");
  }
  const Decision last = explorer.decide(hall.map, hall.input);
  EXPECT_EQ(last.kind, DecisionKind::kStop);
  EXPECT_EQ(last.stop_reason, StopReason::kNoCandidates);
  for (const Candidate& c : last.candidates) EXPECT_NE(c.verdict, Verdict::kKept);
}

TEST(Explorer, ReachedButStillUnknownIsAStrike) {
  Hall hall;
  RevenueExplorer explorer(hall.config, 0.1, 1);
  (void)explorer.decide(hall.map, hall.input);
  hall.input.progress = TargetProgress::kReached;
  EXPECT_EQ(explorer.decide(hall.map, hall.input).previous_end, TargetEnd::kStillUnknown);
  test::fill(hall.map, {150, 1}, {170, 78}, OccupancyMap2D::kFree);
  EXPECT_EQ(explorer.decide(hall.map, hall.input).previous_end, TargetEnd::kReached);
}

TEST(Explorer, StopsWhenLittleIsLeft) {
  Hall hall;
  test::fill(hall.map, {150, 1}, {198, 78}, OccupancyMap2D::kFree);
  hall.config.filter.min_gain_m2 = 0.2;
  test::fill(hall.map, {150, 40}, {154, 44}, OccupancyMap2D::kUnknown);  // 0.25 m^2
  RevenueExplorer explorer(hall.config, 0.1, 1);
  const Decision d = explorer.decide(hall.map, hall.input);
  EXPECT_EQ(d.kind, DecisionKind::kStop);
  EXPECT_EQ(d.stop_reason, StopReason::kLittleLeft);
  hall.config.stop.min_area_m2 = 0.2;
  EXPECT_EQ(RevenueExplorer(hall.config, 0.1, 1).decide(hall.map, hall.input).kind,
            DecisionKind::kNewTarget);
  test::fill(hall.map, {150, 40}, {154, 44}, OccupancyMap2D::kFree);
  EXPECT_EQ(RevenueExplorer(hall.config, 0.1, 1).decide(hall.map, hall.input).stop_reason,
            StopReason::kNoCandidates);
}

TEST(Explorer, StopsWhenTheRestOfTheAreaIsSmall) {
  Hall hall;
  test::fill(hall.map, {1, 1}, {198, 78}, OccupancyMap2D::kFree);
  const auto decide = [&](double left_fraction) {
    hall.config.stop.left_fraction = left_fraction;
    return RevenueExplorer(hall.config, 0.1, 1).decide(hall.map, hall.input);
  };
  // A crumb of 0.8 m^2 of some 150 m^2 that it can fly to: enough for a target, but not of the
  // whole.
  test::fill(hall.map, {150, 40}, {159, 47}, OccupancyMap2D::kUnknown);
  EXPECT_EQ(decide(0).kind, DecisionKind::kNewTarget);
  EXPECT_EQ(decide(0.004).kind, DecisionKind::kNewTarget);
  const Decision stop = decide(0.007);
  EXPECT_EQ(stop.kind, DecisionKind::kStop);
  EXPECT_EQ(stop.stop_reason, StopReason::kLittleLeft);
  // Where no vehicle fits it is seen to from outside, but it does not keep the exploration going.
  test::fill(hall.map, {149, 39}, {160, 48}, OccupancyMap2D::kOccupied);
  test::fill(hall.map, {150, 40}, {159, 47}, OccupancyMap2D::kUnknown);
  test::fill(hall.map, {149, 42}, {149, 45}, OccupancyMap2D::kFree);
  EXPECT_EQ(decide(1e-6).kind, DecisionKind::kStop);
  // Unless there may be much behind the gap.
  test::fill(hall.map, {150, 30}, {167, 60}, OccupancyMap2D::kOccupied);
  test::fill(hall.map, {151, 31}, {166, 59}, OccupancyMap2D::kUnknown);
  test::fill(hall.map, {150, 43}, {150, 46}, OccupancyMap2D::kFree);
  hall.config.filter.obstacle_distance_m = 0.1;
  EXPECT_EQ(decide(1e-6).kind, DecisionKind::kNewTarget);
  // A pocket that fills the disc of f_I is flown to, whatever its share.
  test::fill(hall.map, {140, 30}, {167, 60}, OccupancyMap2D::kFree);
  test::fill(hall.map, {150, 40}, {167, 57}, OccupancyMap2D::kUnknown);  // 3.24 m^2
  EXPECT_EQ(decide(0.5).kind, DecisionKind::kNewTarget);
}

TEST(Explorer, LeavesNoMoreOfAMazeThanItIsTold) {
  double flown_to_the_end = 0, flown = 0;
  for (std::uint64_t seed = 1; seed <= 6; ++seed) {
    ExplorerConfig config = light();
    config.stop.left_fraction = 0.02;
    const Flight flight = explore(seed, config);
    EXPECT_EQ(flight.last.kind, DecisionKind::kStop);
    EXPECT_GE(flight.known, 1 - config.stop.left_fraction) << "seed " << seed;
    flown += flight.flown_m;
    config.stop.left_fraction = 0;
    flown_to_the_end += explore(seed, config).flown_m;
  }
  EXPECT_LT(flown, flown_to_the_end);
}

TEST(Explorer, StopsForTheBatteryByTheKnownWayHome) {
  Hall hall;
  // A wall with a door at one end between vehicle and home: the way home is far longer than the
  // straight line.
  test::fill(hall.map, {60, 1}, {60, 60}, OccupancyMap2D::kOccupied);
  hall.input.p_OB = {-3, -3.4, 1.5};
  hall.input.home_O = {-5, -3.4, 0};
  const Decision open = RevenueExplorer(hall.config, 0.1, 1).decide(hall.map, hall.input);
  EXPECT_EQ(open.kind, DecisionKind::kNewTarget);
  EXPECT_GT(open.home_distance_m, 10);
  EXPECT_LT(open.home_distance_m, 16);
  // Use up what the balance leaves, but for 0.1 Wh; then that too.
  const double spare = open.energy.left_wh - open.energy.reserve_wh - open.energy.needed_wh;
  for (const double left : {0.1, -0.1}) {
    ConsumptionConfig battery;
    battery.internal_resistance = 0;
    hall.input.energy = ConsumptionModel(battery);
    hall.input.energy.add({0, battery.full_v, 0}, 0, false);
    hall.input.energy.add({3600 * kNanosecondsPerSecond, 10, (spare - left) / 10}, 0, false);
    const Decision d = RevenueExplorer(hall.config, 0.1, 1).decide(hall.map, hall.input);
    EXPECT_EQ(d.kind == DecisionKind::kStop, left < 0);
    EXPECT_EQ(d.stop_reason, left < 0 ? StopReason::kBattery : StopReason::kNone);
  }
}

TEST(Explorer, WaitsWhileItKnowsNothing) {
  const OccupancyMap2D map = test::make_map(100, 100, OccupancyMap2D::kUnknown);
  RevenueExplorer explorer(light(), 0.1, 1);
  EXPECT_EQ(explorer.decide(map, ExplorerInput{}).kind, DecisionKind::kWait);
}

/// A hall with an unknown end, and a chamber beside it that the vehicle is in: what it came through
/// has closed in the map.
struct Pocket : Hall {
  Pocket() {
    test::fill(map, {20, 1}, {60, 78}, OccupancyMap2D::kOccupied);
    test::fill(map, {30, 30}, {50, 50}, OccupancyMap2D::kFree);
    for (int x = 55; x <= 80; ++x) {
      map.flown.push_back(static_cast<std::uint32_t>(map.index({135 - x, 40})));
      map.flown_height_m.push_back(2.0F);
    }
    input.p_OB = {map.centre_of({40, 40}).x(), map.centre_of({40, 40}).y(), 1.5};
  }
};

TEST(Explorer, BelievesThatNothingIsLeftOnlyWhereItReachesWhatItFlew) {
  Pocket pocket;
  RevenueExplorer explorer(pocket.config, 0.1, 1);
  const Decision d = explorer.decide(pocket.map, pocket.input);
  ASSERT_EQ(d.kind, DecisionKind::kGoBack);
  // To the nearest place that it flew through, as high as it was there.
  EXPECT_LT((d.goal_O - Vec3(pocket.map.centre_of({55, 40}).x(), 0.05, 2.0)).norm(), 1e-6);
  EXPECT_EQ(explorer.decide(pocket.map, pocket.input).kind, DecisionKind::kKeepTarget);
  pocket.input.p_OB = d.goal_O;
  pocket.input.progress = TargetProgress::kReached;
  EXPECT_EQ(explorer.decide(pocket.map, pocket.input).kind, DecisionKind::kNewTarget);
}

TEST(Explorer, GivesUpTheWayBackInTheEnd) {
  Pocket pocket;
  RevenueExplorer explorer(pocket.config, 0.1, 1);
  int tries = 0;
  Decision d = explorer.decide(pocket.map, pocket.input);
  for (; d.kind == DecisionKind::kGoBack && tries < 10; ++tries) {
    pocket.input.progress = TargetProgress::kUnreachable;
    d = explorer.decide(pocket.map, pocket.input);
  }
  EXPECT_EQ(tries, 3);
  EXPECT_EQ(d.kind, DecisionKind::kStop);
}

TEST(Explorer, KnowsTheWayThatItFlewSinceTheMapWasMade) {
  Pocket pocket;
  for (int x = 40; x < 55; ++x) {
    pocket.input.flown_since.push_back(static_cast<std::uint32_t>(pocket.map.index({x, 40})));
  }
  const Decision d = RevenueExplorer(pocket.config, 0.1, 1).decide(pocket.map, pocket.input);
  EXPECT_EQ(d.kind, DecisionKind::kNewTarget);
}

TEST(Explorer, FliesAtItsHeightAboveTheGroundOfTheGoal) {
  for (const bool follows : {true, false}) {
    Hall hall;
    hall.config.follow_ground = follows;
    hall.config.flight_height_m = 1.5;
    // A floor 8.5 m below, falling by 2 in 100 along x; none was seen in the first tile.
    hall.map.ground.tile_m = 0.8;
    hall.map.ground.origin = hall.map.origin;
    hall.map.ground.width = 25;
    for (int i = 0; i < 25 * 10; ++i) {
      const double x = hall.map.origin.x() + 0.8 * (i % 25 + 0.5);
      hall.map.ground.heights.push_back(static_cast<float>(-8.5 - 0.02 * x));
    }
    RevenueExplorer explorer(hall.config, 0.1, 1);
    const Decision d = explorer.decide(hall.map, hall.input);
    ASSERT_EQ(d.kind, DecisionKind::kNewTarget);
    const double floor = -8.5 - 0.02 * d.goal_O.x();
    EXPECT_NEAR(d.goal_O.z(), follows ? floor + 1.5 : 1.5, 0.02 * 0.4 + 1e-6);
  }
}

TEST(Explorer, CaseCActsWhereDirectionAwareUnlessToldOtherwise) {
  for (const auto& [aware, case_c, acts] : {std::tuple{true, CaseC::kDirected, true},
                                            {false, CaseC::kDirected, false},
                                            {false, CaseC::kAlways, true},
                                            {true, CaseC::kNever, false}}) {
    // Free in the middle, unknown at both ends; the first two targets go east.
    Hall hall;
    hall.config.revenue.direction_aware = aware;
    hall.config.filter.case_c = case_c;
    test::fill(hall.map, {1, 1}, {20, 78}, OccupancyMap2D::kUnknown);
    hall.input.p_OB = {4, 0, 1.5};
    RevenueExplorer explorer(hall.config, 0.1, 1);
    (void)explorer.decide(hall.map, hall.input);
    test::fill(hall.map, {150, 1}, {170, 78}, OccupancyMap2D::kFree);
    hall.input.p_OB = {6, 0, 1.5};
    (void)explorer.decide(hall.map, hall.input);
    test::fill(hall.map, {170, 1}, {185, 78}, OccupancyMap2D::kFree);
    hall.input.p_OB = {-7, 0, 1.5};  // carried back: the west is near now
    const Decision d = explorer.decide(hall.map, hall.input);
    ASSERT_EQ(d.kind, DecisionKind::kNewTarget);
    EXPECT_EQ(d.target.x() > 0, aware || acts);
    int off = 0;
    for (const Candidate& c : d.candidates) off += c.verdict == Verdict::kOffDirection;
    EXPECT_EQ(off > 0, acts);
  }
}

}  // namespace
}  // namespace arex
