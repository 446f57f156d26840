#include "exploration/exploration_bounds.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "config/config.h"
#include "math/random.h"

namespace arex {
namespace {

ExplorationBounds read(const std::string& text) {
  ExplorationBounds bounds;
  read_config(parse_yaml(text, "bounds.yaml"), bounds);
  return bounds;
}

std::string refusal(const std::string& text) {
  try {
    static_cast<void>(read(text));
  } catch (const ConfigError& error) {
    return error.what();
  }
  return "";
}

/// A star around the origin: simple by construction, mostly not convex, partly outside the box.
ExplorationBounds random_star(RandomStream& random) {
  ExplorationBounds bounds{{-5, -4}, {6, 5}, {}};
  const int corners = 3 + static_cast<int>(random.uniform(0, 12));
  for (int i = 0; i < corners; ++i) {
    const double angle = 2 * std::numbers::pi * (i + random.uniform(0.1, 0.9)) / corners;
    bounds.polygon_m.push_back(random.uniform(1, 9) * Vec2(std::cos(angle), std::sin(angle)));
  }
  return bounds;
}

TEST(ExplorationBounds, AreaAndExtentAreThoseOfThePointsThatItContains) {
  RandomStream random(1, "test/bounds");
  for (int round = 0; round < 20; ++round) {
    const ExplorationBounds bounds = random_star(random);
    ASSERT_TRUE(bounds.is_simple());
    constexpr double kStep = 0.05;
    double area = 0;
    Eigen::AlignedBox2d extent;
    for (double y = -10 + kStep / 2; y < 10; y += kStep) {
      for (double x = -10 + kStep / 2; x < 10; x += kStep) {
        if (!bounds.contains({x, y})) continue;
        area += kStep * kStep;
        extent.extend(Vec2(x, y));
      }
    }
    // A cell more or less along the rim, which is shorter than 100 m.
    EXPECT_NEAR(bounds.area_m2(), area, 0.02 * 100 * kStep + 0.01 * area) << round;
    // A tip is missed by as much as it is thin.
    EXPECT_TRUE(bounds.extent().contains(extent)) << round;
    EXPECT_LT((bounds.extent().sizes() - extent.sizes()).maxCoeff(), 1.5) << round;
  }
}

TEST(ExplorationBounds, IsNearWhatLiesWithinTheMarginOfAnythingInside) {
  RandomStream random(2, "test/bounds");
  for (int round = 0; round < 10; ++round) {
    ExplorationBounds bounds = random_star(random);
    bounds.low_m = {-20, -20};
    bounds.high_m = {20, 20};
    for (int i = 0; i < 200; ++i) {
      const Vec2 p(random.uniform(-12, 12), random.uniform(-12, 12));
      bool found = bounds.contains(p);
      constexpr double kMargin = 0.7;
      for (double angle = 0; angle < 6.3; angle += 0.01) {
        found = found || bounds.contains(p + kMargin * Vec2(std::cos(angle), std::sin(angle)));
      }
      if (found) {
        EXPECT_TRUE(bounds.is_near(p, kMargin + 1e-9)) << p.transpose();
      } else {
        EXPECT_FALSE(bounds.is_near(p, kMargin - 0.15)) << p.transpose();
      }
    }
  }
}

TEST(ExplorationBounds, WithoutAPolygonAreTheBox) {
  const ExplorationBounds bounds{{-2, 1}, {3, 4}, {}};
  EXPECT_EQ(bounds.area_m2(), 15);
  EXPECT_TRUE(bounds.contains({-2, 4}));
  EXPECT_FALSE(bounds.contains({-2.001, 4}));
  EXPECT_EQ(bounds.extent().min(), Vec2(-2, 1));
  EXPECT_EQ(bounds.extent().max(), Vec2(3, 4));
}

TEST(ExplorationBounds, RefusesAPolygonThatEnclosesNothingOrTwice) {
  EXPECT_EQ(refusal("polygon_m: [[0, 0], [10, 0], [10, 5], [0, 5]]"), "");
  EXPECT_EQ(refusal("polygon_m: [[0, 0], [5, 0], [10, 0], [10, 5], [0, 5]]"), "");  // straight on
  for (const char* crossing : {"[[0, 0], [10, 10], [10, 0], [0, 10]]",              // a bow tie
                               "[[0, 0], [10, 0], [5, 0], [5, 5]]",   // leads back over itself
                               "[[0, 0], [10, 0], [10, 0], [5, 5]]",  // a corner twice
                               "[[0, 0], [5, 0], [10, 0]]",           // a line
                               "[[0, 0], [10, 0], [10, 10], [5, 0], [0, 10]]"}) {  // touches itself
    EXPECT_NE(refusal(std::string("polygon_m: ") + crossing).find("bounds.yaml:1: "),
              std::string::npos)
        << crossing;
  }
  EXPECT_NE(refusal("polygon_m: [[0, 0], [1, 1]]").find("3 to 1000 corners"), std::string::npos);
  EXPECT_NE(refusal("low_m: [0, 0]\nhigh_m: [5, 5]\npolygon_m: [[6, 6], [9, 6], [9, 9]]")
                .find("bounds.yaml:3: "),
            std::string::npos);
  EXPECT_NE(refusal("low_m: [0, 0]\nhigh_m: [-5, 5]").find("low_m < high_m"), std::string::npos);
}

}  // namespace
}  // namespace arex
