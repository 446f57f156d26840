#pragma once

#include <optional>
#include <vector>

#include "odometry/registration.h"

namespace arex {

struct Relocalisation {
  ErrorStateFilter filter;
  RegistrationReport report;
};

/// Looks for the pose of a scan on the map after a loss: at the prediction first, then by guesses
/// around the vertical and around the last position that keep the filter's roll and pitch, which
/// gravity holds; the best few are refined by the filter itself. The velocity is unknown
/// afterwards. Nothing when none fits, or when two fit almost alike.
std::optional<Relocalisation> relocalise(const std::vector<ScanPoint>& points, const SurfelMap& map,
                                         const LidarInertialConfig& config,
                                         const NavigationState& state, const Vec3& last_position_O,
                                         const ErrorMatrix& covariance);

}  // namespace arex
