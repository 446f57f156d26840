#pragma once

#include "math/types.h"
#include "scoring/clearance.h"
#include "scoring/figures.h"

namespace arex::sim {

/// Where a vehicle came down, by the truth.
struct LandingScore {
  bool on_floor = false;   ///< it stands on ground, floor or ramp
  double clearance_m = 0;  ///< from the airframe to the nearest other surface, at most 5 m
};

/// @param X_WB the vehicle's pose at rest
LandingScore score_landing(const ClearanceMeter& meter, const Pose& X_WB);

/// Sets the figures `landing.*`.
void add_figures(const LandingScore& score, Figures& figures);

}  // namespace arex::sim
