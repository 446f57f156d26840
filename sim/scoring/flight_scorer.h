#pragma once

#include <limits>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "physics/physics.h"
#include "scoring/clearance.h"
#include "scoring/landing.h"
#include "scoring/odometry_error.h"
#include "scoring/thin_branches.h"
#include "scoring/yaw_meter.h"
#include "stack/flight_software.h"

namespace arex::sim {

/// How an odometry source fared that ran beside.
struct SourceScore {
  OdometryScore score;
  double lost_s = 0;
  std::optional<VisualTally> tally{};  ///< of a visual one
};

/// Sets what a visual odometry's tally says of it.
/// @param section "odometry", or "odometries.NAME"
void add_figures(const std::optional<VisualTally>& tally, const std::string& section,
                 Figures& figures);

/// What a flight amounts to beside its outcome; most of summary.json. Not a number: there was
/// nothing to measure.
struct FlightScore {
  double distance_m = 0;
  YawMeter yaw;
  /// True position against the setpoint, from take-off until it begins to land.
  double tracking_rmse_m = std::numeric_limits<double>::quiet_NaN();
  /// Horizontal, true resting place against the last target, where it landed on that.
  double landing_error_m = std::numeric_limits<double>::quiet_NaN();
  std::vector<double> target_miss_m;  ///< true distance from each target when it was reported
  std::vector<PosePair> poses;        ///< truth and estimate at 200 Hz
  OdometryScore odometry;
  double odometry_lost_s = 0;
  std::optional<VisualTally> tally;           ///< of a visual odometry that flew
  std::map<std::string, SourceScore> others;  ///< of the sources that gave an estimate
  ClearanceMeter::Statistics clearance;
  /// Share of the way, 20 Hz, on which the vehicle's own cell was inflated or occupied in its grid.
  double own_cell_blocked_fraction = std::numeric_limits<double>::quiet_NaN();
  std::optional<LandingScore> landing;  ///< of a vehicle that came down and disarmed
  std::optional<ThinBranchScore> thin;  ///< where the world has thin branches
};

/// What a report plots against time. Not a number: there was nothing to measure.
struct FlightRow {
  Stamp stamp = 0;
  double speed_mps = 0;         ///< true
  double tracking_error_m = 0;  ///< true position against the setpoint
  double odometry_error_m = 0;  ///< estimate against truth, aligned at the start
  double odometry_yaw_error_rad = 0;
  double clearance_m = 0;  ///< airframe to the nearest surface
  double height_m = 0;     ///< true z in O
  double battery_voltage_v = 0;
  double battery_power_w = 0;
  double battery_fraction = 1;  ///< state of charge
};

/// What a moment of a flight gives to be written down; nothing before the odometry has begun.
struct FlightSample {
  std::optional<Pose> truth_X_OB;
  std::optional<Pose> estimate_X_OB;                      ///< where there is a new one
  std::optional<FlightRow> row;                           ///< 20 Hz
  std::vector<std::pair<std::string, Pose>> others_X_OB;  ///< new estimates of further sources
};

/// Follows a flight with the truth in hand: where truth meets estimate.
class FlightScorer {
 public:
  FlightScorer(const Scene& scene, const Airframe& airframe, const Pose& X_WB_start,
               ThinBranchMeter thin);

  static constexpr Stamp kPeriod = 5 * kNanosecondsPerTick;  ///< 200 Hz

  /// After each physics tick.
  void moved(const Truth& before, const Truth& after);
  /// Every kPeriod.
  FlightSample sample(const Truth& truth, const FlightView& view, bool flying,
                      const BatteryState& battery);
  /// When the mission says that it reached its newest target.
  void target_reached(const Truth& truth, const FlightView& view);

  /// O in W: where the stack's odometry began; until then where it should begin.
  [[nodiscard]] const Pose& X_WO() const { return X_WO_; }
  /// Whether the odometry has: O stays where it is now.
  [[nodiscard]] bool has_begun() const { return !flown_.poses.empty(); }
  [[nodiscard]] double distance_m() const { return distance_m_; }
  [[nodiscard]] FlightScore score(const Truth& truth, const FlightView& view) const;

 private:
  /// What an odometry source said, beside the truth. Its O is where it began.
  struct Track {
    std::vector<PosePair> poses;
    Stamp newest = -1;  ///< stamp of the last estimate
    double lost_s = 0;
    Nees nees;

    [[nodiscard]] OdometryScore score() const;
    /// @return whether there is a new estimate
    bool follow(const Odometry& odometry, const Truth& truth);
  };
  [[nodiscard]] FlightRow row(const Truth& truth, const Pose& X_OB, double tracking_error,
                              double clearance, const BatteryState& battery) const;
  [[nodiscard]] double landing_error(const Truth& truth, const FlightView& view) const;

  ClearanceMeter clearance_;
  ThinBranchMeter thin_;
  Pose X_WO_;
  Track flown_;                          ///< of the source that flies
  std::map<std::string, Track> others_;  ///< of those that run beside
  double distance_m_ = 0;
  YawMeter yaw_;
  double tracking_sum_ = 0;
  std::size_t tracking_count_ = 0;
  std::size_t grid_count_ = 0;     ///< rows en route with a grid
  std::size_t blocked_count_ = 0;  ///< of these with the vehicle's own cell blocked
  std::vector<double> target_miss_m_;
  std::optional<Vec3> landing_O_;  ///< the target above which it began to land
};

}  // namespace arex::sim
