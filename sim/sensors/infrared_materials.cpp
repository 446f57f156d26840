#include "sensors/infrared_materials.h"

#include <cmath>
#include <limits>

#include "math/mix.h"

namespace arex::sim {
namespace {

using worlds::SurfaceClass;

struct Look {
  std::array<float, Material::kOctaves> wave_m;     // of the noise, coarse to fine
  std::array<float, Material::kOctaves> amplitude;  // relative
  float stretch = 1, seam_m = 0, spread = 0.1F, facet_spread = 0, translucency = 0;
};

// All estimates, by the look of near-infrared photographs: litter and bark are rough at every scale
// and their contrasts great; concrete has stains and the pattern of its formwork; paint and metal
// have little.
Look look_of(SurfaceClass surface_class) {
  switch (surface_class) {
    case SurfaceClass::kGround:
      return {{2.4F, 0.5F, 0.12F, 0.03F}, {0.25F, 0.25F, 0.32F, 0.35F}};
    case SurfaceClass::kTrunk:
    case SurfaceClass::kBranch:
    case SurfaceClass::kLog:
      return {{0.8F, 0.2F, 0.05F, 0.014F}, {0.2F, 0.25F, 0.35F, 0.3F}, 0.3F, 0, 0.2F};
    case SurfaceClass::kLeaf:
    case SurfaceClass::kShrub:
      return {
          {0.05F, 0.025F, 0.012F, 0.006F}, {0.12F, 0.12F, 0.1F, 0.08F}, 1, 0, 0.1F, 0.25F, 0.7F};
    case SurfaceClass::kFloor:
    case SurfaceClass::kRamp:
      return {{5.0F, 0.9F, 0.16F, 0.03F}, {0.22F, 0.2F, 0.2F, 0.2F}, 1, 6, 0.05F};
    case SurfaceClass::kWall:
      return {{3.0F, 0.7F, 0.14F, 0.025F}, {0.18F, 0.16F, 0.14F, 0.14F}, 1, 2.5F, 0.1F};
    case SurfaceClass::kCeiling:
    case SurfaceClass::kBeam:
      return {{3.0F, 0.6F, 0.12F, 0.025F}, {0.12F, 0.12F, 0.10F, 0.10F}, 1, 1.25F, 0.1F};
    case SurfaceClass::kPillar:
    case SurfaceClass::kKerb:
      return {{1.5F, 0.4F, 0.1F, 0.02F}, {0.12F, 0.15F, 0.14F, 0.12F}, 1, 0, 0.15F};
    case SurfaceClass::kDoor:
      return {{1.5F, 0.3F, 0.06F, 0.015F}, {0.05F, 0.05F, 0.06F, 0.04F}, 1, 0, 0.15F};
    case SurfaceClass::kCar:
    case SurfaceClass::kPipe:
      break;
  }
  return {{1.2F, 0.3F, 0.07F, 0.02F}, {0.08F, 0.06F, 0.06F, 0.05F}, 1, 0, 0.1F};
}

Material material_of(const Look& look) {
  Material material = noise_material(look.wave_m, look.amplitude, look.stretch);
  material.seam_m = look.seam_m;
  material.spread = look.spread;
  material.facet_spread = look.facet_spread;
  material.translucency = look.translucency;
  return material;
}

/// -1 to 1, of a number.
float signed_unit(std::uint64_t n) {
  return static_cast<float>(mix_bits(n) >> 40) * 0x1p-23F - 1.0F;
}

// What is smaller is lit alike all over, m: leaves and twigs.
constexpr float kSmall = 0.25F;

/// Light that a small facet sends on from the side of unit normal n.
float light_sent(const SurfaceFacet& facet, const Material& material, const Vec3f& n,
                 const std::array<Vec3f, 3>& corners, const LightGrid& grid, const SunMap& sun,
                 float sun_lx) {
  const Vec3f middle = (corners[0] + corners[1] + corners[2]) / 3.0F;
  const auto off = static_cast<float>(0.5 * grid.spacing_m());
  const Float8 faces = grid.at(middle + off * n);
  float lux = LightGrid::sum(faces, LightGrid::weights(n)) +
              material.translucency * LightGrid::sum(faces, LightGrid::weights(-n));
  const float facing = n.dot(sun.direction_W());
  const float share = facing > 0 ? facing : -facing * material.translucency;
  float visible = 0;
  for (const Vec3f& corner : corners) visible += sun.visible(0.5F * (corner + middle));
  lux += sun_lx * share * visible / 3.0F;
  return facet.albedo * lux;
}

// Retro-reflectors are bright only to who shines on them.
constexpr float kMostAlbedo = 0.8F;

SurfaceFacet facet_of(const worlds::World& world, std::size_t i, const Material& material) {
  const auto& [a, b, c] = world.mesh.triangles[i];
  const std::vector<Vec3f>& vertices = world.mesh.vertices;
  const Vec3 p = vertices[a].cast<double>();
  const Vec3 cross = (vertices[b].cast<double>() - p).cross(vertices[c].cast<double>() - p);
  const std::uint32_t object = world.mesh.object_of_triangle[i];
  SurfaceFacet facet;
  const Vec3 normal = cross.norm() > 0 ? Vec3(cross.normalized()) : Vec3::UnitZ();
  facet.normal_W = normal.cast<float>();
  facet.key = static_cast<std::uint32_t>(mix_bits(object + 1));
  // Quads are drawn as two triangles, one behind the other.
  const float piece = 1 + material.spread * signed_unit(object + 0x1000000000ULL) +
                      material.facet_spread * signed_unit(i / 2 + 0x2000000000ULL);
  facet.albedo = std::min(world.objects[object].reflectivity, kMostAlbedo) * piece;
  const Vec3 n = normal.cwiseAbs();
  const bool level = n.z() >= n.x() && n.z() >= n.y();
  facet.traits =
      static_cast<std::uint32_t>(world.objects[object].surface_class) << SurfaceFacet::kMaterial |
      (level || n.y() >= n.x() ? 0 : SurfaceFacet::kAlongY) | (level ? 0 : SurfaceFacet::kUpright);
  return facet;
}

}  // namespace

Material noise_material(const std::array<float, Material::kOctaves>& wave_m,
                        const std::array<float, Material::kOctaves>& amplitude, float stretch) {
  Material material;
  for (std::size_t k = 0; k < Material::kOctaves; ++k) {
    material.cell_m[k] = 0.5F * wave_m[k];
    const int lane = static_cast<int>(k);
    material.cells_per_m[lane] = material.cells_per_m[lane + 4] = 1 / material.cell_m[k];
  }
  material.amplitude = amplitude;
  material.stretch = stretch;
  return material;
}

InfraredSurfaces::InfraredSurfaces(const worlds::World& world, const std::vector<Lamp>& lamps,
                                   const LightGrid& grid, const SunMap& sun, float sun_lx) {
  for (std::size_t i = 0; i < worlds::kSurfaceClassNames.size(); ++i) {
    materials_.push_back(material_of(look_of(static_cast<SurfaceClass>(i))));
  }
  std::vector<float> glows_below(world.objects.size(), -std::numeric_limits<float>::infinity());
  for (const Lamp& lamp : lamps) {
    if (lamp.object != Hit::kNone) glows_below[lamp.object] = lamp.glow_below_m;
  }
  facets_.reserve(world.mesh.triangles.size());
  kinds_.reserve(world.mesh.triangles.size());
  for (std::size_t i = 0; i < world.mesh.triangles.size(); ++i) {
    const std::uint32_t object = world.mesh.object_of_triangle[i];
    const auto surface_class = static_cast<std::size_t>(world.objects[object].surface_class);
    facets_.push_back(facet_of(world, i, materials_[surface_class]));
    SurfaceFacet& facet = facets_.back();
    const auto& [a, b, c] = world.mesh.triangles[i];
    const std::array<Vec3f, 3> corners{world.mesh.vertices[a], world.mesh.vertices[b],
                                       world.mesh.vertices[c]};
    const bool glows =
        std::max({corners[0].z(), corners[1].z(), corners[2].z()}) <= glows_below[object];
    const bool small = (corners[1] - corners[0]).norm() < kSmall &&
                       (corners[2] - corners[1]).norm() < kSmall &&
                       (corners[0] - corners[2]).norm() < kSmall;
    facet.traits |= (glows ? SurfaceFacet::kGlows : 0) | (small ? SurfaceFacet::kSmall : 0);
    kinds_.push_back(static_cast<std::uint8_t>(2 * surface_class + (glows || small ? 1 : 0)));
    if (!small) continue;
    const Material& material = materials_[surface_class];
    facet.front = light_sent(facet, material, facet.normal_W, corners, grid, sun, sun_lx);
    facet.back = light_sent(facet, material, -facet.normal_W, corners, grid, sun, sun_lx);
  }
}

}  // namespace arex::sim
