#include <gtest/gtest.h>

#include <algorithm>

#include "autonomy/semantics/analytic_clouds.h"
#include "semantics/plan_shapes.h"
#include "semantics/semantic_map.h"

namespace arex::test {
namespace {

using std::numbers::pi;

/// A hall with walls, pillars, cars and a ramp that leads up out of it, turned by a yaw. Only what
/// can be seen from inside has points.
class AnalyticGarage {
 public:
  AnalyticGarage(double yaw_rad, const Vec3& shift, std::uint64_t seed)
      : yaw_(yaw_rad), shift_(shift), random_(seed, "analytic_garage") {}

  std::vector<Vec3f> points;

  [[nodiscard]] Vec3 place(const Vec3& p) const {
    const double c = std::cos(yaw_), s = std::sin(yaw_);
    return Vec3(c * p.x() - s * p.y(), s * p.x() + c * p.y(), p.z()) + shift_;
  }
  /// A parallelogram.
  void face(const Vec3& corner, const Vec3& u, const Vec3& v) {
    constexpr double kSpacing = 0.07, kNoise = 0.008;  // m
    const int nu = std::max(1, static_cast<int>(u.norm() / kSpacing));
    const int nv = std::max(1, static_cast<int>(v.norm() / kSpacing));
    for (int i = 0; i < nu; ++i) {
      for (int j = 0; j < nv; ++j) {
        const Vec3 p = corner + (i + random_.uniform()) / nu * u + (j + random_.uniform()) / nv * v;
        points.push_back((place(p) + kNoise * random_.normal3()).cast<float>());
      }
    }
  }
  /// The sides of an upright box, and its top.
  void box(const Vec3& low, const Vec3& high, bool top) {
    const Vec3 d = high - low, x(d.x(), 0, 0), y(0, d.y(), 0), z(0, 0, d.z());
    face(low, x, z);
    face(low, y, z);
    face(low + y, x, z);
    face(low + x, y, z);
    if (top) face(low + z, x, y);
  }

  static constexpr double kHeight = 3.2;

  void build() {
    face({0, 0, 0}, {30, 0, 0}, {0, 18, 0});
    face({0, 0, kHeight}, {30, 0, 0}, {0, 18, 0});
    face({0, 0, 0}, {30, 0, 0}, {0, 0, kHeight});
    face({0, 18, 0}, {30, 0, 0}, {0, 0, kHeight});
    face({0, 0, 0}, {0, 18, 0}, {0, 0, kHeight});
    face({30, 0, 0}, {0, 6, 0}, {0, 0, kHeight});
    face({30, 11, 0}, {0, 7, 0}, {0, 0, kHeight});
    face({30, 6, 0}, {12, 0, 2.4}, {0, 5, 0});  // the ramp, 11 degrees
    face({30, 6, 0}, {12, 0, 2.4}, {0, 0, kHeight});
    face({30, 11, 0}, {12, 0, 2.4}, {0, 0, kHeight});
    for (const double x : {7.5, 15.0, 22.5}) {
      for (const double y : {6.0, 12.0}) {
        box({x - 0.25, y - 0.25, 0}, {x + 0.25, y + 0.25, kHeight}, false);
        pillars.emplace_back(x, y);
      }
    }
    for (int i = 0; i < 5; ++i) {  // a row of cars, 0.6 m between them
      car({2.5 + 2.4 * i, 3.0}, pi / 2);
    }
    car({19, 9}, 0.15);
  }
  /// A body and a cabin.
  void car(const Vec2& middle, double yaw) {
    const AnalyticGarage own(yaw, {middle.x(), middle.y(), 0}, random_.bits());
    AnalyticGarage body = own;
    body.box({-2.2, -0.9, 0.2}, {2.2, 0.9, 0.9}, true);
    body.box({-1.4, -0.75, 0.9}, {0.8, 0.75, 1.45}, true);
    for (const Vec3f& p : body.points) points.push_back(place(p.cast<double>()).cast<float>());
    cars.push_back(middle);
  }

  std::vector<Vec2> pillars, cars;

 private:
  double yaw_;
  Vec3 shift_;
  RandomStream random_;
};

std::vector<const SemanticObject*> all(const SemanticMap& map, SemanticClass kind) {
  std::vector<const SemanticObject*> found;
  for (const SemanticObject& object : map.objects) {
    if (object.kind == kind) found.push_back(&object);
  }
  return found;
}

/// The object of a kind nearest to a place of the hall.
const SemanticObject* nearest(const SemanticMap& map, SemanticClass kind, const Vec2& p_W) {
  const auto found = all(map, kind);
  const auto best = std::min_element(
      found.begin(), found.end(), [&](const SemanticObject* a, const SemanticObject* b) {
        return (a->position.head<2>() - p_W).norm() < (b->position.head<2>() - p_W).norm();
      });
  return best == found.end() ? nullptr : *best;
}

/// All of a hall that is not turned, and no others.
void expect_pillars(const SemanticMap& map, const AnalyticGarage& garage) {
  EXPECT_EQ(map.count(SemanticClass::kPillar), garage.pillars.size());
  for (const Vec2& pillar : garage.pillars) {
    const SemanticObject* found = nearest(map, SemanticClass::kPillar, pillar);
    ASSERT_NE(found, nullptr);
    EXPECT_LT((found->position.head<2>() - pillar).norm(), 0.05) << pillar.transpose();
  }
}

TEST(GarageMap, FindsPillarsCarsWallsAndTheRamp) {
  for (const double yaw : {0.0, 0.4, 1.3}) {
    AnalyticGarage garage(yaw, {12, -7, -8}, 1);
    garage.build();
    const SemanticMap map = build_semantic_map(garage.points, {}, {});
    ASSERT_EQ(map.scene, SceneKind::kGarage) << map.planarity.fraction;
    EXPECT_EQ(map.count(SemanticClass::kPillar), garage.pillars.size()) << yaw;
    for (const Vec2& pillar : garage.pillars) {
      const Vec2 p = garage.place({pillar.x(), pillar.y(), 0}).head<2>();
      const SemanticObject* found = nearest(map, SemanticClass::kPillar, p);
      ASSERT_NE(found, nullptr);
      EXPECT_LT((found->position.head<2>() - p).norm(), 0.03) << yaw;
      EXPECT_NEAR(found->size.x(), 0.5, 0.05);
      EXPECT_NEAR(found->size.y(), 0.5, 0.05);
      EXPECT_NEAR(found->base_z, -8, 0.05);
    }
    EXPECT_EQ(map.count(SemanticClass::kCar), garage.cars.size()) << yaw;
    for (const Vec2& car : garage.cars) {
      const Vec2 p = garage.place({car.x(), car.y(), 0}).head<2>();
      const SemanticObject* found = nearest(map, SemanticClass::kCar, p);
      ASSERT_NE(found, nullptr);
      EXPECT_LT((found->position.head<2>() - p).norm(), 0.08) << yaw;
      EXPECT_NEAR(found->size.x(), 4.4, 0.12);
      EXPECT_NEAR(found->size.y(), 1.8, 0.12);
      EXPECT_NEAR(found->size.z(), 1.45, 0.08);
    }
    const auto ramps = all(map, SemanticClass::kRamp);
    ASSERT_EQ(ramps.size(), 1u) << yaw;
    EXPECT_NEAR(ramps[0]->size.x(), 12, 0.8);
    EXPECT_NEAR(ramps[0]->size.y(), 5, 0.6);
    double length = 0;
    for (const SemanticObject* wall : all(map, SemanticClass::kWall)) {
      EXPECT_GT(wall->confidence, 0.3);
      length += wall->size.x();
    }
    EXPECT_NEAR(length, 30 + 30 + 18 + 6 + 7 + 2 * 12, 6) << yaw;
  }
}

/// A wall's two faces, 0.2 m apart, from pillar to pillar.
void partition(AnalyticGarage& garage, const Vec2& a, const Vec2& b) {
  constexpr double kPillar = 0.25, kHalf = 0.1;  // m
  const Vec2 u = (b - a).normalized(), n(-u.y(), u.x());
  for (const double side : {-kHalf, kHalf}) {
    const Vec2 start = a + kPillar * u + side * n, run = b - a - 2 * kPillar * u;
    garage.face({start.x(), start.y(), 0}, {run.x(), run.y(), 0}, {0, 0, AnalyticGarage::kHeight});
  }
}

TEST(GarageMap, FindsPillarsInWhichWallsMeet) {
  for (const double yaw : {0.0, 0.4}) {
    AnalyticGarage garage(yaw, {12, -7, -8}, 4);
    garage.build();
    // Walls meet at corners, in a T and in a line.
    partition(garage, {7.5, 6}, {15, 6});
    partition(garage, {7.5, 6}, {7.5, 12});
    partition(garage, {7.5, 12}, {15, 12});
    partition(garage, {15, 6}, {15, 12});
    partition(garage, {15, 12}, {22.5, 12});
    const SemanticMap map = build_semantic_map(garage.points, {}, {});
    EXPECT_EQ(map.count(SemanticClass::kPillar), garage.pillars.size()) << yaw;
    for (const Vec2& pillar : garage.pillars) {
      const Vec2 p = garage.place({pillar.x(), pillar.y(), 0}).head<2>();
      const SemanticObject* found = nearest(map, SemanticClass::kPillar, p);
      ASSERT_NE(found, nullptr);
      EXPECT_LT((found->position.head<2>() - p).norm(), 0.05) << yaw << ", " << pillar.transpose();
      EXPECT_NEAR(found->size.x(), 0.5, 0.08) << pillar.transpose();
    }
  }
}

TEST(GarageMap, TakesNoPillarsSideForAWallNorADuctForACeiling) {
  AnalyticGarage garage(0, Vec3::Zero(), 5);
  garage.build();
  // A pipe along the hall, 0.7 m beside each row, in line with nothing but the pillars' sides, and
  // a duct on the other side.
  for (const double y : {6.0, 12.0}) {
    garage.box({0.3, y + 0.95, 2.4}, {29.7, y + 1.05, 2.5}, true);
    garage.face({0.3, y - 1.45, 2.55}, {29.4, 0, 0}, {0, 0.8, 0});
    garage.face({0.3, y - 0.65, 2.55}, {29.4, 0, 0}, {0, 0, 0.3});
  }
  const SemanticMap map = build_semantic_map(garage.points, {}, {});
  expect_pillars(map, garage);
}

TEST(GarageMap, FindsWallsAndPillarsBelowALowCeiling) {
  AnalyticGarage garage(0, Vec3::Zero(), 8);
  garage.build();
  // Ducts side by side above one row, wide as a room: 2.55 m above the floor, where beams below
  // ceilings are looked for.
  garage.face({5, 4.5, 2.55}, {20, 0, 0}, {0, 3.2, 0});
  partition(garage, {7.5, 6}, {15, 6});
  const SemanticMap map = build_semantic_map(garage.points, {}, {});
  expect_pillars(map, garage);
  const SemanticObject* wall = nearest(map, SemanticClass::kWall, {11.25, 6});
  ASSERT_NE(wall, nullptr);
  EXPECT_LT((wall->position.head<2>() - Vec2(11.25, 6)).norm(), 0.3);
  EXPECT_GT(wall->size.x(), 6.5);
}

TEST(GarageMap, TakesNoPieceOfAWallBelowDuctsForAPillar) {
  for (const double height : {2.3, 2.4, 2.5}) {
    AnalyticGarage garage(0, Vec3::Zero(), 9);
    garage.build();
    // Ducts pass through a wall: lines along their undersides are longer than the wall is, and
    // what they leave of it is as short as a pillar is wide.
    partition(garage, {7.5, 12}, {7.5, 18});
    for (const double y : {12.8, 14.6, 16.3}) {
      garage.face({0.3, y, height}, {14, 0, 0}, {0, 1.2, 0});
    }
    const SemanticMap map = build_semantic_map(garage.points, {}, {});
    expect_pillars(map, garage);
    const SemanticObject* wall = nearest(map, SemanticClass::kWall, {7.5, 15});
    ASSERT_NE(wall, nullptr);
    EXPECT_LT((wall->position.head<2>() - Vec2(7.5, 15)).norm(), 0.4) << height;
    EXPECT_GT(wall->size.x(), 5) << height;
  }
}

TEST(GarageMap, TakesNoRowOfCabinetsForACar) {
  AnalyticGarage garage(0.4, {3, 2, 0}, 6);
  garage.build();
  garage.box({10, 17.25, 0}, {13.26, 17.85, 2.0}, true);
  const SemanticMap map = build_semantic_map(garage.points, {}, {});
  EXPECT_EQ(map.count(SemanticClass::kCar), garage.cars.size());
}

TEST(GarageMap, LabelsItsSurfaces) {
  AnalyticGarage garage(0, Vec3::Zero(), 2);
  garage.build();
  const SemanticMap map = build_semantic_map(garage.points, {}, {});
  std::size_t floor = 0, floor_right = 0, ceiling = 0, ceiling_right = 0, wall = 0, wall_right = 0;
  for (std::size_t i = 0; i < garage.points.size(); ++i) {
    const Vec3f& p = garage.points[i];
    if (p.x() < 29 && p.x() > 1 && p.y() > 1 && p.y() < 17) {
      if (std::abs(p.z()) < 0.04F) {
        ++floor;
        floor_right += map.labels[i] == SemanticClass::kFloor;
      }
      if (std::abs(p.z() - 3.2F) < 0.04F) {
        ++ceiling;
        ceiling_right += map.labels[i] == SemanticClass::kCeiling;
      }
    }
    if (std::abs(p.x()) < 0.03F && p.z() > 0.3F && p.z() < 2.9F) {
      ++wall;
      wall_right += map.labels[i] == SemanticClass::kWall;
    }
  }
  EXPECT_GT(static_cast<double>(floor_right), 0.98 * static_cast<double>(floor));
  EXPECT_GT(static_cast<double>(ceiling_right), 0.98 * static_cast<double>(ceiling));
  EXPECT_GT(static_cast<double>(wall_right), 0.98 * static_cast<double>(wall));
}

TEST(GarageMap, ChoosesTheSceneFromTheCloudUnlessItIsNamed) {
  AnalyticGarage garage(0.2, Vec3::Zero(), 3);
  garage.build();
  SemanticConfig config;
  config.scene = SceneKind::kForest;
  EXPECT_EQ(build_semantic_map(garage.points, {}, config).scene, SceneKind::kForest);
  config.scene = SceneKind::kAuto;
  EXPECT_EQ(build_semantic_map(garage.points, {}, config).scene, SceneKind::kGarage);
}

/// A hall of 20 x 16 m with a room behind a wall of 0.2 m along y = 10, seen from both sides. In
/// it from left to right: a shut door set back by 7 cm at x = 4, a doorway at x = 10, both 1.4 m
/// wide and 2.2 m high, and from x = 14 to 16.5 a part whose lower 2 m cabinets hide on both sides.
AnalyticGarage hall_with_doors(double yaw, double drift_m) {
  AnalyticGarage hall(yaw, {3, -2, 1}, 7);
  constexpr double kHeight = AnalyticGarage::kHeight, kHead = 2.2;  // m
  hall.face({0, 0, 0}, {20, 0, 0}, {0, 9.9, 0});
  hall.face({0, 10.1, 0}, {20, 0, 0}, {0, 5.9, 0});
  hall.face({0, 0, kHeight}, {20, 0, 0}, {0, 16, 0});
  hall.face({0, 0, 0}, {20, 0, 0}, {0, 0, kHeight});
  hall.face({0, 16, 0}, {20, 0, 0}, {0, 0, kHeight});
  for (const double x : {0.0, 20.0}) hall.face({x, 0, 0}, {0, 16, 0}, {0, 0, kHeight});
  for (const double side : {-1.0, 1.0}) {
    const double y = 10 + 0.1 * side;
    const auto wall = [&](double from, double to, double low, double high, double off) {
      hall.face({from, y - side * off, low}, {to - from, 0, 0}, {0, 0, high - low});
    };
    // What was seen below the doors' heads is off what was seen above them.
    wall(0, 20, kHead, kHeight, drift_m * side);
    wall(0, 3.3, 0, kHead, 0);
    wall(3.3, 4.7, 0, kHead, 0.07);
    wall(4.7, 9.3, 0, kHead, 0);
    wall(10.7, 14, 0, kHead, 0);
    wall(14, 16.5, 2, kHead, 0);
    wall(16.5, 20, 0, kHead, 0);
    hall.box({14, y + std::min(0.25 * side, 0.8 * side), 0},
             {16.5, y + std::max(0.25 * side, 0.8 * side), 2}, true);
  }
  for (const double x : {9.3, 10.7}) hall.face({x, 9.9, 0}, {0, 0.2, 0}, {0, 0, kHead});
  hall.face({9.3, 9.9, 0}, {1.4, 0, 0}, {0, 0.2, 0});
  return hall;
}

TEST(GarageMap, FindsDoorsShutAndOpenButNoneBehindCabinets) {
  for (const double yaw : {0.0, 0.7}) {
    for (const double drift : {0.0, 0.02}) {
      const AnalyticGarage hall = hall_with_doors(yaw, drift);
      const SemanticMap map = build_semantic_map(hall.points, {}, {});
      ASSERT_EQ(map.scene, SceneKind::kGarage);
      EXPECT_EQ(map.count(SemanticClass::kDoor), 2u) << yaw << ' ' << drift;
      for (const double x : {4.0, 10.0}) {
        const Vec2 p = hall.place({x, 10, 0}).head<2>();
        const SemanticObject* found = nearest(map, SemanticClass::kDoor, p);
        ASSERT_NE(found, nullptr);
        EXPECT_LT((found->position.head<2>() - p).norm(), 0.2) << x;  // half a wall, a bin
        EXPECT_NEAR(found->size.x(), 1.4, 0.21) << x;                 // bins of 0.1 m
      }
    }
  }
}

TEST(PlanShapes, FitsARectangleToThreeSides) {
  for (const double yaw : {0.0, 0.3, 1.2, 2.5}) {
    RandomStream random(1, "rectangle");
    std::vector<Vec2> points;
    const Vec2 u(std::cos(yaw), std::sin(yaw)), v(-u.y(), u.x());
    for (int i = 0; i < 600; ++i) {
      const double t = random.uniform(-1, 1);
      const Vec2 noise(0.01 * random.normal(), 0.01 * random.normal());
      const Vec2 side = i % 3 == 0   ? Vec2(2.0 * t * u + 0.9 * v)
                        : i % 3 == 1 ? Vec2(2.0 * t * u - 0.9 * v)
                                     : Vec2(2.0 * u + 0.9 * t * v);
      points.push_back(Vec2(5, -3) + side + noise);
    }
    const Rectangle box = fit_rectangle(points, 0.005);
    // Where the open side ends only the points of the long ones tell, 1 cm apart; three of them,
    // the tail, are left out: 4 +- 2 cm.
    EXPECT_LT((box.centre - Vec2(5, -3)).norm(), 0.05);
    EXPECT_NEAR(box.length, 4, 0.1);
    EXPECT_NEAR(box.width, 1.8, 0.06);
    EXPECT_LT(std::abs(std::sin(box.yaw_rad - yaw)), 0.03);
  }
}

}  // namespace
}  // namespace arex::test
