#include "odometry/scan_corrector.h"

#include <algorithm>
#include <cmath>

#include "math/so3.h"
#include "odometry/inertial/imu_slopes.h"
#include "odometry/relocalisation.h"

namespace arex {
namespace {

/// Over so long the shaking of the IMU is measured.
constexpr Stamp kShakenFor = kNanosecondsPerSecond;
/// A surfel's own error is the same for scan after scan and does not average out with their noise:
/// trunks and rough ground are no planes, whatever the sensor. So much more than that noise it
/// leaves in the map, by the NEES of eighteen flights along waypoints (scenarios/RESULTS.md).
constexpr double kSharedError = 150;

std::vector<float> fractions_of(const LidarScan& scan, const std::vector<ScanPoint>& points) {
  std::vector<float> fractions;
  fractions.reserve(points.size());
  for (const ScanPoint& point : points) {
    fractions.push_back(scan.fraction_of(scan.points[point.index]));
  }
  return fractions;
}

/// The covariance with its rotation in the axes that R turns it to.
PoseCovariance turned(const PoseCovariance& covariance, const Mat3& R) {
  PoseCovariance T = PoseCovariance::Identity();
  T.topLeftCorner<3, 3>() = R;
  return T * covariance * T.transpose();
}

/// What the IMU's noise inside a scan, which undistortion takes for motion, makes of the whole
/// scan: the mean of a random walk, in the rotation and, twice integrated, in the position.
PoseCovariance distortion(const ImuNoiseConfig& noise, double scan_s) {
  PoseCovariance covariance = PoseCovariance::Zero();
  const double rotation = noise.gyro_noise_density * noise.gyro_noise_density * scan_s / 3;
  const double position =
      noise.accel_noise_density * noise.accel_noise_density * scan_s * scan_s * scan_s / 20;
  covariance.diagonal().head<3>().setConstant(rotation);
  covariance.diagonal().tail<3>().setConstant(position);
  return covariance;
}

Stamp middle_of(const LidarScan& scan) { return scan.stamp + (scan.end - scan.stamp) / 2; }

}  // namespace

ScanCorrector::ScanCorrector(const LidarInertialConfig& config, const Pose& X_BL,
                             double body_radius_m)
    : config_(config),
      configured_imu_(config.imu),
      X_BL_(X_BL),
      body_radius_m_(body_radius_m),
      filter_(config.imu),
      map_(config.map) {}

ScanUpdate ScanCorrector::correct(const ScanJob& job) {
  imu_.add(job.imu);
  gyro_.full_scale_radps = job.gyro_full_scale_radps;
  ScanUpdate update;
  update.begin = job.scan->stamp;
  update.end = job.scan->end;
  if (stood_at_ && has_imu_gap(imu_.between(stamp_, update.end), update.end)) start_again();
  if (job.suggested && !stood_at_ && status_ != OdometryStatus::kInitialising) {
    move_to(*job.suggested, update.begin);
  }
  if (status_ == OdometryStatus::kInitialising) {
    try_start(job.scan);
    update.points_O = std::make_shared<const std::vector<Vec3f>>();
    update.fractions = std::make_shared<const std::vector<float>>();
  } else {
    const std::vector<ScanPoint> points = register_with_motion(*job.scan, update);
    update_status(update);
    std::vector<Vec3f> points_O;
    std::vector<float> fractions;
    if (update.registration.accepted && status_ != OdometryStatus::kLost &&
        doubtful_in_a_row_ == 0) {
      points_O = to_O(points, update.registration.X_OB);
      fractions = fractions_of(*job.scan, points);
      map_met_ = drift_.met(update.registration.born, filter_.state().p_OB);
      if (confirmations_left_ == 0) {
        insert(points, points_O);
        drift_.add(map_met_,
                   kSharedError * turned(update.registration.covariance, filter_.state().R_OB) +
                       turned(update.registration.carried, filter_.state().R_OB) +
                       distortion(filter_.noise(), to_seconds(job.scan->end - job.scan->stamp)),
                   filter_.state().p_OB);
      }
    }
    update.points_O = std::make_shared<const std::vector<Vec3f>>(std::move(points_O));
    update.fractions = std::make_shared<const std::vector<float>>(std::move(fractions));
    if (status_ == OdometryStatus::kLost && stood_at_) start_again();
  }
  update.stamp = stamp_;
  update.correction_stamp = correction_stamp_;
  update.status = status_;
  update.need = need_;
  update.state = filter_.state();
  update.covariance = filter_.covariance();
  const Mat3 R_BO = filter_.state().R_OB.transpose();
  update.pose_covariance = filter_.pose_covariance().topLeftCorner<6, 6>();
  update.pose_covariance += turned(map_met_.covariance, R_BO);
  update.pose_covariance.diagonal().head<3>().array() += shaken_rad_ * shaken_rad_;
  update.imu_noise = {filter_.noise().gyro_noise_density, filter_.noise().accel_noise_density};
  update.accel_scale = accel_scale_;
  update.gyro = gyro_;
  return update;
}

void ScanCorrector::move_to(const Odometry& suggested, Stamp scan_begin) {
  NavigationState x = filter_.state();
  x.R_OB = suggested.X_OB.R;
  x.v_OB = suggested.v_OB;
  x.p_OB = suggested.X_OB.p - to_seconds(suggested.stamp - scan_begin) * x.v_OB;
  filter_.reset(x, filter_.covariance());
  corrected_position_ = x.p_OB;
  stamp_ = scan_begin;
  status_ = OdometryStatus::kLost;
}

void ScanCorrector::try_start(const LidarScanPtr& scan) {
  standing_scans_.push_back(scan);
  const Stamp window_begin = scan->end - from_seconds(config_.initialiser.window_s);
  std::erase_if(standing_scans_, [&](const LidarScanPtr& s) { return s->stamp < window_begin; });
  const std::span<const ImuSample> samples = imu_.until(scan->end);
  need_ = has_imu_gap(samples, scan->end) ? OdometryNeed::kImu
                                          : missing_for_start(samples, config_.initialiser);
  const auto standing = start_from_standstill(samples, X_BL_, config_);
  if (need_ == OdometryNeed::kNothing && standing && !start(*standing, scan->end)) {
    need_ = scan->points.empty() ? OdometryNeed::kScan : OdometryNeed::kReference;
  }
  if (need_ != OdometryNeed::kNothing) {
    // One window and what a late scan may lack.
    imu_.forget_before(window_begin - from_seconds(0.2));
    return;
  }
  status_ = OdometryStatus::kOk;
  standing_scans_.clear();
  imu_.forget_before(stamp_ - kShakenFor);
}

bool ScanCorrector::start(const StaticStart& standing, Stamp stamp) {
  white_noise_ = standing.white_noise;
  config_.imu = scaled_to_measured(configured_imu_, white_noise_);
  filter_ = ErrorStateFilter(config_.imu);
  filter_.reset(standing.state, standing.covariance);
  accel_scale_ = standing.accel_scale;
  std::vector<ScanPoint> points;
  for (const LidarScanPtr& scan : standing_scans_) {
    MotionSegment still;
    still.begin = scan->stamp;
    still.end = scan->end;
    still.X_OB = filter_.state().X_OB();
    points = undistort(*scan, {still}, still.X_OB, X_BL_, config_.lidar, body_radius_m_);
    insert(points, to_O(points, filter_.state().X_OB()));
    drift_.add_first();
  }
  // A filter that no scan can correct runs away within seconds.
  ErrorStateFilter tried = filter_;
  points =
      voxel_downsample(points, config_.registration.scan_voxel_m, config_.registration.max_points);
  if (!register_scan(points, map_, config_, 0, tried).accepted) {
    forget_map();
    return false;
  }
  stamp_ = correction_stamp_ = started_ = stamp;
  delay_unknown_ = false;
  corrected_position_ = filter_.state().p_OB;
  stood_at_ = filter_.state().X_OB();
  return true;
}

void ScanCorrector::forget_map() {
  map_.clear();
  drift_.clear();
  map_met_ = {};
}

void ScanCorrector::start_again() {
  forget_map();
  stood_at_.reset();
  status_ = OdometryStatus::kInitialising;
  need_ = OdometryNeed::kReference;
  refused_in_a_row_ = doubtful_in_a_row_ = confirmations_left_ = 0;
  gyro_.missing_radps.setConstant(GyroCompletion::kUntold);
}

std::vector<ScanPoint> ScanCorrector::register_with_motion(const LidarScan& scan,
                                                           ScanUpdate& update) {
  constexpr int kPasses = 3;
  constexpr double kSettled = 0.02;  // rad/s
  const WhiteNoise shaking = white_noise(imu_.between(scan.end - kShakenFor, scan.end));
  filter_.set_noise(shaken_by(config_.imu, shaking));
  shaken_rad_ = stood_at_ ? 0 : shaken_angle(shaking);
  const Vec3 clipped_s = clipped_time(scan).seconds;
  const bool clipped = clipped_s.maxCoeff() > 0;
  const ErrorStateFilter before = filter_;
  const bool by_scan = clipped && !gyro_.by_field();
  if (by_scan && status_ != OdometryStatus::kLost) {
    gyro_.missing_radps = likeliest_missing(scan, clipped_s);
  }
  Attempt made;
  for (int pass = 1;; ++pass) {
    const GyroCompletion gyro_before = gyro_;
    made = attempt(scan, shaking);
    const double change = (made.missing_radps - gyro_before.missing_radps).norm();
    if (!by_scan || change < kSettled || pass == kPasses) break;
    filter_ = before;
    gyro_ = gyro_before;
    gyro_.missing_radps = made.missing_radps;
  }
  gyro_.missing_radps = made.missing_radps;
  stamp_ = middle_of(scan);
  if (made.registration.accepted) {
    note_field();
    doubt_delay();
  }
  update.registration = std::move(made.registration);
  update.recovered = made.recovered;
  update.gyro_clipped = clipped;
  imu_.forget_before(stamp_ - kShakenFor);
  return std::move(made.points);
}

void ScanCorrector::doubt_delay() {
  constexpr double kSigmas = 4;
  if (delay_unknown_) return;
  const ImuNoiseConfig& imu = config_.imu;
  const double known = imu.delay_std_s * imu.delay_std_s + imu.delay_walk_density *
                                                               imu.delay_walk_density *
                                                               to_seconds(stamp_ - started_);
  // By so much scans move what was known with that variance, if it was.
  const double moved_variance =
      std::max(0.01 * known, known - filter_.covariance()(kTimeOffset, kTimeOffset));
  const double moved = filter_.state().t_d - imu.delay_s;
  if (moved * moved <= kSigmas * kSigmas * moved_variance) return;
  filter_.doubt_delay(imu.unknown_delay_std_s);
  delay_unknown_ = true;
}

void ScanCorrector::note_field() {
  constexpr Stamp kAround = kNanosecondsPerSecond / 100;
  constexpr double kShare = 0.5;
  const Stamp at = stamp_ + from_seconds(filter_.state().t_d);
  Vec3 sum = Vec3::Zero();
  double n = 0;
  for (const ImuSample& sample : imu_.between(at - kAround, at + kAround)) {
    sum += sample.field_gauss;
    ++n;
  }
  if (n == 0 || sum.isZero(0)) return;
  const Vec3 now = filter_.state().R_OB * (sum / n);
  gyro_.field_O = gyro_.by_field() ? Vec3(gyro_.field_O + kShare * (now - gyro_.field_O)) : now;
}

ClippedTime ScanCorrector::clipped_time(const LidarScan& scan) const {
  ClippedTime clipped;
  if (imu_.empty()) return clipped;
  GyroCompletion gyro = gyro_;
  for (ImuInterval& imu :
       imu_intervals(imu_.samples(), stamp_, scan.end, accel_scale_, filter_.state().t_d)) {
    gyro.complete(imu);
    clipped.add(imu, gyro_.full_scale_radps);
  }
  return clipped;
}

Vec3 ScanCorrector::likeliest_missing(const LidarScan& scan, const Vec3& clipped_s) const {
  // Drives change a rate by so much from scan to scan, and the search halves its steps so often.
  constexpr double kReach = 2.0, kFirstStep = 0.5;  // rad/s
  constexpr int kHalvings = 2;
  constexpr std::size_t kScored = 1200;  // points
  LidarScan thinned = scan;
  const std::size_t every = std::max<std::size_t>(1, scan.points.size() / kScored);
  thinned.points.clear();
  for (std::size_t i = 0; i < scan.points.size(); i += every) {
    thinned.points.push_back(scan.points[i]);
  }
  Eigen::Index axis = 0;
  clipped_s.maxCoeff(&axis);
  Vec3 best = gyro_.missing_radps;
  const double centre = std::max(0.0, best[axis]);
  double best_fit = -1;
  const auto consider = [&](double missing) {
    Vec3 guess = best;
    guess[axis] = missing;
    const double fit = missing < 0 ? -1 : fit_of(thinned, guess);
    if (fit > best_fit) {
      best_fit = fit;
      best = guess;
    }
  };
  for (double off = -kReach; off <= kReach; off += kFirstStep) consider(centre + off);
  double step = kFirstStep;
  for (int i = 0; i < kHalvings; ++i) {
    step /= 2;
    const double middle = best[axis];
    consider(middle - step);
    consider(middle + step);
  }
  return best;
}

double ScanCorrector::fit_of(const LidarScan& scan, const Vec3& missing_radps) const {
  constexpr double kScale = 0.1;  // m from a surface that halve what a point counts
  NavigationState x = filter_.state();
  GyroCompletion gyro = gyro_;
  gyro.missing_radps = missing_radps;
  std::vector<MotionSegment> segments = motion(stamp_, middle_of(scan), x, gyro);
  const Pose X_OB = x.X_OB();
  for (const MotionSegment& after : motion(middle_of(scan), scan.end, x, gyro)) {
    segments.push_back(after);
  }
  const Pose X_OL = X_OB * x.X_BL;
  std::vector<Vec3> points_O;
  for (const ScanPoint& point :
       undistort(scan, segments, X_OB, x.X_BL, config_.lidar, body_radius_m_)) {
    points_O.push_back(X_OL * point.p_L.cast<double>());
  }
  double fit = 0;
  map_.find_each(points_O, [&](std::size_t i, const std::optional<SurfelMatch>& match) {
    if (!match) return;
    const double off = match->normal.dot(points_O[i] - match->mean) / kScale;
    fit += 1 / (1 + off * off);
  });
  return fit;
}

ScanCorrector::Attempt ScanCorrector::attempt(const LidarScan& scan, const WhiteNoise& shaking) {
  const Stamp length = scan.end - scan.stamp, middle = middle_of(scan);
  Attempt made;
  ClippedTime clipped;
  std::vector<MotionSegment> segments = predict_to(middle, length, shaking, clipped);
  if (stood_at_) hold_standstill(scan.end);
  NavigationState x = filter_.state();
  GyroCompletion gyro = gyro_;
  for (const MotionSegment& after : motion(middle, scan.end, x, gyro)) segments.push_back(after);
  made.points = undistort(scan, segments, filter_.state().X_OB(), filter_.state().X_BL,
                          config_.lidar, body_radius_m_);
  const std::vector<ScanPoint> downsampled = voxel_downsample(
      made.points, config_.registration.scan_voxel_m, config_.registration.max_points);
  if (status_ == OdometryStatus::kLost) {
    made.recovered = recover(downsampled, made.registration);
  } else {
    const NavigationState predicted = filter_.state();
    const double shaken_rad = stood_at_ ? 0 : shaken_angle(shaking, to_seconds(length));
    made.registration = register_scan(downsampled, map_, config_, shaken_rad, filter_);
    made.missing_radps =
        missing_rates(clipped, local(predicted, filter_.state()).segment<3>(kRotation));
  }
  return made;
}

std::vector<MotionSegment> ScanCorrector::predict_to(Stamp stamp, Stamp scan_length,
                                                     const WhiteNoise& shaking,
                                                     ClippedTime& clipped) {
  std::vector<MotionSegment> segments;
  if (imu_.empty()) return segments;
  const double t_d = filter_.state().t_d;
  std::vector<ImuInterval> intervals =
      imu_intervals(imu_.samples(), stamp_, stamp, accel_scale_, t_d);
  add_slopes(intervals, imu_.samples(), accel_scale_, t_d, scan_length, shaking);
  for (ImuInterval& imu : intervals) {
    gyro_.complete(imu, filter_.state().R_OB);
    clipped.add(imu, gyro_.full_scale_radps);
    segments.push_back(motion_segment(filter_.state(), imu));
    filter_.predict(imu, stood_at_.has_value());
  }
  return segments;
}

std::vector<MotionSegment> ScanCorrector::motion(Stamp from, Stamp to, NavigationState& x,
                                                 GyroCompletion& gyro) const {
  std::vector<MotionSegment> segments;
  if (imu_.empty()) return segments;
  for (ImuInterval& imu : imu_intervals(imu_.samples(), from, to, accel_scale_, x.t_d)) {
    gyro.complete(imu, x.R_OB);
    segments.push_back(motion_segment(x, imu));
    x = propagate(x, imu);
  }
  return segments;
}

void ScanCorrector::hold_standstill(Stamp until) {
  const NavigationState& x = filter_.state();
  if (!stands_still(imu_.between(stamp_, until), x, accel_scale_, config_.initialiser,
                    white_noise_)) {
    stood_at_.reset();
    return;
  }
  // Held so tightly, a wrong mounting would be found far more slowly.
  if (config_.estimate_extrinsics) return;
  using Moved = Eigen::Matrix<double, 9, 1>;
  Moved moved;
  moved << so3::Log(x.R_OB.transpose() * stood_at_->R), stood_at_->p - x.p_OB, -x.v_OB;
  Eigen::Matrix<double, 9, kErrorDim> H = Eigen::Matrix<double, 9, kErrorDim>::Zero();
  H.leftCols<9>().setIdentity();
  const Moved variance = Moved::Constant(kDefinedStd * kDefinedStd);
  filter_.correct<9>(moved, H, variance.asDiagonal());
}

void ScanCorrector::update_status(const ScanUpdate& update) {
  const OdometryHealthConfig& hc = config_.health;
  const RegistrationReport& report = update.registration;
  if (report.accepted) {
    refused_in_a_row_ = 0;
    correction_stamp_ = stamp_;
    corrected_position_ = filter_.state().p_OB;
    if (confirmations_left_ > 0) --confirmations_left_;
  } else if (report.points >= hc.min_matches) {  // fewer are silence, which the IMU bridges
    ++refused_in_a_row_;
  }
  const bool doubtful = report.accepted && report.innovation > hc.doubtful_innovation;
  doubtful_in_a_row_ = doubtful ? doubtful_in_a_row_ + 1 : 0;
  const PoseInformation::Matrix P = filter_.pose_covariance();
  const double rotation_std = std::sqrt(P.diagonal().segment<3>(0).maxCoeff());
  const double position_std = std::sqrt(P.diagonal().segment<3>(3).maxCoeff());
  const bool weak = report.position_std_m[0] > hc.degenerate_position_std_m ||
                    report.rotation_std_rad[0] > hc.degenerate_rotation_std_rad;
  if (refused_in_a_row_ >= hc.lost_scans || doubtful_in_a_row_ >= hc.lost_scans ||
      position_std > hc.lost_position_std_m || rotation_std > hc.lost_rotation_std_rad) {
    status_ = OdometryStatus::kLost;
  } else if (!report.accepted || weak || report.innovation > hc.noticed_innovation ||
             update.gyro_clipped || confirmations_left_ > 0) {
    status_ = OdometryStatus::kDegenerate;
  } else {
    status_ = OdometryStatus::kOk;
  }
  need_ = status_ == OdometryStatus::kOk ? OdometryNeed::kNothing : OdometryNeed::kReference;
}

bool ScanCorrector::recover(const std::vector<ScanPoint>& points, RegistrationReport& report) {
  const auto found =
      relocalise(points, map_, config_, filter_.state(), corrected_position_, filter_.covariance());
  if (!found) {
    report.points = static_cast<int>(points.size());
    report.accepted = false;
    return false;
  }
  filter_ = found->filter;
  report = found->report;
  refused_in_a_row_ = doubtful_in_a_row_ = 0;
  confirmations_left_ = config_.health.recovery_confirmations;
  return true;
}

std::vector<Vec3f> ScanCorrector::to_O(const std::vector<ScanPoint>& points,
                                       const Pose& X_OB) const {
  const Pose X_OL = X_OB * filter_.state().X_BL;
  std::vector<Vec3f> points_O;
  points_O.reserve(points.size());
  for (const ScanPoint& point : points) {
    points_O.push_back((X_OL * point.p_L.cast<double>()).cast<float>());
  }
  return points_O;
}

void ScanCorrector::insert(const std::vector<ScanPoint>& points,
                           const std::vector<Vec3f>& points_O) {
  std::vector<float> variances;
  variances.reserve(points.size());
  for (const ScanPoint& point : points) {
    const double range = point.range_m;
    variances.push_back(static_cast<float>(config_.lidar.range_variance(range) +
                                           config_.lidar.lateral_variance(range)));
  }
  map_.insert(points_O, variances, drift_.next());
}

}  // namespace arex
