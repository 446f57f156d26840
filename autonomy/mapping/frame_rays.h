#pragma once

#include "mapping/mapping_config.h"
#include "mapping/ray_caster.h"
#include "messages/registered_scan.h"
#include "messages/vehicle.h"

namespace arex {

/// Casts a LiDAR frame, every ray from where the LiDAR was when the point was fired. Points beyond
/// `range_m` only say what is free on the way; returns nearer to B than `own_returns_m()` are the
/// vehicle's own body and say nothing. Nor does a return nearer than `lone_range_m` that has no
/// other one of the frame beside it: what is that near, were it a twig of 1 cm, returns several.
void cast_frame(const RegisteredScan& scan, double range_m, const VehicleConfig& vehicle,
                const CellBox& clip, RayCaster& rays, double lone_range_m = 0);

/// Casts a depth frame, downsampled and cut as the config says; the vehicle's own body is left out.
void cast_frame(const RegisteredDepth& depth, const LocalGridConfig& config,
                const VehicleConfig& vehicle, const CellBox& clip, RayCaster& rays);

}  // namespace arex
