#include "scoring/landing.h"

#include <algorithm>

namespace arex::sim {

LandingScore score_landing(const ClearanceMeter& meter, const Pose& X_WB) {
  using worlds::SurfaceClass;
  constexpr double kStands_m = 0.03;  // the feet are points of the airframe
  constexpr double kFar_m = 5.0;
  constexpr worlds::ClassSet kThings = Scene::kWithoutLeaves.without(SurfaceClass::kGround)
                                           .without(SurfaceClass::kFloor)
                                           .without(SurfaceClass::kRamp);
  const double clearance = meter.distance(X_WB, kThings, kFar_m);
  const double lowest = meter.distance(X_WB, Scene::kWithoutLeaves, kFar_m);
  return {lowest < std::min(kStands_m, clearance), clearance};
}

void add_figures(const LandingScore& score, Figures& figures) {
  figures.set("landing.on_floor", score.on_floor);
  figures.set("landing.clearance_m", score.clearance_m);
}

}  // namespace arex::sim
