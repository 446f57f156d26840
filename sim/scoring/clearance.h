#pragma once

#include <limits>
#include <vector>

#include "physics/airframe.h"
#include "physics/truth.h"
#include "scoring/figures.h"
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

  /// Not a number: it was never measured.
  struct Statistics {
    double min_m = std::numeric_limits<double>::quiet_NaN();
    double p05_m = std::numeric_limits<double>::quiet_NaN();
    std::size_t samples = 0;
  };
  [[nodiscard]] Statistics statistics() const;

  /// Distance from the airframe to the nearest surface of these classes, m, at most `max_m`.
  [[nodiscard]] double distance(const Pose& X_WB, worlds::ClassSet classes, double max_m) const;

  [[nodiscard]] const std::vector<Vec3>& points_B() const { return points_B_; }

 private:
  const Scene& scene_;
  std::vector<Vec3> points_B_;
  std::vector<double> samples_;
  Pose X_WB_;  ///< of the newest sample
};

/// Sets the figures `clearance.*`.
void add_figures(const ClearanceMeter::Statistics& clearance, Figures& figures);

}  // namespace arex::sim
