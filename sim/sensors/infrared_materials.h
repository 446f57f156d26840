#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <vector>

#include "math/types.h"
#include "sensors/eight.h"
#include "sensors/infrared_lamps.h"
#include "sensors/infrared_light.h"
#include "worlds/world.h"

namespace arex::sim {

/// How surfaces of one class look: a texture of four octaves of noise, coarse to fine.
struct Material {
  static constexpr std::size_t kOctaves = 4;

  // Twice, so that both rows of a lattice are computed at once.
  Float8 cells_per_m{};                     ///< of each octave's lattice; half a wave is a cell
  std::array<float, kOctaves> cell_m{};     ///< the same as a length
  std::array<float, kOctaves> amplitude{};  ///< of the albedo, relative
  float stretch = 1;       ///< along the second axis of the texture (bark: up the stem)
  float seam_m = 0;        ///< spacing of joints between panels, both ways; 0: none
  float spread = 0;        ///< of the albedo between objects, relative, +-
  float facet_spread = 0;  ///< and between faces of one object
  float translucency = 0;  ///< light of the far side that comes through, of that of the near side
};

/// A texture of four octaves of noise.
/// @param wave_m of each, coarse to fine
/// @param amplitude of the albedo, relative
Material noise_material(const std::array<float, Material::kOctaves>& wave_m,
                        const std::array<float, Material::kOctaves>& amplitude, float stretch = 1);

/// What is known of a triangle before anybody looks at it; half a cache line, eight numbers wide.
struct alignas(32) SurfaceFacet {
  // Traits; what stands above them is the number of the material.
  static constexpr std::uint32_t kAlongY = 1;   ///< the texture's first axis is W's y, not x
  static constexpr std::uint32_t kUpright = 2;  ///< and its second one z, not y
  static constexpr std::uint32_t kGlows = 4;    ///< a lamp
  static constexpr std::uint32_t kSmall = 8;    ///< all of it is lit as `front` and `back` say
  static constexpr unsigned kMaterial = 8;

  Vec3f normal_W;  ///< unit
  float albedo = 0;
  std::uint32_t key = 0;  ///< of its object's texture
  // Light that it sends on, without its texture, on the side of its normal and on the other, lx.
  float front = 0, back = 0;
  std::uint32_t traits = 0;

  [[nodiscard]] bool glows() const { return (traits & kGlows) != 0; }
  [[nodiscard]] bool small() const { return (traits & kSmall) != 0; }
  [[nodiscard]] std::size_t material() const { return traits >> kMaterial; }
  [[nodiscard]] std::size_t first_axis() const { return (traits & kAlongY) != 0 ? 1 : 0; }
  [[nodiscard]] std::size_t second_axis() const { return (traits & kUpright) != 0 ? 2 : 1; }
};
static_assert(sizeof(SurfaceFacet) == sizeof(Float8));

/// A world's surfaces as an infrared camera sees them. The light of what is small is computed once:
/// leaves and twigs are most of what is drawn.
class InfraredSurfaces {
 public:
  /// @param sun_lx on a surface square to the sun
  InfraredSurfaces(const worlds::World& world, const std::vector<Lamp>& lamps,
                   const LightGrid& grid, const SunMap& sun, float sun_lx);

  [[nodiscard]] const SurfaceFacet& facet(std::uint32_t triangle) const {
    return facets_[triangle];
  }
  [[nodiscard]] const Material& material(const SurfaceFacet& facet) const {
    return materials_[facet.material()];
  }
  /// Of what is shaded alike: material by material, first those that light falls on from place to
  /// place, then those that are lit alike all over.
  [[nodiscard]] std::size_t kinds() const { return 2 * materials_.size(); }
  [[nodiscard]] std::uint8_t kind(std::uint32_t triangle) const { return kinds_[triangle]; }
  static bool is_lit_alike(std::size_t kind) { return kind % 2 != 0; }
  [[nodiscard]] const Material& material_of_kind(std::size_t kind) const {
    return materials_[kind / 2];
  }

 private:
  std::vector<SurfaceFacet> facets_;
  std::vector<std::uint8_t> kinds_;
  std::vector<Material> materials_;  ///< by class
};

/// Uniform bits from the corners of a lattice. Source: the finaliser of MurmurHash3, two of its
/// three rounds.
inline Uint8 lattice_hash(Uint8 h) {
  h ^= h >> 16;
  h *= 0x85EBCA6BU;
  h ^= h >> 13;
  return h;
}

/// Whether a texture shows where a pixel covers `footprint_m`.
template <class Number>
auto texture_shows(const Material& material, const Number& footprint_m) {
  constexpr float kNone = 1.5;
  return 2 * material.cell_m[0] >= kNone * footprint_m;
}

/// The relative albedo of a material at texture coordinates a, b (m): 1 on average. What is finer
/// than the image resolves is left out: octaves fade between waves of 3 and 1.5 footprints.
/// @param footprint_m what a pixel covers there
inline float texture_at(const Material& material, std::uint32_t key, float a, float b,
                        float footprint_m) {
  constexpr float kFull = 3, kNone = 1.5;
  if (!texture_shows(material, footprint_m)) return 1;
  // Lanes 0-3: the four octaves on the lattice's row below, 4-7: on the row above.
  const Float8 x = (a - Float8{}) * material.cells_per_m;
  const Float8 y = (b * material.stretch - Float8{}) * material.cells_per_m;
  const auto floor = [](const Float8& v) {
    const Int8 i = __builtin_convertvector(v, Int8);
    return i + (__builtin_convertvector(i, Float8) > v);  // a comparison that holds is -1
  };
  const Int8 i = floor(x), j = floor(y);
  const Float8 u = x - __builtin_convertvector(i, Float8);
  const Float8 v = y - __builtin_convertvector(j, Float8);
  constexpr Uint8 kRow{0, 0, 0, 0, 1, 1, 1, 1};
  constexpr Uint8 kOctave{0x9E3779B9U, 0x3C6EF372U, 0xDAA66D2BU, 0x78DDE6E4U,
                          0x9E3779B9U, 0x3C6EF372U, 0xDAA66D2BU, 0x78DDE6E4U};
  const Uint8 row = ((Uint8)j + kRow) * 0xC2B2AE35U + kOctave * (key | 1U);
  const Uint8 column = (Uint8)i * 0x27D4EB2FU;
  const auto grey = [](const Uint8& h) {
    return __builtin_convertvector((Int8)(h >> 8), Float8) * 0x1p-23F - 1.0F;  // -1 to 1
  };
  const Float8 left = grey(lattice_hash(column + row));
  const Float8 right = grey(lattice_hash(column + 0x27D4EB2FU + row));
  const Float8 along = left + u * u * (3.0F - 2.0F * u) * (right - left);
  float relative = 1;
  for (std::size_t k = 0; k < Material::kOctaves; ++k) {
    const float fade = (2 * material.cell_m[k] / footprint_m - kNone) * (1 / (kFull - kNone));
    const int lane = static_cast<int>(k);
    const float s = v[lane] * v[lane] * (3 - 2 * v[lane]);
    const float value = along[lane] + s * (along[lane + 4] - along[lane]);
    relative += material.amplitude[k] * std::clamp(fade, 0.0F, 1.0F) * value;
  }
  return std::max(relative, 0.05F);
}

/// The same at eight places at once. @param key one, or one each
template <class Key>
Float8 texture_at(const Material& material, const Key& key, const Float8& a, const Float8& b,
                  const Float8& footprint_m) {
  constexpr float kFull = 3, kNone = 1.5;
  constexpr std::array<std::uint32_t, Material::kOctaves> kOctave{0x9E3779B9U, 0x3C6EF372U,
                                                                  0xDAA66D2BU, 0x78DDE6E4U};
  const auto floor = [](const Float8& v) {
    const Int8 i = __builtin_convertvector(v, Int8);
    return i + (__builtin_convertvector(i, Float8) > v);
  };
  const auto grey = [](const Uint8& h) {
    return __builtin_convertvector((Int8)(h >> 8), Float8) * 0x1p-23F - 1.0F;
  };
  const auto smooth = [](const Float8& t) { return t * t * (3.0F - 2.0F * t); };
  const Float8 zero{}, one = zero + 1.0F;
  Float8 relative = one;
  for (std::size_t k = 0; k < Material::kOctaves; ++k) {
    const float cell = material.cell_m[k];
    if (!any(2 * cell >= kNone * footprint_m)) break;  // the finer ones do not show, either
    Float8 fade = (2 * cell / footprint_m - kNone) * (1 / (kFull - kNone));
    fade = fade < zero ? zero : fade > one ? one : fade;
    const float per_m = material.cells_per_m[static_cast<int>(k)];
    const Float8 x = a * per_m, y = b * material.stretch * per_m;
    const Int8 i = floor(x), j = floor(y);
    const Float8 s = smooth(x - __builtin_convertvector(i, Float8));
    const Float8 t = smooth(y - __builtin_convertvector(j, Float8));
    const Uint8 column = (Uint8)i * 0x27D4EB2FU;
    const Uint8 row = (Uint8)j * 0xC2B2AE35U + kOctave[k] * (key | 1U);
    const Uint8 above = row + 0xC2B2AE35U;
    const auto along = [&](const Uint8& line) {
      const Float8 left = grey(lattice_hash(column + line));
      return left + s * (grey(lattice_hash(column + 0x27D4EB2FU + line)) - left);
    };
    const Float8 low = along(row);
    relative += material.amplitude[k] * fade * (low + t * (along(above) - low));
  }
  const Float8 floor_of_it = zero + 0.05F;
  return relative < floor_of_it ? floor_of_it : relative;
}

}  // namespace arex::sim
