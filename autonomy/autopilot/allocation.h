#pragma once

#include "messages/vehicle.h"

namespace arex {

/// Collective thrust (N) and torque (N m, in B).
struct Wrench {
  double thrust_n = 0;
  Vec3 torque_nm = Vec3::Zero();
};

/// Rotor thrusts that make a wrench. Rotor order and turning sense as in MotorCommand.
///
/// When a rotor would leave its range, the demand gives way in this order: yaw torque, then
/// collective thrust (up or down), and only if the roll and pitch torque alone need more than the
/// range holds, these two by one common factor. So the thrust's direction is kept to the last.
class Allocation {
 public:
  explicit Allocation(const VehicleConfig& vehicle);

  struct Result {
    Vec4 rotor_thrust_n = Vec4::Zero();
    Wrench achieved;
  };
  /// @pre low_n < high_n, the range of every rotor's thrust.
  [[nodiscard]] Result allocate(const Wrench& demand, double low_n, double high_n) const;

  /// Rows: thrust and torque per rotor thrust; columns: rotors.
  [[nodiscard]] const Eigen::Matrix4d& effectiveness() const { return effectiveness_; }
  /// The pseudo-inverse; for four rotors in general position, the inverse.
  [[nodiscard]] const Eigen::Matrix4d& mix() const { return mix_; }

 private:
  Eigen::Matrix4d effectiveness_;
  Eigen::Matrix4d mix_;
};

}  // namespace arex
