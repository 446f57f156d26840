#pragma once

#include "math/pose.h"
#include "math/so3.h"
#include "math/types.h"
#include "physics/flexible_frame.h"

/// Parameters of the simulated vehicle that are not geometry or mass (those stand in
/// models/arex/arex.xml). Sources: models/arex/README.md. [S] sourced, [E] estimated, [P] paper.
namespace arex::sim {

/// One brushless motor with its speed controller.
struct MotorConfig {
  double torque_constant_nm_per_a = 0.01085;  ///< Kt = 60/(2 pi KV), KV 880 [E]
  double resistance_ohm = 0.085;              ///< winding and controller [E]
  double no_load_current_a = 0.5;             ///< I0 [E]
  double current_limit_a = 35.0;              ///< XF 35A 4-in-1 [P]
  double controller_efficiency = 0.96;        ///< [E]
  double brownout_voltage_v = 10.0;  ///< 2.5 V/cell: below it the controllers reset, and stay
                                     ///< silent until the throttle has been at zero [E]

  void fields(auto& f) {
    f("torque_constant_nm_per_a", torque_constant_nm_per_a, "motor torque per ampere");
    f("resistance_ohm", resistance_ohm, "motor winding and controller resistance");
    f("no_load_current_a", no_load_current_a, "current that friction takes");
    f("current_limit_a", current_limit_a, "controller's limit of the motor current");
    f("controller_efficiency", controller_efficiency, "electrical efficiency of the controller");
    f("brownout_voltage_v", brownout_voltage_v, "supply below which the controllers reset");
    f.check(torque_constant_nm_per_a > 0, "torque_constant_nm_per_a > 0");
    f.check(resistance_ohm > 0, "resistance_ohm > 0");
    f.check(no_load_current_a >= 0, "no_load_current_a >= 0");
    f.check(current_limit_a > 0, "current_limit_a > 0");
    f.check(controller_efficiency > 0 && controller_efficiency <= 1,
            "0 < controller_efficiency <= 1");
    f.check(brownout_voltage_v > 0, "brownout_voltage_v > 0");
  }
};

/// One propeller.
struct RotorConfig {
  double thrust_coefficient = 9.1e-6;       ///< kT, N/(rad/s)^2: between UIUC's and APC's data [S]
  double torque_ratio_m = 0.0143;           ///< drag torque per static thrust [S]
  double inertia_kgm2 = 4.0e-5;             ///< propeller and motor bell [E]
  double diameter_m = 0.2286;               ///< 9 inch [P]
  double zero_thrust_advance_ratio = 0.62;  ///< v/(n D) at which a climbing rotor's thrust is gone:
                                            ///< 1.25 x pitch/diameter [E]
  double drag_s_per_m = 0.02;  ///< in-plane drag per thrust and in-plane air speed; RotorS's
                               ///< Hummingbird has 0.0208 at hover [S]

  void fields(auto& f) {
    f("thrust_coefficient", thrust_coefficient, "static thrust per squared speed, N/(rad/s)^2");
    f("torque_ratio_m", torque_ratio_m, "drag torque per static thrust");
    f("inertia_kgm2", inertia_kgm2, "moment of inertia of propeller and motor bell");
    f("diameter_m", diameter_m, "propeller diameter");
    f("zero_thrust_advance_ratio", zero_thrust_advance_ratio,
      "axial advance ratio at which the thrust vanishes");
    f("drag_s_per_m", drag_s_per_m, "in-plane drag per thrust and in-plane air speed");
    f.check(thrust_coefficient > 0, "thrust_coefficient > 0");
    f.check(torque_ratio_m > 0, "torque_ratio_m > 0");
    f.check(inertia_kgm2 > 0, "inertia_kgm2 > 0");
    f.check(diameter_m > 0, "diameter_m > 0");
    f.check(zero_thrust_advance_ratio > 0, "zero_thrust_advance_ratio > 0");
    f.check(drag_s_per_m >= 0, "drag_s_per_m >= 0");
  }
};

/// The battery: an open-circuit voltage that follows the charge, behind a resistance.
struct BatteryConfig {
  int cells = 4;                         ///< [P]
  double capacity_ah = 4.0;              ///< [P]
  double resistance_ohm = 0.028;         ///< with wiring [E]
  double cell_full_v = 4.20;             ///< open-circuit, charge 1 [E]
  double cell_middle_v = 3.70;           ///< open-circuit, charge `middle_charge` [E]
  double cell_empty_v = 3.30;            ///< open-circuit, charge 0 [E]
  double middle_charge = 5.0 / 9.0;      ///< makes the stored energy 59.2 Wh [E]
  double empty_tail_fraction = 0.01;     ///< charge left below 'empty', over which the cells'
                                         ///< voltage collapses to zero [E]
  double avionics_w = 28.0;              ///< computer, LiDAR, camera, autopilot [E]
  double initial_state_of_charge = 1.0;  ///< at the start of the run

  void fields(auto& f) {
    f("cells", cells, "cells in series");
    f("capacity_ah", capacity_ah, "charge between full and empty");
    f("resistance_ohm", resistance_ohm, "internal resistance with wiring");
    f("cell_full_v", cell_full_v, "open-circuit voltage of a full cell");
    f("cell_middle_v", cell_middle_v, "open-circuit voltage of a cell at middle_charge");
    f("cell_empty_v", cell_empty_v, "open-circuit voltage of an empty cell");
    f("middle_charge", middle_charge, "state of charge of the curve's knee");
    f("empty_tail_fraction", empty_tail_fraction,
      "further charge over which an empty cell's voltage collapses");
    f("avionics_w", avionics_w, "power of computer and sensors");
    f("initial_state_of_charge", initial_state_of_charge, "state of charge at the start");
    f.check(cells >= 1 && cells <= 100, "1 <= cells <= 100");
    f.check(capacity_ah > 0, "capacity_ah > 0");
    f.check(resistance_ohm >= 0, "resistance_ohm >= 0");
    f.check(cell_full_v > cell_middle_v, "cell_full_v > cell_middle_v");
    f.check(cell_middle_v > cell_empty_v, "cell_middle_v > cell_empty_v");
    f.check(cell_empty_v > 0, "cell_empty_v > 0");
    f.check(middle_charge > 0 && middle_charge < 1, "0 < middle_charge < 1");
    f.check(empty_tail_fraction > 0, "empty_tail_fraction > 0");
    f.check(avionics_w >= 0, "avionics_w >= 0");
    f.check(initial_state_of_charge >= 0 && initial_state_of_charge <= 1,
            "0 <= initial_state_of_charge <= 1");
  }
};

/// Drag of the airframe without its rotors: F = -1/2 rho |v| (area * v), at the centre of mass.
struct DragConfig {
  double air_density_kgpm3 = 1.225;        ///< ISA, sea level [S]
  Vec3 drag_area_m2{0.025, 0.030, 0.050};  ///< Cd A along B's axes: sum of silhouettes [E]

  void fields(auto& f) {
    f("air_density_kgpm3", air_density_kgpm3, "density of air");
    f("drag_area_m2", drag_area_m2, "drag coefficient times area along B's axes");
    f.check(air_density_kgpm3 >= 0, "air_density_kgpm3 >= 0");
    f.check((drag_area_m2.array() >= 0).all(), "drag_area_m2 >= 0");
  }
};

/// Mean wind and Dryden turbulence (MIL-F-8785C, low altitude).
struct WindConfig {
  Vec3 mean_mps = Vec3::Zero();   ///< the air's mean velocity in W
  double turbulence_scale = 1.0;  ///< 1: standard deviations of the specification, 0: no gusts
  double altitude_m = 3.048;      ///< at which the scales are taken; the specification starts at
                                  ///< 10 ft [S]

  void fields(auto& f) {
    f("mean_mps", mean_mps, "mean velocity of the air, x y z of the world");
    f("turbulence_scale", turbulence_scale, "gust strength relative to MIL-F-8785C");
    f("altitude_m", altitude_m, "height at which gust scales are taken");
    f.check(turbulence_scale >= 0, "turbulence_scale >= 0");
    f.check(altitude_m >= 3.0 && altitude_m <= 305.0, "3 <= altitude_m <= 305");
  }
};

/// What counts as a collision, and how many of the world's shapes MuJoCo sees at once.
struct ContactConfig {
  double leg_bump_limit_mps = 0.5;      ///< legs may touch other things more slowly than this [E]
  double hard_landing_limit_mps = 2.0;  ///< legs may touch the ground more slowly than this [E]
  int slots = 32;                       ///< shapes in MuJoCo at once, the nearest ones
  double search_radius_m = 1.0;         ///< shapes further from B than this are left out

  void fields(auto& f) {
    f("leg_bump_limit_mps", leg_bump_limit_mps,
      "legs that hit something other than ground faster than this have collided");
    f("hard_landing_limit_mps", hard_landing_limit_mps,
      "legs that hit the ground faster than this have collided");
    f("slots", slots, "collision shapes in the physics engine at once");
    f("search_radius_m", search_radius_m, "collision shapes further away are left out");
    f.check(leg_bump_limit_mps >= 0, "leg_bump_limit_mps >= 0");
    f.check(hard_landing_limit_mps >= 0, "hard_landing_limit_mps >= 0");
    f.check(slots >= 1 && slots <= 2000, "1 <= slots <= 2000");
    f.check(search_radius_m >= 0.5 && search_radius_m <= 50, "0.5 <= search_radius_m <= 50");
  }
};

/// How far a sensor sits from where models/arex/arex.xml has it, and the stack's calibration too.
struct MountErrorConfig {
  Vec3 offset_m = Vec3::Zero();
  Vec3 rotation_rad = Vec3::Zero();

  /// The true mount, from the nominal pose in B.
  [[nodiscard]] Pose applied_to(const Pose& X_BS) const {
    return {so3::Exp(rotation_rad) * X_BS.R, X_BS.p + offset_m};
  }

  void fields(auto& f) {
    f("offset_m", offset_m, "true position of the sensor minus that of the model, in B");
    f("rotation_rad", rotation_rad, "rotation vector in B from the model's mount to the true one");
    f.check(offset_m.cwiseAbs().maxCoeff() <= 0.2, "offset_m within 0.2 along each axis");
    f.check(rotation_rad.cwiseAbs().maxCoeff() <= 0.5, "rotation_rad within 0.5 about each axis");
  }
};

/// The true body. What the flight software believes of it stands in `vehicle`.
struct BodyConfig {
  double mass_kg = 1.9;      ///< models/arex/arex.xml [P]
  double inertia_scale = 1;  ///< 1: models/arex/arex.xml
  MountErrorConfig lidar_mount;
  MountErrorConfig camera_mount;

  void fields(auto& f) {
    f("mass_kg", mass_kg, "true all-up mass; vehicle.mass_kg is what the stack believes");
    f("inertia_scale", inertia_scale, "true inertia over that of the model, about the same centre");
    f("lidar_mount", lidar_mount, "true mount of the LiDAR against the model's");
    f("camera_mount", camera_mount, "true mount of the depth camera against the model's");
    f.check(mass_kg >= 0.5 && mass_kg <= 5, "0.5 <= mass_kg <= 5");
    f.check(inertia_scale >= 0.2 && inertia_scale <= 5, "0.2 <= inertia_scale <= 5");
  }
};

struct PhysicsConfig {
  bool perfect_tracking = false;
  BodyConfig body;  ///< its keys stand directly under `physics`
  MotorConfig motor;
  RotorConfig rotor;
  BatteryConfig battery;
  FrameConfig frame;
  DragConfig drag;
  WindConfig wind;
  ContactConfig contact;

  void fields(auto& f) {
    f("perfect_tracking", perfect_tracking,
      "an oracle, for ablation: while it tracks a setpoint the vehicle is carried along it "
      "exactly, "
      "and neither rotors nor air move it");
    body.fields(f);
    f("motor", motor, "motor and speed controller");
    f("rotor", rotor, "propeller");
    f("battery", battery, "battery");
    f("frame", frame, "how the airframe gives way");
    f("drag", drag, "airframe drag");
    f("wind", wind, "wind and gusts");
    f("contact", contact, "contact with the world");
  }
};

}  // namespace arex::sim
