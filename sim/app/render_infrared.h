#pragma once

#include <vector>

#include "app/commands.h"
#include "evaluation/timed_pose.h"
#include "run/scenario.h"
#include "worlds/world.h"

namespace arex::app {

/// `arex render RUN --what infrared`: the left infrared image at a moment of a recorded flight, as
/// the vehicle had it if it flew with `infrared.enabled`, else as auto exposure would have settled;
/// over it the features that a visual odometry followed, where the run has vio_features.csv.
/// @param truth poses of the flight, X_OB, at least two
/// @throws ConfigError for a moment outside of the flight.
void draw_infrared(const RenderArguments& arguments, const sim::Scenario& scenario,
                   const worlds::World& world, const std::vector<sim::TimedPose>& truth);

}  // namespace arex::app
