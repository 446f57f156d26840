#pragma once

#include <array>
#include <cmath>
#include <numbers>

#include "math/random.h"
#include "math/so3.h"
#include "messages/commands.h"
#include "messages/sensors.h"
#include "messages/vehicle.h"

namespace arex::test {

/// A quadrotor by itself, independent of the simulator: rigid body, first-order rotor lag, rotor
/// drag, a flat ground at z = 0 that holds it upright, and an IMU with noise and vibration. For
/// closing the autopilot's loop in unit tests.
class QuadOracle {
 public:
  struct Options {
    Vec3 disturbance_torque_nm = Vec3::Zero();
    Vec3 wind_mps = Vec3::Zero();
    bool noise = true;
    double initial_yaw_rad = 0;
  };

  QuadOracle(std::uint64_t seed, const Options& with)
      : options(with), random_(seed, "quad_oracle") {
    R = so3::from_yaw(options.initial_yaw_rad);
    inertia_ << 0.0137, 0, -0.0020, 0, 0.0126, 0, -0.0020, 0, 0.0213;
    const double x = vehicle_.rotor_offset_m.x(), y = vehicle_.rotor_offset_m.y();
    hubs_ = {Vec3(x, -y, 0), Vec3(-x, y, 0), Vec3(x, y, 0), Vec3(-x, -y, 0)};
  }

  /// One millisecond under `command`.
  void step(const MotorCommand& command) {
    constexpr double kDt = 1e-3, kLag = 0.028;
    // Static speed of an ideal motor at 15 V, reached with the lag of hover.
    constexpr double kKt = 0.01085, kR = 0.085, kI0 = 0.5;
    const double kq = vehicle_.thrust_coefficient * vehicle_.torque_ratio_m;
    double thrust = 0;
    Vec3 torque = options.disturbance_torque_nm;
    for (std::size_t i = 0; i < 4; ++i) {
      const double volts = std::max(command.throttle[i] * kVoltage - kR * kI0, 0.0);
      const double a = kR * kq / kKt;
      const double target = (std::sqrt(kKt * kKt + 4 * a * volts) - kKt) / (2 * a);
      speed_[i] += (target - speed_[i]) * kDt / kLag;
      const double force = vehicle_.thrust_coefficient * speed_[i] * speed_[i];
      const double turn = i < 2 ? 1 : -1;
      thrust += force;
      torque +=
          hubs_[i].cross(Vec3(0, 0, force)) - Vec3(0, 0, turn * vehicle_.torque_ratio_m * force);
    }
    const Vec3 air_B = R.transpose() * (v - options.wind_mps);
    force_B = Vec3(0, 0, thrust) - 0.02 * thrust * Vec3(air_B.x(), air_B.y(), 0);
    const Vec3 a_before = R * force_B / vehicle_.mass_kg - Vec3(0, 0, kGravity);
    const bool supported = p.z() <= 0 && a_before.z() <= 0;
    if (supported) {  // the ground takes what the rotors leave
      v.setZero();
      w.setZero();
      R = so3::from_yaw(so3::yaw(R));
      p.z() = 0;
      specific_force = Vec3(0, 0, kGravity);
    } else {
      v += a_before * kDt;
      p += v * kDt;
      w += inertia_.inverse() * (torque - w.cross(inertia_ * w)) * kDt;
      R = R * so3::Exp(w * kDt);
      specific_force = force_B / vehicle_.mass_kg;
      if (p.z() < 0) {
        touchdown_speed = -v.z();
        p.z() = 0;
        v.setZero();
      }
    }
    stamp += kNanosecondsPerTick;
  }

  [[nodiscard]] ImuSample imu() {
    ImuSample out{stamp, w, specific_force};
    if (!options.noise) return out;
    const double t = to_seconds(stamp);
    const double spin = speed_[0] / 716;
    const double level = spin * spin;
    const double phase = 2 * std::numbers::pi * 114 * t;
    out.accel_mps2 += level * Vec3(2 * std::sin(phase), 2 * std::cos(phase), std::sin(2 * phase));
    out.gyro_radps += level * 0.03 * Vec3(std::sin(phase), std::cos(phase), std::sin(phase));
    constexpr double kRootHz = 22.36;  // sqrt(1 kHz / 2): density to sample
    out.accel_mps2 += 1.4e-3 * kRootHz * random_.normal3() + level * 0.3 * random_.normal3();
    out.gyro_radps += 1e-4 * kRootHz * random_.normal3() + gyro_bias;
    return out;
  }
  [[nodiscard]] MagnetometerSample magnetometer() {
    const Vec3 noise = options.noise ? Vec3(0.003 * random_.normal3()) : Vec3(Vec3::Zero());
    return {stamp, R.transpose() * Vec3(0.2, 0, -0.43) + noise};
  }
  [[nodiscard]] BarometerSample barometer() {
    const double noise = options.noise ? random_.normal() : 0;
    return {stamp, 101325 - 12.01 * p.z() + noise};
  }
  [[nodiscard]] BatterySample battery() const { return {stamp, kVoltage, 20}; }
  [[nodiscard]] double mass_kg() const { return vehicle_.mass_kg; }

  static constexpr double kVoltage = 15.0;
  Options options;
  Stamp stamp = 0;
  Vec3 p = Vec3::Zero(), v = Vec3::Zero(), w = Vec3::Zero();
  Mat3 R = Mat3::Identity();
  Vec3 force_B = Vec3::Zero();
  Vec3 specific_force{0, 0, kGravity};
  Vec3 gyro_bias = Vec3::Zero();
  double touchdown_speed = 0;

 private:
  VehicleConfig vehicle_;
  Mat3 inertia_;
  std::array<Vec3, 4> hubs_;
  std::array<double, 4> speed_{};
  RandomStream random_;
};

}  // namespace arex::test
