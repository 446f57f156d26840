#pragma once

#include "math/types.h"
#include "messages/sensors.h"
#include "physics/truth.h"

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

/// What it measures. @param X_OW of the odometry's origin as it should be
inline MocapSample sample_mocap(const MocapConfig& config, Stamp now, const Pose& X_OW,
                                const Truth& truth) {
  MocapSample sample{now, X_OW * truth.X_WB, X_OW.R * truth.v_WB};
  if (now >= from_seconds(config.fault_jump_from_s)) sample.X_OB.p += config.fault_jump_m;
  return sample;
}

}  // namespace arex::sim
