#include "odometry/visual/visual_estimator.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

#include "math/so3.h"

namespace arex {
namespace {

// What the IMU's buffer keeps before the newest state: the shaking is measured over it.
constexpr Stamp kShakenFor = kNanosecondsPerSecond / 2;

// For so long a camera's clock or mounting must seem off. One that is stays so; what a few odd
// tracks make of them, close above the ground, is over within a second or two.
constexpr Stamp kCameraOffFor = 3 * kNanosecondsPerSecond;

int seen_by_both(const FeatureFrame& features) {
  return static_cast<int>(std::count_if(features.features.begin(), features.features.end(),
                                        [](const TrackedFeature& f) { return f.right; }));
}

}  // namespace

VisualEstimator::VisualEstimator(const VisualInertialConfig& config, const Pose& X_BC)
    : config_(config),
      configured_imu_(config.imu),
      nominal_{X_BC, config.imu.delay_s - config.camera.clock_offset_s},
      window_(config.window),
      camera_(nominal_) {}

CameraError VisualEstimator::camera_std() const {
  const StereoCalibrationConfig& c = config_.camera;
  CameraError std;
  std << Vec3::Constant(c.mount_rotation_std_rad), Vec3::Constant(c.mount_position_std_m),
      c.clock_offset_std_s;
  return std;
}

Mat3 VisualEstimator::camera_turn(Stamp from, Stamp to) const {
  const Mat3& R_BC = camera_.X_BC.R;
  if (imu_.empty() || to <= from) return Mat3::Identity();
  Mat3 turn = Mat3::Identity();
  for (const ImuInterval& imu :
       imu_intervals(imu_.samples(), from, to, accel_scale_, camera_.t_d)) {
    turn = turn * so3::Exp(imu.dt_s() * (imu.mean_gyro() - state_.b_g));
  }
  return R_BC.transpose() * turn * R_BC;
}

Preintegration VisualEstimator::integrate(Stamp to, double t_d) const {
  Preintegration imu(config_.imu, state_.b_g, state_.b_a);
  const Stamp begin = stamp_ + from_seconds(placed_by_), end = to + from_seconds(t_d);
  for (const ImuInterval& interval : imu_intervals(imu_.samples(), begin, end, accel_scale_)) {
    imu.add(interval);
  }
  const WhiteNoise shaking = white_noise(imu_.between(end - kShakenFor, end));
  imu.note_shaking(shaken_angle(shaking), shaken_speed(shaking));
  return imu;
}

Vec3 VisualEstimator::rate_at(Stamp stamp, double t_d) const {
  constexpr Stamp kAround = kNanosecondsPerSecond / 50;  // single readings are shaken
  const Stamp at = stamp + from_seconds(t_d);
  Vec3 sum = Vec3::Zero();
  int count = 0;
  for (const ImuSample& sample : imu_.between(at - kAround, at + kAround)) {
    sum += sample.gyro_radps;
    ++count;
  }
  return count > 0 ? Vec3(sum / count - state_.b_g) : Vec3(Vec3::Zero());
}

void VisualEstimator::remember(const FrameState& state, Stamp stamp, double t_d) {
  state_ = state;
  stamp_ = stamp;
  placed_by_ = t_d;
  imu_.forget_before(stamp + from_seconds(t_d) - kShakenFor);
}

VisualUpdate VisualEstimator::add(const FeatureFrame& features) {
  VisualUpdate update;
  update.stamp = features.stamp;
  if (phase_ == Phase::kStanding) {
    try_start(features, update);
  } else if (phase_ == Phase::kTracking) {
    track(features, update);
  } else {
    try_restart(features, update);
  }
  update.correction_stamp = correction_stamp_;
  update.camera = camera_;
  update.accel_scale = accel_scale_;
  update.covariance = covariance_;
  update.imu_noise = {config_.imu.gyro_noise_density, config_.imu.accel_noise_density};
  NavigationState& x = update.state;
  x.R_OB = state_.R_OB;
  x.p_OB = state_.p_OB;
  x.v_OB = state_.v_OB;
  x.b_g = state_.b_g;
  x.b_a = state_.b_a;
  x.t_d = placed_by_;
  return update;
}

void VisualEstimator::try_start(const FeatureFrame& features, VisualUpdate& update) {
  const Stamp until = features.stamp + from_seconds(nominal_.t_d);
  const std::span<const ImuSample> samples = imu_.until(until);
  const StaticInitialiserConfig& still = config_.initialiser;
  update.need =
      has_imu_gap(samples, until) ? OdometryNeed::kImu : missing_for_start(samples, still);
  const auto standing =
      update.need == OdometryNeed::kNothing ? measure_standstill(samples, still) : std::nullopt;
  if (standing && seen_by_both(features) < config_.health.restart_tracks) {
    update.need = features.features.empty() ? OdometryNeed::kImages : OdometryNeed::kFeatures;
  }
  imu_.forget_before(until - from_seconds(still.window_s + 0.2));
  if (!standing || update.need != OdometryNeed::kNothing) return;

  config_.imu = scaled_to_measured(configured_imu_, standing->white_noise);
  accel_scale_ = kGravity / standing->moments.accel_mean.norm();
  WindowStart start;
  start.state.R_OB = level(standing->moments.accel_mean);
  start.state.b_g = standing->moments.gyro_mean;
  const double mean_std =
      standing->moments.gyro_std / std::sqrt(static_cast<double>(standing->samples));
  start.gyro_bias_std_radps = std::hypot(still.gyro_bias_std_radps, mean_std);
  start.accel_bias_std_mps2 = still.accel_bias_std_mps2;
  start.rest_force_std_mps2 = still.gravity_std_mps2;
  window_.start(start, nominal_, camera_std(), features);
  camera_ = nominal_;
  remember(start.state, features.stamp, nominal_.t_d);
  phase_ = Phase::kTracking;
  correction_stamp_ = features.stamp;
  update.status = OdometryStatus::kOk;
}

void VisualEstimator::track(const FeatureFrame& features, VisualUpdate& update) {
  const Preintegration imu = integrate(features.stamp, camera_.t_d);
  const FrameState reckoned = predict(state_, imu);
  const double t_d = camera_.t_d;
  update.window = window_.add(features, imu, {t_d, rate_at(features.stamp, t_d)});
  if (const auto why = failure(update)) {
    remember(reckoned, features.stamp, t_d);
    lose(*why, update);
    return;
  }
  camera_ = window_.window().camera;
  covariance_ = update.window.solve.newest_covariance;
  remember(window_.newest().state, features.stamp, t_d);
  judge(update);
  watch_camera(update);
}

std::optional<std::string> VisualEstimator::failure(const VisualUpdate& update) const {
  const VisualHealthConfig& health = config_.health;
  const FrameState& x = window_.newest().state;
  const bool finite = x.p_OB.allFinite() && x.v_OB.allFinite() && x.R_OB.allFinite();
  if (!finite || update.window.correction_m > health.jump_m) return "a jump of the position";
  if (x.b_g.norm() > health.most_gyro_bias_radps) return "gyro bias out of range";
  if (x.b_a.norm() > health.most_accel_bias_mps2) return "accelerometer bias out of range";
  if (large_in_a_row_ + (update.window.innovation_px > health.large_innovation_px) >=
      health.lost_innovations) {
    return "large innovations";
  }
  return std::nullopt;
}

void VisualEstimator::judge(VisualUpdate& update) {
  const VisualHealthConfig& health = config_.health;
  const bool large = update.window.innovation_px > health.large_innovation_px;
  const bool few = update.window.tracked < health.few_tracks;
  large_in_a_row_ = large ? large_in_a_row_ + 1 : 0;
  if (!few && !large) {
    correction_stamp_ = update.stamp;
    confirmations_left_ = std::max(0, confirmations_left_ - 1);
  }
  const double silence_s = to_seconds(update.stamp - correction_stamp_);
  if (silence_s > health.lost_silence_s) {
    lose("too few tracks for too long", update);
    return;
  }
  const bool silent = silence_s > health.degenerate_silence_s;
  update.status = large || silent || confirmations_left_ > 0 ? OdometryStatus::kDegenerate
                                                             : OdometryStatus::kOk;
  if (update.status != OdometryStatus::kOk) update.need = OdometryNeed::kFeatures;
  if (silent) {
    tell_once(fmt::format("few tracks: {}", update.window.tracked), few_told_, update);
  } else if (large) {
    tell_once(fmt::format("large innovation: {:.0f} px", update.window.innovation_px), large_told_,
              update);
  } else if (!few) {
    few_told_ = large_told_ = false;
  }
}

void VisualEstimator::lose(const std::string& why, VisualUpdate& update) {
  phase_ = Phase::kLost;
  update.status = OdometryStatus::kLost;
  update.need = OdometryNeed::kFeatures;
  update.faults.push_back("visual odometry lost: " + why);
}

void VisualEstimator::try_restart(const FeatureFrame& features, VisualUpdate& update) {
  const VisualHealthConfig& health = config_.health;
  const Preintegration imu = integrate(features.stamp, camera_.t_d);
  remember(predict(state_, imu), features.stamp, camera_.t_d);
  update.status = OdometryStatus::kLost;
  update.need = features.features.empty() ? OdometryNeed::kImages : OdometryNeed::kFeatures;
  if (seen_by_both(features) < health.restart_tracks) return;
  WindowStart start;
  start.state = state_;
  start.yaw_std_rad = start.tilt_std_rad = health.restart_tilt_std_rad;
  start.position_std_m = health.restart_position_std_m;
  start.velocity_std_mps = health.restart_velocity_std_mps;
  start.gyro_bias_std_radps = 1e-3;
  start.accel_bias_std_mps2 = config_.initialiser.accel_bias_std_mps2;
  window_.start(start, camera_, camera_std(), features);
  phase_ = Phase::kTracking;
  correction_stamp_ = features.stamp;
  large_in_a_row_ = 0;
  few_told_ = large_told_ = false;
  confirmations_left_ = health.restart_confirmations;
  update.status = OdometryStatus::kDegenerate;
  update.faults.emplace_back("visual odometry begins anew");
}

void VisualEstimator::tell_once(const std::string& what, bool& told, VisualUpdate& update) const {
  if (std::exchange(told, true)) return;
  update.faults.push_back("visual odometry degenerate: " + what);
}

void VisualEstimator::watch_camera(VisualUpdate& update) {
  const VisualHealthConfig& health = config_.health;
  const CameraError off = local(nominal_, camera_);
  const auto& P = update.window.solve.camera_covariance;
  const auto sure = [&](double value, double limit, double variance) {
    return std::abs(value) > limit + health.sure_sigma * std::sqrt(std::max(variance, 0.0));
  };
  const double clock_s = off[kCameraTime];
  const bool clock_off = sure(clock_s, health.clock_s, P(kCameraTime, kCameraTime));
  if (clock_off_.holds(clock_off, stamp_, kCameraOffFor) && !std::exchange(clock_told_, true)) {
    // t_d is what the IMU's stamps are ahead by.
    update.faults.push_back(fmt::format("camera clock {:.0f} ms {}", 1e3 * std::abs(clock_s),
                                        clock_s < 0 ? "ahead" : "behind"));
  }
  const double angle = off.head<3>().norm();
  const bool mount_off = sure(angle, health.mount_rad, P.topLeftCorner<3, 3>().trace());
  if (mount_off_.holds(mount_off, stamp_, kCameraOffFor) && !std::exchange(mount_told_, true)) {
    update.faults.push_back(
        fmt::format("camera mount turned {:.1f} deg", angle * 180 / std::numbers::pi));
  }
}

}  // namespace arex
