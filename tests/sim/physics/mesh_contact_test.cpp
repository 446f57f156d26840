#include "physics/mesh_contact.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "fixtures.h"
#include "messages/vehicle.h"
#include "physics/physics.h"
#include "worlds/mesh_builder.h"
#include "worlds/triangle.h"

namespace arex::sim {
namespace {

using fixtures::level;
using worlds::MeshBuilder;
using worlds::SurfaceClass;
using worlds::World;

constexpr std::array<double, 4> kStopped{};
const double kStanding_m = VehicleConfig{}.ground_offset_m;

/// A surface z = height(x, y) of triangles with sides of `step_m`, irregular, as a scan gives.
World surface(const std::function<double(double, double)>& height, double half_m, double step_m,
              std::uint64_t seed) {
  MeshBuilder builder;
  const auto object = builder.add_object(SurfaceClass::kFloor, 0.3, true);
  RandomStream random(seed, "surface");
  const int n = static_cast<int>(std::lround(2 * half_m / step_m));
  std::vector<Vec3> grid;
  for (int j = 0; j <= n; ++j) {
    for (int i = 0; i <= n; ++i) {
      const bool rim = i == 0 || j == 0 || i == n || j == n;
      const double x = -half_m + step_m * (i + (rim ? 0 : random.uniform(-0.3, 0.3)));
      const double y = -half_m + step_m * (j + (rim ? 0 : random.uniform(-0.3, 0.3)));
      grid.emplace_back(x, y, height(x, y));
    }
  }
  const auto at = [&](int i, int j) {
    return grid[static_cast<std::size_t>(j) * static_cast<std::size_t>(n + 1) +
                static_cast<std::size_t>(i)];
  };
  for (int j = 0; j < n; ++j) {
    for (int i = 0; i < n; ++i) {
      // Both diagonals, and both windings.
      if (random.uniform() < 0.5) {
        builder.add_triangle(object, at(i, j), at(i + 1, j), at(i + 1, j + 1));
        builder.add_triangle(object, at(i, j), at(i, j + 1), at(i + 1, j + 1));
      } else {
        builder.add_triangle(object, at(i, j), at(i + 1, j), at(i, j + 1));
        builder.add_triangle(object, at(i + 1, j + 1), at(i + 1, j), at(i, j + 1));
      }
    }
  }
  return builder.finish();
}

World plane(double tilt_rad, double step_m, std::uint64_t seed) {
  return surface([&](double x, double) { return std::tan(tilt_rad) * x; }, 3, step_m, seed);
}

/// The same plane as one thick box, which MuJoCo knows how to touch.
World box_plane(double tilt_rad) {
  World world;
  const Mat3 R = so3::Exp({0, -tilt_rad, 0});
  fixtures::add_shape(world, SurfaceClass::kFloor, worlds::CollisionShape::Kind::kBox,
                      {R, R * Vec3(0, 0, -0.25)}, {4, 4, 0.25});
  return world;
}

double energy(const Physics& physics) {
  const Truth& truth = physics.truth();
  const Airframe& airframe = physics.airframe();
  const Vec3 v = truth.v_WB + truth.X_WB.R * truth.w_WB_B.cross(airframe.p_BBcm);
  return 0.5 * airframe.mass_kg * v.squaredNorm() +
         0.5 * truth.w_WB_B.dot(airframe.inertia_kgm2 * truth.w_WB_B) +
         airframe.mass_kg * kGravity * (truth.X_WB * airframe.p_BBcm).z();
}

TEST(MeshContact, RestsOnManyTrianglesAsOnOneBox) {
  for (const double step : {2.0, 0.3, 0.06}) {
    const World world = plane(0, step, 3);
    Physics physics({}, world, level(0.13, -0.21, kStanding_m + 0.05, 0.7), 1);
    for (int i = 0; i < 2000; ++i) physics.step({});
    const Vec3 rest = physics.truth().X_WB.p;
    EXPECT_NEAR(rest.z(), kStanding_m, 1e-3) << "neither sunk nor held up, side " << step;
    double fastest = 0, force = 0;
    for (int i = 0; i < 1000; ++i) {
      physics.step({});
      fastest = std::max({fastest, physics.truth().v_WB.norm(), physics.truth().w_WB_B.norm()});
      ASSERT_TRUE(physics.landed());
      ASSERT_EQ(physics.collision(), nullptr);
    }
    for (const Contact& contact : physics.contacts()) force += contact.normal_force_n;
    EXPECT_LT(fastest, 1e-4) << "no jitter, side " << step;
    EXPECT_LT((physics.truth().X_WB.p - rest).norm(), 1e-4) << "no creep, side " << step;
    EXPECT_NEAR(force, physics.airframe().mass_kg * kGravity, 1e-3 * force);
  }
}

TEST(MeshContact, FallsOntoTiltedTrianglesAsOntoATiltedBox) {
  for (const double tilt_deg : {5.0, 15.0, 30.0}) {
    const double tilt = tilt_deg * std::numbers::pi / 180;
    const World box = box_plane(tilt);
    for (const std::uint64_t seed : {1, 2}) {
      const World world = plane(tilt, 0.15, seed);
      // So low that no foot's axis gets below the surface, where MuJoCo's own answer is another.
      const double drop = 0.01;
      const Mat3 R = so3::Exp({0, -tilt, 0});
      const Pose start{R, R * Vec3(0.2, 0.1, kStanding_m + drop)};
      Physics on_mesh(fixtures::without_air(), world, start, 1);
      Physics on_box(fixtures::without_air(), box, start, 1);
      const double energy_before = energy(on_mesh);
      double highest = -1e9, farthest = 0;
      for (int i = 0; i < 1500; ++i) {
        on_mesh.step({});
        on_box.step({});
        highest = std::max(highest, energy(on_mesh));
        farthest = std::max(farthest, (on_mesh.truth().X_WB.p - on_box.truth().X_WB.p).norm());
      }
      EXPECT_LT(farthest, 1e-3) << tilt_deg;
      EXPECT_LT(highest, energy_before + 1e-3) << "contacts give no energy";
      if (tilt_deg < 20) {
        EXPECT_LT(on_mesh.truth().v_WB.norm(), 5e-3) << "friction of 0.8 holds it";
      }
    }
  }
}

TEST(MeshContact, TheTouchIsWhereTheNearestPointsAre) {
  // Capsules alone: distances have closed forms.
  const World world = surface(
      [](double x, double y) { return 0.2 * std::sin(2 * x) * std::cos(1.7 * y); }, 1.5, 0.11, 4);
  std::vector<worlds::CollisionShape> capsule(1);
  capsule[0].kind = worlds::CollisionShape::Kind::kCapsule;
  capsule[0].size = {0.05, 0.12, 0};
  RandomStream random(5, "poses");
  MeshContacts contacts(world, capsule);
  std::size_t touching = 0;
  for (int trial = 0; trial < 4000; ++trial) {
    const Pose X{so3::Exp(random.normal3()),
                 {random.uniform(-1, 1), random.uniform(-1, 1), random.uniform(0.02, 0.5)}};
    // Nearest distance of the core, sampled finely, from the surface, one by one.
    double nearest = 1;
    bool above = true;
    for (int i = 0; i <= 48; ++i) {
      const Vec3 p = X * Vec3(0, 0, 0.12 * (i / 24.0 - 1));
      above &= p.z() > 0.2 * std::sin(2 * p.x()) * std::cos(1.7 * p.y()) + 0.01;
      for (const auto& [a, b, c] : world.mesh.triangles) {
        const auto& v = world.mesh.vertices;
        Eigen::AlignedBox3f box(v[a]);
        box.extend(v[b]);
        box.extend(v[c]);
        if (static_cast<double>(box.exteriorDistance(p.cast<float>())) > nearest) continue;
        nearest = std::min(nearest,
                           (worlds::nearest_on_triangle(p, v[a].cast<double>(), v[b].cast<double>(),
                                                        v[c].cast<double>()) -
                            p)
                               .norm());
      }
    }
    if (!above) continue;
    contacts.reset(X.p);
    const auto found = contacts.find(X);
    double deepest = 0;
    for (const MeshTouch& touch : found) {
      deepest = std::max(deepest, touch.depth_m);
      EXPECT_GT(touch.normal_W.z(), 0) << "out of the ground";
      EXPECT_NEAR(touch.normal_W.norm(), 1, 1e-9);
    }
    // 5 mm between the samples of a core: 0.1 mm at most at these distances.
    EXPECT_NEAR(deepest, std::max(0.0, 0.05 - nearest), 2e-4) << trial;
    touching += !found.empty();
  }
  EXPECT_GT(touching, 200U);
}

TEST(MeshContact, SlidesOverTheEdgesBetweenTrianglesUnhindered) {
  // A flat floor of 5 cm triangles against one of two: friction alone slows it.
  PhysicsConfig config = fixtures::without_air();
  const World fine = plane(0, 0.05, 6), coarse = plane(0, 6, 6);
  std::array<Vec3, 2> ends;
  for (const auto* world : {&fine, &coarse}) {
    Physics physics(config, *world, level(-1, 0.02, kStanding_m), 1);
    physics.set_state(level(-1, 0.02, kStanding_m), {1.2, 0.1, 0}, Vec3::Zero(), kStopped);
    for (int i = 0; i < 1000; ++i) {
      physics.step({});
      ASSERT_LT(physics.truth().X_WB.p.z(), kStanding_m + 0.03);
    }
    EXPECT_LT(physics.truth().v_WB.norm(), 1e-3);
    ends[world == &fine ? 0 : 1] = physics.truth().X_WB.p;
  }
  EXPECT_GT(ends[0].x(), -0.95) << "it slid";
  EXPECT_LT((ends[0] - ends[1]).norm(), 5e-3);
}

TEST(MeshContact, AThinWallStopsAnySpeed) {
  MeshBuilder builder;
  const auto wall = builder.add_object(SurfaceClass::kWall, 0.3, true);
  builder.add_quad(wall, {0, -3, -3}, {0, 3, -3}, {0, 3, 3}, {0, -3, 3});
  const World world = builder.finish();
  RandomStream random(8, "attitudes");
  for (const double speed : {0.5, 2.0, 5.0, 10.0, 15.0}) {
    for (int trial = 0; trial < 12; ++trial) {
      const double side = trial % 2 == 0 ? 1 : -1;
      const Pose start{so3::Exp(trial == 0 ? Vec3(0, 0, 0) : Vec3(2 * random.normal3())),
                       {side * random.uniform(0.4, 0.42), 0, 0}};
      PhysicsConfig config = fixtures::without_air();
      Physics physics(config, world, start, 1);
      physics.set_state(start, {-side * speed, 0, 0}, 3 * random.normal3(), kStopped);
      bool touched = false;
      const double energy_before = energy(physics);
      for (int i = 0; i < 600; ++i) {
        physics.step({});
        ASSERT_LT(energy(physics), 1.01 * energy_before + 0.1) << "contacts give no energy";
        if (!physics.contacts().empty()) {
          if (!touched) {
            EXPECT_NEAR(physics.contacts()[0].impact_speed_mps, speed, 0.15 * speed + 1.3);
          }
          touched = true;
        }
        ASSERT_GT(side * physics.truth().X_WB.p.x(), -0.09)
            << "through the wall at " << speed << " m/s, trial " << trial;
        if (std::abs(physics.truth().X_WB.p.z()) > 2) break;
      }
      EXPECT_TRUE(touched);
      EXPECT_GT(side * physics.truth().X_WB.p.x(), 0) << speed << " m/s, trial " << trial;
    }
  }
}

TEST(MeshContact, AThinWallOfManyTrianglesStopsTheNoseAsAMuJoCoBoxDoes) {
  MeshBuilder builder;
  const auto wall = builder.add_object(SurfaceClass::kWall, 0.3, true);
  const double side = 0.1;
  for (double y = -1; y < 1 - 1e-9; y += side) {
    for (double z = -1; z < 1 - 1e-9; z += side) {
      builder.add_quad(wall, {1, y, z}, {1, y + side, z}, {1, y + side, z + side},
                       {1, y, z + side});
    }
  }
  const World mesh = builder.finish();
  World box;
  fixtures::add_shape(box, SurfaceClass::kWall, worlds::CollisionShape::Kind::kBox,
                      {Mat3::Identity(), {1.25, 0, 0}}, {0.25, 1, 1});
  std::array<double, 2> x_min{}, at{};
  for (const World* world : std::initializer_list<const World*>{&mesh, &box}) {
    Physics physics(fixtures::without_air(), *world, level(0.5, 0, 0), 1);
    physics.set_state(level(0.5, 0, 0), {3, 0, 0}, Vec3::Zero(), kStopped);
    const std::size_t which = world == &mesh ? 0 : 1;
    int first = 0;
    for (int i = 0; i < 250; ++i) {
      physics.step({});
      if (first == 0 && !physics.contacts().empty()) first = i;
      x_min[which] = std::max(x_min[which], physics.truth().X_WB.p.x());
    }
    at[which] = first;
  }
  EXPECT_NEAR(at[0], at[1], 2) << "ms until it touches";
  EXPECT_NEAR(x_min[0], x_min[1], 0.01) << "as deep";
}

TEST(MeshContact, EveryPartFeelsAThinPole) {
  // Eight sides, 2 cm thick: smaller than any disc or box it may meet.
  MeshBuilder builder;
  const auto pole = builder.add_object(SurfaceClass::kBranch, 0.3, true);
  builder.add_cylinder(pole, {Mat3::Identity(), {0, 0, 0}}, 0.01, 40, 8);
  const World world = builder.finish();
  RandomStream random(9, "poles");
  for (int trial = 0; trial < 60; ++trial) {
    const double aim = random.uniform(-0.2, 0.2), heading = random.uniform(-3, 3);
    const Vec3 ahead = so3::from_yaw(heading).col(0), across = so3::from_yaw(heading).col(1);
    const Pose start{so3::from_yaw(random.uniform(-3, 3)), -0.6 * ahead + aim * across};
    for (const double speed : {0.5, 3.0, 8.0}) {
      Physics physics(fixtures::without_air(), world, start, 1);
      physics.set_state(start, speed * ahead, Vec3::Zero(), kStopped);
      bool touched = false;
      for (int i = 0; i < static_cast<int>(1200 / speed) && !touched; ++i) {
        physics.step({});
        touched = physics.collision() != nullptr;
      }
      EXPECT_TRUE(touched) << "aim " << aim << " speed " << speed;
    }
  }
}

TEST(MeshContact, ASpikeIsFeltUnderABoxAndADisc) {
  MeshBuilder builder;
  const auto spike = builder.add_object(SurfaceClass::kLog, 0.3, true);
  for (const Vec2& p : {Vec2(-0.01, 0), Vec2(0.095, 0.22)}) {  // below the body, below a propeller
    const Vec3 top(p.x(), p.y(), p.y() > 0 ? 0.045 : 0);
    const std::array<Vec3, 3> feet{top + Vec3(0.02, 0, -1), top + Vec3(-0.02, 0.02, -1),
                                   top + Vec3(-0.02, -0.02, -1)};
    for (std::size_t i = 0; i < 3; ++i)
      builder.add_triangle(spike, top, feet[i], feet[(i + 1) % 3]);
  }
  const World world = builder.finish();
  // Level, so that both are met before it tips: the legs find nothing to stand on.
  Physics physics(fixtures::without_air(), world, level(0, 0, 0.15), 1);
  std::array<bool, 2> felt{};
  for (int i = 0; i < 400; ++i) {
    physics.step({});
    for (const Contact& contact : physics.contacts()) {
      felt[0] |= contact.part == AirframePart::kBody;
      felt[1] |= contact.part == AirframePart::kRotor;
    }
  }
  EXPECT_TRUE(felt[0]);
  EXPECT_TRUE(felt[1]);
}

TEST(MeshContact, LyingOnItsBackInABowlItComesToRest) {
  const World world =
      surface([](double x, double y) { return 0.15 * (x * x + y * y); }, 2, 0.08, 10);
  RandomStream random(11, "falls");
  for (int trial = 0; trial < 6; ++trial) {
    const Pose start{so3::Exp(2 * random.normal3()), {0.3 * random.normal(), 0.2, 0.9}};
    Physics physics({}, world, start, 1);
    physics.set_state(start, 2 * random.normal3(), 4 * random.normal3(), kStopped);
    const double before = energy(physics);
    double highest = -1e9;
    for (int i = 0; i < 6000; ++i) {
      physics.step({});
      highest = std::max(highest, energy(physics));
      ASSERT_GT(physics.truth().X_WB.p.z(), -0.1);
    }
    EXPECT_LT(highest, before + 0.02 * std::abs(before)) << "trial " << trial;
    EXPECT_LT(physics.truth().v_WB.norm(), 0.02) << "trial " << trial;
  }
}

TEST(TriangleTree, FindsWhatBruteForceFinds) {
  const World world =
      surface([](double x, double y) { return std::sin(3 * x) + y * y; }, 2, 0.13, 12);
  const TriangleTree tree(world);
  RandomStream random(13, "boxes");
  std::vector<std::uint32_t> found;
  for (int trial = 0; trial < 300; ++trial) {
    const Vec3f low =
        (Vec3(random.uniform(-2, 2), random.uniform(-2, 2), random.uniform(-1, 3))).cast<float>();
    const Eigen::AlignedBox3f box(
        low, low + Vec3f::Constant(static_cast<float>(random.uniform(0, 0.7))));
    tree.find(box, found);
    std::sort(found.begin(), found.end());
    std::vector<std::uint32_t> expected;
    double nearest = 0.5;
    const Vec3 p = low.cast<double>();
    for (std::uint32_t t = 0; t < world.mesh.triangles.size(); ++t) {
      Eigen::AlignedBox3f each;
      std::array<Vec3, 3> v;
      for (std::size_t i = 0; i < 3; ++i) {
        each.extend(world.mesh.vertices[world.mesh.triangles[t][i]]);
        v[i] = world.mesh.vertices[world.mesh.triangles[t][i]].cast<double>();
      }
      if (each.intersects(box)) expected.push_back(t);
      nearest = std::min(nearest, (worlds::nearest_on_triangle(p, v[0], v[1], v[2]) - p).norm());
    }
    EXPECT_EQ(found, expected);
    EXPECT_DOUBLE_EQ(tree.distance(p, 0.5), nearest);
  }
}

}  // namespace
}  // namespace arex::sim
