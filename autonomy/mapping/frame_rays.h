#pragma once

#include "mapping/mapping_config.h"
#include "mapping/ray_caster.h"
#include "messages/registered_scan.h"
#include "messages/vehicle.h"

namespace arex {

/// Casts a LiDAR frame, every ray from where the LiDAR was when the point was fired. Points beyond
/// `range_m` only say what is free on the way; returns nearer to B than the vehicle's radius are
/// its own body and say nothing.
void cast_frame(const RegisteredScan& scan, double range_m, const VehicleConfig& vehicle,
                const CellBox& clip, RayCaster& rays);

/// Casts a depth frame, thinned and cut as the config says; the vehicle's own body is left out.
void cast_frame(const RegisteredDepth& depth, const LocalGridConfig& config,
                const VehicleConfig& vehicle, const CellBox& clip, RayCaster& rays);

}  // namespace arex
