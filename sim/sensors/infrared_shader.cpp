#include "sensors/infrared_shader.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>

namespace arex::sim {
namespace {

constexpr double kStripArea = 1.5 * 0.2;  // of a lamp, m^2
constexpr float kSeamWidth = 0.012F;      // m
constexpr float kSeamDark = 0.35F;        // share of the light lost in it
constexpr float kLeastSlant = 0.15F;      // cosine: surfaces seen more obliquely count as this

PinholeCamera finer(const PinholeCamera& camera, int samples) {
  // Pixel centres are at integers: sample k of a pixel lies (k + 0.5) / samples - 0.5 beside it.
  const double shift = 0.5 * (samples - 1);
  return {samples * camera.width, samples * camera.height,     samples * camera.fx,
          samples * camera.fy,    samples * camera.cx + shift, samples * camera.cy + shift};
}

/// Share of the sun that reaches a surface of unit normal n, on either side: asked for off the
/// surface, by more than its slope makes of a texel of the map.
float sun_on(const SunMap& sun, const Vec3f& p, const Vec3f& n) {
  constexpr double kTexels = 2;
  const auto off = static_cast<float>(kTexels * sun.texel_m());
  return sun.visible(p + (n.dot(sun.direction_W()) > 0 ? off : -off) * n);
}

Float8 root(const Float8& v) {
  Float8 out;
  for (int i = 0; i < 8; ++i) out[i] = std::sqrt(v[i]);
  return out;
}

/// How dark a joint between panels makes a pixel that covers `footprint` at a distance from it.
float seam(float at, float spacing, float footprint) {
  const float cells = at / spacing;
  const auto nearest = static_cast<float>(static_cast<int>(cells + (cells > 0 ? 0.5F : -0.5F)));
  const float distance = std::abs(at - nearest * spacing);
  const float width = std::max(kSeamWidth, footprint);
  return distance < 0.5F * width ? 1 - kSeamDark * kSeamWidth / width : 1;
}

std::vector<Lamp> lit(const InfraredLightConfig& light, const std::vector<Lamp>& lamps) {
  return light.lamps ? lamps : std::vector<Lamp>{};
}

}  // namespace

InfraredShader::InfraredShader(const InfraredLightConfig& light, const worlds::World& world,
                               const Scene& scene, const PinholeCamera& camera)
    : camera_(camera),
      fine_(finer(camera, kSamples)),
      lamps_(lit(light, find_lamps(world, scene))),
      sun_(light, world),
      grid_(light, world, scene, sun_, lamps_),
      sun_lx_(light.sun ? static_cast<float>(light.sun_lx) : 0),
      surfaces_(world, lamps_, grid_, sun_, sun_lx_),
      backdrop_(light, world),
      renderer_(world, fine_, {.far_m = light.draw_range_m}),
      lamp_lx_(static_cast<float>(light.lamp_flux_lm / kStripArea)),
      pixel_rad_(static_cast<float>(1 / camera.fx)),
      off_surface_m_(static_cast<float>(0.6 * grid_.spacing_m())) {
  for (int u = 0; u < camera.width; ++u) {
    column_x_.push_back(static_cast<float>((u - camera.cx) / camera.fx));
  }
}

float InfraredShader::textured(const SurfaceFacet& facet, const Material& material, const Vec3f& p,
                               const Vec3f& ray_W, float z, float towards) const {
  const float slant = std::max(std::abs(towards) / ray_W.norm(), kLeastSlant);
  const float footprint = z * pixel_rad_ / slant;
  const float a = p[facet.first_axis], b = p[facet.second_axis];
  float relative = texture_at(material, facet.key, a, b, footprint);
  if (material.seam_m > 0) {
    relative *= seam(a, material.seam_m, footprint) * seam(b, material.seam_m, footprint);
  }
  return relative;
}

float InfraredShader::surface(const View& view, std::uint32_t triangle, const Vec3f& ray_W,
                              float inverse_depth) const {
  const SurfaceFacet& facet = surfaces_.facet(triangle);
  if (facet.glows) return lamp_lx_;
  const Material& material = surfaces_.material(facet);
  const float z = 1 / inverse_depth;
  const float towards = facet.normal_W.dot(ray_W);
  const bool from_behind = towards > 0;
  if (facet.small) {
    const float light = from_behind ? facet.back : facet.front;
    if (!texture_shows(material, z * pixel_rad_)) return light;
    return light * textured(facet, material, view.eye_W + z * ray_W, ray_W, z, towards);
  }
  const Vec3f p = view.eye_W + z * ray_W;
  const Side side = side_of(facet, material, from_behind);
  float lux = indirect(side, material, p);
  if (side.sun_lx > 0) lux += side.sun_lx * sun_on(sun_, p, side.normal_W);
  return facet.albedo * lux * textured(facet, material, p, ray_W, z, towards);
}

InfraredShader::Side InfraredShader::side_of(const SurfaceFacet& facet, const Material& material,
                                             bool from_behind) const {
  const Float8 flipped = __builtin_shuffle(facet.weights, Int8{1, 0, 3, 2, 5, 4, 7, 6});
  Side side{from_behind ? Vec3f(-facet.normal_W) : facet.normal_W,
            from_behind ? flipped : facet.weights, from_behind ? facet.weights : flipped};
  const float facing = side.normal_W.dot(sun_.direction_W());
  side.sun_lx = sun_lx_ * (facing > 0 ? facing : -facing * material.translucency);
  return side;
}

float InfraredShader::indirect(const Side& side, const Material& material, const Vec3f& p) const {
  const Float8 faces = grid_.at(p + off_surface_m_ * side.normal_W);
  const float lux = LightGrid::sum(faces, side.near);
  if (material.translucency == 0) return lux;
  return lux + material.translucency * LightGrid::sum(faces, side.far);
}

bool InfraredShader::is_even(std::size_t first_sample) const {
  const std::uint32_t* above = &triangles_[first_sample];
  const std::uint32_t* below = above + fine_.width;
  std::uint32_t different = above[0] ^ below[0];
  for (std::size_t i = 1; i < 16; ++i) different |= (above[i] ^ above[0]) | (below[i] ^ above[0]);
  return different == 0 && above[0] != Renderer::kNoTriangle;
}

/// @param u the first of them
void InfraredShader::eight_pixels(const View& view, const Vec3f& row_W, int u,
                                  std::size_t first_sample, float* light,
                                  float* inverse_depth) const {
  const SurfaceFacet& facet = surfaces_.facet(triangles_[first_sample]);
  const Material& material = surfaces_.material(facet);
  Float8 x, q;
  const float* above = &fine_inverse_depth_[first_sample];
  const float* below = above + fine_.width;
  for (int i = 0; i < 8; ++i) {
    x[i] = column_x_[static_cast<std::size_t>(u + i)];
    q[i] = 0.25F * ((above[2 * i] + above[2 * i + 1]) + (below[2 * i] + below[2 * i + 1]));
  }
  std::memcpy(inverse_depth, &q, sizeof q);
  const Float8 z = 1 / q;
  std::array<Float8, 3> ray, p;
  Float8 towards{}, squared{};
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const auto k = static_cast<Eigen::Index>(axis);
    ray[axis] = row_W[k] + x * view.right_W[k];
    p[axis] = view.eye_W[k] + z * ray[axis];
    towards += facet.normal_W[k] * ray[axis];
    squared += ray[axis] * ray[axis];
  }
  Float8 lux;
  const bool from_behind = towards[0] > 0;
  if (facet.glows || facet.small) {
    lux = (facet.glows ? lamp_lx_ : from_behind ? facet.back : facet.front) - Float8{};
  } else {
    // The baked light is smooth: known at both ends, it is known between.
    const auto at = [&](int i) { return Vec3f(p[0][i], p[1][i], p[2][i]); };
    const Side side = side_of(facet, material, from_behind);
    const float begin = indirect(side, material, at(0)), end = indirect(side, material, at(7));
    lux = begin + (end - begin) * (1.0F / 7) * Float8{0, 1, 2, 3, 4, 5, 6, 7};
    for (int i = 0; i < 8 && side.sun_lx > 0; ++i) {
      lux[i] += side.sun_lx * sun_on(sun_, at(i), side.normal_W);
    }
    lux *= facet.albedo;
  }
  if (!facet.glows) {
    const Float8 cosine = (towards < 0 ? -towards : towards) / root(squared);
    const Float8 slant = cosine < kLeastSlant ? kLeastSlant - Float8{} : cosine;
    const Float8 footprint = z * pixel_rad_ / slant;
    const Float8 &a = p[facet.first_axis], &b = p[facet.second_axis];
    lux *= texture_at(material, facet.key, a, b, footprint);
    for (int i = 0; i < 8 && material.seam_m > 0; ++i) {
      lux[i] *=
          seam(a[i], material.seam_m, footprint[i]) * seam(b[i], material.seam_m, footprint[i]);
    }
  }
  std::memcpy(light, &lux, sizeof lux);
}

/// @param row_W the ray through the row's pixel of column cx
float InfraredShader::pixel(const View& view, const Vec3f& row_W, int u, int v,
                            float& inverse_depth) const {
  const auto row = static_cast<std::size_t>(fine_.width);
  const std::size_t first =
      static_cast<std::size_t>(kSamples * v) * row + static_cast<std::size_t>(kSamples * u);
  const std::array<std::size_t, 4> at{first, first + 1, first + row, first + row + 1};
  std::array<std::uint32_t, 4> seen{};
  std::array<float, 4> q{};
  for (std::size_t i = 0; i < 4; ++i) {
    seen[i] = triangles_[at[i]];
    q[i] = fine_inverse_depth_[at[i]];
  }
  inverse_depth = 0.25F * ((q[0] + q[1]) + (q[2] + q[3]));
  const Vec3f ray_W = row_W + column_x_[static_cast<std::size_t>(u)] * view.right_W;
  const auto light = [&](std::uint32_t triangle, const Vec3f& ray, float depth) {
    return triangle == Renderer::kNoTriangle ? backdrop_.at(view.eye_W, ray, pixel_rad_)
                                             : surface(view, triangle, ray, depth);
  };
  if (seen[0] == seen[1] && seen[0] == seen[2] && seen[0] == seen[3]) {
    return light(seen[0], ray_W, inverse_depth);
  }
  // Each of the triangles once, in the middle of its samples.
  constexpr std::array<float, 4> kBeside{-0.25F, 0.25F, -0.25F, 0.25F};
  constexpr std::array<float, 4> kBelow{-0.25F, -0.25F, 0.25F, 0.25F};
  float total = 0;
  std::array<bool, 4> done{};
  for (std::size_t i = 0; i < 4; ++i) {
    if (done[i]) continue;
    float count = 0, beside = 0, below = 0, depth = 0;
    for (std::size_t k = i; k < 4; ++k) {
      if (seen[k] != seen[i]) continue;
      done[k] = true;
      count += 1;
      beside += kBeside[k];
      below += kBelow[k];
      depth += q[k];
    }
    const float share = 1 / count, pixel = share * pixel_rad_;
    const Vec3f ray = ray_W + pixel * beside * view.right_W + pixel * below * view.down_W;
    total += count * light(seen[i], ray, share * depth);
  }
  return 0.25F * total;
}

void InfraredShader::draw(const Pose& X_WC, InfraredScene& out) {
  renderer_.render_triangles(X_WC, fine_inverse_depth_, triangles_);
  const Eigen::Matrix3f R = X_WC.R.cast<float>();
  const View view{X_WC.p.cast<float>(), R.col(0), R.col(1)};
  const std::size_t pixels =
      static_cast<std::size_t>(camera_.width) * static_cast<std::size_t>(camera_.height);
  out.light_lx.resize(pixels);
  out.inverse_depth.resize(pixels);
  for (int v = 0; v < camera_.height; ++v) {
    const auto y = static_cast<float>((v - camera_.cy) / camera_.fy);
    const Vec3f row_W = y * R.col(1) + R.col(2);
    const std::size_t row = static_cast<std::size_t>(v) * static_cast<std::size_t>(camera_.width);
    float* light = &out.light_lx[row];
    float* inverse_depth = &out.inverse_depth[row];
    for (int u = 0; u < camera_.width;) {
      const std::size_t first = kSamples * (kSamples * row + static_cast<std::size_t>(u));
      if (u + 8 <= camera_.width && is_even(first)) {
        eight_pixels(view, row_W, u, first, light + u, inverse_depth + u);
        u += 8;
        continue;
      }
      const int end = std::min(u + 8, camera_.width);
      for (; u < end; ++u) light[u] = pixel(view, row_W, u, v, inverse_depth[u]);
    }
  }
}

}  // namespace arex::sim
