#include "run/replay.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>
#include <utility>

#include "messages/odometry_need.h"
#include "semantics/semantic_map.h"
#include "stack/stack.h"

namespace arex::sim {
namespace {

constexpr Stamp kSamplePeriod = FlightScorer::kPeriod;
constexpr Stamp kRowPeriod = 50 * kNanosecondsPerTick;  // 20 Hz: flight.csv
constexpr Stamp kGrowthDue = 1000 * kNanosecondsPerTick;
// After so long a pause, time goes on just before the next message.
constexpr Stamp kLongestPause = 60 * kNanosecondsPerSecond;
constexpr Stamp kBeforeNext = kNanosecondsPerSecond;
// Between estimates further apart nothing is known of the way.
constexpr Stamp kLongestGap = kNanosecondsPerSecond / 10;
constexpr double kUnknown = std::numeric_limits<double>::quiet_NaN();

Stamp tick_before(Stamp stamp) {
  return stamp >= 0
             ? stamp / kNanosecondsPerTick * kNanosecondsPerTick
             : -((-stamp + kNanosecondsPerTick - 1) / kNanosecondsPerTick) * kNanosecondsPerTick;
}

/// What the mission and the planner say is of nobody's concern, and what the watch finds by the
/// firings of a MID-360 is true of no other LiDAR.
bool concerns_replay(const Event& event) {
  switch (event.kind) {
    case EventKind::kOdometryStatus:
    case EventKind::kMapFull:
      return true;
    case EventKind::kSensorFault:
      return !event.detail.starts_with("lidar returns") && event.detail != "lidar sound again";
    default:
      return false;
  }
}

double length_of(const std::vector<PosePair>& pairs) {
  double length = 0;
  for (std::size_t i = 1; i < pairs.size(); ++i) {
    length += (pairs[i].X_WB.p - pairs[i - 1].X_WB.p).norm();
  }
  return length;
}

nlohmann::ordered_json json_of(const MessageCounts& counts, const std::string& topic) {
  return {{"topic", topic},
          {"used", counts.used},
          {"damaged", counts.damaged},
          {"unordered", counts.unordered},
          {"doubled", counts.doubled},
          {"missing", counts.missing}};
}

}  // namespace

std::string ReplayResult::outcome() const {
  if (interrupted) return "interrupted";
  return began && !lost ? "succeeded" : "lost";
}

std::string ReplayResult::reason() const {
  if (interrupted) return "signal";
  if (!began) return "the odometry never began: " + missing;
  return lost ? "the odometry was lost in the end" : "the recording is over";
}

bool Replay::Track::follow(const Odometry& odometry, Stamp stamp) {
  status = odometry.status;
  if (status == OdometryStatus::kLost) lost_s += to_seconds(kSamplePeriod);
  if (status == OdometryStatus::kInitialising || odometry.stamp <= newest) return false;
  if (!estimates.empty() && stamp <= estimates.back().stamp) return false;
  newest = odometry.stamp;
  estimates.push_back({stamp, Pose(), odometry.X_OB});
  covariances.emplace_back(odometry.covariance.cast<float>());
  return true;
}

Replay::Beside Replay::Track::beside(const std::vector<StampedPose>& truth) const {
  Beside both;
  auto after = estimates.begin();
  for (const StampedPose& pose : truth) {
    after = std::lower_bound(after, estimates.end(), pose.stamp,
                             [](const PosePair& e, Stamp stamp) { return e.stamp < stamp; });
    if (after == estimates.end()) break;
    if (after->stamp == pose.stamp) {
      both.pairs.push_back({pose.stamp, pose.X_WB, after->X_OB});
    } else if (after != estimates.begin()) {
      const PosePair& before = *std::prev(after);
      const Stamp gap = after->stamp - before.stamp;
      if (gap > kLongestGap) continue;
      const double fraction = to_seconds(pose.stamp - before.stamp) / to_seconds(gap);
      both.pairs.push_back(
          {pose.stamp, pose.X_WB, interpolate(before.X_OB, after->X_OB, fraction)});
    } else {
      continue;
    }
    both.covariances.push_back(covariances[static_cast<std::size_t>(after - estimates.begin())]);
  }
  return both;
}

OdometryScore Replay::Beside::score() const {
  OdometryScore score = score_odometry(pairs);
  Nees nees;
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    nees.add(pairs.front(), pairs[i], covariances[i].cast<double>());
  }
  score.nees_rotation = nees.rotation();
  score.nees_position = nees.position();
  return score;
}

Replay::Replay(const Scenario& scenario, ReplayInput& input, int threads)
    : config_(scenario.config), input_(input), coming_(input.next()), jobs_(threads) {
  stack_ = std::make_unique<Stack>(config_.stack, jobs_, config_.seed);
  if (coming_) begin_ = now_ = tick_before(coming_->time);
}

Replay::~Replay() { jobs_.stop(); }

bool Replay::tick() {
  if (coming_ && coming_->time - now_ > kLongestPause) {
    now_ = tick_before(coming_->time - kBeforeNext);
  }
  stack_->begin(now_);
  deliver();
  {
    const StageTimer::Scope timed(stack_time_);
    jobs_.advance(now_);
    static_cast<void>(stack_->tick());
  }
  record();
  if (!coming_ || interrupted_) return false;
  now_ += kNanosecondsPerTick;
  return true;
}

// As in a flight: what a tick brings of the IMU, then what jobs have ready, then scans. Shutters
// open between two ticks: what a camera saw comes before what jobs have ready on the tick.
void Replay::deliver() {
  while (coming_ && coming_->time <= now_) {
    if (coming_->depth || coming_->images) jobs_.advance(now_ - 1);
    const bool maps_it =
        coming_->depth && stack_->accepts_depth(coming_->depth->device, coming_->depth->stamp);
    if (maps_it) stack_->add_depth(coming_->depth);
    if (coming_->images) stack_->add_images(coming_->images);
    if (coming_->imu) {
      imu_stamp_ = coming_->imu->stamp;
      stack_->add_imu(*coming_->imu);
    }
    if (coming_->scan) {
      jobs_.advance(now_);
      stack_->add_scan(coming_->scan);
    }
    const StageTimer::Scope timed(reading_time_);
    coming_ = input_.next();
  }
}

void Replay::record() {
  for (const Event& event : stack_->take_events()) {
    if (recorder_ && concerns_replay(event)) recorder_->event(event);
  }
  static_cast<void>(stack_->take_decisions());
  const std::vector<FeatureSight> features = stack_->take_features();
  if (recorder_) recorder_->features(features);
  if (now_ % kSamplePeriod == 0) {
    // The estimate that is held when a sample has come is the one of its stamp.
    const FlightView view = stack_->view();
    FlightSample sample;
    if (flown_.follow(view.odometry, imu_stamp_)) sample.estimate_X_OB = view.odometry.X_OB;
    for (const NamedOdometry& other : view.others) {
      const std::string name(other.name);
      if (others_[name].follow(*other.odometry, imu_stamp_)) {
        sample.others_X_OB.emplace_back(name, other.odometry->X_OB);
      }
    }
    if (recorder_) recorder_->sample(imu_stamp_, sample);
  }
  if (recorder_ && now_ % kFlushPeriod == 0) recorder_->flush();
  if (recorder_ && now_ % kGrowthPeriod == 0) note_cloud_growth();
}

void Replay::note_cloud_growth() {
  stack_->read_cloud(now_ + kGrowthDue,
                     [this, stamp = now_](const PointCloudMap& cloud) -> JobQueue::Delivery {
                       if (cloud.size() > 0) cloud_growth_.push_back({stamp, cloud.size()});
                       return nullptr;
                     });
}

void Replay::write_maps() {
  const std::vector<Vec3f> cloud = stack_->cloud().points();
  if (!cloud.empty()) recorder_->write_cloud(cloud, cloud_growth_);
  if (config_.stack.mapping.enabled) recorder_->write_maps(stack_->mapper());
  if (cloud.empty() || !config_.semantics.enabled) return;
  const StageTimer::Scope timed(semantics_time_);
  constexpr float kStep = 0.25F;  // m, between points of the path
  std::vector<Vec3f> path;
  for (const PosePair& estimate : flown_.estimates) {
    const Vec3f p = estimate.X_OB.p.cast<float>();
    if (path.empty() || (p - path.back()).norm() > kStep) path.push_back(p);
  }
  recorder_->write_semantics(build_semantic_map(cloud, path, config_.semantics.map), cloud, path);
}

// In O, where the estimate began: what a flight's truth.tum and flight.csv are.
void Replay::write_truth(const std::vector<PosePair>& pairs) {
  if (pairs.empty()) return;
  const Pose X_OW = align_at_start(pairs).inverse();
  std::optional<PosePair> last;
  for (const PosePair& pair : pairs) {
    FlightSample sample;
    const Pose X_OB = X_OW * pair.X_WB;
    sample.truth_X_OB = X_OB;
    if (!last || pair.stamp - last->stamp >= kRowPeriod) {
      FlightRow row;
      row.stamp = pair.stamp;
      row.speed_mps =
          last ? (pair.X_WB.p - last->X_WB.p).norm() / to_seconds(pair.stamp - last->stamp) : 0;
      row.tracking_error_m = row.clearance_m = kUnknown;
      row.odometry_error_m = (pair.X_OB.p - X_OB.p).norm();
      row.odometry_yaw_error_rad = so3::yaw(X_OB.R.transpose() * pair.X_OB.R);
      row.height_m = X_OB.p.z();
      row.battery_voltage_v = row.battery_power_w = row.battery_fraction = kUnknown;
      sample.row = row;
      last = pair;
    }
    recorder_->sample(pair.stamp, sample);
  }
}

ReplayResult Replay::finish(const std::vector<StampedPose>& truth) {
  jobs_.drain();
  ReplayResult result;
  result.duration = now_ - begin_;
  result.interrupted = interrupted_;
  result.began = !flown_.estimates.empty();
  result.lost = flown_.status == OdometryStatus::kLost;
  const FlightView view = stack_->view();
  result.missing = kOdometryNeedNames[static_cast<std::size_t>(view.need)];
  result.tally = view.tally;
  Beside flown = flown_.beside(truth);
  result.odometry = flown.score();
  result.poses = std::move(flown.pairs);
  result.lost_s = flown_.lost_s;
  for (const auto& [name, track] : others_) {
    if (track.estimates.empty()) continue;
    result.others[name] = {track.beside(truth).score(), track.lost_s};
  }
  for (const NamedOdometry& other : view.others) {
    const auto found = result.others.find(std::string(other.name));
    if (found != result.others.end()) found->second.tally = other.tally;
  }
  if (!result.poses.empty()) result.distance_m = length_of(result.poses);
  if (recorder_) {
    write_truth(result.poses);
    write_maps();
  }
  for (const StageTimer* timer : {&reading_time_, &stack_time_, &semantics_time_}) {
    result.timing.push_back(timing_row(timer->name(), timer->seconds()));
  }
  for (const auto& lane : jobs_.timings()) {
    result.timing.push_back(timing_row(lane.name, lane.seconds));
  }
  return result;
}

nlohmann::ordered_json summarise_replay(const Scenario& scenario, const ReplayResult& result,
                                        const ReplayInput& input, const std::string& recording,
                                        const HostTime& host) {
  Figures figures;
  const double duration_s = to_seconds(result.duration);
  figures.set("outcome", result.outcome());
  figures.set("reason", result.reason());
  figures.set("scenario", scenario.name);
  figures.set("seed", scenario.config.seed);
  figures.set("sim_time_s", duration_s);
  figures.set("wall_time_s", host.wall_s);
  figures.set("cpu_time_s", host.cpu_s);
  figures.set("real_time_factor", duration_s / host.wall_s);
  if (result.distance_m) figures.set("distance_m", *result.distance_m);
  figures.set("odometry.source", scenario.config.stack.odometry.source);
  add_figures(result.odometry, "odometry", figures);
  if (result.began) figures.set("odometry.lost_s", result.lost_s);
  add_figures(result.tally, "odometry", figures);
  for (const auto& [name, source] : result.others) {
    add_figures(source.score, "odometries." + name, figures);
    figures.set("odometries." + name + ".lost_s", source.lost_s);
    add_figures(source.tally, "odometries." + name, figures);
  }
  figures.set("build.version", build_version());
  figures.set("build.compiler", build_compiler());
  nlohmann::ordered_json json = figures.json();
  json["replay"] = {{"recording", recording},
                    {"time_origin_s", input.time_origin() / kNanosecondsPerSecond},
                    {"imu", json_of(input.imu_counts(), input.imu_topic())},
                    {"lidar", json_of(input.lidar_counts(), input.lidar_topic())},
                    {"lidar_misses", input.lidar_misses()},
                    {"truth_topic", input.truth_topic()},
                    {"damaged_places", input.damage().places},
                    {"notes", input.notes()},
                    {"world_known", scenario.source.find("world") != nullptr}};
  if (!input.depth_topic().empty()) {
    json["replay"]["depth"] = json_of(input.depth_counts(), input.depth_topic());
  }
  if (!input.infrared_topic().empty()) {
    json["replay"]["infrared"] = json_of(input.infrared_counts(), input.infrared_topic());
  }
  return json;
}

}  // namespace arex::sim
