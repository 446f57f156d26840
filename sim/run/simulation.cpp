#include "run/simulation.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <utility>

namespace arex::sim {
namespace {

constexpr Stamp kTick = kNanosecondsPerTick;
constexpr Stamp kEstimatePeriod = 5 * kTick;  // 200 Hz: IMU to the stack, TUM files
constexpr Stamp kFlightPeriod = 50 * kTick;   // 20 Hz: flight.csv, clearance
constexpr Stamp kFlushPeriod = 1000 * kTick;  // what a killed run leaves
constexpr Stamp kLidarPart = 20 * kTick;      // a frame is cast in parts while it is fired

std::vector<worlds::CollisionShape> airframe_without_lidar(const Airframe& airframe) {
  std::vector<worlds::CollisionShape> shapes;
  for (const auto& shape : airframe.shapes) {
    if (shape.object != static_cast<std::uint32_t>(AirframePart::kLidar)) shapes.push_back(shape);
  }
  return shapes;
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

}  // namespace

Simulation::Simulation(const Scenario& scenario, int threads)
    : config_(scenario.config),
      world_(scenario.build_world()),
      scene_(world_),
      physics_(config_.physics, world_, start_pose(world_, config_.stack.vehicle), config_.seed),
      X_OW_(physics_.truth().X_WB.inverse()),
      imu_(config_.imu, config_.seed),
      lidar_(config_.lidar, scene_, physics_.airframe().X_BL,
             airframe_without_lidar(physics_.airframe()), config_.seed),
      autopilot_(config_.autopilot, config_.stack.vehicle),
      previous_truth_(physics_.truth()),
      clearance_(scene_, physics_.airframe()),
      jobs_(threads),
      lidar_lane_(jobs_.add_lane("lidar")),
      depth_lane_(jobs_.add_lane("depth")),
      stack_(config_.stack, jobs_) {}

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
  autopilot_.add_imu(imu_.sample(truth));
  if (const auto sample = imu_.output()) stack_.add_imu(*sample);
  if (const auto sample = imu_.magnetometer()) autopilot_.add_magnetometer(*sample);
  if (const auto sample = imu_.barometer()) autopilot_.add_barometer(*sample);
  if (now_ % kEstimatePeriod == 0) {
    const BatteryState& battery = physics_.battery();
    autopilot_.add_battery({now_, battery.voltage_v, battery.current_a});
    if (config_.stack.odometry.source == OdometryConfig::Source::kMocap) {
      stack_.add_mocap({now_, true_pose_in_O(), X_OW_.R * truth.v_WB});
    }
  }
}

void Simulation::fire_lidar() {
  if (!config_.devices.lidar) return;
  lidar_part_.push_back(physics_.truth());
  if (now_ == 0 || now_ % kLidarPart != 0) return;
  // The parts of a frame are cast while the next ones are fired; all become visible with the frame.
  const Stamp period = from_seconds(1 / config_.lidar.rate_hz);
  const Stamp begin = lidar_part_.front().stamp;
  const Stamp frame_begin = begin / period * period;
  const Stamp frame_end = frame_begin + period;
  if (begin == frame_begin) {
    lidar_frame_ = std::make_shared<LidarScan>();
    lidar_frame_->stamp = frame_begin;
    lidar_frame_->end = frame_end;
  }
  const bool complete = now_ == frame_end;
  jobs_.schedule(
      lidar_lane_, frame_end + from_seconds(config_.devices.lidar_latency_s),
      [this, ticks = lidar_part_, frame = lidar_frame_, complete]() -> JobQueue::Delivery {
        const LidarScan part = lidar_.scan(ticks);
        const auto offset = static_cast<std::uint32_t>(part.stamp - frame->stamp);
        for (LidarPoint point : part.points) {
          point.offset_ns += offset;
          frame->points.push_back(point);
        }
        if (!complete) return nullptr;
        return [this, frame, hash = hash_of(*frame)] {
          sensor_hash_.add(hash);
          stack_.add_scan(frame);
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
  if (!camera_) {
    camera_ = std::make_unique<D430>(config_.depth, world_, physics_.airframe().X_BC, config_.seed);
  }
  const double fraction = now_ == stamp ? 1.0 : 1.0 - static_cast<double>(now_ - stamp) / kTick;
  const Pose X_WB = interpolate(previous_truth_.X_WB, physics_.truth().X_WB, fraction);
  jobs_.schedule(depth_lane_, stamp + from_seconds(config_.devices.depth_latency_s),
                 [this, stamp, X_WB]() -> JobQueue::Delivery {
                   const DepthImagePtr frame = camera_->capture(stamp, X_WB);
                   return [this, frame, hash = hash_of(*frame)] {
                     sensor_hash_.add(hash);
                     stack_.add_depth(frame);
                   };
                 });
}

void Simulation::run_stack() {
  jobs_.advance(now_);
  const StageTimer::Scope timed(timers_.stack);
  if (now_ % kEstimatePeriod == 0) {
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
  distance_m_ += (truth.X_WB.p - previous_truth_.X_WB.p).norm();
}

void Simulation::record() {
  const StageTimer::Scope timed(timers_.recording);
  for (const Event& event : stack_.take_events()) {
    if (event.kind == EventKind::kTargetReached) {
      const Vec3 target = stack_.mission().targets().back().p_O;
      target_miss_m_.push_back((true_pose_in_O().p - target).norm());
    }
    if (recorder_) recorder_->event(event);
  }
  if (now_ % kEstimatePeriod == 0) score_tick();
  if (recorder_ && now_ % kFlushPeriod == 0) recorder_->flush();
}

void Simulation::score_tick() {
  const Truth& truth = physics_.truth();
  const Odometry& odometry = stack_.odometry();
  const bool flying = !autopilot_.landed();
  if (odometry.status == OdometryStatus::kLost) odometry_lost_s_ += to_seconds(kEstimatePeriod);
  if (odometry.status != OdometryStatus::kInitialising && odometry.stamp == now_) {
    // The stack's O is where its odometry began; truth is compared in that frame from then on.
    if (pose_pairs_.empty()) X_OW_ = odometry.X_OB * truth.X_WB.inverse();
    pose_pairs_.push_back({now_, truth.X_WB, odometry.X_OB});
    if (recorder_) recorder_->estimate(now_, odometry.X_OB);
  }
  if (pose_pairs_.empty()) return;
  const Pose X_OB_true = true_pose_in_O();
  const double odometry_error = (pose_pairs_.back().X_OB.p - X_OB_true.p).norm();
  const double tracking_error = flying ? (X_OB_true.p - stack_.setpoint().p_OB).norm() : 0.0;
  if (flying && stack_.mission().state() != MissionState::kLand) {
    tracking_sum_ += tracking_error * tracking_error;
    ++tracking_count_;
  }
  if (recorder_) recorder_->truth(now_, X_OB_true);
  if (now_ % kFlightPeriod != 0) return;
  if (stack_.mission().state() == MissionState::kFly) {
    last_clearance_m_ = clearance_.measure(truth);
  }
  if (!recorder_) return;
  const BatteryState& battery = physics_.battery();
  recorder_->flight({now_, truth.v_WB.norm(), tracking_error, odometry_error, last_clearance_m_,
                     X_OB_true.p.z(), battery.voltage_v, battery.voltage_v * battery.current_a,
                     battery.state_of_charge});
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
    } else {
      end(Outcome::kSucceeded, "mission done");
    }
  } else if (now_ >= from_seconds(config_.stack.mission.max_time_s)) {
    end(Outcome::kTimedOut, "mission.max_time_s is over");
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

FlightResult Simulation::finish() {
  FlightResult result;
  result.outcome = outcome_;
  result.reason = reason_;
  result.duration = now_;
  result.trajectory_hash = hash_.text();
  result.sensor_hash = sensor_hash_.text();
  result.distance_m = distance_m_;
  if (tracking_count_ > 0) {
    result.tracking_rmse_m = std::sqrt(tracking_sum_ / static_cast<double>(tracking_count_));
  }
  result.collisions = collisions_;
  result.targets = stack_.mission().targets();
  result.target_miss_m = target_miss_m_;
  if (!result.targets.empty()) {
    const Vec3 miss = true_pose_in_O().p - result.targets.back().p_O;
    result.landing_error_m = miss.head<2>().norm();
  }
  result.odometry = score_odometry(pose_pairs_);
  result.odometry_lost_s = odometry_lost_s_;
  result.clearance = clearance_.statistics();
  result.battery = physics_.battery();
  if (camera_) result.renderer = camera_->renderer_name();
  for (const StageTimer* timer :
       {&timers_.imu, &timers_.stack, &timers_.autopilot, &timers_.physics, &timers_.recording}) {
    result.timing.push_back(summarise(timer->name(), timer->seconds()));
  }
  for (const auto& lane : jobs_.timings()) {
    result.timing.push_back(summarise(lane.name, lane.seconds));
  }
  return result;
}

}  // namespace arex::sim
