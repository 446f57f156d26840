#include "sensors/infrared_projector.h"

#include <cmath>
#include <cstdint>

#include "math/mix.h"

namespace arex::sim {
namespace {

// tan of half of 86 and of 57 deg.
constexpr float kHalfWidth = 0.9325F, kHalfHeight = 0.5430F;
constexpr float kDots = 5000;     // [E]
constexpr float kRadius = 0.26F;  // of a dot, in cells: 2.2 px [E]
// What 1 W/m^2 of its light is to the imager, as if it were daylight: as much of it is seen. [E]
constexpr float kLxPerWattPerM2 = 100;

constexpr float kArea = 4 * kHalfWidth * kHalfHeight;
// A dot falls off as (1 - r^2)^2, whose mean over its cell is a third of its disc.
constexpr float kPeak = 3 / (3.14159265F * kRadius * kRadius);

}  // namespace

DotProjector::DotProjector(const InfraredLightConfig& light)
    : cells_per_unit_(1 / std::sqrt(kArea / kDots)),
      mean_lx_(kLxPerWattPerM2 * static_cast<float>(light.projector_power_w) / kArea) {}

float DotProjector::at(float a, float b) const {
  if (!(std::abs(a) < kHalfWidth && std::abs(b) < kHalfHeight)) return 0;
  const float column = (a + kHalfWidth) * cells_per_unit_;
  const float row = (b + kHalfHeight) * cells_per_unit_;
  const auto i = static_cast<std::uint32_t>(column), j = static_cast<std::uint32_t>(row);
  const std::uint64_t bits = mix_bits(std::uint64_t{i} << 32U | j);
  // A dot lies somewhere in its cell, all of it.
  constexpr float kStep = (1 - 2 * kRadius) / 65535;
  const auto place = [](std::uint64_t sixteen) {
    return kRadius + kStep * static_cast<float>(sixteen & 0xFFFFU);
  };
  const float right = column - static_cast<float>(i) - place(bits);
  const float down = row - static_cast<float>(j) - place(bits >> 16U);
  const float left = 1 - (right * right + down * down) / (kRadius * kRadius);
  return left > 0 ? mean_lx_ * kPeak * left * left : 0;
}

}  // namespace arex::sim
