#pragma once

#include "math/random.h"
#include "physics/physics.h"
#include "worlds/world.h"

/// Small worlds and states for the tests of sim/physics.
namespace arex::sim::fixtures {

inline std::uint32_t add_object(worlds::World& world, worlds::SurfaceClass surface) {
  world.objects.push_back({surface, 0.3F});
  return static_cast<std::uint32_t>(world.objects.size() - 1);
}

inline void add_shape(worlds::World& world, worlds::SurfaceClass surface,
                      worlds::CollisionShape::Kind kind, const Pose& X_WS, const Vec3& size) {
  world.collision_shapes.push_back({kind, X_WS, size, add_object(world, surface)});
}

/// A floor of 100 x 50 m whose top is z = 0, as one box.
inline worlds::World floor_world() {
  worlds::World world;
  add_shape(world, worlds::SurfaceClass::kFloor, worlds::CollisionShape::Kind::kBox,
            {Mat3::Identity(), {0, 0, -0.25}}, {50, 25, 0.25});
  return world;
}

/// Rolling ground: two waves of `amplitude_m` each, 30 x 24 m, spacing 0.4 m, off centre and
/// below zero in places.
inline worlds::World rolling_world(double amplitude_m) {
  worlds::World world;
  add_object(world, worlds::SurfaceClass::kTrunk);  // so that the ground's id is not zero
  add_object(world, worlds::SurfaceClass::kGround);
  worlds::HeightField& terrain = world.terrain;
  terrain.origin = {-11, -13};
  terrain.spacing_m = 0.4;
  terrain.columns = 76;
  terrain.rows = 61;
  for (int row = 0; row < terrain.rows; ++row) {
    for (int column = 0; column < terrain.columns; ++column) {
      const double x = terrain.origin.x() + column * terrain.spacing_m;
      const double y = terrain.origin.y() + row * terrain.spacing_m;
      terrain.height_m.push_back(static_cast<float>(
          amplitude_m * (std::sin(0.9 * x + 0.3 * y) + std::cos(0.7 * y - 0.2 * x)) - 0.3));
    }
  }
  return world;
}

inline Pose level(double x, double y, double z, double yaw = 0) {
  return {so3::from_yaw(yaw), {x, y, z}};
}

/// No drag of any kind: closed forms hold.
inline PhysicsConfig without_air() {
  PhysicsConfig config;
  config.drag.air_density_kgpm3 = 0;
  config.rotor.drag_s_per_m = 0;
  return config;
}

/// The throttle at which rotors keep their speed while the bus stands at `bus_v`.
inline double holding_throttle(const PhysicsConfig& config, double speed, double bus_v) {
  const double torque =
      config.rotor.thrust_coefficient * config.rotor.torque_ratio_m * speed * speed;
  const double current =
      torque / config.motor.torque_constant_nm_per_a + config.motor.no_load_current_a;
  return (config.motor.torque_constant_nm_per_a * speed + config.motor.resistance_ohm * current) /
         bus_v;
}

}  // namespace arex::sim::fixtures
