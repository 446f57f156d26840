#include "scoring/semantic_score.h"

#include <gtest/gtest.h>

#include <cmath>
#include <nlohmann/json.hpp>
#include <numbers>

#include "math/so3.h"
#include "worlds/mesh_builder.h"

namespace arex::sim {
namespace {

using std::numbers::pi;
using worlds::SurfaceClass;

/// Level ground, three upright trunks of 36 sides, two pillars, a pilaster, a car and a wall.
worlds::World small_world() {
  worlds::MeshBuilder builder;
  worlds::HeightField ground;
  ground.origin = {-15, -15};
  ground.spacing_m = 1;
  ground.columns = ground.rows = 31;
  ground.height_m.assign(31 * 31, 0.5F);
  builder.add_height_field(builder.add_object(SurfaceClass::kGround, 0.3), ground);
  for (int i = 0; i < 3; ++i) {
    const std::vector<Vec3> axis{{4.0 * i, 0, 0}, {4.0 * i, 0, 6}};
    const std::vector<double> radii{0.1 + 0.05 * i, 0.1 + 0.05 * i};
    builder.add_tube(builder.add_object(SurfaceClass::kTrunk, 0.3), axis, radii, 36);
  }
  const auto box = [&](SurfaceClass kind, const Vec3& low, const Vec3& high) {
    builder.add_box(builder.add_object(kind, 0.3), {Mat3::Identity(), 0.5 * (low + high)},
                    0.5 * (high - low));
  };
  box(SurfaceClass::kPillar, {-0.3, 5.7, 0.5}, {0.3, 6.3, 3.5});
  box(SurfaceClass::kPillar, {7.7, 5.7, 0.5}, {8.3, 6.3, 3.5});
  box(SurfaceClass::kPillar, {3.7, 11.85, 0.5}, {4.3, 12, 3.5});  // proud of the wall by 0.15
  box(SurfaceClass::kCar, {2, 8, 0.7}, {6.4, 9.8, 2.0});
  box(SurfaceClass::kWall, {-10, 12, 0.5}, {10, 12.2, 3.5});
  worlds::World world = builder.finish();
  return world;
}

/// Points on every surface but those that `hidden` names, in O, which is W moved and turned.
std::vector<Vec3f> cloud_of(const worlds::World& world, const Pose& X_WO,
                            const std::function<bool(const Vec3&)>& hidden) {
  std::vector<Vec3f> cloud;
  const Pose X_OW = X_WO.inverse();
  for (const auto& [a, b, c] : world.mesh.triangles) {
    const Vec3 p = world.mesh.vertices[a].cast<double>(), q = world.mesh.vertices[b].cast<double>(),
               r = world.mesh.vertices[c].cast<double>();
    const int n = std::max(1, static_cast<int>(std::max((q - p).norm(), (r - p).norm()) / 0.07));
    for (int i = 0; i <= n; ++i) {
      for (int j = 0; i + j <= n; ++j) {
        const Vec3 s =
            p + static_cast<double>(i) / n * (q - p) + static_cast<double>(j) / n * (r - p);
        if (!hidden(s)) cloud.push_back((X_OW * s).cast<float>());
      }
    }
  }
  return cloud;
}

SemanticObject object(SemanticClass kind, const Vec3& p_W, const Vec3& size, const Pose& X_WO) {
  SemanticObject made;
  made.kind = kind;
  made.position = X_WO.inverse() * p_W;
  made.size = size;
  made.yaw_rad = -so3::yaw(X_WO.R);
  return made;
}

struct Case {
  worlds::World world = small_world();
  Pose X_WO{so3::from_yaw(0.3), Vec3(2, -1, 0.4)};
  SemanticMap map;

  void add(SemanticClass kind, const Vec3& p_W, const Vec3& size) {
    map.objects.push_back(object(kind, p_W, size, X_WO));
  }
  void add_everything() {
    for (int i = 0; i < 3; ++i) {
      const double girth = 36 * 2 * (0.1 + 0.05 * i) * std::sin(pi / 36);
      add(SemanticClass::kTrunk, {4.0 * i, 0, 1.8}, Vec3(girth / pi, girth / pi, 6));
    }
    add(SemanticClass::kPillar, {0, 6, 2}, {0.6, 0.6, 3});
    add(SemanticClass::kPillar, {8, 6, 2}, {0.6, 0.6, 3});
    add(SemanticClass::kCar, {4.2, 8.9, 1.3}, {4.4, 1.8, 1.5});
    add(SemanticClass::kWall, {0, 12, 2}, {20, 0, 3});
  }
  [[nodiscard]] SemanticScore score(const std::function<bool(const Vec3&)>& hidden =
                                        [](const Vec3&) { return false; }) const {
    return score_semantics(map, cloud_of(world, X_WO, hidden), X_WO, world);
  }
};

TEST(SemanticScore, IsPerfectForTheTruth) {
  Case example;
  example.add_everything();
  const SemanticScore score = example.score();
  for (const SemanticClass kind :
       {SemanticClass::kTrunk, SemanticClass::kPillar, SemanticClass::kCar, SemanticClass::kWall}) {
    const ClassScore& of = score.of(kind);
    EXPECT_EQ(of.precision, 1) << static_cast<int>(kind);
    EXPECT_GT(of.recall, kind == SemanticClass::kWall ? 0.45 : 0.999);  // its back is mapped, too
    EXPECT_LT(of.position_median_m, kind == SemanticClass::kWall ? 0.06 : 1e-6);
  }
  EXPECT_EQ(score.of(SemanticClass::kTrunk).mapped, 3u);
  EXPECT_EQ(score.of(SemanticClass::kPillar).mapped, 2u);  // the pilaster does not count
  EXPECT_LT(score.of(SemanticClass::kTrunk).size_median_m, 1e-4);
  EXPECT_LT(score.of(SemanticClass::kCar).size_median_m, 1e-4);
  EXPECT_TRUE(std::isnan(score.of(SemanticClass::kRamp).f1));
  EXPECT_TRUE(std::isnan(score.of(SemanticClass::kWall).size_median_m));
}

TEST(SemanticScore, CountsALeafThatStandsOpenAndItsFrameAsOneDoor) {
  worlds::MeshBuilder builder;
  const auto box = [&](const Vec3& low, const Vec3& high) {
    builder.add_box(builder.add_object(SurfaceClass::kDoor, 0.3),
                    {Mat3::Identity(), 0.5 * (low + high)}, 0.5 * (high - low));
  };
  // Hung on the far side of a wall of 0.2 m; the frame is a lintel here.
  box({-0.05, 0.1, 0}, {0, 1.5, 2.2});
  box({-0.08, -0.12, 2.2}, {1.48, -0.1, 2.28});
  box({5, -0.1, 0}, {6.1, -0.06, 2.2});
  Case example;
  example.world = builder.finish();
  example.add(SemanticClass::kDoor, {0.7, 0, 1.05}, {1.4, 0, 2.1});
  example.add(SemanticClass::kDoor, {5.55, 0, 1.05}, {1.1, 0, 2.1});
  const ClassScore& doors = example.score().of(SemanticClass::kDoor);
  EXPECT_EQ(doors.mapped, 2u);
  EXPECT_EQ(doors.right, 2u);
  EXPECT_EQ(doors.f1, 1);
}

TEST(SemanticScore, MeasuresWhatIsOff) {
  Case example;
  example.add_everything();
  for (SemanticObject& each : example.map.objects) {
    each.position += Vec3(0.06, 0.08, 3);  // height does not count
    each.size.x() += 0.03;
  }
  const SemanticScore score = example.score();
  EXPECT_NEAR(score.of(SemanticClass::kTrunk).position_median_m, 0.1, 1e-6);
  EXPECT_NEAR(score.of(SemanticClass::kTrunk).size_median_m, 0.03, 1e-4);
  EXPECT_NEAR(score.of(SemanticClass::kPillar).size_median_m, 0.03, 1e-4);
  EXPECT_EQ(score.of(SemanticClass::kTrunk).f1, 1);
}

TEST(SemanticScore, CountsMissedAndInvented) {
  Case example;
  example.add_everything();
  example.map.objects.erase(example.map.objects.begin());  // a trunk
  example.add(SemanticClass::kTrunk, {2, -5, 1.8}, {0.2, 0.2, 6});
  example.add(SemanticClass::kTrunk, {4.05, 0, 1.8}, {0.2, 0.2, 6});  // one twice
  const ClassScore trunk = example.score().of(SemanticClass::kTrunk);
  EXPECT_NEAR(trunk.recall, 2.0 / 3, 1e-9);
  EXPECT_NEAR(trunk.precision, 2.0 / 4, 1e-9);
  EXPECT_NEAR(trunk.f1, 2 * (2.0 / 3) * 0.5 / (2.0 / 3 + 0.5), 1e-9);
  EXPECT_EQ(example.score().of(SemanticClass::kPillar).f1, 1);
}

TEST(SemanticScore, LeavesOutWhatWasNotMapped) {
  Case example;
  example.add_everything();
  // Of the first trunk nothing was mapped, of the second one side.
  const auto hidden = [](const Vec3& p) {
    return (p - Vec3(0, 0, p.z())).norm() < 0.3 ||
           ((p - Vec3(4, 0, p.z())).norm() < 0.3 && p.y() > -0.06);
  };
  const ClassScore trunk = example.score(hidden).of(SemanticClass::kTrunk);
  EXPECT_EQ(trunk.mapped, 2u);
  EXPECT_EQ(trunk.found, 2u);  // the first one is neither right nor wrong
  EXPECT_EQ(trunk.f1, 1);
  example.map.objects.erase(example.map.objects.begin());
  EXPECT_EQ(example.score(hidden).of(SemanticClass::kTrunk).recall, 1);
}

TEST(SemanticScore, AllowsPilastersToBeNamedOrNot) {
  Case example;
  example.add_everything();
  example.add(SemanticClass::kPillar, {4, 12.1, 2}, {0.6, 0.6, 3});
  const ClassScore pillar = example.score().of(SemanticClass::kPillar);
  EXPECT_EQ(pillar.precision, 1);
  EXPECT_EQ(pillar.found, 2u);
}

TEST(SemanticScore, WeighsWallsByTheirLength) {
  Case example;
  example.add(SemanticClass::kWall, {-5, 12, 2}, {10, 0, 3});
  example.add(SemanticClass::kWall, {5, 15, 2}, {5, 0, 3});  // there is none
  const ClassScore wall = example.score().of(SemanticClass::kWall);
  EXPECT_NEAR(wall.precision, 10.0 / 15, 0.01);
  EXPECT_NEAR(wall.recall, 0.5, 0.03);  // both faces within 0.2 m
}

TEST(SemanticScore, SetsEveryFigureOfItsClasses) {
  Case example;
  example.add_everything();
  Figures figures;
  add_figures(example.score(), figures);
  const auto json = figures.json();
  EXPECT_EQ(json["semantic"]["trunk"]["f1"], 1.0);
  EXPECT_EQ(json["semantic"]["pillar"]["recall"], 1.0);
  EXPECT_TRUE(json["semantic"]["ramp"].is_null()) << "nothing of it was measured";
}

}  // namespace
}  // namespace arex::sim
