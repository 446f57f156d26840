#pragma once

#include <array>

#include "math/types.h"
#include "odometry/inertial/navigation_state.h"

/// A gyro that turns faster than its full scale reads the full scale. The odometry notices it by
/// the readings alone. What they lack the magnetometer says at once, where there is one, by how far
/// the earth's field has turned; where not, the next scan does, and until then the turn is taken to
/// go on as it came.
namespace arex {

/// What readings at full scale lack. Goes along with the intervals, one after the other.
struct GyroCompletion {
  static constexpr double kUntold = -1;

  double full_scale_radps = 0;
  /// Beyond the full scale, each axis, by the newest scan; kUntold where none has told.
  Vec3 missing_radps = Vec3::Constant(kUntold);
  /// The earth's field as the last scans leave it, with what a magnetometer adds of its own, gauss;
  /// zero where there is none.
  Vec3 field_O = Vec3::Zero();

  [[nodiscard]] bool by_field() const { return !field_O.isZero(0); }
  [[nodiscard]] bool clipped(double reading_radps) const;
  /// Marks the axes at full scale and adds what their readings lack.
  /// @param R_OB at the interval's begin
  void complete(ImuInterval& imu, const Mat3& R_OB = Mat3::Identity());

 private:
  [[nodiscard]] double missing(int axis, double side) const;
  /// Follows the field, and turns to where it is.
  /// @return what the readings lack over the interval, rad/s
  double follow_field(int axis, double side, const ImuInterval& imu, const Mat3& R_OB);

  Vec3 acceleration_radps2_ = Vec3::Zero();  ///< of the last sound readings
  Vec3 clipped_s_ = Vec3::Zero();            ///< since then
  Vec3 followed_radps_ = Vec3::Zero();       ///< beyond the full scale, by the field
};

/// Learns the full scale: a clipped axis repeats its reading, which noise keeps a sound one from.
class GyroFullScale {
 public:
  /// @param nominal_radps the largest it may be
  explicit GyroFullScale(double nominal_radps) : nominal_(nominal_radps), learned_(nominal_radps) {}

  void add(const Vec3& gyro_radps);
  [[nodiscard]] double radps() const { return learned_; }

 private:
  double nominal_, learned_;
  Vec3 last_ = Vec3::Zero();
  std::array<int, 3> repeats_{};
};

/// For how long each axis was clipped during a scan, and to which side.
struct ClippedTime {
  Vec3 seconds = Vec3::Zero();
  Vec3 side = Vec3::Zero();       ///< sign of the readings
  Vec3 added_rad = Vec3::Zero();  ///< what the completion added to the turn, to that side

  /// @param imu a completed interval
  void add(const ImuInterval& imu, double full_scale_radps);
  [[nodiscard]] bool any() const { return seconds.maxCoeff() > 0; }
};

/// What the registration's turn of the attitude says of the missing rates. A scan that is
/// undistorted to its middle with a rate that lacks d shows the turn that is missing there: what
/// the points before it lack those behind it have too much.
/// @param turn_rad correction of the attitude by the scan, in B
/// @return the missing rates, axis by axis; kUntold where nothing was clipped for long enough.
Vec3 missing_rates(const ClippedTime& clipped, const Vec3& turn_rad);

}  // namespace arex
