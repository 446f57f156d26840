#pragma once

#include "physics/physics.h"
#include "physics/truth.h"
#include "stack/flight_software.h"

/// A vehicle that is where the flight software means it to be: the oracle of control, for
/// ablations. It is as good as a tracker can be, not better: what counts is the setpoint against
/// the estimate, so that an odometry that is wrong leads it astray as it leads any tracker.
namespace arex::sim {

/// Whether the software means the vehicle to be anywhere: not before the odometry has begun, nor
/// after it was lost.
[[nodiscard]] bool has_setpoint(const FlightView& view);

/// The motion of the next tick: the setpoint's own, with what is missing to it made up for as by a
/// critically damped spring. The attitude is that of an undisturbed vehicle on the setpoint's path;
/// it follows from the path alone, so that a step of the estimate does not shake the sensors.
[[nodiscard]] CarriedMotion carried_along(const FlightView& view, const Truth& truth);

/// The same of the autopilot's own landing: straight down, level, at its speed.
[[nodiscard]] CarriedMotion carried_down(double descent_speed_mps, const Truth& truth);

}  // namespace arex::sim
