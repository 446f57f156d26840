#include "stack/navigator.h"

#include <gtest/gtest.h>

#include "math/so3.h"

namespace arex {
namespace {

constexpr Stamp kPeriod = kNanosecondsPerSecond / 100;

/// A vehicle that is where it should be, in a grid of free cells that rolls with it.
class Air {
 public:
  explicit Air(const PlanningConfig& planning)
      : navigator_(planning, 0.15, jobs_, 1), local_({}, planning.inflation_m, 0.1) {
    local_.bar_outside(planning.floor_m, planning.ceiling_m);
    odometry_.status = OdometryStatus::kOk;
    odometry_.X_OB.p = {0, 0, 1.5};
    TrajectorySetpoint here;
    here.p_OB = odometry_.X_OB.p;
    navigator_.take_over(here, now_);
  }
  void fly_to(const Vec3& goal_O) {
    navigator_.fly_to({MotionRequest::Kind::kGoTo, goal_O}, odometry_, nullptr, now_);
  }
  /// Until it has arrived or failed. @return seconds
  double run(double seconds, bool with_grid = true) {
    const Stamp begin = now_, end = now_ + from_seconds(seconds);
    while (now_ < end && navigator_.progress() == MotionProgress::kUnderWay) {
      now_ += kPeriod;
      odometry_.stamp = now_;
      if (with_grid && now_ % (10 * kPeriod) == 0) {
        local_.recentre(odometry_.X_OB.p);
        grid_ = local_.snapshot();
      }
      jobs_.advance(now_);
      const TrajectorySetpoint next = navigator_.update(grid_, nullptr, odometry_, now_);
      odometry_.X_OB = {so3::from_yaw(next.yaw_rad), next.p_OB};
      odometry_.v_OB = next.v_OB;
      highest_ = std::max(highest_, next.p_OB.z());
    }
    return to_seconds(now_ - begin);
  }

  JobQueue jobs_{1};
  Navigator navigator_;
  LocalGrid local_;
  std::shared_ptr<const GridSnapshot> grid_;
  Odometry odometry_;
  Stamp now_ = kPeriod;
  double highest_ = 0;
};

PlanningConfig below(double ceiling_m) {
  PlanningConfig planning;
  planning.ceiling_m = ceiling_m;
  planning.local.stop_in_known_space = false;  // nothing is known of an empty grid
  return planning;
}

TEST(Navigator, RefusesGoalsAboveTheCeilingAndBelowTheFloor) {
  PlanningConfig planning = below(3);
  planning.floor_m = 0.5;
  Air air(planning);
  air.fly_to({4, 0, 3.2});
  EXPECT_LT(air.run(10), 0.1);
  EXPECT_EQ(air.navigator_.progress(), MotionProgress::kFailed);
  EXPECT_EQ(air.navigator_.cause(), "goal_above_ceiling");
  air.fly_to({4, 0, 0.3});
  EXPECT_LT(air.run(10), 0.1);
  EXPECT_EQ(air.navigator_.cause(), "goal_below_floor");
  air.fly_to({4, 0, 2.8});
  air.run(30);
  EXPECT_EQ(air.navigator_.progress(), MotionProgress::kArrived);
  EXPECT_LE(air.highest_, 3.0 + 1e-9);
}

TEST(Navigator, ReachesAGoalFarAboveTheLocalGrid) {
  Air air(below(20));
  air.fly_to({3, 0, 9});
  air.run(60);
  EXPECT_EQ(air.navigator_.progress(), MotionProgress::kArrived) << air.navigator_.cause();
  EXPECT_NEAR(air.odometry_.X_OB.p.z(), 9, 0.3);
}

TEST(Navigator, WithoutAMapItGivesUpInsteadOfHoveringForEver) {
  Air air(below(20));
  air.fly_to({3, 0, 1.5});
  EXPECT_LT(air.run(100, false), 30);
  EXPECT_EQ(air.navigator_.progress(), MotionProgress::kFailed);
  EXPECT_EQ(air.navigator_.cause(), "no_progress");
}

}  // namespace
}  // namespace arex
