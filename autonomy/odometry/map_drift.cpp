#include "odometry/map_drift.h"

#include <algorithm>

#include "math/so3.h"

namespace arex {

MapDrift::Met MapDrift::met(std::span<const int> born, const Vec3& p_OB) const {
  std::vector<int> counts(insertions_.size(), 0);
  for (const int insertion : born) ++counts.at(static_cast<std::size_t>(insertion));
  Met met;
  double age = 0;
  for (std::size_t i = 0; i < counts.size(); ++i) {
    if (counts[i] == 0) continue;
    const double share = counts[i] / static_cast<double>(born.size());
    const Insertion& piece = insertions_[i];
    PoseCovariance shift = PoseCovariance::Identity();
    shift.bottomLeftCorner<3, 3>() = -so3::hat(p_OB - piece.p_OB);
    met.covariance += share * shift * piece.covariance * shift.transpose();
    age += share * static_cast<double>(counts.size() - i);
  }
  met.age = std::max(1.0, age);
  return met;
}

}  // namespace arex
