#pragma once

#include <memory>
#include <optional>
#include <vector>

#include "messages/estimates.h"
#include "messages/sensors.h"
#include "odometry/inertial/gyro_clipping.h"
#include "odometry/registration.h"
#include "odometry/static_initialiser.h"

namespace arex {

/// What a scan's correction reads of the rest: the scan and the IMU samples that came since the
/// last job was made.
struct ScanJob {
  LidarScanPtr scan;
  std::vector<ImuSample> imu;
  double gyro_full_scale_radps = 0;   ///< as far as it is known
  std::optional<Odometry> suggested;  ///< of a lost odometry: where it may be, in O
};

using PointsPtr = std::shared_ptr<const std::vector<Vec3f>>;
using FractionsPtr = std::shared_ptr<const std::vector<float>>;

/// What came of one scan. Its state holds at `stamp`, the scan's middle: that is when the pose was
/// which the scan's points see in the mean, whatever the motion between them is taken for.
struct ScanUpdate {
  Stamp begin = 0, end = 0;  ///< of the scan
  Stamp stamp = 0;
  Stamp correction_stamp = 0;  ///< of the newest scan that corrected the state
  OdometryStatus status = OdometryStatus::kInitialising;
  OdometryNeed need = OdometryNeed::kImu;  ///< what keeps the status from being ok
  NavigationState state;
  ErrorMatrix covariance = ErrorMatrix::Zero();  ///< the filter's, on the map as it is
  PoseCovariance pose_covariance =
      PoseCovariance::Zero();  ///< in B and O, the map's error included
  WhiteNoise imu_noise;        ///< densities that the filter now believes
  double accel_scale = 1;
  GyroCompletion gyro;        ///< of the axes that are clipped
  bool gyro_clipped = false;  ///< during this scan
  RegistrationReport registration;
  bool recovered = false;  ///< the pose was found again on the map: it may have jumped
  PointsPtr points_O;      ///< undistorted, in O, m; empty when the state is not to be trusted
  FractionsPtr fractions;  ///< when each of points_O was fired: 0 the scan's begin, 1 its end
};

/// The heavy half of the odometry: filter and map. Touches nothing but itself and its job, so that
/// a job may run on any thread; jobs run one at a time, in the order of their scans.
class ScanCorrector {
 public:
  ScanCorrector(const LidarInertialConfig& config, const Pose& X_BL, double body_radius_m);

  [[nodiscard]] ScanUpdate correct(const ScanJob& job);

  [[nodiscard]] const SurfelMap& map() const { return map_; }

 private:
  void try_start(const LidarScanPtr& scan);
  /// Is lost at another's place: what the IMU says since the last correction is forgotten.
  void move_to(const Odometry& suggested, Stamp scan_begin);
  /// Places O and makes the first map of the standing scans. @return whether the newest of them can
  /// be registered against it; otherwise the map is empty again.
  bool start(const StaticStart& standing, Stamp stamp);
  /// Forgets the map: whatever it came from, the vehicle has not left the ground yet.
  void start_again();
  void forget_map();
  std::vector<ScanPoint> register_with_motion(const LidarScan& scan, ScanUpdate& update);
  /// A scan undistorted and registered with what is taken to be missing of clipped readings.
  struct Attempt {
    std::vector<ScanPoint> points;
    RegistrationReport registration;
    bool recovered = false;
    Vec3 missing_radps = Vec3::Constant(GyroCompletion::kUntold);  ///< by what it found
  };
  Attempt attempt(const LidarScan& scan, const WhiteNoise& shaking);
  /// Where the earth's field lies in O, by the scan that has just been registered.
  void note_field();
  [[nodiscard]] ClippedTime clipped_time(const LidarScan& scan) const;
  /// A clipped gyro turns a scan and bends it, so far perhaps that a registration does not find
  /// where it belongs. Both hang on one figure, the rate that is missing: looks for the one with
  /// which the points fit the map best.
  [[nodiscard]] Vec3 likeliest_missing(const LidarScan& scan, const Vec3& clipped_s) const;
  /// How well the points lie on the map's surfaces: each counts up to 1.
  [[nodiscard]] double fit_of(const LidarScan& scan, const Vec3& missing_radps) const;
  /// Before take-off the vehicle is where it started: holds the filter there, by a
  /// pseudo-measurement, while it stands.
  void hold_standstill(Stamp until);
  /// @param scan_length of the scan that is predicted to
  std::vector<MotionSegment> predict_to(Stamp stamp, Stamp scan_length, const WhiteNoise& shaking,
                                        ClippedTime& clipped);
  /// The motion that follows from `x`, the state at `from`; becomes that at `to`.
  [[nodiscard]] std::vector<MotionSegment> motion(Stamp from, Stamp to, NavigationState& x,
                                                  GyroCompletion& gyro) const;
  /// Takes the IMU's delay for unknown once scans have drawn it further than it was known to.
  void doubt_delay();
  void update_status(const ScanUpdate& update);
  bool recover(const std::vector<ScanPoint>& points, RegistrationReport& report);
  void insert(const std::vector<ScanPoint>& points, const std::vector<Vec3f>& points_O);
  [[nodiscard]] std::vector<Vec3f> to_O(const std::vector<ScanPoint>& points,
                                        const Pose& X_OB) const;

  LidarInertialConfig config_;
  ImuNoiseConfig configured_imu_;  ///< before it is graded by what the start measures
  Pose X_BL_;
  double body_radius_m_;
  ErrorStateFilter filter_;
  SurfelMap map_;
  MapDrift drift_;
  MapDrift::Met map_met_;  ///< as of the last scan
  double accel_scale_ = 1;
  double shaken_rad_ = 0;  ///< 1 sigma of the IMU against the vehicle, now
  GyroCompletion gyro_;
  ImuBuffer imu_;
  std::vector<LidarScanPtr> standing_scans_;  ///< taken at standstill before the start
  WhiteNoise white_noise_;                    ///< of the IMU, measured at the start
  std::optional<Pose> stood_at_;              ///< X_OB, until it moves for the first time
  OdometryNeed need_ = OdometryNeed::kImu;
  Stamp stamp_ = 0;  ///< of the filter's state
  Stamp correction_stamp_ = 0;
  Stamp started_ = 0;
  bool delay_unknown_ = false;
  Vec3 corrected_position_ = Vec3::Zero();
  OdometryStatus status_ = OdometryStatus::kInitialising;
  int refused_in_a_row_ = 0;
  int doubtful_in_a_row_ = 0;
  int confirmations_left_ = 0;
};

}  // namespace arex
