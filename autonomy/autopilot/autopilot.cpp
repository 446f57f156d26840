#include "autopilot/autopilot.h"

#include <algorithm>
#include <cmath>

#include "math/so3.h"

namespace arex {
namespace {

// Support by the ground may come a little late, vibration must not come through.
constexpr double kSupportCutoffHz = 10;
// Of the autopilot's own descent: it never pushes and never falls.
constexpr double kDescentThrustLow = 0.1, kDescentThrustHigh = 1.4;  // of the weight

Stamp period_of(double hz) { return from_seconds(1 / hz); }

}  // namespace

Autopilot::Autopilot(const AutopilotConfig& config, const VehicleConfig& vehicle)
    : config_(config),
      vehicle_(vehicle),
      ahrs_(config.ahrs),
      allocation_(vehicle),
      motor_(config.motor, vehicle),
      rate_control_(config.control),
      land_detector_(config.land, vehicle),
      health_(config.health, allocation_.mix(), vehicle.mass_kg * kGravity),
      gyro_filter_(kFlightImuHz, config.control.gyro_cutoff_hz),
      support_filter_(kFlightImuHz, kSupportCutoffHz),
      rate_period_(period_of(config.control.rate_loop_hz)),
      attitude_period_(period_of(config.control.attitude_loop_hz)),
      voltage_v_(config.motor.nominal_voltage_v) {}

void Autopilot::add_imu(const ImuSample& imu) {
  ahrs_.add_imu(imu);
  rate_B_ = gyro_filter_.update(imu.gyro_radps) - ahrs_.gyro_bias();
  const double support = vehicle_.mass_kg * imu.accel_mps2.z() - rotor_thrust_n_;
  support_n_ = support_filter_.update(Vec3(support, 0, 0)).x();
  last_imu_ = imu.stamp;
  health_.add_imu(now_, imu);
}

void Autopilot::add_magnetometer(const MagnetometerSample& sample) {
  ahrs_.add_magnetometer(sample);
  health_.add_magnetometer(now_, sample);
}

void Autopilot::add_barometer(const BarometerSample& sample) {
  health_.add_barometer(now_, sample);
  // By a noisy one the vehicle would seem to climb and sink in turn, on the ground as well.
  ahrs_.add_barometer(sample, health_.pressure_noise_pa());
}

void Autopilot::add_battery(const BatterySample& sample) {
  const double dt = to_seconds(sample.stamp - battery_stamp_);
  const double share = battery_stamp_ == 0 ? 1 : dt / (dt + config_.motor.voltage_filter_s);
  voltage_v_ += share * (sample.voltage_v - voltage_v_);
  battery_stamp_ = sample.stamp;
  health_.add_battery(now_, sample);
}

void Autopilot::command(const AttitudeCommand& command) {
  if (commanded_ && command.stamp < command_.stamp) return;
  command_ = command;
  commanded_ = true;
}

AttitudeEstimate Autopilot::attitude() const { return {last_imu_, ahrs_.R_AB(), rate_B_}; }

MotorCommand Autopilot::tick(Stamp now) {
  now_ = now;
  if (now % attitude_period_ == 0) {
    update_state(now);
    update_targets(to_seconds(attitude_period_));
    watch_health(to_seconds(attitude_period_));
  }
  if (now % rate_period_ == 0) {
    run_rate_loop();
    follow_rotors(to_seconds(rate_period_));
  }
  return motors_;
}

void Autopilot::enter(AutopilotState state, Stamp now) {
  const bool was_landed = landed();
  state_ = state;
  state_since_ = now;
  if (was_landed && !landed()) {
    rate_control_.reset(rate_B_);
    land_detector_.reset(now);
  }
  if (state == AutopilotState::kDescending) {
    R_AB_descend_ = so3::from_yaw(so3::yaw(ahrs_.R_AB()));
    descent_integral_ = 0;
  }
  if (state == AutopilotState::kStandby) must_release_ = true;
  if (landed()) contact_ = false;
  ahrs_.set_on_ground(landed());
}

void Autopilot::update_state(Stamp now) {
  using enum AutopilotState;
  const AutopilotMode wanted = commanded_ ? command_.mode : AutopilotMode::kDisarmed;
  const bool fresh = commanded_ && to_seconds(now - command_.stamp) <= config_.command_timeout_s;
  const bool follow = fresh && wanted == AutopilotMode::kAttitude;
  if (wanted == AutopilotMode::kDisarmed) must_release_ = false;

  switch (state_) {
    case kInitialising:
      if (ahrs_.initialised()) {
        enter(kStandby, now);
        must_release_ = false;
      }
      return;
    case kStandby: {
      const bool level = ahrs_.R_AB()(2, 2) > std::cos(config_.arming_tilt_rad);
      if (follow && level && !must_release_) enter(kSpinUp, now);
      return;
    }
    case kSpinUp:
    case kOnGround:
      if (!follow) {
        enter(kStandby, now);
      } else if (state_ == kSpinUp) {
        if (to_seconds(now - state_since_) >= config_.spin_up_s) enter(kOnGround, now);
      } else if (command_.thrust_n >
                 config_.takeoff_thrust_fraction * vehicle_.mass_kg * kGravity) {
        enter(kFlying, now);
      }
      return;
    case kFlying:
    case kDescending:
      update_flight(now, follow);
      return;
  }
}

void Autopilot::update_flight(Stamp now, bool follow) {
  using enum AutopilotState;
  std::optional<double> vertical_speed;
  if (!health_.barometer_silent()) vertical_speed = ahrs_.velocity().z();
  const LandDetector::Stage stage =
      land_detector_.update(now, {support_n_, thrust_setpoint_n_, vertical_speed, rate_B_.norm()});
  contact_ = stage != LandDetector::Stage::kAirborne;
  // The integrators would wind up against the feet.
  if (contact_) rate_control_.reset(rate_B_);
  if (stage == LandDetector::Stage::kLanded) {
    enter(kStandby, now);
  } else if (follow != (state_ == kFlying)) {
    enter(follow ? kFlying : kDescending, now);
  }
}

double Autopilot::descent_thrust(double dt) {
  const double error = -config_.descent_speed_mps - ahrs_.velocity().z();
  const double weight = vehicle_.mass_kg * kGravity;
  const double acceleration = config_.descent_p * error + descent_integral_;
  const double up = std::max(ahrs_.R_AB()(2, 2), 0.5);  // beyond 60 degrees no more thrust helps
  const double wanted = vehicle_.mass_kg * (kGravity + acceleration) / up;
  const double thrust = std::clamp(wanted, kDescentThrustLow * weight, kDescentThrustHigh * weight);
  if ((thrust - wanted) * error >= 0) descent_integral_ += config_.descent_i * error * dt;
  return thrust;
}

void Autopilot::update_targets(double dt) {
  Mat3 R_AB_desired = R_AB_descend_;
  double yaw_rate = 0;
  if (state_ == AutopilotState::kFlying) {
    if (contact_) {
      R_AB_desired = so3::from_yaw(so3::yaw(ahrs_.R_AB()));
    } else {
      R_AB_desired = limit_tilt(command_.R_AB_desired, config_.control.tilt_limit_rad);
      yaw_rate = command_.yaw_rate_radps;
    }
    thrust_setpoint_n_ = command_.thrust_n;
  } else if (state_ == AutopilotState::kDescending) {
    thrust_setpoint_n_ = descent_thrust(dt);
  } else {
    return;
  }
  rate_setpoint_ = attitude_rate_setpoint(config_.control, ahrs_.R_AB(), R_AB_desired, yaw_rate);
}

void Autopilot::run_rate_loop() {
  if (!armed()) {
    motors_ = {};
    demanded_thrust_n_.setZero();
    return;
  }
  const double low = motor_.idle_thrust();
  Vec4 thrust = Vec4::Constant(low);
  if (!landed()) {
    // A flat battery may leave less than idle; the throttle then saturates.
    const double high = std::max(motor_.full_thrust(voltage_v_), 2 * low);
    const Vec3 torque = rate_control_.update(rate_setpoint_, rate_B_);
    const auto result = allocation_.allocate({thrust_setpoint_n_, torque}, low, high);
    rate_control_.integrate(result.achieved.torque_nm);
    thrust = result.rotor_thrust_n;
  }
  demanded_thrust_n_ = thrust;
  for (int i = 0; i < 4; ++i) {
    motors_.throttle[static_cast<std::size_t>(i)] = motor_.throttle(thrust[i], voltage_v_);
  }
}

void Autopilot::watch_health(double dt) {
  HealthMonitor::Flight flight;
  flight.armed = armed();
  flight.in_air = !landed() && !contact_;
  flight.tilt_rad = std::acos(std::clamp(ahrs_.R_AB()(2, 2), -1.0, 1.0));
  // What the rate loop adds in the mean is what the rotors fail to give.
  flight.missing.steady << support_n_, -rate_control_.integral_nm();
  flight.missing.at_once << support_n_, -rate_control_.demand_nm();
  health_.update(now_, flight, dt);
}

void Autopilot::follow_rotors(double dt) {
  const double share = dt / (dt + config_.motor.time_constant_s);
  // Braking at 45 degrees the air comes from below and adds a third to the thrust, though the
  // vehicle neither climbs nor sinks: without it, that would look like support by the ground.
  const double axial = ahrs_.R_AB().col(2).dot(ahrs_.velocity());
  rotor_thrust_n_ = 0;
  for (int i = 0; i < 4; ++i) {
    rotor_radps_[i] += share * (motor_.speed(demanded_thrust_n_[i]) - rotor_radps_[i]);
    rotor_thrust_n_ += motor_.thrust(rotor_radps_[i], axial);
  }
}

}  // namespace arex
