#pragma once

#include <vector>

#include "physics/airframe.h"
#include "physics/truth.h"
#include "sensors/scene.h"

namespace arex::sim {

/// Distance between the airframe and the nearest surface of the world, leaves left out (the vehicle
/// can't hit them). The airframe is represented by points on the hulls of its solids, a few
/// centimetres apart.
class ClearanceMeter {
 public:
  ClearanceMeter(const Scene& scene, const Airframe& airframe);

  /// Clearance at one pose, m, at most `max_m`; remembered for the statistics.
  double measure(const Truth& truth, double max_m = 5.0);

  struct Statistics {
    double min_m = 0;
    double p05_m = 0;
    std::size_t samples = 0;
  };
  [[nodiscard]] Statistics statistics() const;

  [[nodiscard]] const std::vector<Vec3>& points_B() const { return points_B_; }

 private:
  const Scene& scene_;
  std::vector<Vec3> points_B_;
  std::vector<double> samples_;
  Pose X_WB_;  ///< of the newest sample
};

}  // namespace arex::sim
