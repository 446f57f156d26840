#include "run/simulation.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "run/companion_link.h"
#include "run/device_types.h"
#include "run/drive_faults.h"
#include "run/perfect_tracking.h"
#include "sensors/board_device.h"
#include "sensors/mocap_device.h"
#include "stack/stack.h"

namespace arex::sim {
namespace {

constexpr Stamp kTick = kNanosecondsPerTick;
constexpr Stamp kStatusPeriod = 5 * kTick;      // 200 Hz: what the autopilot tells
constexpr Stamp kCloudPeriod = 10'000 * kTick;  // the map as a killed run leaves it
constexpr Stamp kPathPeriod = 100 * kTick;      // 10 Hz: revisits and turns
constexpr Stamp kCoveragePeriod = 1000 * kTick;
constexpr Stamp kScoreDue = 1000 * kTick;  // the flight does not wait for what is scored or written

/// What the planner counts with when it asks how fast it may fly.
StoppingModel stopping_of(const StackConfig& stack) {
  const PlanningConfig& planning = stack.planning;
  return {stack.vehicle.radius_m, planning.local.max_acceleration_mps2,
          planning.local.reaction_s + planning.replan.planning_latency_s};
}

/// Whether a vehicle is where nothing is: too far off for any sensor, or below all ground. It goes
/// on as long as its battery does, and no flight software finds back from there.
bool has_left(const worlds::Bounds& bounds, const Vec3& p_W) {
  constexpr double kFarthest_m = 100, kDeepest_m = 2;
  const Vec3 nearest = p_W.cwiseMax(bounds.low).cwiseMin(bounds.high);
  return (p_W - nearest).norm() > kFarthest_m || p_W.z() < bounds.low.z() - kDeepest_m;
}

/// A reason with the fault that had been told and still stood, unless it tells of it itself. What
/// was asked to end, or went well, was ended by no fault.
std::string reason_after(Outcome outcome, const std::string& reason, const std::string& fault) {
  const bool failed = outcome != Outcome::kSucceeded && outcome != Outcome::kInterrupted;
  const bool of_odometry = fault.starts_with("odometry ");
  const bool says_so = reason.find(of_odometry ? "odometry" : fault) != std::string::npos;
  return !failed || fault.empty() || says_so ? reason : reason + std::string(kAfter) + fault;
}

/// What the omniscient tour has in common with the mission.
TourMission tour_mission_of(const StackConfig& stack) {
  const MissionConfig& mission = stack.mission;
  return {mission.takeoff_height_m,
          mission.entry_m,
          mission.land_at_start != MissionConfig::LandAtStart::kFalse,
          {stack.planning.local.max_speed_mps, stack.planning.local.max_acceleration_mps2,
           stack.path.climb_speed_mps, stack.path.landing_speed_mps}};
}

}  // namespace

void ExplorationLog::add(const Decision& decision) {
  ++decisions;
  seen += decision.previous_end == TargetEnd::kSeen;
  given_up += decision.previous_end == TargetEnd::kUnreachable ||
              decision.previous_end == TargetEnd::kCutOff;
  if (decision.kind == DecisionKind::kNewTarget) {
    ++issued;
    directed += decision.undirected_winner && decision.undirected_winner != decision.winner;
    exhaustive += decision.source == "exhaustive" || decision.source == "forgiving";
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
  figures.set("exploration.directed", directed);
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
      frame_(config_.physics.frame, physics_.airframe(), config_.seed),
      autopilot_(config_.autopilot, config_.stack.vehicle),
      wires_(config_.interfaces.dshot, config_.seed),
      previous_truth_(physics_.truth()),
      scorer_(scene_, physics_.airframe(), physics_.truth().X_WB,
              ThinBranchMeter(config_.scoring.thin, world_, stopping_of(config_.stack))),
      fault_log_(config_.faults),
      jobs_(threads),
      operator_(config_.operator_link, config_.commands, config_.seed),
      drive_faulty_(concern_drive(config_.faults)) {
  add_devices();
  stack_ = std::make_unique<Stack>(config_.stack, jobs_, config_.seed);
  if (CompanionLink::is_needed(config_.interfaces)) {
    stack_ =
        std::make_unique<CompanionLink>(config_.interfaces, config_.autopilot.motor,
                                        config_.stack.vehicle, std::move(stack_), config_.seed);
  }
  outlets_.software = stack_.get();
  if (config_.stack.mission.kind != MissionConfig::Kind::kExplore) return;
  coverage_ =
      std::make_unique<CoverageScorer>(config_.scoring.coverage, world_, scene_, scorer_.X_WO(),
                                       scenario.scored_region(), physics_.airframe().radius_m);
}

void Simulation::add_devices() {
  const Airframe& airframe = physics_.airframe();
  const auto context = [&](const std::string& name, const Pose& X_BS) {
    const std::uint64_t seed =
        name.empty() ? config_.seed : RandomStream(config_.seed, "device " + name).bits();
    return DeviceContext{name,  world_,   scene_, airframe,      X_BS,
                         jobs_, outlets_, seed,   config_.faults};
  };
  const auto add = [&](const std::string& name, std::unique_ptr<Device> device) {
    if (device) devices_.emplace_back(name, std::move(device));
  };
  add("imu", std::make_unique<BoardDevice>(config_.imu, autopilot_, context("", Pose())));
  if (config_.stack.uses_odometry("mocap")) {
    add("mocap", std::make_unique<MocapDevice>(config_.mocap, scorer_.X_WO(), context("", Pose())));
  }
  add("lidar", make_mid360(config_.lidar, context("", airframe.X_BL)));
  add("depth", make_d430(config_.depth, context("", airframe.X_BC)));
  add("infrared", make_infrared(config_, context("", airframe.X_BC)));
  for (const auto& [name, section] : config_.devices) {
    const DeviceContext where = context(name, section.mount.X_BL());
    add(name, device_types().at(section.type, "devices").make(section.own, {config_, where}));
  }
}

Simulation::~Simulation() { jobs_.stop(); }

void Simulation::record_to(Recorder& recorder) {
  recorder_ = &recorder;
  outlets_.on_images = [&recorder](const InfraredShot& shot, const StereoImage& images,
                                   double mean_grey) { recorder.images(shot, images, mean_grey); };
}

void Simulation::record_to(BagWriter& bag) {
  outlets_.bags.push_back(&bag);
  displays_.emplace_back(bag, *stack_, physics_.airframe());
}

bool Simulation::tick() {
  stack_->begin(now_);
  for (BagWriter* bag : outlets_.bags) bag->begin(now_);
  fire_devices();
  run_stack();
  run_autopilot();
  record();
  step_physics();
  check_end();
  return outcome_ == Outcome::kFlying;
}

void Simulation::fire_devices() {
  const StageTimer::Scope timed(timers_.devices);
  // All that senses sits on the plate.
  if (!frame_.stiff()) frame_.step(physics_.truth());
  const Truth& now = frame_.stiff() ? physics_.truth() : frame_.plate();
  const Truth& before = frame_.stiff() ? previous_truth_ : frame_.plate_before();
  const Moment moment{now_, now, before, physics_.battery()};
  for (const auto& [name, device] : devices_) device->fire(moment);
}

void Simulation::run_stack() {
  jobs_.advance(now_);
  const StageTimer::Scope timed(timers_.stack);
  if (now_ % kStatusPeriod == 0) {
    stack_->add_autopilot({autopilot_.attitude(), autopilot_.state() == AutopilotState::kStandby,
                           autopilot_.armed(), autopilot_.state() > AutopilotState::kSpinUp,
                           autopilot_.landed(), autopilot_.take_notices()});
  }
  for (const OperatorMessage& message : operator_.deliver(now_)) stack_->add_operator(message);
  const auto command = stack_->tick();
  if (!command) return;
  autopilot_.command(*command);
  hash_.add({command->R_AB_desired.data(), 9});
  hash_.add({&command->thrust_n, 1});
}

void Simulation::run_autopilot() {
  const StageTimer::Scope timed(timers_.autopilot);
  motors_ = wires_.carry(autopilot_.tick(now_));
  hash_.add(motors_.throttle);
}

// Without odometry there is nothing to be carried along: the autopilot levels the vehicle and
// brings it down.
std::optional<CarriedMotion> Simulation::carried_motion() const {
  if (!config_.physics.perfect_tracking) return std::nullopt;
  const FlightView view = stack_->view();
  if (!has_setpoint(view)) return std::nullopt;
  if (autopilot_.state() == AutopilotState::kDescending) {
    return carried_down(config_.autopilot.descent_speed_mps, physics_.truth());
  }
  if (autopilot_.state() != AutopilotState::kFlying) return std::nullopt;
  return carried_along(view, physics_.truth());
}

void Simulation::step_physics() {
  const StageTimer::Scope timed(timers_.physics);
  previous_truth_ = physics_.truth();
  if (drive_faulty_) physics_.set_faults(drive_faults_at(config_.faults, now_));
  if (const auto motion = carried_motion()) {
    physics_.step(motors_, *motion);
  } else {
    physics_.step(motors_);
  }
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
  const FlightView view = stack_->view();
  for (const Event& event : stack_->take_events()) {
    if (event.kind == EventKind::kTargetReached) {
      scorer_.target_reached(truth, view);
      exploration_.reached += view.state == MissionState::kExplore;
    }
    fault_log_.add(event);
    operator_.report(event);
    if (recorder_) recorder_->event(event);
    for (FlightDisplay& display : displays_) display.event(event);
  }
  if (now_ % FlightScorer::kPeriod == 0) {
    const FlightSample sample =
        scorer_.sample(truth, view, !autopilot_.landed(), physics_.battery());
    if (recorder_) recorder_->sample(now_, sample);
    for (BagWriter* bag : outlets_.bags) {
      if (sample.estimate_X_OB) bag->estimate(now_, *sample.estimate_X_OB);
      bag->place_odom(scorer_.X_WO(), scorer_.has_begun());
      bag->truth(now_, truth.X_WB, truth.v_WB, truth.w_WB_B);
    }
  }
  const std::vector<FeatureSight> features = stack_->take_features();
  if (recorder_) recorder_->features(features);
  for (const Decision& decision : stack_->take_decisions()) {
    exploration_.add(decision);
    if (recorder_) recorder_->decision(decision);
    for (FlightDisplay& display : displays_) display.decision(decision);
  }
  for (FlightDisplay& display : displays_) display.update(now_);
  if (coverage_ && now_ % kPathPeriod == 0) path_W_.push_back(truth.X_WB.p);
  if (coverage_ && now_ % kCoveragePeriod == 0) score_coverage();
  if (recorder_ && now_ % kFlushPeriod == 0) recorder_->flush();
  if (recorder_ && now_ % kGrowthPeriod == 0) note_cloud_growth();
  if (recorder_ && now_ > 0 && now_ % kCloudPeriod == 0) write_cloud();
}

void Simulation::score_coverage() {
  const FlightView view = stack_->view();
  if (!view.map_2d) return;
  stack_->read_cloud(
      now_ + kScoreDue,
      [this, stamp = now_, path = std::exchange(path_W_, {}), map = view.map_2d,
       X_WO = scorer_.X_WO(), distance = scorer_.distance_m(),
       volume = view.known_volume_m3](const PointCloudMap& cloud) -> JobQueue::Delivery {
        for (const Vec3& p_WB : path) coverage_->add_position(p_WB);
        const auto points = cloud.points(covered_points_);
        covered_points_ += points.size();
        coverage_->update(stamp, distance, *map, volume, points, X_WO);
        return [this, row = coverage_->latest()] {
          if (std::isfinite(row.area_fraction)) area_fraction_ = row.area_fraction;
        };
      });
}

void Simulation::write_cloud() {
  stack_->read_cloud(now_ + kScoreDue, [this](const PointCloudMap& cloud) -> JobQueue::Delivery {
    recorder_->write_cloud(cloud.points(), cloud_growth_);
    return nullptr;
  });
}

void Simulation::note_cloud_growth() {
  stack_->read_cloud(now_ + kScoreDue,
                     [this, stamp = now_](const PointCloudMap& cloud) -> JobQueue::Delivery {
                       if (cloud.size() > 0) cloud_growth_.push_back({stamp, cloud.size()});
                       return nullptr;
                     });
}

void Simulation::check_end() {
  if (const Contact* hit = physics_.collision()) {
    ++collisions_;
    const auto name = worlds::kSurfaceClassNames[static_cast<std::size_t>(hit->surface_class)];
    const std::string what =
        fmt::format("{} {} at {:.2f} m/s", name, hit->object, hit->impact_speed_mps);
    if (recorder_) recorder_->event({now_, EventKind::kCollision, what});
    for (FlightDisplay& display : displays_) {
      display.event({now_, EventKind::kCollision, what});
    }
    end(Outcome::kCollided, "hit " + what);
  } else if (has_left(world_.bounds, truth().X_WB.p)) {
    end(Outcome::kLost, "left the world");
  } else if (const FlightView view = stack_->view(); view.state == MissionState::kDone) {
    if (view.lost) {
      end(Outcome::kLost, "no odometry");
    } else if (!view.stuck.empty()) {
      end(Outcome::kStuck, std::string(view.stuck));
    } else {
      end(Outcome::kSucceeded, "mission done");
    }
  } else if (now_ >= from_seconds(config_.stack.mission.max_time_s)) {
    const auto state = static_cast<std::size_t>(view.state);
    end(Outcome::kTimedOut,
        "mission.max_time_s is over in state " + std::string(kMissionStateNames[state]));
  }
}

void Simulation::interrupt(const std::string& reason) { end(Outcome::kInterrupted, reason); }

void Simulation::end(Outcome outcome, const std::string& reason) {
  if (outcome_ != Outcome::kFlying) return;
  outcome_ = outcome;
  const bool stuck = outcome == Outcome::kStuck;
  reason_ = reason_after(outcome, reason,
                         stuck ? fault_log_.standing_when_stuck() : fault_log_.standing());
  if (recorder_) {
    const std::string name(kOutcomeNames[static_cast<std::size_t>(outcome)]);
    recorder_->event({now_, EventKind::kFinished, name + ": " + reason_});
  }
}

std::map<std::string, std::string> Simulation::device_hashes() const {
  std::map<std::string, std::string> hashes;
  for (const auto& [name, device] : devices_) {
    if (device->delivered()) hashes[name] = device->fingerprint().text();
  }
  return hashes;
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

// Depends on world and mission alone, on nothing that was flown.
void Simulation::compare_with_the_possible(FlightResult& result) {
  const StageTimer::Scope timed(timers_.tour);
  const ScoredRegion region = config_.scored_region();
  const Pose X_WO = start_pose(world_);
  const double radius_m = physics_.airframe().radius_m;
  const std::vector<Vec3f>& area = coverage_->area_cells_W();
  result.complexity =
      measure_complexity(config_.scoring.complexity, world_, scene_, X_WO, region, area,
                         config_.scoring.coverage.space.resolution_m, radius_m);
  if (!config_.scoring.tour.enabled) return;
  result.tour = plan_omniscient_tour(config_.scoring.tour, world_, X_WO, region, radius_m, area,
                                     tour_mission_of(config_.stack));
}

FlightResult Simulation::finish() {
  jobs_.drain();
  FlightResult result;
  result.outcome = outcome_;
  result.reason = reason_;
  result.duration = now_;
  result.trajectory_hash = trajectory_hash();
  result.sensor_hash = outlets_.frames.text();
  result.device_hashes = device_hashes();
  for (const auto& [name, device] : devices_) {
    if (name != "lidar") continue;
    result.lidar_firings = device->firings();
    result.lidar_misses = device->misses();
  }
  result.collisions = collisions_;
  const FlightView view = stack_->view();
  result.targets.assign(view.targets.begin(), view.targets.end());
  result.flight = scorer_.score(physics_.truth(), view);
  const std::vector<Vec3f> cloud = stack_->cloud().points();
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
  if (coverage_) {
    result.coverage = coverage_->result();
    compare_with_the_possible(result);
  }
  result.exploration = exploration_;
  result.faults = fault_log_;
  result.plans = view.plans;
  if (recorder_ && config_.stack.mapping.enabled) {
    recorder_->write_maps(stack_->mapper());
  }
  result.battery = physics_.battery();
  if (result.device_hashes.contains("depth")) result.renderer = Renderer::kName;
  for (const StageTimer* timer :
       {&timers_.devices, &timers_.stack, &timers_.autopilot, &timers_.physics, &timers_.recording,
        &timers_.semantics, &timers_.tour}) {
    result.timing.push_back(timing_row(timer->name(), timer->seconds()));
  }
  for (const auto& lane : jobs_.timings()) {
    result.timing.push_back(timing_row(lane.name, lane.seconds));
  }
  return result;
}

}  // namespace arex::sim
