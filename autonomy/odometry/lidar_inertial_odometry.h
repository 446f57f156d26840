#pragma once

#include <vector>

#include "messages/estimates.h"
#include "messages/vehicle.h"
#include "odometry/inertial/imu_predictor.h"
#include "odometry/inertial/silence.h"
#include "odometry/scan_corrector.h"

namespace arex {

/// Tightly coupled LiDAR-inertial odometry: an iterated error-state Kalman filter, corrected by
/// scans at 10 Hz, propagated by every IMU sample at 200 Hz.
///
/// Frames: O gravity-aligned, origin at start-up; B body = IMU; L LiDAR.
/// Source: Xu and Zhang, FAST-LIO, RA-L 2021; AREX paper, eqs. (2)-(9).
///
/// A scan is handled in three steps, so that the heavy one may run elsewhere and its result be
/// applied when the modelled latency is over:
///
///     ScanJob job = odometry.prepare(scan);         // at the scan's end; cheap
///     ScanUpdate update = odometry.correct(job);    // heavy, any thread; beside add_imu()
///     odometry.apply(update);                       // later; cheap
///
/// prepare() and apply() belong to the thread of add_imu(); every job prepared is corrected, in
/// order.
class LidarInertialOdometry {
 public:
  LidarInertialOdometry(const LidarInertialConfig& config, const VehicleConfig& vehicle);
  LidarInertialOdometry(const LidarInertialConfig& config, const Pose& X_BL, double body_radius_m);

  /// Propagates by one sample and returns the estimate at its stamp. The readings are those of
  /// `imu.delay_s` before; the newest one is held for that long.
  /// @pre imu.stamp is later than every stamp seen so far.
  Odometry add_imu(const ImuSample& imu);

  /// Hands the scan and the IMU samples since the last call to a job.
  [[nodiscard]] ScanJob prepare(const LidarScanPtr& scan);
  [[nodiscard]] ScanUpdate correct(const ScanJob& job) { return corrector_.correct(job); }
  /// Anchors the output at the update and integrates the later samples again.
  void apply(const ScanUpdate& update);

  /// Where another has the vehicle, in O: the next scan is looked for there, if this one is lost.
  void suggest(const Odometry& odometry) { suggested_ = odometry; }

  /// The three steps at once.
  ScanUpdate add_scan(const LidarScanPtr& scan);

  /// The newest estimate; kInitialising before the first scan update, and again when a start is
  /// taken back: that may happen until the vehicle moves for the first time.
  [[nodiscard]] const Odometry& odometry() const { return odometry_; }
  /// What keeps it from being ok; no scan has come yet, as long as nothing else is known.
  [[nodiscard]] OdometryNeed need() const;
  [[nodiscard]] const SurfelMap& map() const { return corrector_.map(); }

 private:
  void publish();
  /// The covariance at the newest update, and what the IMU's noise has added since.
  [[nodiscard]] PoseCovariance covariance_at(Stamp stamp) const;

  OdometryHealthConfig health_;
  Silence silence_{health_.degenerate_silence_s};
  ScanCorrector corrector_;
  ImuPredictor predictor_;
  double imu_delay_s_;
  GyroFullScale full_scale_;
  std::vector<ImuSample> unhanded_;  ///< samples that no job has got yet, at their true times
  ImuSample newest_;
  std::optional<Odometry> suggested_;
  PoseCovariance corrected_ = PoseCovariance::Zero();  ///< at the newest update
  Mat3 corrected_velocity_ = Mat3::Zero();             ///< covariance likewise
  WhiteNoise imu_noise_;
  Stamp corrected_at_ = 0;
  OdometryStatus scan_status_ = OdometryStatus::kInitialising;
  OdometryNeed scan_need_ = OdometryNeed::kScan;
  Odometry odometry_;
};

}  // namespace arex
