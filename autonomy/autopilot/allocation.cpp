#include "autopilot/allocation.h"

#include <Eigen/QR>
#include <algorithm>

namespace arex {
namespace {

/// Largest factor in [0, 1] for which base + factor * direction stays in [low, high]; 0 if none
/// does.
double largest_factor(const Vec4& base, const Vec4& direction, double low, double high) {
  double least = 0;
  double most = 1;
  for (int i = 0; i < 4; ++i) {
    if (direction[i] == 0) {
      if (base[i] < low || base[i] > high) return 0;
      continue;
    }
    const double a = (low - base[i]) / direction[i];
    const double b = (high - base[i]) / direction[i];
    least = std::max(least, std::min(a, b));
    most = std::min(most, std::max(a, b));
  }
  return least <= most ? most : 0;
}

}  // namespace

Allocation::Allocation(const VehicleConfig& vehicle) {
  const Vec3& offset = vehicle.rotor_offset_m;
  const Vec4 x = Vec4(1, -1, 1, -1) * offset.x();
  const Vec4 y = Vec4(-1, 1, 1, -1) * offset.y();
  // Air drags on a rotor against its turning: counter-clockwise rotors turn the body clockwise.
  const Vec4 yaw = Vec4(-1, -1, 1, 1) * vehicle.torque_ratio_m;
  effectiveness_.row(0).setOnes();
  effectiveness_.row(1) = y;
  effectiveness_.row(2) = -x;
  effectiveness_.row(3) = yaw;
  mix_ = effectiveness_.completeOrthogonalDecomposition().pseudoInverse();
}

Allocation::Result Allocation::allocate(const Wrench& demand, double low_n, double high_n) const {
  Vec4 tilt = mix_.col(1) * demand.torque_nm.x() + mix_.col(2) * demand.torque_nm.y();
  const Vec4 yaw = mix_.col(3) * demand.torque_nm.z();

  const double span = tilt.maxCoeff() - tilt.minCoeff();
  if (span > high_n - low_n) tilt *= (high_n - low_n) / span;

  // All rotors share the collective thrust equally: mix_.col(0) is constant.
  const double collective =
      std::clamp(demand.thrust_n * mix_(0, 0), low_n - tilt.minCoeff(), high_n - tilt.maxCoeff());
  const Vec4 base = tilt + Vec4::Constant(collective);

  Result result;
  // Rounding may leave the clamp a last bit outside.
  result.rotor_thrust_n =
      (base + largest_factor(base, yaw, low_n, high_n) * yaw).cwiseMax(low_n).cwiseMin(high_n);
  const Vec4 wrench = effectiveness_ * result.rotor_thrust_n;
  result.achieved = {wrench[0], wrench.tail<3>()};
  return result;
}

}  // namespace arex
