#include "exploration/revenue.h"

#include <gtest/gtest.h>

#include "autonomy/exploration/test_map.h"
#include "config/config.h"
#include "exploration/explorer.h"
#include "exploration/explorer_config.h"
#include "exploration/frontier_search.h"

namespace arex {
namespace {

TargetHistory history(const Vec2& before_last, const Vec2& last) {
  TargetHistory h;
  h.push(before_last);
  h.push(last);
  return h;
}

TEST(Revenue, AngleIsBetweenTheLastLegAndTheNext) {
  const TargetHistory east = history({0, 0}, {2, 0});
  EXPECT_NEAR(*direction_angle(east, {5, 0}), 0, 1e-12);
  EXPECT_NEAR(*direction_angle(east, {3, 1}), M_PI / 4, 1e-12);
  EXPECT_NEAR(*direction_angle(east, {3, -1}), M_PI / 4, 1e-12);  // no side is preferred
  EXPECT_NEAR(*direction_angle(east, {2, 7}), M_PI / 2, 1e-12);
  EXPECT_NEAR(*direction_angle(east, {0, 0}), M_PI, 1e-12);
  RandomStream random(1, "angle");
  for (int i = 0; i < 200; ++i) {
    const double turn = random.uniform(-M_PI, M_PI), heading = random.uniform(-M_PI, M_PI);
    const Vec2 a(random.uniform(-5, 5), random.uniform(-5, 5));
    const auto ahead = [](double angle) { return Vec2(std::cos(angle), std::sin(angle)); };
    const Vec2 b = a + random.uniform(0.1, 20) * ahead(heading);
    const Vec2 c = b + random.uniform(0.1, 20) * ahead(heading + turn);
    EXPECT_NEAR(*direction_angle(history(a, b), c), std::abs(turn), 1e-9);
  }
}

TEST(Revenue, TheFirstTwoTargetsHaveNoAngle) {
  TargetHistory h;
  EXPECT_FALSE(direction_angle(h, {1, 1}));
  h.push({0, 0});
  EXPECT_FALSE(direction_angle(h, {1, 1}));
  h.push({1, 0});
  EXPECT_TRUE(direction_angle(h, {1, 1}));
  EXPECT_FALSE(direction_angle(h, {1, 0}));  // no vector to there
}

TEST(Revenue, IsThePapersFormula) {
  RevenueConfig config;
  config.weight_information = 2.5;
  config.weight_distance = 0.4;
  config.weight_direction = 0.7;
  Candidate c;
  c.information_m2 = 1.2;
  c.distance_m = 5;
  c.angle_rad = 1.1;
  evaluate_revenue(c, config);
  EXPECT_NEAR(c.direction, 2.159766253784915, 1e-12);      // exp(0.77)
  EXPECT_NEAR(c.revenue, 1.0 - 2.159766253784915, 1e-12);  // 2.5 1.2 - 0.4 5 = 1
  c.angle_rad.reset();
  evaluate_revenue(c, config);
  EXPECT_NEAR(c.direction, 1, 1e-12);
  EXPECT_NEAR(c.revenue, 0, 1e-12);
  config.direction_aware = false;
  evaluate_revenue(c, config);
  EXPECT_NEAR(c.revenue, 1, 1e-12);
}

TEST(Revenue, HysteresisRaisesTheGainOfWhatIsNear) {
  RevenueConfig config;
  config.direction_aware = false;
  config.hysteresis_gain = 2;
  Candidate c;
  c.information_m2 = 1.5;
  c.distance_m = 3;
  evaluate_revenue(c, config);
  EXPECT_NEAR(c.revenue, 3 * 2 * 1.5 - 3, 1e-12);
  c.distance_m = 3.1;
  evaluate_revenue(c, config);
  EXPECT_NEAR(c.revenue, 3 * 1.5 - 3.1, 1e-12);
}

TEST(Revenue, DirectionAwarePrefersStraightOn) {
  const TargetHistory east = history({0, 0}, {5, 0});
  std::vector<Candidate> candidates(3);
  candidates[0].point = {1, 0.5};  // back, and the nearest
  candidates[0].distance_m = 4;
  candidates[1].point = {10, 0};  // straight on
  candidates[1].distance_m = 5;
  candidates[2].point = {5, 4.5};  // to the left
  candidates[2].distance_m = 4.5;
  for (const bool aware : {false, true}) {
    RevenueConfig config;
    config.direction_aware = aware;
    for (Candidate& c : candidates) {
      c.information_m2 = 1;
      c.angle_rad = direction_angle(east, c.point);
      evaluate_revenue(c, config);
    }
    EXPECT_EQ(best_candidate(candidates), aware ? 1u : 0u);
    if (aware) {
      EXPECT_EQ(best_undirected(candidates), 0u);
    }
  }
  candidates[1].verdict = Verdict::kNearObstacle;
  EXPECT_EQ(best_candidate(candidates), 2u);
  for (Candidate& c : candidates) c.verdict = Verdict::kBlacklisted;
  EXPECT_FALSE(best_candidate(candidates));
}

TEST(CandidateFilter, DropsNearObstaclesAndLittleGain) {
  OccupancyMap2D map = test::make_map(100, 60, OccupancyMap2D::kFree);
  test::fill(map, {60, 0}, {99, 59}, OccupancyMap2D::kUnknown);
  test::fill(map, {60, 12}, {60, 12}, OccupancyMap2D::kOccupied);
  test::fill(map, {20, 40}, {22, 43}, OccupancyMap2D::kUnknown);  // 12 cells: 0.12 m^2
  const ExplorationSpace space(map, ExplorationBounds{}, {}, map.centre_of({30, 30}));
  std::vector<Candidate> candidates(4);
  candidates[0].point = map.centre_of({60, 30});
  candidates[1].point = map.centre_of({60, 15});  // 0.3 m from the obstacle
  candidates[2].point = map.centre_of({60, 16});  // 0.4 m
  candidates[3].point = map.centre_of({20, 40});
  for (Candidate& c : candidates) c.information_m2 = space.unknown_area(c.point);
  const auto verdicts = [&](const CandidateFilterConfig& config) {
    std::vector<Candidate> copy = candidates;
    apply_map_filters(copy, space, config);
    std::vector<Verdict> out;
    for (const Candidate& c : copy) out.push_back(c.verdict);
    return out;
  };
  CandidateFilterConfig config;
  EXPECT_EQ(verdicts(config), (std::vector{Verdict::kKept, Verdict::kNearObstacle, Verdict::kKept,
                                           Verdict::kLittleGain}));
  config.min_gain_m2 = 0.1;
  config.obstacle_distance_m = 0.2;
  EXPECT_EQ(verdicts(config), std::vector(4, Verdict::kKept));
}

TEST(CandidateFilter, DropsWhatIsOffTheDirectionUnlessNothingWouldBeLeft) {
  CandidateFilterConfig config;
  config.max_angle_rad = 1.0;
  std::vector<Candidate> candidates(3);
  candidates[0].angle_rad = 0.9;
  candidates[1].angle_rad = 1.1;
  candidates[2].angle_rad = 3.0;
  std::vector<Candidate> some = candidates;
  apply_direction_filter(some, config);
  EXPECT_EQ(some[0].verdict, Verdict::kKept);
  EXPECT_EQ(some[1].verdict, Verdict::kOffDirection);
  EXPECT_EQ(some[2].verdict, Verdict::kOffDirection);
  std::vector<Candidate> none = candidates;
  none[0].verdict = Verdict::kNearObstacle;
  apply_direction_filter(none, config);
  EXPECT_EQ(none[1].verdict, Verdict::kKept);
  EXPECT_EQ(none[2].verdict, Verdict::kKept);
}

TEST(Blacklist, ForgivesLaterEachTimeAndFinallyNever) {
  BlacklistConfig config;
  config.radius_m = 0.5;
  config.duration_s = 10;
  config.max_strikes = 3;
  Blacklist list(config);
  const auto at = [](double s) { return from_seconds(s); };
  EXPECT_FALSE(list.bars({1, 1}, at(0)));
  list.strike({1, 1}, at(0));
  EXPECT_TRUE(list.bars({1.3, 1.3}, at(9.9)));
  EXPECT_FALSE(list.bars({1.6, 1}, at(1)));  // elsewhere
  EXPECT_FALSE(list.bars({1, 1}, at(10)));
  list.strike({1.2, 1}, at(20));  // the same place
  EXPECT_TRUE(list.bars({1, 1}, at(39.9)));
  EXPECT_FALSE(list.bars({1, 1}, at(40)));
  EXPECT_FALSE(list.gave_up({1, 1}));
  list.strike({1, 1}, at(50));
  EXPECT_TRUE(list.gave_up({1, 1}));
  EXPECT_TRUE(list.bars({1, 1}, at(1e6)));
  EXPECT_FALSE(list.gave_up({3, 3}));
}

TEST(ViewpointFinder, IsReachableClearAndSeesThePoint) {
  int found = 0, clear = 0;
  for (std::uint64_t seed = 1; seed <= 4; ++seed) {
    RandomStream random(seed, "view");
    const OccupancyMap2D truth = test::maze(4, 3, 40, 16, random);
    const Vec2 robot = test::maze_start(truth, 4, 3, 40);
    OccupancyMap2D map = test::unknown_like(truth);
    test::reveal(truth, robot, 6, map);
    const ExplorationSpace space(map, ExplorationBounds{}, {}, robot);
    const ViewpointConfig config;
    const ViewpointFinder finder(config, map.resolution);
    for (const Frontier& frontier : find_frontiers(space)) {
      for (const FrontierPoint& p : frontier.points) {
        const auto view = finder.find(space, p.point, p.seen_from);
        ASSERT_TRUE(view);
        ++found;
        const Eigen::Vector2i cell = map.cell_of(*view);
        EXPECT_TRUE(space.is_reachable(cell));
        EXPECT_TRUE(space.sees(*view, map.cell_of(p.point)));
        EXPECT_GE(space.clearance(cell), 0.5);
        clear += space.clearance(cell) >= config.clearance_m &&
                 (*view - p.point).norm() >= config.standoff_m - 1e-9;
      }
    }
  }
  EXPECT_GT(found, 8);
  EXPECT_GE(clear, found * 3 / 4);
}

TEST(ViewpointFinder, TakesTheNearestAtTheStandoff) {
  OccupancyMap2D map = test::make_map(100, 60, OccupancyMap2D::kFree);
  test::fill(map, {60, 0}, {99, 59}, OccupancyMap2D::kUnknown);
  const Vec2 robot = map.centre_of({10, 30}), point = map.centre_of({60, 30});
  const ExplorationSpace space(map, ExplorationBounds{}, {}, robot);
  const auto view = ViewpointFinder({}, 0.1).find(space, point, robot);
  ASSERT_TRUE(view);
  EXPECT_NEAR((*view - point).norm(), 0.6, 1e-9);
}

TEST(ConsumptionModel, LearnsPowerBySpeedAndCountsEnergy) {
  ConsumptionConfig config;
  config.internal_resistance = 0.05;
  ConsumptionModel model(config);
  EXPECT_NEAR(model.power_w(0), config.prior_power_w, 1e-9);
  EXPECT_NEAR(model.power_w(1.7), config.prior_power_w, 1e-9);
  // 15 V, 20 A and 0.05 ohm: 320 W slow; 24 A: 388.8 W fast. 0.1 s apart, 1000 s each.
  for (int i = 0; i <= 20000; ++i) {
    const bool fast = i > 10000;
    model.add({i * kNanosecondsPerSecond / 10, 15.0, fast ? 24.0 : 20.0}, fast ? 1.3 : 0.2, true);
  }
  EXPECT_NEAR(model.used_wh(), (320.0 * 1000 + 388.8 * 1000) / 3600, 1e-6);
  EXPECT_NEAR(model.left_wh(), config.capacity_wh * energy_fraction(config, 16.0) - model.used_wh(),
              1e-9);
  // Middles of the classes; the prior (the dearer flight mean) weighs 20 s of 1020 s.
  const double flight = (258.0 * 20 + 320.0 * 1000 + 388.8 * 1000) / 2020;
  EXPECT_NEAR(model.power_w(0.25), (flight * 20 + 320.0 * 1000) / 1020, 1e-6);
  EXPECT_NEAR(model.power_w(1.25), (flight * 20 + 388.8 * 1000) / 1020, 1e-6);
  EXPECT_NEAR(model.power_w(0.75), flight, 1e-6);  // never flown: what flying has cost so far
  EXPECT_NEAR(model.power_w(0.5), (model.power_w(0.25) + model.power_w(0.75)) / 2, 1e-9);
}

TEST(ConsumptionModel, TheFirstReadingTellsHowFullTheBatteryIs) {
  const ConsumptionConfig config;
  const auto rest_v = [&](double charge) {
    const double knee = config.middle_charge;
    return charge < knee
               ? config.empty_v + charge / knee * (config.middle_v - config.empty_v)
               : config.middle_v + (charge - knee) / (1 - knee) * (config.full_v - config.middle_v);
  };
  // The curve's integral, summed.
  constexpr int kSteps = 100'000;
  double all = 0;
  for (int i = 0; i < kSteps; ++i) all += rest_v((i + 0.5) / kSteps);
  double sum = 0;
  for (int i = 0; i < kSteps; ++i) {
    sum += rest_v((i + 0.5) / kSteps);
    if (i % 10'000 != 9'999) continue;
    const double v = rest_v((i + 1.0) / kSteps);
    EXPECT_NEAR(energy_fraction(config, v), sum / all, 1e-6) << v;
    ConsumptionModel model(config);  // under the load of standing on the ground
    model.add({0, v - config.internal_resistance * 2, 2}, 0, false);
    EXPECT_NEAR(model.left_wh(), config.capacity_wh * sum / all, 1e-3);
  }
  EXPECT_EQ(energy_fraction(config, 18), 1);
  EXPECT_EQ(energy_fraction(config, 12), 0);
}

TEST(ConsumptionModel, StandingTeachesNothingAboutFlying) {
  ConsumptionModel model;
  for (int i = 0; i <= 100; ++i) model.add({i * kNanosecondsPerSecond, 16.0, 2.0}, 0, false);
  EXPECT_NEAR(model.power_w(0), ConsumptionConfig{}.prior_power_w, 1e-9);
  EXPECT_NEAR(model.used_wh(), 100 * (32 + 0.028 * 4) / 3600, 1e-9);
}

TEST(StopCriteria, EnergyHomeIsTheClosedForm) {
  ConsumptionConfig battery;
  battery.capacity_wh = 50;
  const ConsumptionModel model(battery);
  StopConfig config;
  const double d = 36;
  const double needed =
      config.energy_margin * 258 * (d / config.return_speed_mps + config.landing_s) / 3600;
  const EnergyBalance balance = balance_energy(model, d, config);
  EXPECT_NEAR(balance.needed_wh, needed, 1e-9);
  EXPECT_NEAR(balance.reserve_wh, 10, 1e-9);
  EXPECT_NEAR(balance.left_wh, 50, 1e-9);
  config.return_home = false;
  EXPECT_NEAR(balance_energy(model, d, config).needed_wh,
              config.energy_margin * 258 * config.landing_s / 3600, 1e-9);
}

TEST(StopCriteria, ComesHomeWithTheReserveWhereverItStops) {
  // Flies out at 1.5 m/s until the balance says stop, then home at the believed mean speed: what is
  // left after landing is at least the reserve, for dearer and cheaper vehicles than the prior.
  for (const double power : {200.0, 258.0, 320.0, 400.0}) {
    ConsumptionConfig battery;
    ConsumptionModel model(battery);
    model.add({0, battery.full_v, 0}, 0, false);
    const StopConfig config;
    double distance = 0;
    Stamp now = 0;
    const auto fly = [&](double seconds, double speed) {
      now += from_seconds(seconds);
      const double voltage = 15, r = battery.internal_resistance;
      const double current = (-voltage + std::sqrt(voltage * voltage + 4 * r * power)) / (2 * r);
      model.add({now, voltage, current}, std::abs(speed), true);
      distance = std::max(0.0, distance + speed * seconds);
    };
    int steps = 0;
    while (!balance_energy(model, distance, config).must_stop() && ++steps < 100000) fly(0.5, 1.5);
    EXPECT_GT(distance, 100);
    EXPECT_FALSE(balance_energy(model, distance, config).out_of_reach());
    while (distance > 0) fly(0.5, -config.return_speed_mps);
    for (double t = 0; t < config.landing_s; t += 0.5) fly(0.5, 0);
    EXPECT_GE(model.left_wh(), config.reserve_fraction * battery.capacity_wh) << power;
    EXPECT_LE(model.left_wh(), 0.4 * battery.capacity_wh) << power;  // and does not give up early
  }
}

TEST(ExplorerConfig, KeysStandWhereOthersRelyOnThem) {
  ExplorerConfig config;
  read_config(parse_yaml("direction_aware: false\nweight_information: 1\nweight_distance: 2\n"
                         "weight_direction: 3\ndistance: euclidean\n"
                         "bounds: {low_m: [-1, -2], polygon_m: [[0, 0], [4, 0], [0, 4]]}\n",
                         "test"),
              config);
  EXPECT_FALSE(config.revenue.direction_aware);
  EXPECT_EQ(config.revenue.weight_information, 1);
  EXPECT_EQ(config.revenue.weight_distance, 2);
  EXPECT_EQ(config.revenue.weight_direction, 3);
  EXPECT_EQ(config.revenue.distance, DistanceKind::kEuclidean);
  EXPECT_EQ(config.bounds.polygon_m.size(), 3u);
  EXPECT_THROW(read_config(parse_yaml("weight_distance: -1\n", "test"), config), ConfigError);
}

}  // namespace
}  // namespace arex
