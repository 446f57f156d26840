#pragma once

#include "autopilot/ahrs.h"
#include "autopilot/allocation.h"
#include "autopilot/attitude_control.h"
#include "autopilot/autopilot_config.h"
#include "autopilot/health_monitor.h"
#include "autopilot/land_detector.h"
#include "autopilot/low_pass.h"
#include "autopilot/motor_model.h"
#include "messages/commands.h"
#include "messages/estimates.h"
#include "messages/sensors.h"
#include "messages/vehicle.h"

namespace arex {

/// Where the autopilot is in its flight.
enum class AutopilotState {
  kInitialising,  ///< the attitude filter waits for two still seconds
  kStandby,       ///< ready to arm
  kSpinUp,        ///< armed, rotors idle
  kOnGround,      ///< armed, thrust below what lifts
  kFlying,        ///< tracks commands
  kDescending,    ///< comes down by itself: told to, or commands stopped
};

/// The flight controller (the Pixhawk): sees its own IMU, magnetometer, barometer and battery, and
/// turns attitude commands into ESC throttles.
///
///   AttitudeCommand -> attitude P (250 Hz) -> rate PID (500 Hz) -> allocation -> thrust curve
///
/// Feet on the ground it stays level whatever is commanded: leaning against wind or a position
/// error it would tip over. It arms on the first kAttitude command once its filter is initialised
/// and the vehicle is nearly level; it disarms on touchdown, and then needs a kDisarmed command
/// before it arms again. In flight kDisarmed is not obeyed but taken as kDescend: nobody stops the
/// rotors of a flying vehicle.
class Autopilot {
 public:
  Autopilot(const AutopilotConfig& config, const VehicleConfig& vehicle);

  void add_imu(const ImuSample& imu);  ///< raw, 1 kHz
  void add_magnetometer(const MagnetometerSample& sample);
  void add_barometer(const BarometerSample& sample);
  void add_battery(const BatterySample& sample);

  /// Takes the newest command; an older one than the present is dropped.
  void command(const AttitudeCommand& command);

  /// Runs the loops that are due and returns what the motors shall do until the next tick.
  /// @pre `now` increases by whole milliseconds.
  MotorCommand tick(Stamp now);

  [[nodiscard]] AttitudeEstimate attitude() const;
  [[nodiscard]] AutopilotState state() const { return state_; }
  [[nodiscard]] bool armed() const { return state_ >= AutopilotState::kSpinUp; }
  /// Standing: not in the air as far as it knows.
  [[nodiscard]] bool landed() const { return state_ < AutopilotState::kFlying; }
  /// Flying, but the ground carries a part of the weight: before lift-off, after touchdown.
  [[nodiscard]] bool ground_contact() const { return contact_; }
  [[nodiscard]] const Ahrs& ahrs() const { return ahrs_; }
  [[nodiscard]] const HealthMonitor& health() const { return health_; }
  /// What it has found to be wrong with sensors, motors and airframe since the last call.
  std::vector<Event> take_notices() { return health_.take_notices(); }

 private:
  void update_state(Stamp now);
  void update_flight(Stamp now, bool follow);
  void enter(AutopilotState state, Stamp now);
  void update_targets(double dt);
  double descent_thrust(double dt);
  void run_rate_loop();
  void follow_rotors(double dt);
  void watch_health(double dt);

  AutopilotConfig config_;
  VehicleConfig vehicle_;
  Ahrs ahrs_;
  Allocation allocation_;
  MotorModel motor_;
  RateControl rate_control_;
  LandDetector land_detector_;
  HealthMonitor health_;
  LowPass gyro_filter_;
  LowPass support_filter_;
  Stamp rate_period_;
  Stamp attitude_period_;

  AutopilotState state_ = AutopilotState::kInitialising;
  Stamp state_since_ = 0;
  bool must_release_ = false;  ///< kDisarmed has to be seen before arming
  AttitudeCommand command_;
  bool commanded_ = false;
  Stamp now_ = 0;  ///< of the newest tick: what arrives is as old at most
  Stamp last_imu_ = 0;
  Stamp battery_stamp_ = 0;
  double voltage_v_;
  Vec3 rate_B_ = Vec3::Zero();  ///< filtered, bias removed
  double support_n_ = 0;        ///< filtered: what carries the vehicle besides its rotors
  bool contact_ = false;        ///< feet on the ground though flying

  Mat3 R_AB_descend_ = Mat3::Identity();
  double descent_integral_ = 0;  ///< m/s^2
  Vec3 rate_setpoint_ = Vec3::Zero();
  double thrust_setpoint_n_ = 0;
  Vec4 demanded_thrust_n_ = Vec4::Zero();  ///< static, of each rotor
  Vec4 rotor_radps_ = Vec4::Zero();        ///< believed speeds, which lag behind the demand
  double rotor_thrust_n_ = 0;              ///< collective, in the present axial flow
  MotorCommand motors_;
};

}  // namespace arex
