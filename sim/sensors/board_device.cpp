#include "sensors/board_device.h"

#include <array>

namespace arex::sim {
namespace {

constexpr Stamp kPowerPeriod = 5 * kNanosecondsPerTick;  // 200 Hz

}  // namespace

void BoardDevice::fire(const Moment& moment) {
  delivered_ = true;
  const ImuSample raw = imu_.sample(moment.truth);
  autopilot_.add_imu(raw);
  add(raw);
  if (const auto sample = imu_.output()) {
    outlets_.software->add_imu(*sample);
    add(*sample);
    if (outlets_.bag) outlets_.bag->imu(*sample);
  }
  if (const auto sample = imu_.magnetometer()) {
    autopilot_.add_magnetometer(*sample);
    fingerprint_.add({sample->field_gauss.data(), 3});
  }
  if (const auto sample = imu_.barometer()) {
    autopilot_.add_barometer(*sample);
    fingerprint_.add({&sample->pressure_pa, 1});
  }
  if (moment.now % kPowerPeriod != 0) return;
  const BatterySample power{moment.now, moment.battery.voltage_v, moment.battery.current_a};
  autopilot_.add_battery(power);
  outlets_.software->add_battery(power);
  fingerprint_.add(std::array{power.voltage_v, power.current_a});
}

void BoardDevice::add(const ImuSample& sample) {
  fingerprint_.add(static_cast<std::uint64_t>(sample.stamp));
  fingerprint_.add({sample.gyro_radps.data(), 3});
  fingerprint_.add({sample.accel_mps2.data(), 3});
}

}  // namespace arex::sim
