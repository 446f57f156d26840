#include "odometry/map_drift.h"

namespace arex {

PoseCovariance MapDrift::met(std::span<const int> born) const {
  std::vector<int> counts(insertions_.size(), 0);
  for (const int insertion : born) ++counts.at(static_cast<std::size_t>(insertion));
  PoseCovariance mean = PoseCovariance::Zero();
  for (std::size_t i = 0; i < counts.size(); ++i) {
    if (counts[i] > 0) mean += counts[i] / static_cast<double>(born.size()) * insertions_[i];
  }
  return mean;
}

}  // namespace arex
