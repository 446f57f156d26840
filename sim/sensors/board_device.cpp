#include "sensors/board_device.h"

#include <array>
#include <optional>

namespace arex::sim {
namespace {

constexpr Stamp kPowerPeriod = 5 * kNanosecondsPerTick;  // 200 Hz

}  // namespace

void BoardDevice::fire(const Moment& moment) {
  delivered_ = true;
  const Stamp now = moment.now;
  std::optional<ImuSample> raw = imu_.sample(moment.truth);
  std::optional<ImuSample> output = imu_.output();
  fields_.clear();
  field_line_.pass(now, imu_.magnetometer(),
                   [&](const MagnetometerSample& sample) { fields_.push_back(sample); });
  if (!field_line_.sound()) {
    // The nine axes hold what the magnetometer has delivered, not what it has measured.
    if (!fields_.empty()) field_gauss_ = fields_.back().field_gauss;
    raw->field_gauss = field_gauss_;
    if (output) output->field_gauss = field_gauss_;
  }
  raw_line_.pass(now, raw, [&](const ImuSample& sample) {
    autopilot_.add_imu(sample);
    add(sample);
  });
  output_line_.pass(now, output, [&](const ImuSample& sample) {
    outlets_.software->add_imu(sample);
    add(sample);
    for (BagWriter* bag : outlets_.bags) bag->imu(sample);
  });
  for (const MagnetometerSample& sample : fields_) {
    autopilot_.add_magnetometer(sample);
    fingerprint_.add({sample.field_gauss.data(), 3});
  }
  pressure_line_.pass(now, imu_.barometer(), [&](const BarometerSample& sample) {
    autopilot_.add_barometer(sample);
    fingerprint_.add({&sample.pressure_pa, 1});
  });
  hand_on_power(moment);
}

void BoardDevice::hand_on_power(const Moment& moment) {
  std::optional<BatterySample> reading;
  if (moment.now % kPowerPeriod == 0) {
    reading = {moment.now, moment.battery.voltage_v, moment.battery.current_a};
  }
  power_line_.pass(moment.now, reading, [&](const BatterySample& power) {
    autopilot_.add_battery(power);
    outlets_.software->add_battery(power);
    fingerprint_.add(std::array{power.voltage_v, power.current_a});
  });
}

void BoardDevice::add(const ImuSample& sample) {
  fingerprint_.add(static_cast<std::uint64_t>(sample.stamp));
  fingerprint_.add({sample.gyro_radps.data(), 3});
  fingerprint_.add({sample.accel_mps2.data(), 3});
  fingerprint_.add({sample.field_gauss.data(), 3});
}

}  // namespace arex::sim
