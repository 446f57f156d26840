#include "planning/bspline_planner.h"

#include <gtest/gtest.h>

#include <numbers>

#include "autonomy/planning/test_grid.h"
#include "planning/curve_check.h"
#include "planning/free_space.h"
#include "planning/stopping.h"
#include "support/pillar_field.h"
#include "support/unavoidable.h"

namespace arex {
namespace {

constexpr double kTolerance = 1.05;  // the requirement on norms

struct Setting {
  int pillars;
  double inflation_m;
  double cruise_mps;
};

/// Everything that must hold of an accepted trajectory; sampled every 1 ms to its very end.
void expect_sound(const GridView& grid, const PlanRequest& request, const PlanResult& result,
                  const LocalPlannerConfig& config) {
  const UniformBspline& s = result.trajectory;
  EXPECT_LT((s.position(0) - request.start.p).norm(), 1e-9);
  EXPECT_LT((s.velocity(0) - request.start.v).norm(), 1e-9);
  EXPECT_LT((s.acceleration(0) - request.start.a).norm(), 1e-8);
  EXPECT_LT((s.position(s.duration_s()) - result.goal).norm(), 1e-9);
  EXPECT_LT(s.velocity(s.duration_s()).norm(), 1e-9);
  constexpr double h = 1e-3;
  const int n = static_cast<int>(s.duration_s() / h) + 1;
  MotionState before = s.state(0);
  for (int i = 1; i <= n; ++i) {
    const MotionState here = s.state(i * h);
    ASSERT_FALSE(grid.inflated(here.p)) << "at " << i * h << " s";
    ASSERT_LE(here.v.norm(), kTolerance * config.max_speed_mps);
    ASSERT_LE(here.a.norm(), kTolerance * config.max_acceleration_mps2);
    if (i * h < s.duration_s()) {  // derivatives: trapezoids between the samples
      ASSERT_LT((here.p - before.p - 0.5 * h * (here.v + before.v)).norm(), 1e-6);
      ASSERT_LT((here.v - before.v - 0.5 * h * (here.a + before.a)).norm(), 1e-5);
    }
    before = here;
  }
}

class PillarFields : public testing::TestWithParam<Setting> {};

TEST_P(PillarFields, ManyPlansAreSoundAndNearlyAllSucceed) {
  constexpr int kCases = 250;  // times five settings
  const Setting setting = GetParam();
  const LocalPlannerConfig config;
  BsplinePlanner planner(config);
  GridAstar oracle;
  support::PillarFieldOptions options;
  options.pillars = setting.pillars;
  options.inflation_m = setting.inflation_m;
  int solvable = 0, solved = 0;
  for (std::uint64_t i = 0; i < kCases; ++i) {
    const support::PillarField field(options, 42, i);
    const GridView grid = field.view();
    const auto drawn = support::draw_case(grid, RandomStream(42, "test_case").fork(i), 7.5);
    if (!drawn.valid) continue;
    const Vec3 ahead = (drawn.goal - drawn.start).normalized();
    PlanRequest request{{drawn.start, setting.cruise_mps * ahead, Vec3::Zero()}, drawn.goal};
    request.seed = i;
    AstarOptions complete;
    complete.max_expansions = 1 << 30;
    complete.cut_corners = true;
    if (oracle.search(grid, grid.cell_of(drawn.start), grid.cell_of(drawn.goal), complete).status !=
        AstarStatus::kFound) {
      continue;
    }
    const PlanResult result = planner.plan(grid, request);
    if (!result.ok()) {  // it does not count against the planner that nobody can brake in time
      solvable += !support::is_collision_unavoidable(grid, request.start.p, request.start.v,
                                                     kTolerance * config.max_acceleration_mps2);
      continue;
    }
    ++solvable;
    ++solved;
    expect_sound(grid, request, result, config);
    if (HasFatalFailure()) return;
  }
  EXPECT_GT(solvable, kCases / 2);
  const double share = setting.cruise_mps > 0 ? 0.97 : 0.99;
  EXPECT_GE(solved, share * solvable - 1e-9) << solved << " of " << solvable;
}

INSTANTIATE_TEST_SUITE_P(Densities, PillarFields,
                         testing::Values(Setting{90, 0.3, 0.0}, Setting{180, 0.5, 0.0},
                                         Setting{180, 0.3, 1.5}, Setting{90, 0.5, 1.5},
                                         Setting{180, 0.5, 1.5}));

TEST(BsplinePlanner, GrazesTheInflationOfWhatItCannotAvoidAnyMore) {
  RandomStream random(3, "graze");
  BsplinePlanner planner((LocalPlannerConfig()));
  const LocalPlannerConfig& config = planner.config();
  int grazed = 0;
  for (int i = 0; i < 20; ++i) {
    // Seen a moment ago: the inflation begins 0.25 m ahead of 1.7 m/s, which need 0.48 m to stop.
    test::TestGrid grid(120, 80, 20);
    const int side = random.uniform(0, 1) < 0.5 ? 1 : -1, aside = 3 + i % 2;
    const Eigen::Vector3i pillar(18, 40 + side * aside, 0);
    grid.add_obstacle(pillar, pillar + Eigen::Vector3i(0, 0, 19), 5);
    PlanRequest request{{{1.05, 4.05, 1.0}, {1.7, 0, 0}, Vec3::Zero()}, {8.5, 4.0, 1.0}};
    ASSERT_FALSE(grid.view().inflated(request.start.p));
    EXPECT_FALSE(planner.plan(grid.view(), request).ok());
    request.may_graze = true;
    const PlanResult result = planner.plan(grid.view(), request);
    if (!result.ok()) continue;
    ++grazed;
    EXPECT_TRUE(result.diagnostics.start_inflated);
    const UniformBspline& s = result.trajectory;
    EXPECT_LT((s.velocity(0) - request.start.v).norm(), 1e-9);
    for (double t = 0; t < s.duration_s(); t += 1e-3) {
      ASSERT_GE(clearance(grid.view(), s.position(t), 1.0), config.vehicle_radius_m - 1e-9) << t;
      ASSERT_LE(s.acceleration(t).norm(), kTolerance * config.max_acceleration_mps2);
    }
  }
  EXPECT_GE(grazed, 18);
}

TEST(BsplinePlanner, LeavesAndReachesPlacesOnTheFaceOfABlockedCell) {
  test::TestGrid grid(120, 80, 20);
  grid.mark({20, 30, 0}, {39, 50, 19}, GridView::kInflated);  // up to x = 4
  grid.mark({80, 30, 0}, {90, 50, 19}, GridView::kInflated);  // from x = 8
  BsplinePlanner planner((LocalPlannerConfig()));
  const double inside = std::nextafter(8.0, 0.0);
  PlanRequest request{{{4.0, 4.0, 1.0}, Vec3::Zero(), Vec3::Zero()}, {inside, 4.0, 1.0}};
  const PlanResult result = planner.plan(grid.view(), request);
  ASSERT_TRUE(result.ok()) << to_string(result.status);
  EXPECT_EQ(result.goal, request.goal);
  for (double t = 0; t < result.trajectory.duration_s(); t += 1e-3) {
    const double x = result.trajectory.position(t).x();
    ASSERT_GE(x, 4.0 - 2 * kGrazeLength_m);
    ASSERT_LE(x, 8.0 + 2 * kGrazeLength_m);
  }
}

TEST(BsplinePlanner, SameInputGivesTheSameBits) {
  support::PillarFieldOptions options;
  options.pillars = 180;
  options.inflation_m = 0.5;
  BsplinePlanner planner((LocalPlannerConfig())), other((LocalPlannerConfig()));
  int compared = 0;
  for (std::uint64_t i = 0; i < 30; ++i) {
    const support::PillarField field(options, 9, i);
    const auto drawn = support::draw_case(field.view(), RandomStream(9, "case").fork(i), 7.5);
    if (!drawn.valid) continue;
    PlanRequest request{{drawn.start, Vec3::Zero(), Vec3::Zero()}, drawn.goal};
    const PlanResult a = planner.plan(field.view(), request);
    const PlanResult b = other.plan(field.view(), request);  // another history
    const PlanResult c = planner.plan(field.view(), request);
    ASSERT_EQ(a.status, b.status);
    if (!a.ok()) continue;
    ++compared;
    EXPECT_EQ(a.trajectory.control_points(), b.trajectory.control_points());
    EXPECT_EQ(a.trajectory.control_points(), c.trajectory.control_points());
    EXPECT_EQ(a.trajectory.knot_span_s(), c.trajectory.knot_span_s());
  }
  EXPECT_GT(compared, 20);
}

TEST(BsplinePlanner, NamesWhyItFails) {
  test::TestGrid grid(100, 100, 20);
  grid.add_obstacle({20, 20, 0}, {24, 24, 19}, 4);
  BsplinePlanner planner((LocalPlannerConfig()));
  PlanRequest request{{{1.85, 1.85, 1.0}, Vec3::Zero(), Vec3::Zero()}, {8.0, 8.0, 1.0}};
  EXPECT_EQ(planner.plan(grid.view(), request).status, PlanStatus::kStartInInflation);

  request.start.p = {1.0, 8.0, 1.0};
  request.goal = {2.25, 2.25, 1.0};
  const PlanResult shifted = planner.plan(grid.view(), request);
  ASSERT_TRUE(shifted.ok());
  EXPECT_TRUE(shifted.diagnostics.goal_shifted);
  EXPECT_FALSE(grid.view().inflated(shifted.goal));
  expect_sound(grid.view(), request, shifted, planner.config());

  test::TestGrid walled(100, 100, 20);
  walled.mark({50, 0, 0}, {52, 99, 19}, GridView::kInflated);
  request.start.p = {1.0, 5.0, 1.0};
  request.goal = {9.0, 5.0, 1.0};
  EXPECT_EQ(planner.plan(walled.view(), request).status, PlanStatus::kNoPath);

  test::TestGrid block(100, 100, 20);
  block.mark({40, 0, 0}, {99, 99, 19}, GridView::kInflated);
  EXPECT_EQ(planner.plan(block.view(), request).status, PlanStatus::kGoalInInflation);
}

TEST(BsplinePlanner, ClimbsOverALowWall) {
  test::TestGrid grid(100, 60, 30);
  grid.add_obstacle({50, 0, 0}, {51, 59, 10}, 4);
  BsplinePlanner planner((LocalPlannerConfig()));
  const PlanRequest request{{{1.0, 3.0, 0.8}, Vec3::Zero(), Vec3::Zero()}, {9.0, 3.0, 0.8}};
  const PlanResult result = planner.plan(grid.view(), request);
  ASSERT_TRUE(result.ok()) << to_string(result.status);
  expect_sound(grid.view(), request, result, planner.config());
}

TEST(BsplinePlanner, ReplansAlongThePreviousTrajectoryWithoutAJump) {
  test::TestGrid grid(150, 80, 20);
  BsplinePlanner planner((LocalPlannerConfig()));
  PlanRequest request{{{1.0, 4.0, 1.0}, Vec3::Zero(), Vec3::Zero()}, {8.0, 4.0, 1.0}};
  const PlanResult first = planner.plan(grid.view(), request);
  ASSERT_TRUE(first.ok());
  grid.add_obstacle({70, 36, 0}, {73, 42, 19}, 5);  // seen on the way
  PlanRequest replan{first.trajectory.state(1.5), {10.0, 4.2, 1.0}, &first.trajectory, 1.5};
  const PlanResult second = planner.plan(grid.view(), replan);
  ASSERT_TRUE(second.ok());
  EXPECT_EQ(second.diagnostics.stage, PlanStage::kPrevious);
  expect_sound(grid.view(), replan, second, planner.config());
}

TEST(BsplinePlanner, EscapesFromTheInflationTowardsClearance) {
  test::TestGrid grid(60, 60, 20);
  grid.add_obstacle({30, 30, 0}, {32, 32, 19}, 6);
  BsplinePlanner planner((LocalPlannerConfig()));
  const MotionState start{{2.65, 3.1, 1.0}, Vec3::Zero(), Vec3::Zero()};
  ASSERT_TRUE(grid.view().inflated(start.p));
  const PlanResult escape = planner.plan_escape(grid.view(), start);
  ASSERT_TRUE(escape.ok());
  EXPECT_EQ(escape.diagnostics.stage, PlanStage::kEscape);
  EXPECT_FALSE(grid.view().inflated(escape.goal));
  double nearest = 1e9;
  for (double t = 0; t <= escape.trajectory.duration_s(); t += 0.01) {
    const Vec3 p = escape.trajectory.position(t);
    nearest = std::min(nearest, 3.0 - p.x());  // distance to the obstacle's face
    EXPECT_LE(escape.trajectory.velocity(t).norm(), 1.05 * planner.config().escape_speed_mps);
  }
  EXPECT_GT(nearest, 0.3);
}

TEST(BsplinePlanner, CanAlwaysStopBeforeTheUnknown) {
  LocalPlannerConfig config;
  config.unknown_speed_mps = 0;
  BsplinePlanner planner(config);
  for (const double speed : {0.0, 1.5}) {
    test::TestGrid grid(120, 60, 20);
    grid.forget({50, 0, 0}, {119, 59, 19});
    const PlanRequest request{{{1.0, 3.0, 1.0}, {speed, 0, 0}, Vec3::Zero()}, {9.0, 3.0, 1.0}};
    const PlanResult result = planner.plan(grid.view(), request);
    ASSERT_TRUE(result.ok());
    EXPECT_TRUE(result.diagnostics.slowed);
    for (double t = 0; t < result.trajectory.duration_s(); t += 0.01) {
      const MotionState here = result.trajectory.state(t);
      const double known = 5.0 - here.p.x();
      if (known < 0.02) break;
      EXPECT_LE(stopping_distance(here.v.norm(), config.max_acceleration_mps2, 0.0), known + 0.02);
    }
  }
}

}  // namespace
}  // namespace arex
