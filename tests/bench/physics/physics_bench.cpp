// CPU time of a physics tick: `physics_bench`. Each row is the least of several passes.

#include <cmath>
#include <cstdio>
#include <ctime>
#include <functional>
#include <limits>

#include "physics/physics.h"
#include "worlds/forest.h"

namespace {

using namespace arex;
using sim::Physics;
using sim::PhysicsConfig;

constexpr std::array<double, 4> kHover{716, 716, 716, 716};
const MotorCommand kThrottle{{0.53, 0.53, 0.53, 0.53}};

double cpu_seconds() { return static_cast<double>(std::clock()) / CLOCKS_PER_SEC; }

struct Row {
  double tick_us = std::numeric_limits<double>::infinity();
  double contacts_per_tick = 0;
};

/// `place` sets the state before each tick, or leaves it alone.
Row measure(const PhysicsConfig& config, const worlds::World& world, const Pose& start, int ticks,
            const MotorCommand& command, const std::function<void(Physics&, int)>& place,
            int passes = 7) {
  Row row;
  for (int pass = 0; pass < passes; ++pass) {
    Physics physics(config, world, start, 1);
    for (int i = 0; i < 50; ++i) physics.step(command);
    std::size_t contacts = 0;
    const double begin = cpu_seconds();
    for (int i = 0; i < ticks; ++i) {
      if (place) place(physics, i);
      physics.step(command);
      contacts += physics.contacts().size();
    }
    row.tick_us = std::min(row.tick_us, 1e6 * (cpu_seconds() - begin) / ticks);
    row.contacts_per_tick = static_cast<double>(contacts) / ticks;
  }
  return row;
}

/// Straight lines through the forest at 1.5 m/s, 1.5 m above the ground, through whatever stands
/// there: the share of ticks near or inside wood is higher than in any flight.
void through_forest(Physics& physics, const worlds::World& world, int tick) {
  const double along = 1.5e-3 * tick;
  const double x = -20 + std::fmod(along, 40.0), y = -12 + 4 * std::floor(along / 40.0);
  physics.set_state({Mat3::Identity(), {x, y, world.terrain.at(x, y) + 1.5}}, {1.5, 0, 0},
                    Vec3::Zero(), kHover);
}

/// The same forest as somebody's mesh would be: ground, wood and shrubs felt by their triangles.
worlds::World as_triangles(worlds::World world) {
  world.collision_shapes.clear();
  world.terrain = {};
  for (worlds::Object& object : world.objects) {
    object.felt = object.surface_class != worlds::SurfaceClass::kLeaf;
  }
  return world;
}

void print(const char* name, const Row& row) {
  std::printf("%-44s %8.2f %12.2f\n", name, row.tick_us, row.contacts_per_tick);
}

}  // namespace

int main() {
  const worlds::World forest = worlds::build({}, 1);
  const worlds::World nothing;
  PhysicsConfig windy;
  windy.wind.mean_mps = {2, 0, 0};
  PhysicsConfig all_static = windy;
  all_static.contact.slots = static_cast<int>(forest.collision_shapes.size());
  all_static.contact.search_radius_m = 1e3;

  const Pose high{Mat3::Identity(), {0, 0, 1000}};
  const Pose pad{forest.X_WS.R, forest.X_WS * Vec3(0, 0, 0.14)};
  const auto fly = [&forest](Physics& physics, int tick) { through_forest(physics, forest, tick); };
  std::printf("default forest, %zu collision shapes; light wind\n\n",
              forest.collision_shapes.size());
  std::printf("%-44s %8s %12s\n", "", "us/tick", "contacts");
  print("open air", measure(windy, nothing, high, 20'000, kThrottle, {}));
  print("forest, straight through at 1.5 m/s",
        measure(windy, forest, pad, 160'000, kThrottle, fly));
  print("forest, standing on the pad", measure(windy, forest, pad, 20'000, {}, {}));
  const worlds::World triangles = as_triangles(forest);
  print("as triangles, straight through",
        measure(windy, triangles, pad, 160'000, kThrottle, fly, 3));
  print("as triangles, standing on the pad", measure(windy, triangles, pad, 20'000, {}, {}, 3));
  // The same ticks with and without the nearest shapes' slots; the second is slow: few ticks, once.
  print("the flight's first 300 ticks", measure(windy, forest, pad, 300, kThrottle, fly));
  print("these with all shapes in MuJoCo at once",
        measure(all_static, forest, pad, 300, kThrottle, fly, 1));
  return 0;
}
