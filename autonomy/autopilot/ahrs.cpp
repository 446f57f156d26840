#include "autopilot/ahrs.h"

#include <cmath>

#include "math/so3.h"

namespace arex {
namespace {

constexpr int kTheta = 0, kBias = 3, kVelocity = 6, kHeight = 9;

// Initial standard deviations. The static window leaves the accelerometer's bias in the tilt and
// the gyro's white noise in the bias.
constexpr double kInitialTilt = 0.01;     // rad
constexpr double kInitialHeading = 0.03;  // rad
constexpr double kInitialBias = 3e-4;     // rad/s
// A static window that is not still starts again: it is looked at this often.
constexpr Stamp kStillnessCheck = kNanosecondsPerSecond / 4;

// Specific gas constant of dry air (J/(kg K)) and the standard atmosphere's temperature at sea
// level (K): the pressure's scale height is R T / g.
constexpr double kAirGasConstant = 287.053;
constexpr double kStandardTemperature = 288.15;

double height_above(double ground_pressure_pa, double pressure_pa) {
  return kAirGasConstant * kStandardTemperature / kGravity *
         std::log(ground_pressure_pa / pressure_pa);
}

/// Largest standard deviation of the three axes.
double largest_deviation(const Vec3& sum, const Vec3& sum_of_squares, int samples) {
  const Vec3 mean = sum / samples;
  const Vec3 variance = sum_of_squares / samples - mean.cwiseAbs2();
  return std::sqrt(std::max(variance.maxCoeff(), 0.0));
}

}  // namespace

Ahrs::Ahrs(const AhrsConfig& config) : config_(config) {}

void Ahrs::add_imu(const ImuSample& imu) {
  const double dt = to_seconds(imu.stamp - last_stamp_);
  last_stamp_ = imu.stamp;
  if (!initialised_) {
    collect_static(imu);
    return;
  }
  propagate(imu, dt);
  if (window_s_ * config_.correction_hz >= 1 - 1e-9) correct_window();
}

void Ahrs::collect_static(const ImuSample& imu) {
  StaticWindow& s = static_;
  if (s.samples == 0) s.begin = s.checked = imu.stamp;
  ++s.samples;
  s.gyro += imu.gyro_radps;
  s.gyro2 += imu.gyro_radps.cwiseAbs2();
  s.accel += imu.accel_mps2;
  s.accel2 += imu.accel_mps2.cwiseAbs2();
  if (imu.stamp - s.checked < kStillnessCheck) return;
  s.checked = imu.stamp;
  const bool still = largest_deviation(s.gyro, s.gyro2, s.samples) < config_.still_gyro_radps &&
                     largest_deviation(s.accel, s.accel2, s.samples) < config_.still_accel_mps2;
  if (!still) {
    s = {};
  } else if (to_seconds(imu.stamp - s.begin) >= config_.initialisation_s && s.fields > 0) {
    initialise(s);
  }
}

void Ahrs::initialise(const StaticWindow& window) {
  const Vec3 up = window.accel.normalized();  // in B
  // Heading: A's x axis along the horizontal part of the field.
  const Vec3 north = (window.field - up * up.dot(window.field)).normalized();
  R_AB_.row(0) = north.transpose();
  R_AB_.row(1) = up.cross(north).transpose();
  R_AB_.row(2) = up.transpose();
  gyro_bias_ = window.gyro / window.samples;
  v_.setZero();
  height_ = 0;
  ground_pressure_pa_ = window.pressures > 0 ? window.pressure / window.pressures : 0;

  P_.setZero();
  Mat3 P_theta = Vec3(kInitialTilt, kInitialTilt, kInitialHeading).cwiseAbs2().asDiagonal();
  P_.block<3, 3>(kTheta, kTheta) = R_AB_.transpose() * P_theta * R_AB_;
  P_.block<3, 3>(kBias, kBias) = Mat3::Identity() * kInitialBias * kInitialBias;
  P_.block<3, 3>(kVelocity, kVelocity) =
      Mat3::Identity() * config_.still_noise_mps * config_.still_noise_mps;
  P_(kHeight, kHeight) = config_.barometer_noise_m * config_.barometer_noise_m;
  window_s_ = 0;
  window_force_B_.setZero();
  window_velocity_change_.setZero();
  R_AB_window_ = R_AB_;
  initialised_ = true;
}

void Ahrs::propagate(const ImuSample& imu, double dt) {
  const Mat3 half = so3::Exp((imu.gyro_radps - gyro_bias_) * (0.5 * dt));
  const Mat3 R_middle = R_AB_ * half;
  const Vec3 velocity_change = R_middle * imu.accel_mps2 * dt;
  const Vec3 v_before = v_;
  v_ += velocity_change - Vec3(0, 0, kGravity * dt);
  height_ += 0.5 * (v_before.z() + v_.z()) * dt;
  R_AB_ = R_middle * half;
  // One Newton step back to orthogonality: the error it leaves is the square of the one it finds.
  R_AB_ = 0.5 * R_AB_ * (3 * Mat3::Identity() - R_AB_.transpose() * R_AB_);

  window_s_ += dt;
  window_force_B_ += imu.accel_mps2 * dt;
  window_velocity_change_ += velocity_change;
}

void Ahrs::propagate_covariance() {
  const double dt = window_s_;
  const Mat3 identity = Mat3::Identity();
  Covariance F = Covariance::Identity();
  F.block<3, 3>(kTheta, kTheta) = R_AB_.transpose() * R_AB_window_;
  F.block<3, 3>(kTheta, kBias) = -dt * identity;
  F.block<3, 3>(kVelocity, kTheta) = -so3::hat(window_velocity_change_) * R_AB_window_;
  F(kHeight, kVelocity + 2) = dt;
  P_ = F * P_ * F.transpose();

  const auto add = [&](int first, int count, double density) {
    P_.diagonal().segment(first, count).array() += density * density * dt;
  };
  add(kTheta, 3, config_.gyro_noise);
  add(kBias, 3, config_.gyro_walk);
  add(kVelocity, 2, config_.gust_noise);
  add(kVelocity + 2, 1, config_.vertical_noise);
}

void Ahrs::correct_window() {
  propagate_covariance();
  const Vec3 mean_force = window_force_B_ / window_s_;
  window_s_ = 0;
  window_force_B_.setZero();
  window_velocity_change_.setZero();
  if (on_ground_) {
    for (int axis = 0; axis < 3; ++axis) {
      Row H = Row::Zero();
      H[kVelocity + axis] = 1;
      correct(H, -v_[axis], config_.still_noise_mps * config_.still_noise_mps, false);
    }
  } else if (last_stamp_ >= drag_from_) {
    correct_drag(mean_force);
  }
  R_AB_window_ = R_AB_;
}

void Ahrs::correct_drag(const Vec3& mean_specific_force) {
  // Drag acts in the rotor plane, in proportion to thrust: f_xy = -k f_z (R_AB^T v)_xy.
  const double d = config_.drag_s_per_m * std::max(mean_specific_force.z(), 0.0);
  for (int axis = 0; axis < 2; ++axis) {
    const Vec3 v_B = R_AB_.transpose() * v_;
    Row H = Row::Zero();
    H.segment<3>(kTheta) = -d * so3::hat(v_B).row(axis);
    H.segment<3>(kVelocity) = -d * R_AB_.col(axis).transpose();
    correct(H, mean_specific_force[axis] + d * v_B[axis],
            config_.drag_noise_mps2 * config_.drag_noise_mps2, false);
  }
}

void Ahrs::add_magnetometer(const MagnetometerSample& sample) {
  if (!initialised_) {
    static_.field += sample.field_gauss;
    ++static_.fields;
    return;
  }
  const Vec3 field_A = R_AB_ * sample.field_gauss;
  const double heading_error = std::atan2(field_A.y(), field_A.x());
  Row H = Row::Zero();
  H.segment<3>(kTheta) = R_AB_.row(2);
  const double sigma = config_.magnetic_heading_noise_rad;
  correct(H, -heading_error, sigma * sigma, true);
}

void Ahrs::add_barometer(const BarometerSample& sample, double noise_pa) {
  if (!initialised_) {
    static_.pressure += sample.pressure_pa;
    ++static_.pressures;
    return;
  }
  if (ground_pressure_pa_ <= 0) ground_pressure_pa_ = sample.pressure_pa;
  Row H = Row::Zero();
  H[kHeight] = 1;
  const double sigma = std::max(config_.barometer_noise_m,
                                height_above(sample.pressure_pa + noise_pa, sample.pressure_pa));
  correct(H, height_above(ground_pressure_pa_, sample.pressure_pa) - height_, sigma * sigma, false);
}

void Ahrs::set_on_ground(bool on_ground) {
  if (on_ground_ && !on_ground && initialised_) {
    // What held the velocity at zero was the ground, not the air.
    const double sigma = config_.airspeed_at_takeoff_mps;
    P_.diagonal().segment<2>(kVelocity).array() += sigma * sigma;
    drag_from_ = last_stamp_ + from_seconds(config_.takeoff_s);
  } else if (!on_ground_ && on_ground) {
    // The airspeed was the wind; the feet stand still.
    P_.middleRows<3>(kVelocity).setZero();
    P_.middleCols<3>(kVelocity).setZero();
    P_.block<3, 3>(kVelocity, kVelocity) =
        Mat3::Identity() * config_.still_noise_mps * config_.still_noise_mps;
    v_.setZero();
  }
  on_ground_ = on_ground;
}

void Ahrs::correct(const Row& H, double innovation, double variance, bool heading_only) {
  const Eigen::Matrix<double, kStates, 1> PHt = P_ * H.transpose();
  const double innovation_variance = H.dot(PHt) + variance;
  const double gate = config_.gate_sigma;
  if (innovation * innovation > gate * gate * innovation_variance) return;
  Eigen::Matrix<double, kStates, 1> K = PHt / innovation_variance;
  if (heading_only) {
    // Iron nearby must not tilt the horizon: only the parts about the vertical are taken.
    const Vec3 up = R_AB_.row(2).transpose();
    K.segment<3>(kTheta) = up * up.dot(K.segment<3>(kTheta));
    K.segment<3>(kBias) = up * up.dot(K.segment<3>(kBias));
    K.tail<4>().setZero();
  }
  // Joseph's form holds for any gain.
  const Eigen::Matrix<double, kStates, 1> cross = PHt - K * innovation_variance;
  P_ -= K * PHt.transpose() + cross * K.transpose();
  P_ = 0.5 * (P_ + P_.transpose()).eval();

  const Eigen::Matrix<double, kStates, 1> dx = K * innovation;
  R_AB_ = R_AB_ * so3::Exp(dx.segment<3>(kTheta));
  gyro_bias_ += dx.segment<3>(kBias);
  v_ += dx.segment<3>(kVelocity);
  height_ += dx[kHeight];
}

}  // namespace arex
