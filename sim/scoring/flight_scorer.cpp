#include "scoring/flight_scorer.h"

#include <cmath>
#include <utility>

namespace arex::sim {
namespace {

constexpr Stamp kRowPeriod = 50 * kNanosecondsPerTick;  // 20 Hz: flight.csv, clearance
constexpr double kUnknown = std::numeric_limits<double>::quiet_NaN();

// Landing and without odometry the vehicle follows no setpoint: the autopilot brings it down.
bool follows_setpoint(MissionState state) {
  return state != MissionState::kLand && state != MissionState::kLost &&
         state != MissionState::kDone;
}

bool is_en_route(MissionState state) {
  return state == MissionState::kFly || state == MissionState::kEntry ||
         state == MissionState::kExplore || state == MissionState::kReturn;
}

}  // namespace

FlightScorer::FlightScorer(const Scene& scene, const Airframe& airframe, const Pose& X_WB_start,
                           ThinBranchMeter thin)
    : clearance_(scene, airframe), thin_(std::move(thin)), X_WO_(X_WB_start) {}

void add_figures(const std::optional<VisualTally>& tally, const std::string& section,
                 Figures& figures) {
  if (!tally || tally->exposures == 0) return;
  figures.set(section + ".tracked_mean",
              static_cast<double>(tally->tracked) / static_cast<double>(tally->exposures));
  figures.set(section + ".keyframes", static_cast<int>(tally->keyframes));
}

bool FlightScorer::Track::follow(const Odometry& odometry, const Truth& truth) {
  if (odometry.status == OdometryStatus::kLost) lost_s += to_seconds(kPeriod);
  if (odometry.status == OdometryStatus::kInitialising || odometry.stamp <= newest) return false;
  // What the source holds for now is scored as such, whatever the IMU's clock says.
  newest = odometry.stamp;
  poses.push_back({truth.stamp, truth.X_WB, odometry.X_OB});
  nees.add(poses.front(), poses.back(), odometry.covariance);
  return true;
}

OdometryScore FlightScorer::Track::score() const {
  OdometryScore score = score_odometry(poses);
  score.nees_rotation = nees.rotation();
  score.nees_position = nees.position();
  return score;
}

void FlightScorer::moved(const Truth& before, const Truth& after) {
  distance_m_ += (after.X_WB.p - before.X_WB.p).norm();
  yaw_.add(after);
}

FlightSample FlightScorer::sample(const Truth& truth, const FlightView& view, bool flying,
                                  const BatteryState& battery) {
  FlightSample sample;
  const Odometry& odometry = view.odometry;
  const bool begins = flown_.poses.empty();
  if (flown_.follow(odometry, truth)) {
    // The stack's O is where its odometry began; truth is compared in that frame from then on.
    if (begins) X_WO_ = truth.X_WB * odometry.X_OB.inverse();
    sample.estimate_X_OB = odometry.X_OB;
  }
  for (const NamedOdometry& other : view.others) {
    const std::string name(other.name);
    if (others_[name].follow(*other.odometry, truth)) {
      sample.others_X_OB.emplace_back(name, other.odometry->X_OB);
    }
  }
  if (flown_.poses.empty()) return sample;
  const Pose X_OB = X_WO_.inverse() * truth.X_WB;
  sample.truth_X_OB = X_OB;

  const MissionState state = view.state;
  double tracking_error = kUnknown;
  if (flying && follows_setpoint(state)) {
    tracking_error = (X_OB.p - view.setpoint.p_OB).norm();
    tracking_sum_ += tracking_error * tracking_error;
    ++tracking_count_;
  }
  if (state == MissionState::kLand) landing_O_ = view.goal_O;
  if (truth.stamp % kRowPeriod != 0) return sample;
  const bool en_route = is_en_route(state);
  const double clearance = en_route ? clearance_.measure(truth) : kUnknown;
  if (en_route && view.grid) {
    ++grid_count_;
    blocked_count_ += view.grid->view.inflated(odometry.X_OB.p);
  }
  if (const auto& grid = view.grid; en_route && grid && !thin_.empty()) {
    thin_.observe(truth, odometry.X_OB, grid->view);
  }
  sample.row = row(truth, X_OB, tracking_error, clearance, battery);
  return sample;
}

FlightRow FlightScorer::row(const Truth& truth, const Pose& X_OB, double tracking_error,
                            double clearance, const BatteryState& battery) const {
  FlightRow row;
  row.stamp = truth.stamp;
  row.speed_mps = truth.v_WB.norm();
  row.tracking_error_m = tracking_error;
  row.odometry_error_m = (flown_.poses.back().X_OB.p - X_OB.p).norm();
  row.odometry_yaw_error_rad = so3::wrap(so3::yaw(flown_.poses.back().X_OB.R) - so3::yaw(X_OB.R));
  row.clearance_m = clearance;
  row.height_m = X_OB.p.z();
  row.battery_voltage_v = battery.voltage_v;
  row.battery_power_w = battery.voltage_v * battery.current_a;
  row.battery_fraction = battery.state_of_charge;
  return row;
}

void FlightScorer::target_reached(const Truth& truth, const FlightView& view) {
  const Vec3 target_W = X_WO_ * view.targets.back().p_O;
  target_miss_m_.push_back((truth.X_WB.p - target_W).norm());
}

// A vehicle that fell, was stopped in the air, or came down where it was has no landing to judge.
double FlightScorer::landing_error(const Truth& truth, const FlightView& view) const {
  const bool landed = view.state == MissionState::kDone && !view.lost;
  if (!landed || view.targets.empty()) return kUnknown;
  const Vec3& target_O = view.targets.back().p_O;
  if (landing_O_ != target_O) return kUnknown;
  return (truth.X_WB.p - X_WO_ * target_O).head<2>().norm();
}

FlightScore FlightScorer::score(const Truth& truth, const FlightView& view) const {
  FlightScore score;
  score.distance_m = distance_m_;
  score.yaw = yaw_;
  if (tracking_count_ > 0) {
    score.tracking_rmse_m = std::sqrt(tracking_sum_ / static_cast<double>(tracking_count_));
  }
  score.landing_error_m = landing_error(truth, view);
  if (grid_count_ > 0) {
    score.own_cell_blocked_fraction =
        static_cast<double>(blocked_count_) / static_cast<double>(grid_count_);
  }
  score.target_miss_m = target_miss_m_;
  score.poses = flown_.poses;
  score.odometry = flown_.score();
  score.odometry_lost_s = flown_.lost_s;
  for (const auto& [name, track] : others_) {
    if (!track.poses.empty()) score.others[name] = {track.score(), track.lost_s};
  }
  score.tally = view.tally;
  for (const NamedOdometry& other : view.others) {
    const auto found = score.others.find(std::string(other.name));
    if (found != score.others.end()) found->second.tally = other.tally;
  }
  score.clearance = clearance_.statistics();
  if (view.state == MissionState::kDone) {
    score.landing = score_landing(clearance_, truth.X_WB);
  }
  if (!thin_.empty()) score.thin = thin_.score();
  return score;
}

}  // namespace arex::sim
