#include <array>
#include <cstring>

#include "sensors/infrared_shader.h"

// Pixels at the edges of things, each of other surfaces than its neighbours: what they show is
// collected along a row and shaded eight at a time.
namespace arex::sim {
namespace {

constexpr float kSeamWidth = 0.012F;  // m
constexpr float kSeamDark = 0.35F;    // share of the light lost in it
constexpr float kLeastSlant = 0.15F;  // cosine: surfaces seen more obliquely count as this

Float8 load(const float* from) {
  Float8 v;
  std::memcpy(&v, from, sizeof v);
  return v;
}

}  // namespace

void InfraredShader::Queue::add(std::uint32_t to, std::uint32_t of, const Vec3f& ray, float depth) {
  slot.push_back(to);
  triangle.push_back(of);
  for (std::size_t k = 0; k < 3; ++k) ray_W[k].push_back(ray[static_cast<Eigen::Index>(k)]);
  inverse_depth.push_back(depth);
}

void InfraredShader::Queue::fill_up() {
  while (slot.size() % 8 != 0) {
    const std::size_t last = slot.size() - 1;
    add(slot[last], triangle[last], Vec3f(ray_W[0][last], ray_W[1][last], ray_W[2][last]),
        inverse_depth[last]);
  }
}

void InfraredShader::Queue::clear() {
  slot.clear();
  triangle.clear();
  for (std::vector<float>& axis : ray_W) axis.clear();
  inverse_depth.clear();
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

Vec3f InfraredShader::off_towards_sun(const Vec3f& n) const {
  constexpr double kTexels = 2;
  const auto off = static_cast<float>(kTexels * sun_.texel_m());
  return (n.dot(sun_.direction_W()) > 0 ? off : -off) * n;
}

/// Light of eight surfaces, from number `first` of the queue on, as white ones', lx.
Float8 InfraredShader::eight_surfaces(const View& view, std::size_t first) const {
  const Queue& queue = surface_queue_;
  const Float8 z = 1 / load(&queue.inverse_depth[first]);
  std::array<Float8, 3> ray, p, normal;
  std::array<const SurfaceFacet*, 8> facets{};
  std::array<const Material*, 8> materials{};
  for (std::size_t i = 0; i < 8; ++i) {
    facets[i] = &surfaces_.facet(queue.triangle[first + i]);
    materials[i] = &surfaces_.material(*facets[i]);
    for (std::size_t k = 0; k < 3; ++k) {
      normal[k][static_cast<int>(i)] = facets[i]->normal_W[static_cast<Eigen::Index>(k)];
    }
  }
  for (std::size_t k = 0; k < 3; ++k) {
    ray[k] = load(&queue.ray_W[k][first]);
    p[k] = view.eye_W[static_cast<Eigen::Index>(k)] + z * ray[k];
  }
  const Float8 towards = normal[0] * ray[0] + (normal[1] * ray[1] + normal[2] * ray[2]);
  const Float8 squared = ray[0] * ray[0] + (ray[1] * ray[1] + ray[2] * ray[2]);
  const Float8 footprint = footprint_of(z, towards, squared);
  const Float8 zero{}, one = zero + 1.0F;
  Float8 lux, albedo = one, sun_lx{}, a{}, b{}, seam_m{};
  std::array<Float8, 3> lit = p;
  Int8 plain{};  // -1: without texture
  Uint8 keys;
  for (int i = 0; i < 8; ++i) {
    const auto lane = static_cast<std::size_t>(i);
    const SurfaceFacet& facet = *facets[lane];
    const Material& material = *materials[lane];
    const bool from_behind = towards[i] > 0;
    keys[i] = facet.key;
    a[i] = p[facet.first_axis][i];
    b[i] = p[facet.second_axis][i];
    if (facet.glows) {
      lux[i] = lamp_lx_;
      plain[i] = -1;
    } else if (facet.small) {
      lux[i] = from_behind ? facet.back : facet.front;
      plain[i] = texture_shows(material, z[i] * pixel_rad_) ? 0 : -1;
      seam_m[i] = material.seam_m;
    } else {
      const Side side = side_of(facet, material, from_behind);
      lux[i] = indirect(side, material, Vec3f(p[0][i], p[1][i], p[2][i]));
      albedo[i] = facet.albedo;
      seam_m[i] = material.seam_m;
      if (!(side.sun_lx > 0)) continue;
      sun_lx[i] = side.sun_lx;
      const Vec3f off = off_towards_sun(side.normal_W);
      for (std::size_t k = 0; k < 3; ++k) lit[k][i] += off[static_cast<Eigen::Index>(k)];
    }
  }
  if (any(sun_lx > 0)) lux = sun_lx > 0 ? lux + sun_lx * sun_.visible(lit) : lux;
  lux *= albedo;
  if (!any(plain == 0)) return lux;
  Float8 relative = texture_at(materials, keys, a, b, footprint);
  if (any(seam_m > 0)) {
    const Float8 spacing = seam_m > 0 ? seam_m : one;
    const Float8 dark = seam(a, spacing, footprint) * seam(b, spacing, footprint);
    relative = seam_m > 0 ? relative * dark : relative;
  }
  return plain == 0 ? lux * relative : lux;
}

void InfraredShader::shade_queues(const View& view) {
  surface_queue_.fill_up();
  for (std::size_t first = 0; first < surface_queue_.slot.size(); first += 8) {
    const Float8 light = eight_surfaces(view, first);
    for (int i = 0; i < 8; ++i) {
      scattered_lx_[surface_queue_.slot[first + static_cast<std::size_t>(i)]] = light[i];
    }
  }
  surface_queue_.clear();
  backdrop_queue_.fill_up();
  for (std::size_t first = 0; first < backdrop_queue_.slot.size(); first += 8) {
    const Float8 light = backdrop_.at(
        view.eye_W,
        {load(&backdrop_queue_.ray_W[0][first]), load(&backdrop_queue_.ray_W[1][first]),
         load(&backdrop_queue_.ray_W[2][first])},
        pixel_rad_);
    for (int i = 0; i < 8; ++i) {
      scattered_lx_[backdrop_queue_.slot[first + static_cast<std::size_t>(i)]] = light[i];
    }
  }
  backdrop_queue_.clear();
}

}  // namespace arex::sim
