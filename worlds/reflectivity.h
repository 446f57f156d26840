#pragma once

#include "math/random.h"

namespace arex::worlds {

/// Diffuse reflectivity at 905 nm: the band that a natural surface's objects are drawn from.
/// Estimates, read off the near-infrared plateau of the vegetation, bark, litter and soil spectra
/// of the ECOSTRESS spectral library (Meerdink et al., Remote Sensing of Environment 230, 2019).
struct ReflectivityBand {
  double low, high;
  [[nodiscard]] double draw(RandomStream& random) const { return random.uniform(low, high); }
};

inline constexpr ReflectivityBand kBarkReflectivity{0.30, 0.50};
inline constexpr ReflectivityBand kLeafReflectivity{0.42, 0.56};
inline constexpr ReflectivityBand kShrubReflectivity{0.38, 0.54};
inline constexpr ReflectivityBand kDeadWoodReflectivity{0.25, 0.45};
inline constexpr ReflectivityBand kForestFloorReflectivity{0.26, 0.36};  ///< litter on soil
inline constexpr ReflectivityBand kConcreteReflectivity{0.30, 0.42};

/// Above 1 a surface is a retro-reflector: the light that it sends back to where it came from, over
/// what a perfect diffuse reflector would. That returns 1/pi cd/(lx m^2); the sheetings' least
/// coefficients of retro-reflection at 0.2 degrees, white, are 50 (number plates, ISO 7591), 70
/// (signs, ASTM D4956 type I) and 250 cd/(lx m^2) (warning strips, type III).
inline constexpr double kNumberPlateReflectivity = 157;
inline constexpr double kSignReflectivity = 220;
inline constexpr double kWarningStripReflectivity = 785;
inline constexpr double kGreatestReflectivity = 1000;

}  // namespace arex::worlds
