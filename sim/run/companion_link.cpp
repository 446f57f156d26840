#include "run/companion_link.h"

#include <algorithm>
#include <utility>

namespace arex::sim {
namespace {

// Bytes of MAVLink 2's messages, 12 of them the frame's: HIGHRES_IMU, ATTITUDE_QUATERNION,
// BATTERY_STATUS, SET_ATTITUDE_TARGET (common.xml of the protocol).
constexpr int kFrameBytes = 12;
constexpr int kImuBytes = 63 + kFrameBytes, kStatusBytes = 32 + kFrameBytes;
constexpr int kBatteryBytes = 36 + kFrameBytes, kCommandBytes = 39 + kFrameBytes;
constexpr int kRotors = 4;

}  // namespace

CompanionLink::CompanionLink(const InterfaceConfig& config, const MotorBelief& motor,
                             const VehicleConfig& vehicle, std::unique_ptr<FlightSoftware> software,
                             std::uint64_t seed)
    : config_(config),
      motor_(motor, vehicle),
      battery_v_(motor.nominal_voltage_v),
      software_(std::move(software)),
      up_(config.uart, seed, "uart up"),
      down_(config.uart, seed, "uart down") {}

void CompanionLink::begin(Stamp now) {
  now_ = now;
  software_->begin(now);
  while (const auto report = up_.receive(now)) hand_on(*report);
}

void CompanionLink::add_imu(const ImuSample& imu) { report(kImuBytes, imu); }

void CompanionLink::add_autopilot(const AutopilotStatus& status) { report(kStatusBytes, status); }

void CompanionLink::add_battery(const BatterySample& battery) {
  battery_v_ = battery.voltage_v;
  report(kBatteryBytes, battery);
}

void CompanionLink::report(int bytes, const Report& what) {
  config_.uart.enabled ? up_.send(now_, bytes, what) : hand_on(what);
}

void CompanionLink::hand_on(const Report& what) {
  if (const auto* imu = std::get_if<ImuSample>(&what)) software_->add_imu(*imu);
  if (const auto* status = std::get_if<AutopilotStatus>(&what)) software_->add_autopilot(*status);
  if (const auto* battery = std::get_if<BatterySample>(&what)) software_->add_battery(*battery);
}

double CompanionLink::throttle_of(double thrust_n) const {
  return std::clamp(thrust_n / (kRotors * motor_.full_thrust(config_.throttle_voltage_v)), 0.0,
                    1.0);
}

double CompanionLink::thrust_of(double throttle) const {
  return throttle * kRotors * motor_.full_thrust(battery_v_);
}

std::optional<AttitudeCommand> CompanionLink::tick() {
  std::optional<AttitudeCommand> command = software_->tick();
  const bool as_throttle = config_.command == InterfaceConfig::Command::kThrottle;
  if (command && as_throttle) command->thrust_n = throttle_of(command->thrust_n);
  if (config_.uart.enabled) {
    if (command) down_.send(now_, kCommandBytes, *std::exchange(command, std::nullopt));
    while (auto arrived = down_.receive(now_)) command = *arrived;
  }
  if (command && as_throttle) command->thrust_n = thrust_of(command->thrust_n);
  return command;
}

}  // namespace arex::sim
