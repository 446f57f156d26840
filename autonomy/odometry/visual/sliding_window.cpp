#include "odometry/visual/sliding_window.h"

#include <algorithm>
#include <cmath>

namespace arex {
namespace {

// Fewer features make no keyframe: it would push out one that sees something.
constexpr int kLeastOfKeyframe = 20;
// A known quantity is one of so little doubt; nothing would keep the algebra from dividing by zero.
constexpr double kKnown = 1e-6;

/// Rows of a start: the deviations given, and, at rest, the force that gravity makes.
LinearRows start_rows(const WindowStart& start, const CameraError& camera_std) {
  const WindowLayout layout{1};
  const int rest = start.rest_force_std_mps2 ? 3 : 0;
  LinearRows rows{Eigen::MatrixXd::Zero(layout.size() + rest, layout.size()),
                  Eigen::VectorXd::Zero(layout.size() + rest)};
  const Mat3& R = start.state.R_OB;  // a turn d in B is one of R d in O
  rows.J.block<2, 3>(0, kRotation) = R.topRows<2>() / start.tilt_std_rad;
  rows.J.block<1, 3>(2, kRotation) = R.bottomRows<1>() / start.yaw_std_rad;
  int row = 3;
  const auto add = [&](int column, double std) {
    for (int i = 0; i < 3; ++i) rows.J(row++, column + i) = 1 / std;
  };
  add(layout.pose(0) + kPosition, start.position_std_m);
  add(layout.at(0, kVelocity), start.velocity_std_mps);
  add(layout.at(0, kGyroBias), start.gyro_bias_std_radps);
  add(layout.at(0, kAccelBias), start.accel_bias_std_mps2);
  for (int i = 0; i < kCameraDim; ++i) {
    rows.J(row++, layout.camera() + i) = 1 / std::max(camera_std[i], kKnown);
  }
  if (!start.rest_force_std_mps2) return rows;
  // f_B = -R' g + b_a: a turn changes the first by hat(-R' g) d.
  const double weight = 1 / *start.rest_force_std_mps2;
  rows.J.block<3, 3>(row, layout.at(0, kRotation)) =
      weight * so3::hat(R.transpose() * Vec3(0, 0, kGravity));
  rows.J.block<3, 3>(row, layout.at(0, kAccelBias)) = weight * Mat3::Identity();
  return rows;
}

}  // namespace

FrameState predict(const FrameState& from, const Preintegration& imu) {
  const double dt = imu.dt_s();
  const Vec3 g(0, 0, -kGravity);
  FrameState to = from;
  to.R_OB = from.R_OB * imu.dR();
  to.v_OB = from.v_OB + dt * g + from.R_OB * imu.dv();
  to.p_OB = from.p_OB + dt * from.v_OB + 0.5 * dt * dt * g + from.R_OB * imu.dp();
  return to;
}

SlidingWindow::SlidingWindow(const SlidingWindowConfig& config) : config_(config) {
  noise_.huber_sigma = config.huber_sigma;
  noise_.least_images = config.least_observations;
  noise_.first_estimates = config.first_estimates;
}

void SlidingWindow::start(const WindowStart& start, const CameraState& camera,
                          const CameraError& camera_std, const FeatureFrame& features) {
  focal_px_ = features.f_px;
  noise_.ray_std = config_.pixel_std / features.f_px;
  noise_.disparity_std = config_.disparity_std / features.f_px;
  noise_.baseline_m = features.baseline_m;
  window_ = {};
  dropped_imu_.reset();
  waited_ = 0;
  window_.camera = camera;
  window_.frames.push_back(
      {next_number_++, features.stamp, {camera.t_d, Vec3::Zero()}, true, start.state, {}});
  window_.prior = {{start.state}, camera, start_rows(start, camera_std)};
  WindowUpdate update;
  observe(features, update);
  triangulate_new();
}

void SlidingWindow::make_room() {
  if (!window_.newest().keyframe) {
    dropped_imu_ = drop_newest(window_);
  } else if (static_cast<int>(window_.frames.size()) > config_.keyframes) {
    marginalise_oldest(window_, noise_);
  }
}

WindowUpdate SlidingWindow::add(const FeatureFrame& features, const Preintegration& imu,
                                const FrameTiming& timing) {
  WindowUpdate update;
  const FrameState predicted = predict(window_.newest().state, imu);
  make_room();
  WindowFrame frame{next_number_++, features.stamp, timing, false, predicted, imu};
  if (dropped_imu_) {
    dropped_imu_->join(imu);
    frame.imu = std::move(dropped_imu_);
    dropped_imu_.reset();
  }
  window_.frames.push_back(std::move(frame));
  observe(features, update);
  update.innovation_px = median_innovation_px();
  triangulate_new();
  update.solve = optimise(window_, noise_, config_.iterations, config_.converged);
  drop_outliers(update);
  relinearise_imu();
  update.correction_m = (window_.newest().state.p_OB - predicted.p_OB).norm();
  update.keyframe = window_.frames.back().keyframe = is_keyframe(update);
  return update;
}

void SlidingWindow::observe(const FeatureFrame& features, WindowUpdate& update) {
  const std::int64_t number = window_.newest().number;
  for (const TrackedFeature& feature : features.features) {
    Landmark& landmark = window_.landmarks[feature.id];
    update.fresh += landmark.seen.empty();
    landmark.id = feature.id;
    if (landmark.seen.empty()) landmark.state.ray = feature.left;
    landmark.seen.push_back({number, feature.left, feature.right});
  }
}

void SlidingWindow::triangulate_new() {
  for (auto& [id, landmark] : window_.landmarks) {
    if (landmark.state.inverse_depth > 0 || landmark.images() < 2) continue;
    std::vector<const FrameState*> frames;
    for (const Observation& o : landmark.seen) {
      frames.push_back(&window_.frames[static_cast<std::size_t>(window_.slot(o.frame))].state);
    }
    landmark.state.inverse_depth =
        triangulate(landmark, frames, window_.camera, noise_.baseline_m).value_or(0);
  }
}

double SlidingWindow::median_innovation_px() const {
  const std::int64_t newest = window_.newest().number;
  const WindowExposures exposures(window_, noise_);
  std::vector<double> off;
  for (const auto& [id, landmark] : window_.landmarks) {
    const Observation& last = landmark.seen.back();
    if (landmark.state.inverse_depth <= 0 || landmark.seen.size() < 2 || last.frame != newest) {
      continue;
    }
    const auto anchor = static_cast<std::size_t>(window_.slot(landmark.seen.front().frame));
    const auto r = sight_residual({last, false, false, noise_.baseline_m}, exposures.now[anchor],
                                  exposures.now.back(), window_.camera, landmark.state);
    if (r) off.push_back(focal_px_ * r->norm());
  }
  if (off.empty()) return 0;
  const auto middle = off.begin() + static_cast<std::ptrdiff_t>(off.size() / 2);
  std::nth_element(off.begin(), middle, off.end());
  return *middle;
}

bool SlidingWindow::is_keyframe(const WindowUpdate& update) {
  const WindowFrame& last = window_.frames[window_.frames.size() - 2];
  const WindowFrame& newest = window_.newest();
  const Mat3& R_BC = window_.camera.X_BC.R;
  const Mat3 turn = (newest.state.R_OB * R_BC).transpose() * last.state.R_OB * R_BC;
  int common = 0, seen = 0, both = 0;
  double parallax = 0;
  for (const auto& [id, landmark] : window_.landmarks) {
    if (landmark.seen.back().frame != newest.number) continue;
    ++seen;
    both += landmark.seen.back().right.has_value();
    if (landmark.seen.size() < 2) continue;
    const Observation& before = landmark.seen[landmark.seen.size() - 2];
    if (before.frame != last.number) continue;
    ++common;
    parallax +=
        (landmark.seen.back().left - Vec3(turn * before.left.homogeneous()).hnormalized()).norm();
  }
  if (seen < kLeastOfKeyframe) return false;
  if (update.tracked >= config_.keyframe_tracked && 2 * common >= seen &&
      parallax <= config_.keyframe_parallax_rad * common) {
    waited_ = 0;
    return false;
  }
  // What both eyes saw goes with a frame that is dropped: it is worth a wait.
  const bool waits = 2 * both < seen && waited_ < config_.keyframe_wait;
  waited_ = waits ? waited_ + 1 : 0;
  return !waits;
}

void SlidingWindow::drop_outliers(WindowUpdate& update) {
  const double most = config_.outlier_px / config_.pixel_std;
  const std::int64_t newest = window_.newest().number;
  const WindowExposures exposures(window_, noise_);
  for (auto it = window_.landmarks.begin(); it != window_.landmarks.end();) {
    const Landmark& landmark = it->second;
    if (noise_.uses(landmark)) {
      const auto residual = mean_residual(window_, exposures, landmark, noise_);
      if (!residual || *residual > most) {
        update.outliers.push_back(landmark.id);
        it = window_.landmarks.erase(it);
        continue;
      }
      update.tracked += landmark.seen.back().frame == newest;
    }
    ++it;
  }
}

void SlidingWindow::relinearise_imu() {
  // Beyond this the bias Jacobian's second order counts, rad/s and m/s^2.
  constexpr double kGyro = 1e-3, kAccel = 0.05;
  for (std::size_t k = 1; k < window_.frames.size(); ++k) {
    const FrameState& from = window_.frames[k - 1].state;
    std::optional<Preintegration>& imu = window_.frames[k].imu;
    if ((from.b_g - imu->b_g()).norm() > kGyro || (from.b_a - imu->b_a()).norm() > kAccel) {
      imu = imu->relinearised(from.b_g, from.b_a);
    }
  }
}

}  // namespace arex
