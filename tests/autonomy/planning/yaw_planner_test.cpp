#include "planning/yaw_planner.h"

#include <gtest/gtest.h>

#include <numbers>

#include "math/so3.h"

namespace arex {
namespace {

constexpr double kStep = 0.01;

TEST(YawPlanner, TurnsWithinItsLimitsAndStopsOnTheMark) {
  const YawConfig config;
  const YawPlanner planner(config);
  for (const double wanted : {0.3, 1.5, -2.9, 3.1}) {
    Heading heading{-1.0, 0.0};
    double overshoot = 0;
    const double side = so3::wrap(wanted - heading.yaw_rad) > 0 ? 1 : -1;
    for (int i = 0; i < 600; ++i) {
      const Heading next = planner.step(heading, wanted, kStep);
      EXPECT_LE(std::abs(next.rate_radps), config.max_rate_radps + 1e-12);
      EXPECT_LE(std::abs(next.rate_radps - heading.rate_radps),
                config.max_acceleration_radps2 * kStep + 1e-9);
      heading = next;
      const double error = so3::wrap(wanted - heading.yaw_rad);
      if (std::abs(error) < 1) overshoot = std::max(overshoot, -side * error);
    }
    EXPECT_NEAR(so3::wrap(wanted - heading.yaw_rad), 0.0, 1e-3);
    EXPECT_LT(overshoot, 0.02);
  }
}

TEST(YawPlanner, LooksAlongThePathAndKeepsItsHeadingAtTheEnd) {
  const YawPlanner planner((YawConfig()));
  std::vector<Vec3> q;
  for (int i = 0; i < 20; ++i) q.push_back({0.2 * i, 0.2 * i, 1.0});
  const UniformBspline s(q, 0.2);
  EXPECT_NEAR(planner.wanted(s, 0.5, 2.0), std::numbers::pi / 4, 1e-9);
  EXPECT_EQ(planner.wanted(s, s.duration_s(), 2.0), 2.0);
  EXPECT_EQ(planner.wanted(UniformBspline(), 0, 1.2), 1.2);
}

TEST(YawPlanner, TurnTimeIsEnough) {
  const YawConfig config;
  const YawPlanner planner(config);
  for (const double wanted : {0.2, 1.0, 2.0, 3.0}) {
    Heading heading;
    for (double t = 0; t < planner.turn_time_s(0.0, wanted); t += kStep) {
      heading = planner.step(heading, wanted, kStep);
    }
    EXPECT_LE(std::abs(so3::wrap(wanted - heading.yaw_rad)), config.max_offset_rad + 0.02);
  }
}

}  // namespace
}  // namespace arex
