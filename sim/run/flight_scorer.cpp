#include "run/flight_scorer.h"

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

void FlightScorer::moved(const Truth& before, const Truth& after) {
  distance_m_ += (after.X_WB.p - before.X_WB.p).norm();
}

void FlightScorer::sample(const Truth& truth, const Stack& stack, bool flying,
                          const BatteryState& battery, Recorder* recorder) {
  const Odometry& odometry = stack.odometry();
  if (odometry.status == OdometryStatus::kLost) odometry_lost_s_ += to_seconds(kPeriod);
  if (odometry.status != OdometryStatus::kInitialising && odometry.stamp > last_estimate_) {
    // What the stack holds for now is scored as such, whatever the IMU's clock says.
    last_estimate_ = odometry.stamp;
    // The stack's O is where its odometry began; truth is compared in that frame from then on.
    if (poses_.empty()) X_WO_ = truth.X_WB * odometry.X_OB.inverse();
    poses_.push_back({truth.stamp, truth.X_WB, odometry.X_OB});
    if (recorder) recorder->estimate(truth.stamp, odometry.X_OB);
  }
  if (poses_.empty()) return;
  const Pose X_OB = X_WO_.inverse() * truth.X_WB;
  if (recorder) recorder->truth(truth.stamp, X_OB);

  const MissionState state = stack.mission().state();
  double tracking_error = kUnknown;
  if (flying && follows_setpoint(state)) {
    tracking_error = (X_OB.p - stack.setpoint().p_OB).norm();
    tracking_sum_ += tracking_error * tracking_error;
    ++tracking_count_;
  }
  if (state == MissionState::kLand) landing_O_ = stack.mission().request().goal_O;
  if (truth.stamp % kRowPeriod != 0) return;
  const bool en_route = is_en_route(state);
  const double clearance = en_route ? clearance_.measure(truth) : kUnknown;
  if (const auto& grid = stack.perception().grid(); en_route && grid && !thin_.empty()) {
    thin_.observe(truth, odometry.X_OB, grid->view);
  }
  if (recorder) write_row(truth, X_OB, tracking_error, clearance, battery, *recorder);
}

void FlightScorer::write_row(const Truth& truth, const Pose& X_OB, double tracking_error,
                             double clearance, const BatteryState& battery,
                             Recorder& recorder) const {
  FlightRow row;
  row.stamp = truth.stamp;
  row.speed_mps = truth.v_WB.norm();
  row.tracking_error_m = tracking_error;
  row.odometry_error_m = (poses_.back().X_OB.p - X_OB.p).norm();
  row.odometry_yaw_error_rad = so3::wrap(so3::yaw(poses_.back().X_OB.R) - so3::yaw(X_OB.R));
  row.clearance_m = clearance;
  row.height_m = X_OB.p.z();
  row.battery_voltage_v = battery.voltage_v;
  row.battery_power_w = battery.voltage_v * battery.current_a;
  row.battery_fraction = battery.state_of_charge;
  recorder.flight(row);
}

void FlightScorer::target_reached(const Truth& truth, const Stack& stack) {
  const Vec3 target_W = X_WO_ * stack.mission().targets().back().p_O;
  target_miss_m_.push_back((truth.X_WB.p - target_W).norm());
}

// A vehicle that fell, was stopped in the air, or came down where it was has no landing to judge.
double FlightScorer::landing_error(const Truth& truth, const Mission& mission) const {
  const bool landed = mission.state() == MissionState::kDone && !mission.lost();
  if (!landed || mission.targets().empty()) return kUnknown;
  const Vec3& target_O = mission.targets().back().p_O;
  if (landing_O_ != target_O) return kUnknown;
  return (truth.X_WB.p - X_WO_ * target_O).head<2>().norm();
}

FlightScore FlightScorer::score(const Truth& truth, const Stack& stack) const {
  FlightScore score;
  score.distance_m = distance_m_;
  if (tracking_count_ > 0) {
    score.tracking_rmse_m = std::sqrt(tracking_sum_ / static_cast<double>(tracking_count_));
  }
  score.landing_error_m = landing_error(truth, stack.mission());
  score.target_miss_m = target_miss_m_;
  score.poses = poses_;
  score.odometry = score_odometry(poses_);
  score.odometry_lost_s = odometry_lost_s_;
  score.clearance = clearance_.statistics();
  if (stack.mission().state() == MissionState::kDone)
    score.landing = score_landing(clearance_, truth.X_WB);
  if (!thin_.empty()) score.thin = thin_.score();
  return score;
}

}  // namespace arex::sim
