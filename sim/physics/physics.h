#pragma once

#include <cstdint>
#include <memory>
#include <span>

#include "messages/commands.h"
#include "physics/airframe.h"
#include "physics/physics_config.h"
#include "physics/powertrain.h"
#include "physics/truth.h"
#include "worlds/world.h"

namespace arex::sim {

/// One point where the vehicle touches the world.
struct Contact {
  AirframePart part = AirframePart::kBody;
  std::uint32_t object = 0;  ///< index into World::objects
  worlds::SurfaceClass surface_class = worlds::SurfaceClass::kGround;
  Vec3 p_W = Vec3::Zero();       ///< m
  Vec3 normal_W = Vec3::Zero();  ///< out of the world, towards the vehicle
  double impact_speed_mps = 0;   ///< closing speed along the normal before this tick, >= 0
  double normal_force_n = 0;
  bool collision = false;  ///< more than a leg standing on the ground or brushing something slowly
};

/// What a vehicle that is carried shall do during a tick.
struct CarriedMotion {
  Vec3 a_WB = Vec3::Zero();        ///< acceleration of B's origin, m/s^2, in W
  Vec3 alpha_WB_B = Vec3::Zero();  ///< angular acceleration, rad/s^2, in B
};

/// The vehicle in its world: MuJoCo's rigid body and contacts, motors, battery, drag and wind.
/// Ticks at 1 kHz; a run is a function of its configuration, world, seed and commands.
class Physics {
 public:
  /// Starts at rest at X_WB_start, rotors stopped, stamp 0. `world` must outlive this object.
  Physics(const PhysicsConfig& config, const worlds::World& world, const Pose& X_WB_start,
          std::uint64_t seed);
  ~Physics();
  Physics(Physics&&) noexcept;
  Physics& operator=(Physics&&) noexcept;

  /// What is broken of the drive from now on.
  void set_faults(const DriveFaults& faults);

  /// Holds `command` for one tick.
  /// @throws std::runtime_error if MuJoCo's state diverges.
  void step(const MotorCommand& command);
  /// The same of a vehicle that is carried: the rotors turn and take their current, but what moves
  /// it, gravity and contacts aside, is the wrench that `carry` takes in free air.
  void step(const MotorCommand& command, const CarriedMotion& carry);

  [[nodiscard]] const Truth& truth() const;
  [[nodiscard]] const BatteryState& battery() const;
  [[nodiscard]] const Powertrain& powertrain() const;
  [[nodiscard]] const Airframe& airframe() const;
  [[nodiscard]] const Vec3& wind_W() const;  ///< velocity of the air at the vehicle, m/s

  /// What the vehicle touched during the last tick.
  [[nodiscard]] std::span<const Contact> contacts() const;
  /// Legs on the ground and no other part touching anything.
  [[nodiscard]] bool landed() const;
  /// The worst collision of the last tick (highest impact speed), or nullptr.
  [[nodiscard]] const Contact* collision() const;

  /// Puts the vehicle into a state, rotors spinning: for tests and starts in the air.
  void set_state(const Pose& X_WB, const Vec3& v_WB, const Vec3& w_WB_B,
                 const std::array<double, 4>& rotor_radps);

 private:
  class Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace arex::sim
