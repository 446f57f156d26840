#pragma once

#include <limits>
#include <optional>
#include <vector>

#include "physics/physics.h"
#include "run/recorder.h"
#include "scoring/clearance.h"
#include "scoring/landing.h"
#include "scoring/odometry_error.h"
#include "scoring/thin_branches.h"
#include "stack/stack.h"

namespace arex::sim {

/// What a flight amounts to beside its outcome; most of summary.json. Not a number: there was
/// nothing to measure.
struct FlightScore {
  double distance_m = 0;
  /// True position against the setpoint, from take-off until it begins to land.
  double tracking_rmse_m = std::numeric_limits<double>::quiet_NaN();
  /// Horizontal, true resting place against the last target, where it landed on that.
  double landing_error_m = std::numeric_limits<double>::quiet_NaN();
  std::vector<double> target_miss_m;  ///< true distance from each target when it was reported
  std::vector<PosePair> poses;        ///< truth and estimate at 200 Hz
  OdometryScore odometry;
  double odometry_lost_s = 0;
  ClearanceMeter::Statistics clearance;
  std::optional<LandingScore> landing;  ///< of a vehicle that came down and disarmed
  std::optional<ThinBranchScore> thin;  ///< where the world has thin branches
};

/// Follows a flight with the truth in hand: the place in sim/run where truth meets estimate.
class FlightScorer {
 public:
  FlightScorer(const Scene& scene, const Airframe& airframe, const Pose& X_WB_start,
               ThinBranchMeter thin);

  static constexpr Stamp kPeriod = 5 * kNanosecondsPerTick;  ///< 200 Hz

  /// After each physics tick.
  void moved(const Truth& before, const Truth& after);
  /// Every kPeriod; `recorder` may be null.
  void sample(const Truth& truth, const Stack& stack, bool flying, const BatteryState& battery,
              Recorder* recorder);
  /// When the mission says that it reached its newest target.
  void target_reached(const Truth& truth, const Stack& stack);

  /// O in W: where the stack's odometry began; until then where it should begin.
  [[nodiscard]] const Pose& X_WO() const { return X_WO_; }
  [[nodiscard]] double distance_m() const { return distance_m_; }
  [[nodiscard]] FlightScore score(const Truth& truth, const Stack& stack) const;

 private:
  void write_row(const Truth& truth, const Pose& X_OB, double tracking_error, double clearance,
                 const BatteryState& battery, Recorder& recorder) const;
  [[nodiscard]] double landing_error(const Truth& truth, const Mission& mission) const;

  ClearanceMeter clearance_;
  ThinBranchMeter thin_;
  Pose X_WO_;
  std::vector<PosePair> poses_;
  double odometry_lost_s_ = 0;
  Stamp last_estimate_ = -1;  ///< stamp of the newest one scored
  double distance_m_ = 0;
  double tracking_sum_ = 0;
  std::size_t tracking_count_ = 0;
  std::vector<double> target_miss_m_;
  std::optional<Vec3> landing_O_;  ///< the target above which it began to land
};

}  // namespace arex::sim
