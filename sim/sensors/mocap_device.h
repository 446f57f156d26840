#pragma once

#include "sensors/device.h"
#include "sensors/faulty_line.h"

namespace arex::sim {

/// A motion capture system: the true pose and velocity, an oracle for ablations.
struct MocapConfig {
  double fault_jump_from_s = 0;
  Vec3 fault_jump_m = Vec3::Zero();

  void fields(auto& f) {
    f("fault_jump_from_s", fault_jump_from_s, "from here on its origin stands elsewhere");
    f("fault_jump_m", fault_jump_m, "by this much, in O: as after a relocalisation");
    f.check(fault_jump_from_s >= 0, "fault_jump_from_s >= 0");
  }
};

class MocapDevice : public Device {
 public:
  /// @param X_WO the odometry's origin as it should be
  MocapDevice(const MocapConfig& config, const Pose& X_WO, const DeviceContext& context)
      : config_(config),
        X_OW_(X_WO.inverse()),
        outlets_(context.outlets),
        line_(context.faults, context.seed, "mocap") {}

  void fire(const Moment& moment) override {
    constexpr Stamp kPeriod = 5 * kNanosecondsPerTick;  // 200 Hz
    std::optional<MocapSample> reading;
    if (moment.now % kPeriod == 0) {
      reading = {moment.now, X_OW_ * moment.truth.X_WB, X_OW_.R * moment.truth.v_WB};
      if (moment.now >= from_seconds(config_.fault_jump_from_s)) {
        reading->X_OB.p += config_.fault_jump_m;
      }
    }
    line_.pass(moment.now, reading,
               [this](const MocapSample& sample) { outlets_.software->add_mocap(sample); });
  }

 private:
  MocapConfig config_;
  Pose X_OW_;
  Outlets& outlets_;
  FaultyLine<MocapSample> line_;
};

}  // namespace arex::sim
