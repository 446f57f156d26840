#pragma once

#include "autopilot/autopilot.h"
#include "sensors/device.h"
#include "sensors/imu.h"

namespace arex::sim {

/// All that the autopilot's board measures, IMU, magnetometer, barometer and power: for the
/// autopilot at once, for the flight software at the output's rate.
class BoardDevice : public Device {
 public:
  BoardDevice(const ImuConfig& config, Autopilot& autopilot, const DeviceContext& context)
      : imu_(config, context.seed), autopilot_(autopilot), outlets_(context.outlets) {}

  void fire(const Moment& moment) override;

 private:
  void add(const ImuSample& sample);

  ImuModel imu_;
  Autopilot& autopilot_;
  Outlets& outlets_;
};

}  // namespace arex::sim
