#include "run/simulation.h"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <cstdio>
#include <utility>

namespace arex::sim {
namespace {

constexpr Stamp kTick = kNanosecondsPerTick;
constexpr Stamp kStatusPeriod = 5 * kTick;  // 200 Hz: what the autopilot tells, the battery, mocap
constexpr Stamp kCloudPeriod = 10'000 * kTick;  // the map as a killed run leaves it
constexpr Stamp kPathPeriod = 100 * kTick;      // 10 Hz: revisits and turns
constexpr Stamp kCoveragePeriod = 1000 * kTick;
constexpr Stamp kScoreDue = 1000 * kTick;  // the flight does not wait for what is scored or written
constexpr Stamp kGrowthPeriod = 500 * kTick;  // what a replay of the map resolves
constexpr Stamp kFlushPeriod = 1000 * kTick;  // what a killed run leaves
constexpr Stamp kLidarPart = 20 * kTick;      // a frame is cast in parts while it is fired

std::vector<worlds::CollisionShape> airframe_without_lidar(const Airframe& airframe) {
  std::vector<worlds::CollisionShape> shapes;
  for (const auto& shape : airframe.shapes) {
    if (shape.object != static_cast<std::uint32_t>(AirframePart::kLidar)) shapes.push_back(shape);
  }
  return shapes;
}

/// What the planner counts with when it asks how fast it may fly.
StoppingModel stopping_of(const StackConfig& stack) {
  const PlanningConfig& planning = stack.planning;
  return {stack.vehicle.radius_m, planning.local.max_acceleration_mps2,
          planning.local.reaction_s + planning.replan.planning_latency_s};
}

std::uint64_t hash_of(const LidarScan& scan) {
  TrajectoryHash hash;
  for (const LidarPoint& point : scan.points) {
    hash.add_bytes(std::span<const float>(point.p_L.data(), 3));
    hash.add(std::uint64_t{point.offset_ns} << 32 | std::bit_cast<std::uint32_t>(point.intensity));
    hash.add(std::uint64_t{point.line} << 8 | point.tag);
  }
  return hash.value();
}

std::uint64_t hash_of(const DepthImage& image) {
  TrajectoryHash hash;
  hash.add_bytes(std::span<const float>(image.depth_m));
  return hash.value();
}

void add_to(TrajectoryHash& hash, const ImuSample& sample) {
  hash.add(static_cast<std::uint64_t>(sample.stamp));
  hash.add({sample.gyro_radps.data(), 3});
  hash.add({sample.accel_mps2.data(), 3});
}

}  // namespace

/// A frame of the LiDAR in the making: its parts are cast in any order, the last one joins them.
struct Simulation::LidarFrame {
  explicit LidarFrame(std::int64_t count)
      : parts(static_cast<std::size_t>(count)),
        missing(count),
        scan(std::make_shared<LidarScan>()) {}

  void add(std::size_t part, LidarScan points) {
    parts[part] = std::move(points);
    if (--missing == 0) join();
  }

  void join() {
    scan->stamp = parts.front().stamp;
    scan->end = parts.back().end;
    for (LidarScan& part : parts) {
      const auto offset = static_cast<std::uint32_t>(part.stamp - scan->stamp);
      for (LidarPoint point : std::exchange(part.points, {})) {
        point.offset_ns += offset;
        scan->points.push_back(point);
      }
    }
    hash = hash_of(*scan);
  }

  std::vector<LidarScan> parts;
  std::atomic<std::int64_t> missing;
  std::shared_ptr<LidarScan> scan;
  std::uint64_t hash = 0;
};

void ExplorationLog::add(const Decision& decision) {
  ++decisions;
  seen += decision.previous_end == TargetEnd::kSeen;
  given_up += decision.previous_end == TargetEnd::kUnreachable ||
              decision.previous_end == TargetEnd::kCutOff;
  if (decision.kind == DecisionKind::kNewTarget) {
    ++issued;
    exhaustive += decision.source != CandidateSource::kTrees;
  } else if (decision.kind == DecisionKind::kStop) {
    stop_reason = decision.stop_reason;
    open_frontier_m2 = decision.open_frontier_m2;
  }
}

void ExplorationLog::add_figures(Figures& figures) const {
  if (decisions == 0) return;
  figures.set("exploration.decisions", decisions);
  figures.set("exploration.targets", issued);
  figures.set("exploration.targets_issued", issued);
  figures.set("exploration.targets_seen", seen);
  figures.set("exploration.targets_reached", reached);
  figures.set("exploration.targets_given_up", given_up);
  figures.set("exploration.exhaustive", exhaustive);
  if (stop_reason != StopReason::kNone) {
    figures.set("exploration.stop", kStopReasonNames[static_cast<std::size_t>(stop_reason)]);
  }
  figures.set("exploration.open_frontier_m2", open_frontier_m2);
}

Simulation::Simulation(const Scenario& scenario, int threads)
    : config_(scenario.config),
      world_(scenario.build_world()),
      scene_(world_, threads > 1 ? Scene::Build::kBeside : Scene::Build::kNow),
      physics_(config_.physics, world_, start_pose(world_), config_.seed),
      imu_(config_.imu, config_.seed),
      lidar_(config_.lidar, scene_, physics_.airframe().X_BL,
             airframe_without_lidar(physics_.airframe()), config_.seed),
      autopilot_(config_.autopilot, config_.stack.vehicle),
      previous_truth_(physics_.truth()),
      scorer_(scene_, physics_.airframe(), physics_.truth().X_WB,
              ThinBranchMeter(config_.scoring.thin, world_, stopping_of(config_.stack))),
      jobs_(threads),
      lidar_lane_(jobs_.add_lane("lidar", JobQueue::Order::kSideBySide)),
      depth_lane_(jobs_.add_lane("depth")),
      stack_(config_.stack, jobs_, config_.seed) {
  if (config_.stack.mission.kind != MissionConfig::Kind::kExplore) return;
  coverage_ =
      std::make_unique<CoverageScorer>(config_.scoring.coverage, world_, scene_, scorer_.X_WO(),
                                       scenario.scored_region(), physics_.airframe().radius_m);
}

Simulation::~Simulation() { jobs_.stop(); }

bool Simulation::tick() {
  stack_.begin(now_);
  fire_imu();
  fire_lidar();
  fire_depth();
  run_stack();
  run_autopilot();
  record();
  step_physics();
  judge();
  return outcome_ == Outcome::kFlying;
}

void Simulation::fire_imu() {
  const StageTimer::Scope timed(timers_.imu);
  const Truth& truth = physics_.truth();
  const ImuSample raw = imu_.sample(truth);
  autopilot_.add_imu(raw);
  add_to(imu_hash_, raw);
  if (const auto sample = imu_.output()) {
    stack_.add_imu(*sample);
    add_to(imu_hash_, *sample);
    if (bag_) bag_->imu(*sample);
  }
  if (const auto sample = imu_.magnetometer()) {
    autopilot_.add_magnetometer(*sample);
    imu_hash_.add({sample->field_gauss.data(), 3});
  }
  if (const auto sample = imu_.barometer()) {
    autopilot_.add_barometer(*sample);
    imu_hash_.add({&sample->pressure_pa, 1});
  }
  if (now_ % kStatusPeriod == 0) {
    const BatteryState& battery = physics_.battery();
    const BatterySample sample{now_, battery.voltage_v, battery.current_a};
    autopilot_.add_battery(sample);
    stack_.add_battery(sample);
    imu_hash_.add(std::array{sample.voltage_v, sample.current_a});
    if (config_.stack.odometry.source == OdometryConfig::Source::kMocap) {
      const Pose X_OW = scorer_.X_WO().inverse();
      stack_.add_mocap({now_, X_OW * truth.X_WB, X_OW.R * truth.v_WB});
    }
  }
}

void Simulation::fire_lidar() {
  if (!config_.devices.lidar) return;
  lidar_part_.push_back(physics_.truth());
  // The parts of a frame are cast while the next ones are fired, side by side; all become visible
  // with the frame.
  const Stamp period = config_.lidar.period();
  const Stamp begin = lidar_part_.front().stamp;
  const Stamp frame_begin = begin / period * period;
  const Stamp frame_end = frame_begin + period;
  if (now_ < std::min(begin + kLidarPart, frame_end)) return;
  const auto part = static_cast<std::size_t>((begin - frame_begin) / kLidarPart);
  if (part == 0)
    lidar_frame_ = std::make_shared<LidarFrame>((period + kLidarPart - 1) / kLidarPart);
  jobs_.schedule(lidar_lane_, frame_end + from_seconds(config_.devices.lidar_latency_s),
                 [this, ticks = lidar_part_, frame = lidar_frame_, part]() -> JobQueue::Delivery {
                   frame->add(part, lidar_.scan(ticks));
                   if (part + 1 < frame->parts.size()) return nullptr;
                   return [this, frame] {
                     sensor_hash_.add(frame->hash);
                     lidar_hash_.add(frame->hash);
                     stack_.add_scan(frame->scan);
                     if (bag_) bag_->scan(*frame->scan);
                   };
                 });
  lidar_part_.assign(1, physics_.truth());
}

void Simulation::fire_depth() {
  // 30 Hz does not divide a millisecond: the shutter opens between two ticks.
  const double rate = config_.depth.rate_hz;
  const Stamp stamp = from_seconds(static_cast<double>(depth_frame_) / rate);
  if (stamp > now_) return;
  ++depth_frame_;
  if (!stack_.accepts_depth(stamp)) return;
  const double fraction = now_ == stamp ? 1.0 : 1.0 - static_cast<double>(now_ - stamp) / kTick;
  const Pose X_WB = interpolate(previous_truth_.X_WB, physics_.truth().X_WB, fraction);
  jobs_.schedule(depth_lane_, stamp + from_seconds(config_.devices.depth_latency_s),
                 [this, stamp, X_WB]() -> JobQueue::Delivery {
                   if (!camera_) {
                     camera_ = std::make_unique<D430>(config_.depth, world_,
                                                      physics_.airframe().X_BC, config_.seed);
                   }
                   const DepthImagePtr frame = camera_->capture(stamp, X_WB);
                   return [this, frame, hash = hash_of(*frame)] {
                     sensor_hash_.add(hash);
                     depth_hash_.add(hash);
                     stack_.add_depth(frame);
                     if (bag_) bag_->depth(*frame);
                   };
                 });
}

void Simulation::run_stack() {
  jobs_.advance(now_);
  const StageTimer::Scope timed(timers_.stack);
  if (now_ % kStatusPeriod == 0) {
    stack_.add_autopilot({autopilot_.attitude(), autopilot_.state() == AutopilotState::kStandby,
                          autopilot_.armed(), autopilot_.state() > AutopilotState::kSpinUp,
                          autopilot_.landed()});
  }
  const auto command = stack_.tick();
  if (!command) return;
  autopilot_.command(*command);
  hash_.add({command->R_AB_desired.data(), 9});
  hash_.add({&command->thrust_n, 1});
}

void Simulation::run_autopilot() {
  const StageTimer::Scope timed(timers_.autopilot);
  motors_ = autopilot_.tick(now_);
  hash_.add(motors_.throttle);
}

void Simulation::step_physics() {
  const StageTimer::Scope timed(timers_.physics);
  previous_truth_ = physics_.truth();
  physics_.step(motors_);
  now_ += kTick;
  const Truth& truth = physics_.truth();
  hash_.add({truth.X_WB.R.data(), 9});
  hash_.add({truth.X_WB.p.data(), 3});
  hash_.add({truth.v_WB.data(), 3});
  scorer_.moved(previous_truth_, truth);
}

void Simulation::record() {
  const StageTimer::Scope timed(timers_.recording);
  const Truth& truth = physics_.truth();
  for (const Event& event : stack_.take_events()) {
    if (event.kind == EventKind::kTargetReached) {
      scorer_.target_reached(truth, stack_);
      exploration_.reached += stack_.mission().state() == MissionState::kExplore;
    }
    if (recorder_) recorder_->event(event);
  }
  if (now_ % FlightScorer::kPeriod == 0) {
    scorer_.sample(truth, stack_, !autopilot_.landed(), physics_.battery(), recorder_);
    if (bag_) {
      const Pose X_OW = scorer_.X_WO().inverse();
      bag_->truth(now_, X_OW * truth.X_WB, X_OW.R * truth.v_WB, truth.w_WB_B);
    }
  }
  for (const Decision& decision : stack_.take_decisions()) {
    exploration_.add(decision);
    if (recorder_) recorder_->decision(decision);
  }
  if (coverage_ && now_ % kPathPeriod == 0) path_W_.push_back(truth.X_WB.p);
  if (coverage_ && now_ % kCoveragePeriod == 0) score_coverage();
  if (recorder_ && now_ % kFlushPeriod == 0) recorder_->flush();
  if (recorder_ && now_ % kGrowthPeriod == 0) note_cloud_growth();
  if (recorder_ && now_ > 0 && now_ % kCloudPeriod == 0) write_cloud();
}

void Simulation::score_coverage() {
  const Perception& perception = stack_.perception();
  if (!perception.map_2d()) return;
  jobs_.schedule(perception.cloud_lane(), now_ + kScoreDue,
                 [this, stamp = now_, path = std::exchange(path_W_, {}), map = perception.map_2d(),
                  X_WO = scorer_.X_WO(), distance = scorer_.distance_m(),
                  volume = perception.known_volume_m3()]() -> JobQueue::Delivery {
                   for (const Vec3& p_WB : path) coverage_->add_position(p_WB);
                   const auto points = stack_.perception().cloud().points(covered_points_);
                   covered_points_ += points.size();
                   coverage_->update(stamp, distance, *map, volume, points, X_WO);
                   return [this, row = coverage_->latest()] {
                     if (std::isfinite(row.area_fraction)) area_fraction_ = row.area_fraction;
                   };
                 });
}

void Simulation::write_cloud() {
  // Behind the insertions of the same lane, so that the file is the map of this moment.
  jobs_.schedule(stack_.perception().cloud_lane(), now_ + kScoreDue,
                 [this]() -> JobQueue::Delivery {
                   recorder_->write_cloud(stack_.perception().cloud().points(), cloud_growth_);
                   return nullptr;
                 });
}

void Simulation::note_cloud_growth() {
  jobs_.schedule(stack_.perception().cloud_lane(), now_ + kScoreDue,
                 [this, stamp = now_]() -> JobQueue::Delivery {
                   const std::size_t points = stack_.perception().cloud().size();
                   if (points > 0) cloud_growth_.push_back({stamp, points});
                   return nullptr;
                 });
}

void Simulation::judge() {
  if (const Contact* hit = physics_.collision()) {
    ++collisions_;
    std::array<char, 96> detail{};
    const auto name = worlds::kSurfaceClassNames[static_cast<std::size_t>(hit->surface_class)];
    std::snprintf(detail.data(), detail.size(), "%.*s %u at %.2f m/s",
                  static_cast<int>(name.size()), name.data(), hit->object, hit->impact_speed_mps);
    if (recorder_) recorder_->event({now_, EventKind::kCollision, detail.data()});
    end(Outcome::kCollided, std::string("hit ") + detail.data());
  } else if (stack_.mission().state() == MissionState::kDone) {
    if (stack_.mission().lost()) {
      end(Outcome::kLost, "no odometry");
    } else if (!stack_.mission().stuck().empty()) {
      end(Outcome::kStuck, stack_.mission().stuck());
    } else {
      end(Outcome::kSucceeded, "mission done");
    }
  } else if (now_ >= from_seconds(config_.stack.mission.max_time_s)) {
    const auto state = static_cast<std::size_t>(stack_.mission().state());
    end(Outcome::kTimedOut,
        "mission.max_time_s is over in state " + std::string(kMissionStateNames[state]));
  }
}

void Simulation::interrupt(const std::string& reason) { end(Outcome::kInterrupted, reason); }

void Simulation::end(Outcome outcome, const std::string& reason) {
  if (outcome_ != Outcome::kFlying) return;
  outcome_ = outcome;
  reason_ = reason;
  if (recorder_) {
    const std::string name(kOutcomeNames[static_cast<std::size_t>(outcome)]);
    recorder_->event({now_, EventKind::kFinished, name + ": " + reason});
  }
}

SemanticScore Simulation::map_semantics(const std::vector<Vec3f>& cloud_O,
                                        const std::vector<PosePair>& poses) const {
  constexpr double kStep = 0.25;  // m, between points of the path
  std::vector<Vec3f> path_O;
  for (const PosePair& pose : poses) {
    const Vec3f p = pose.X_OB.p.cast<float>();
    if (path_O.empty() || (p - path_O.back()).norm() > static_cast<float>(kStep)) {
      path_O.push_back(p);
    }
  }
  const SemanticMap map = build_semantic_map(cloud_O, path_O, config_.semantics.map);
  if (recorder_) recorder_->write_semantics(map, cloud_O, path_O);
  return score_semantics(map, cloud_O, align_map(poses), world_, config_.scoring.semantic);
}

FlightResult Simulation::finish() {
  jobs_.drain();
  FlightResult result;
  result.outcome = outcome_;
  result.reason = reason_;
  result.duration = now_;
  result.trajectory_hash = trajectory_hash();
  result.sensor_hash = sensor_hash_.text();
  result.device_hashes = device_hashes();
  result.collisions = collisions_;
  result.targets = stack_.mission().targets();
  result.flight = scorer_.score(physics_.truth(), stack_);
  const std::vector<Vec3f> cloud = stack_.perception().cloud().points();
  if (!cloud.empty()) {
    if (recorder_) recorder_->write_cloud(cloud, cloud_growth_);
    // Placed by the best rigid fit of the trajectory: the shape is the map's, its place the
    // odometry's.
    result.map = score_map(cloud, align_map(result.flight.poses), scene_, config_.scoring.map);
    if (coverage_ && config_.semantics.enabled) {
      const StageTimer::Scope timed(timers_.semantics);
      result.semantic = map_semantics(cloud, result.flight.poses);
    }
  }
  if (coverage_) result.coverage = coverage_->result();
  result.exploration = exploration_;
  result.plans = stack_.navigator().machine().plans();
  result.plan_failures = stack_.navigator().machine().failures();
  if (recorder_ && config_.stack.mapping.enabled) {
    recorder_->write_maps(stack_.perception().mapper());
  }
  result.battery = physics_.battery();
  if (camera_) result.renderer = Renderer::kName;
  for (const StageTimer* timer : {&timers_.imu, &timers_.stack, &timers_.autopilot,
                                  &timers_.physics, &timers_.recording, &timers_.semantics}) {
    result.timing.push_back(summarise(timer->name(), timer->seconds()));
  }
  for (const auto& lane : jobs_.timings()) {
    result.timing.push_back(summarise(lane.name, lane.seconds));
  }
  return result;
}

}  // namespace arex::sim
