#pragma once

#include <array>
#include <cstdint>

#include "worlds/mesh_builder.h"
#include "worlds/reflectivity.h"

/// Parked cars: a body lofted through cross-sections, windows, wheels. Frame C: on the ground under
/// the car's middle, x forward, z up.
namespace arex::worlds {

enum class CarKind : std::uint8_t { kSedan, kHatchback, kSuv, kVan, kPickup };
inline constexpr int kCarKinds = 5;

struct CarMaterials {
  double paint = 0.4;  ///< reflectivities at 905 nm
  double glass = 0.06;
  double rubber = 0.04;
  double plate = kNumberPlateReflectivity;
};

/// Length, width (without mirrors) and height of a kind, m.
[[nodiscard]] Vec3 car_size(CarKind kind);

/// Adds a car as four objects of class car, since each reflects differently: body, windows,
/// tyres and number plates. It is felt as four boxes, all of the body.
void add_car(MeshBuilder& mesh, CarKind kind, const Pose& X_WC, const CarMaterials& materials);

}  // namespace arex::worlds
