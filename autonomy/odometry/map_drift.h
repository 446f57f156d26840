#pragma once

#include <Eigen/Core>
#include <span>
#include <vector>

#include "math/types.h"

namespace arex {

/// What is known of a pose: covariance of [rotation, position], rad and m.
using PoseCovariance = Eigen::Matrix<double, 6, 6>;

/// What the map's own error does to a pose that is registered on it.
///
/// A filter that takes its map as given believes that every scan tells the absolute pose. But each
/// piece of the map stands where the scan that made it was believed to be: it carries the error of
/// the pieces that this scan was registered on, and that of the registration. So the error of the
/// map seen now is that of the insertions which made the surfels seen now, in the mean, and what is
/// inserted now has this and the scan's own. New ground lets the map drift; where the vehicle
/// returns, it sees old surfels again, and the drift is gone.
class MapDrift {
 public:
  void clear() { insertions_.clear(); }

  /// The map's covariance where it is met, axes of O.
  /// @param born for each matched point, the insertion that made its surfel
  [[nodiscard]] PoseCovariance met(std::span<const int> born) const;

  /// Number of the next insertion.
  [[nodiscard]] int next() const { return static_cast<int>(insertions_.size()); }
  void add(const PoseCovariance& covariance) { insertions_.push_back(covariance); }

 private:
  std::vector<PoseCovariance> insertions_;
};

}  // namespace arex
