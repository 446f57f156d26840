#pragma once

#include <vector>

#include "autopilot/autopilot.h"
#include "sensors/device.h"
#include "sensors/faulty_line.h"
#include "sensors/imu.h"

namespace arex::sim {

/// All that the autopilot's board measures, IMU, magnetometer, barometer and power: for the
/// autopilot at once, for the flight software at the output's rate.
class BoardDevice : public Device {
 public:
  BoardDevice(const ImuConfig& config, Autopilot& autopilot, const DeviceContext& context)
      : imu_(config, context.seed),
        raw_line_(context.faults, context.seed, "imu", " raw"),
        output_line_(context.faults, context.seed, "imu"),
        field_line_(context.faults, context.seed, "magnetometer"),
        pressure_line_(context.faults, context.seed, "barometer"),
        power_line_(context.faults, context.seed, "power"),
        autopilot_(autopilot),
        outlets_(context.outlets) {}

  void fire(const Moment& moment) override;

 private:
  void add(const ImuSample& sample);
  void hand_on_power(const Moment& moment);

  ImuModel imu_;
  FaultyLine<ImuSample> raw_line_, output_line_;
  FaultyLine<MagnetometerSample> field_line_;
  FaultyLine<BarometerSample> pressure_line_;
  FaultyLine<BatterySample> power_line_;
  std::vector<MagnetometerSample> fields_;  ///< that arrive at this tick
  Vec3 field_gauss_ = Vec3::Zero();         ///< the newest that has arrived
  Autopilot& autopilot_;
  Outlets& outlets_;
};

}  // namespace arex::sim
