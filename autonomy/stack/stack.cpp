#include "stack/stack.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "stack/modules.h"

namespace arex {
namespace {

// An estimate comes with every sample of a 200 Hz IMU: one that has stopped is none.
constexpr Stamp kOdometryStale = kNanosecondsPerSecond / 10;

/// Whether one scan's points are the other's, bit for bit.
bool is_same(const LidarScan& a, const LidarScan& b) {
  return !a.points.empty() && a.points.size() == b.points.size() &&
         a.points.front().p_L == b.points.front().p_L && a.points.back().p_L == b.points.back().p_L;
}

/// What a scenario says under `modules` of a module.
ConfigNode own_parameters(const StackConfig& config, const std::string& name) {
  const auto section = config.modules.find(name);
  if (section != config.modules.end()) return section->second.own;
  ConfigNode none;
  none.kind = ConfigNode::Kind::kMap;
  none.where = name;
  return none;
}

template <class Registry>
auto make(const Registry& registry, const std::string& name, const StackConfig& config,
          std::uint64_t seed) {
  return registry.at(name, "stack").make(own_parameters(config, name), {config, seed});
}

/// Null where the B-spline planner plans, which the navigator has anyway.
std::unique_ptr<LocalPlanner> other_planner(const StackConfig& config, std::uint64_t seed) {
  if (config.planning.strategy == PlanningConfig().strategy) return nullptr;
  return make(modules().planners, config.planning.strategy, config, seed);
}

}  // namespace

Stack::Stack(const StackConfig& config, JobQueue& jobs, std::uint64_t seed)
    : config_(with_shared_values(config)),
      seed_(seed),
      jobs_(jobs),
      sources_(make_sources()),
      may_fly_(std::max<std::size_t>(1, config_.odometry.failover.size())),
      switch_(config_.odometry.handover, may_fly_),
      lidar_watch_(config_.odometry.watch),
      health_watch_(config_.health, config_.vehicle, sensors_read()),
      energy_(config_.exploration.explorer.consumption),
      perception_(config_, jobs),
      explorer_(make(modules().explorers, config_.exploration.strategy, config_, seed)),
      explorer_lane_(jobs.add_lane("exploration")),
      mission_(config_.mission,
               [this](EventKind kind, const std::string& detail) { report(kind, detail); }),
      landing_finder_(config_.mission.landing, config_.exploration.explorer,
                      config_.vehicle.radius_m),
      legs_(config_.path, config_.caution),
      navigator_(config_.planning, config_.control.attitude_lag_s, jobs, seed,
                 other_planner(config_, seed)),
      tracker_(config_.control, config_.vehicle),
      control_period_(from_seconds(1 / config_.control.rate_hz)) {}

std::vector<Stack::Source> Stack::make_sources() {
  const std::string& flying = config_.odometry.source;
  std::vector<Source> sources;
  sources.push_back(make_source(flying, "odometry"));
  const auto add = [&](const std::string& name) {
    const bool there = std::any_of(sources.begin(), sources.end(),
                                   [&](const Source& source) { return source.name == name; });
    if (!there) sources.push_back(make_source(name, "odometry_" + name));
  };
  for (const std::string& name : config_.odometry.failover) add(name);
  for (const auto& [name, section] : config_.odometries) add(name);
  return sources;
}

Stack::Source Stack::make_source(const std::string& name, const std::string& lane) {
  const auto latency_of = [&](const std::string& type) {
    return type == kVisualInertial ? config_.odometry.visual_inertial.latency_s
                                   : config_.odometry.latency_s;
  };
  const auto further = config_.odometries.find(name);
  if (further == config_.odometries.end()) {
    return {name, make(modules().odometry, name, config_, seed_), jobs_.add_lane(lane),
            from_seconds(latency_of(name))};
  }
  const OdometrySection& section = further->second;
  return {name, modules().odometry.at(section.type, name).make(section.own, {config_, seed_}),
          jobs_.add_lane(lane), from_seconds(section.latency_s.value_or(latency_of(section.type)))};
}

void Stack::add_imu(const ImuSample& imu) {
  health_watch_.add_imu(now_, imu);
  for (Source& source : sources_) {
    source.odometry->add_imu(imu);
    collect(source);
  }
  choose_source();
}

void Stack::add_autopilot(const AutopilotStatus& status) {
  autopilot_ = status;
  for (const Event& notice : status.notices) report(notice.kind, notice.detail);
}

void Stack::add_battery(const BatterySample& battery) {
  energy_.add(battery, odometry_.v_OB.norm(), !autopilot_.landed);
}

void Stack::add_mocap(const MocapSample& mocap) {
  health_watch_.add_mocap(now_, mocap);
  for (Source& source : sources_) {
    source.odometry->add_mocap(mocap);
    collect(source);
  }
}

void Stack::add_scan(const LidarScanPtr& scan) {
  health_watch_.add_scan(now_, scan);
  if (!scan->device.empty()) {  // for the maps only
    if (config_.mapping.takes(scan->device)) perception_.add_scan(now_, *scan);
    return;
  }
  // A device that hangs goes on sending what it saw last: in the air that is as good as nothing,
  // and worse for who believes it.
  const bool repeats = last_scan_ && !autopilot_.landed && is_same(*scan, *last_scan_);
  last_scan_ = scan;
  if (repeats) return;
  lidar_watch_.add_scan(now_, *scan);
  for (std::size_t i = 0; i < sources_.size(); ++i) {
    Source& source = sources_[i];
    if (i < may_fly_ && i != switch_.flying()) source.odometry->suggest(switch_.in_frame_of(i));
    start(source, source.odometry->add_scan(scan));
  }
  if (!flying().odometry->places_scans()) perception_.add_scan(now_, *scan);
}

void Stack::add_images(const StereoImagePtr& images) {
  health_watch_.add_images(now_, *images);
  for (Source& source : sources_) start(source, source.odometry->add_images(images));
}

void Stack::start(Source& source, std::optional<OdometrySource::Job> job) {
  if (job) {
    jobs_.start(source.lane, now_, source.latency,
                [this, &source, job = *std::move(job)]() -> JobQueue::Delivery {
                  return [this, &source, deliver = job()] {
                    deliver();
                    collect(source);
                  };
                });
  }
  collect(source);
}

void Stack::choose_source() {
  if (may_fly_ == 1) return;
  std::vector<const Odometry*> newest;
  for (std::size_t i = 0; i < may_fly_; ++i) newest.push_back(&sources_[i].odometry->odometry());
  const std::string before = flying().name;
  if (!switch_.update(newest)) return;
  report(EventKind::kRecovery, "odometry " + flying().name + " takes over from " + before);
  set_odometry(switch_.in_common_frame(flying().odometry->odometry()));
}

void Stack::collect(Source& source) {
  const std::vector<RegisteredScan> scans = source.odometry->take_scans();
  const bool visual = source.odometry->visual_tally().has_value();
  if (&source != &flying() && !visual) return;
  for (const std::string& fault : source.odometry->take_faults()) {
    report(EventKind::kSensorFault, fault);
  }
  if (&source != &flying()) return;
  for (const RegisteredScan& scan : scans) {
    const bool tells = scan.matched_share && health_watch_.imu_sound(now_) &&
                       odometry_.status != OdometryStatus::kLost;
    lidar_watch_.add_matched_share(tells ? scan.matched_share : std::nullopt);
  }
  set_odometry(switch_.in_common_frame(source.odometry->odometry()));
  for (const RegisteredScan& scan : scans) {
    if (scan.jumped) start_again(scan.stamp);
    if (config_.mapping.takes("")) perception_.add_scan(now_, scan);
  }
}

void Stack::add_depth(const DepthImagePtr& depth) {
  health_watch_.add_depth(now_, *depth);
  perception_.add_depth(now_, depth);
}

bool Stack::accepts_depth(const std::string& device, Stamp stamp) {
  Stamp& next = next_depth_[device];
  if (!config_.mapping.local.use_depth || stamp < next) return false;
  next += from_seconds(1 / config_.mapping.depth_rate_hz);
  return true;
}

void Stack::set_odometry(const Odometry& odometry) {
  if (odometry.status != odometry_.status) {
    report(EventKind::kOdometryStatus,
           std::string(kOdometryStatusNames[static_cast<std::size_t>(odometry.status)]));
  }
  const bool jumps = jumps_to(odometry);
  odometry_ = odometry;
  if (jumps) start_again(odometry.stamp);
  perception_.add_odometry(odometry);
}

bool Stack::jumps_to(const Odometry& odometry) const {
  if (odometry_.status == OdometryStatus::kInitialising) return false;
  const Vec3 expected =
      odometry_.X_OB.p + to_seconds(odometry.stamp - odometry_.stamp) * odometry_.v_OB;
  return (odometry.X_OB.p - expected).norm() > config_.odometry.jump_m;
}

void Stack::start_again(Stamp jumped_at) {
  setpoint_ = {};
  setpoint_.p_OB = odometry_.X_OB.p;
  setpoint_.yaw_rad = so3::yaw(odometry_.X_OB.R);
  perception_.forget_local(now_, jumped_at);
  legs_.start_again(setpoint_);
  navigating_ = false;  // whoever flies next starts from the setpoint
}

Odometry Stack::checked_odometry() const {
  Odometry odometry = odometry_;
  if (now_ - odometry.stamp > kOdometryStale) odometry.status = OdometryStatus::kLost;
  return odometry;
}

OdometryNeed Stack::odometry_need() const {
  const OdometryNeed need = flying().odometry->need();
  // An estimate comes with the IMU's samples.
  const bool silent = now_ - odometry_.stamp > kOdometryStale && need != OdometryNeed::kMocap;
  return silent ? OdometryNeed::kImu : need;
}

std::optional<AttitudeCommand> Stack::tick() {
  if (now_ < next_control_) return std::nullopt;
  next_control_ += control_period_;
  watch_health();
  if (perception_.take_cloud_cut()) {
    report(EventKind::kMapFull, "mapping.cloud.max_points is reached, later points are left out");
  }
  decide();
  seek_landing();
  // The navigator's word counts for the request that it serves, not for one it has not seen yet.
  const bool serves = navigating_ && navigator_.request() == mission_.request();
  request_ = mission_.update(
      {now_, checked_odometry(), odometry_need(), autopilot_.ready, autopilot_.armed,
       serves ? navigator_.progress() : MotionProgress::kUnderWay, navigator_.cause(),
       !navigating_ && legs_.blocked(), ground_below(), at_reserve(), faults_.first(),
       lidar_watch_.silent_s(now_), flying().odometry->places_scans()});
  setpoint_ = move(request_);
  return control(request_);
}

ExpectedSensors Stack::sensors_read() const {
  const bool infrared = std::any_of(sources_.begin(), sources_.end(), [](const Source& source) {
    return source.odometry->visual_tally().has_value();
  });
  return {.imu = true, .depth = config_.mapping.local.use_depth, .infrared = infrared};
}

void Stack::watch_health() {
  // Who flies on motion capture may have no LiDAR.
  if (autopilot_.armed && config_.odometry.source != "mocap") lidar_watch_.expect(now_);
  if (const auto fault = lidar_watch_.update(now_)) {
    report(EventKind::kSensorFault, std::string(*fault));
  }
  HealthWatch::Flight flight;
  flight.armed = autopilot_.armed;
  flight.in_air = autopilot_.armed && !autopilot_.landed;
  const bool located = odometry_.status == OdometryStatus::kOk;
  if (located) {
    const Vec3 up_B = odometry_.X_OB.R.row(2), autopilot_up_B = autopilot_.attitude.R_AB.row(2);
    flight.attitude_difference_rad =
        std::atan2(up_B.cross(autopilot_up_B).norm(), up_B.dot(autopilot_up_B));
  }
  // A landing aims below the ground.
  const bool on_a_path = located && request_.kind != MotionRequest::Kind::kLand;
  if (on_a_path) flight.off_path_m = (setpoint_.p_OB - odometry_.X_OB.p).norm();
  for (const Event& event : health_watch_.update(now_, flight)) report(event.kind, event.detail);
}

void Stack::decide() {
  if (mission_.state() != MissionState::kExplore || !perception_.map_2d()) return;
  const TargetProgress progress = mission_.target_progress();
  const bool told = progress != TargetProgress::kUnderWay;
  if (!jobs_.is_free(explorer_lane_, now_) || (now_ < next_decision_ && !told)) return;
  next_decision_ = now_ + from_seconds(1 / config_.exploration.decision_rate_hz);
  ExplorerInput input{now_,     odometry_.X_OB.p, Vec3::Zero(),
                      progress, energy_,          perception_.flown_since_map()};
  jobs_.start(explorer_lane_, now_, from_seconds(config_.exploration.latency_s),
              [this, input, map = perception_.map_2d()]() -> JobQueue::Delivery {
                return [this, decision = explorer_->decide(*map, input)] {
                  mission_.decide(decision);
                  decisions_.push_back(decision);
                };
              });
}

void Stack::seek_landing() {
  if (!mission_.landing_query() || !jobs_.is_free(explorer_lane_, now_)) return;
  if (!perception_.map_2d()) {
    mission_.answer(std::nullopt);
    return;
  }
  jobs_.start(
      explorer_lane_, now_, from_seconds(config_.exploration.latency_s),
      [this, query = *mission_.landing_query(), p_OB = odometry_.X_OB.p, map = perception_.map_2d(),
       flown = perception_.flown_since_map()]() -> JobQueue::Delivery {
        return [this, place = landing_finder_.find(*map, p_OB, query, flown)] {
          mission_.answer(place);
        };
      });
}

LandingGround Stack::ground_below() const {
  const auto& map = perception_.map_2d();
  return map ? landing_finder_.assess(*map, setpoint_.p_OB) : LandingGround::kUnknown;
}

bool Stack::at_reserve() const {
  StopConfig stop = config_.exploration.explorer.stop;
  stop.return_home = false;
  return balance_energy(energy_, 0, stop).must_stop();
}

TrajectorySetpoint Stack::move(const MotionRequest& request) {
  const bool holds = navigating_ && request.kind == MotionRequest::Kind::kHold;
  if (request.kind != MotionRequest::Kind::kGoTo && !holds) {
    if (navigating_) legs_.take_over(setpoint_);
    navigating_ = false;
    // The legs into an area lead down ramps and through doors by heights that its 2D map has not.
    const bool in_area = config_.mission.kind != MissionConfig::Kind::kExplore;
    if (in_area && !autopilot_.landed) perception_.note_flown(odometry_.X_OB.p);
    if (perception_.grid()) {
      legs_.look_ahead(perception_.grid()->view, config_.vehicle.radius_m);
    }
    return legs_.update(now_, request, odometry_, autopilot_.follows);
  }
  if (!navigating_) navigator_.take_over(setpoint_, now_);
  if (!navigating_ || !(request == navigator_.request())) {
    holds ? navigator_.hold(request, now_)
          : navigator_.fly_to(request, odometry_, perception_.map_2d(), now_);
  }
  navigating_ = true;
  perception_.note_flown(odometry_.X_OB.p);
  const TrajectorySetpoint setpoint =
      navigator_.update(perception_.grid(), perception_.map_2d(), odometry_, now_);
  for (const PlannerEvent& event : navigator_.take_events()) {
    if (event.kind == PlannerEventKind::kStateChanged || event.kind == PlannerEventKind::kPlanned) {
      continue;  // many a second
    }
    const bool recovers =
        event.kind == PlannerEventKind::kEscape || event.kind == PlannerEventKind::kBackOff;
    report(recovers ? EventKind::kRecovery : EventKind::kPlanner,
           std::string(to_string(event.kind)) + " " + std::string(to_string(event.cause)));
  }
  return setpoint;
}

AttitudeCommand Stack::control(const MotionRequest& request) {
  AttitudeCommand command;
  command.stamp = now_;
  switch (request.kind) {
    case MotionRequest::Kind::kNone:
      return command;  // disarmed
    case MotionRequest::Kind::kDescend:
      command.mode = AutopilotMode::kDescend;
      return command;
    case MotionRequest::Kind::kLevel:
      tracker_.reset();
      command.mode = AutopilotMode::kAttitude;
      command.R_AB_desired = so3::from_yaw(so3::yaw(autopilot_.attitude.R_AB));
      command.thrust_n = config_.vehicle.mass_kg * kGravity;
      return command;
    default:
      break;
  }
  const TrackerOutput output = tracker_.update(setpoint_, odometry_, !autopilot_.landed);
  const Mat3 R_AO = heading_between(autopilot_.attitude.R_AB, odometry_.X_OB.R);
  command.mode = AutopilotMode::kAttitude;
  command.R_AB_desired = R_AO * output.R_OB_desired;
  command.yaw_rate_radps = output.yaw_rate_radps;
  command.thrust_n = output.thrust_n;
  return command;
}

void Stack::report(EventKind kind, const std::string& detail) {
  faults_.add(kind, detail);
  events_.push_back({now_, kind, detail});
}

FlightView Stack::view() const {
  FlightView view{odometry_,
                  {},
                  setpoint_,
                  mission_.state(),
                  mission_.lost(),
                  mission_.stuck(),
                  mission_.targets(),
                  mission_.request().goal_O,
                  perception_.grid(),
                  perception_.map_2d(),
                  perception_.known_volume_m3(),
                  navigator_.counts(),
                  odometry_need(),
                  sources_.front().odometry->visual_tally()};
  for (std::size_t i = 1; i < sources_.size(); ++i) {
    const OdometrySource& source = *sources_[i].odometry;
    view.others.push_back({sources_[i].name, &source.odometry(), source.visual_tally()});
  }
  return view;
}

std::vector<Vec3> Stack::planned_path() const {
  if (navigating_) return navigator_.planned_path(now_);
  const bool leg =
      request_.kind == MotionRequest::Kind::kLeg || request_.kind == MotionRequest::Kind::kTakeoff;
  return leg ? std::vector<Vec3>{setpoint_.p_OB, request_.goal_O} : std::vector<Vec3>{};
}

void Stack::read_cloud(Stamp due, CloudReader reader) {
  jobs_.schedule(perception_.cloud_lane(), due,
                 [this, reader = std::move(reader)] { return reader(perception_.cloud()); });
}

std::vector<Event> Stack::take_events() { return std::exchange(events_, {}); }

std::vector<FeatureSight> Stack::take_features() {
  std::vector<FeatureSight> features;
  for (Source& source : sources_) {
    features = source.odometry->take_features();
    if (!features.empty()) break;
  }
  return features;
}

std::vector<Decision> Stack::take_decisions() { return std::exchange(decisions_, {}); }

}  // namespace arex
