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
/// inserted now has this and the scan's own. As many scans as the surfels seen are old have made
/// the piece of map that is seen together; their own errors are independent and average out in it.
/// New ground lets the map drift; where the vehicle returns, it sees old surfels again, and the
/// drift is gone. A piece that is turned shifts whatever lies away from where the vehicle was.
class MapDrift {
 public:
  void clear() { insertions_.clear(); }

  /// The map where a scan meets it.
  struct Met {
    PoseCovariance covariance = PoseCovariance::Zero();  ///< axes of O
    double age = 1;                                      ///< mean, in insertions, at least one
  };
  /// @param born for each matched point, the insertion that made its surfel
  /// @param p_OB where the vehicle is, m
  [[nodiscard]] Met met(std::span<const int> born, const Vec3& p_OB) const;

  /// Number of the next insertion.
  [[nodiscard]] int next() const { return static_cast<int>(insertions_.size()); }
  /// The map's first piece, which is where O is.
  void add_first() { insertions_.push_back({}); }
  /// @param registration of the scan that is inserted, axes of O
  void add(const Met& met, const PoseCovariance& registration, const Vec3& p_OB) {
    insertions_.push_back({met.covariance + registration / met.age, p_OB});
  }

 private:
  struct Insertion {
    PoseCovariance covariance = PoseCovariance::Zero();
    Vec3 p_OB = Vec3::Zero();  ///< of the vehicle
  };
  std::vector<Insertion> insertions_;
};

}  // namespace arex
