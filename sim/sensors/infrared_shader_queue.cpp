#include <array>
#include <cstring>

#include "sensors/infrared_shader.h"

// Pixels at the edges of things, each of other surfaces than its neighbours: what they show is
// collected by kind and shaded eight at a time.
namespace arex::sim {
namespace {

constexpr float kSeamWidth = 0.012F;  // m
constexpr float kSeamDark = 0.35F;    // share of the light lost in it
constexpr float kLeastSlant = 0.15F;  // cosine: surfaces seen more obliquely count as this

}  // namespace

/// SurfaceFacet's members, each of eight.
struct InfraredShader::EightFacets {
  std::array<Float8, 3> normal_W;
  Float8 albedo, front, back;
  Uint8 key, traits;

  EightFacets(const InfraredSurfaces& surfaces, const std::uint32_t* triangles) {
    std::array<Float8, 8> rows;
    for (std::size_t i = 0; i < 8; ++i) {
      std::memcpy(&rows[i], &surfaces.facet(triangles[i]), sizeof rows[i]);
    }
    const std::array<Float8, 8> columns = transposed(rows);
    normal_W = {columns[0], columns[1], columns[2]};
    albedo = columns[3];
    key = (Uint8)columns[4];
    front = columns[5];
    back = columns[6];
    traits = (Uint8)columns[7];
  }
  /// -1 where it has one.
  [[nodiscard]] Int8 has(std::uint32_t trait) const { return (Int8)((traits & trait) != 0); }
};

void InfraredShader::Queue::fill_up() {
  for (; count % 8 != 0; ++count) {
    to[count] = to[count - 1];
    triangle[count] = triangle[count - 1];
    for (std::array<float, kCapacity>& axis : ray_W) axis[count] = axis[count - 1];
    inverse_depth[count] = inverse_depth[count - 1];
  }
}

Float8 InfraredShader::footprint_of(const Float8& z, const Float8& towards,
                                    const Float8& squared) const {
  const Float8 cosine = (towards < 0 ? -towards : towards) / root(squared);
  const Float8 slant = cosine < kLeastSlant ? kLeastSlant - Float8{} : cosine;
  return z * pixel_rad_ / slant;
}

/// How dark a joint between panels makes pixels that cover `footprint` at a distance from it.
Float8 InfraredShader::seam(const Float8& at, const Float8& spacing, const Float8& footprint) {
  const Float8 cells = at / spacing, zero{}, one = zero + 1.0F;
  const Float8 nearest = __builtin_convertvector(
      __builtin_convertvector(cells + (cells > 0 ? zero + 0.5F : zero - 0.5F), Int8), Float8);
  const Float8 off = at - nearest * spacing;
  const Float8 width = footprint > kSeamWidth ? footprint : zero + kSeamWidth;
  return (off < 0 ? -off : off) < 0.5F * width ? one - kSeamDark * kSeamWidth / width : one;
}

Float8 InfraredShader::lit_alike(const EightFacets& facets, const Int8& from_behind) const {
  const Float8 lux = from_behind ? facets.back : facets.front;
  return facets.has(SurfaceFacet::kGlows) ? lamp_lx_ - Float8{} : lux;
}

/// @param p their places in W
Float8 InfraredShader::lit_from_place_to_place(const Material& material, const EightFacets& facets,
                                               const Int8& from_behind,
                                               const std::array<Float8, 3>& p) const {
  std::array<Float8, 3> normal, off;
  for (std::size_t k = 0; k < 3; ++k) {
    normal[k] = from_behind ? -facets.normal_W[k] : facets.normal_W[k];
    off[k] = p[k] + off_surface_m_ * normal[k];
  }
  const bool translucent = material.translucency != 0;
  const auto sides = grid_.sides(off, normal, translucent);
  Float8 lux = sides.near;
  if (translucent) lux += material.translucency * sides.far;
  const Vec3f& sun = sun_.direction_W();
  const Float8 zero{};
  const Float8 facing = normal[0] * sun.x() + (normal[1] * sun.y() + normal[2] * sun.z());
  const Float8 sun_lx = sun_lx_ * (facing > 0 ? facing : -facing * material.translucency);
  if (any(sun_lx > 0)) {
    const Float8 off_m = facing > 0 ? zero + off_towards_sun() : zero - off_towards_sun();
    for (std::size_t k = 0; k < 3; ++k) off[k] = p[k] + off_m * normal[k];
    lux = sun_lx > 0 ? lux + sun_lx * sun_.visible(off) : lux;
  }
  return lux * facets.albedo;
}

Float8 InfraredShader::eight_surfaces(const View& view, const Queue& queue, std::size_t kind,
                                      std::size_t first) const {
  const Material& material = surfaces_.material_of_kind(kind);
  const EightFacets facets(surfaces_, &queue.triangle[first]);
  const Float8 z = 1 / load_eight(&queue.inverse_depth[first]);
  const std::array<Float8, 3> ray = queue.rays(first);
  std::array<Float8, 3> p;
  for (std::size_t k = 0; k < 3; ++k) {
    p[k] = view.eye_W[static_cast<Eigen::Index>(k)] + z * ray[k];
  }
  const std::array<Float8, 3>& normal = facets.normal_W;
  const Float8 towards = normal[0] * ray[0] + (normal[1] * ray[1] + normal[2] * ray[2]);
  const Int8 from_behind = towards > 0;
  const bool alike = InfraredSurfaces::is_lit_alike(kind);
  const Float8 lux = alike ? lit_alike(facets, from_behind)
                           : lit_from_place_to_place(material, facets, from_behind, p);
  Int8 plain{};  // -1: without texture
  if (alike) {
    plain = facets.has(SurfaceFacet::kGlows) | ~texture_shows(material, z * pixel_rad_);
    if (!any(~plain)) return lux;
  }
  const Float8 squared = ray[0] * ray[0] + (ray[1] * ray[1] + ray[2] * ray[2]);
  const Float8 footprint = footprint_of(z, towards, squared);
  const Float8 a = facets.has(SurfaceFacet::kAlongY) ? p[1] : p[0];
  const Float8 b = facets.has(SurfaceFacet::kUpright) ? p[2] : p[1];
  Float8 relative = texture_at(material, facets.key, a, b, footprint);
  if (material.seam_m > 0) {
    const Float8 spacing = material.seam_m - Float8{};
    relative *= seam(a, spacing, footprint) * seam(b, spacing, footprint);
  }
  return plain ? lux : lux * relative;
}

/// Finds the light of what is collected of a kind.
void InfraredShader::shade(const View& view, std::vector<Queue>& queues, std::size_t kind) const {
  Queue& queue = queues[kind];
  queue.fill_up();
  for (std::size_t first = 0; first < queue.count; first += 8) {
    const Float8 light = kind == backdrop_kind()
                             ? backdrop_.at(view.eye_W, queue.rays(first), pixel_rad_)
                             : eight_surfaces(view, queue, kind, first);
    for (int i = 0; i < 8; ++i) *queue.to[first + static_cast<std::size_t>(i)] = light[i];
  }
  queue.count = 0;
}

}  // namespace arex::sim
