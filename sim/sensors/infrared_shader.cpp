#include "sensors/infrared_shader.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>

namespace arex::sim {
namespace {

constexpr double kStripArea = 1.5 * 0.2;  // of a lamp, m^2

PinholeCamera finer(const PinholeCamera& camera, int samples) {
  // Pixel centres are at integers: sample k of a pixel lies (k + 0.5) / samples - 0.5 beside it.
  const double shift = 0.5 * (samples - 1);
  return {samples * camera.width, samples * camera.height,     samples * camera.fx,
          samples * camera.fy,    samples * camera.cx + shift, samples * camera.cy + shift};
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
  mixtures_.resize(column_x_.size());
  scattered_lx_.resize(4 * column_x_.size());
}

InfraredShader::Side InfraredShader::side_of(const SurfaceFacet& facet, const Material& material,
                                             bool from_behind) const {
  const Float8 flipped = __builtin_shuffle(facet.weights, Int8{1, 0, 3, 2, 5, 4, 7, 6});
  const Vec3f normal = from_behind ? Vec3f(-facet.normal_W) : facet.normal_W;
  const float facing = normal.dot(sun_.direction_W());
  return {normal, from_behind ? flipped : facet.weights, from_behind ? facet.weights : flipped,
          sun_lx_ * (facing > 0 ? facing : -facing * material.translucency)};
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
    if (side.sun_lx > 0) {
      const Vec3f off = off_towards_sun(side.normal_W);
      lux += side.sun_lx * sun_.visible({p[0] + off.x(), p[1] + off.y(), p[2] + off.z()});
    }
    lux *= facet.albedo;
  }
  if (!facet.glows) {
    const Float8 footprint = footprint_of(z, towards, squared);
    const Float8 &a = p[facet.first_axis], &b = p[facet.second_axis];
    lux *= texture_at(material, facet.key, a, b, footprint);
    if (material.seam_m > 0) {
      const Float8 spacing = material.seam_m - Float8{};
      lux *= seam(a, spacing, footprint) * seam(b, spacing, footprint);
    }
  }
  std::memcpy(light, &lux, sizeof lux);
}

/// Notes what a pixel shows: each of its triangles once, in the middle of its samples.
/// @param row_W the ray through the row's pixel of column cx
void InfraredShader::split_pixel(const View& view, const Vec3f& row_W, int u, int v,
                                 float& inverse_depth) {
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
  Mixture& mixture = mixtures_[static_cast<std::size_t>(u)];
  mixture.surfaces = 0;
  const auto show = [&](std::uint32_t triangle, const Vec3f& ray, float depth, float count) {
    const auto slot = static_cast<std::uint32_t>(4 * u + mixture.surfaces);
    mixture.samples[static_cast<std::size_t>(mixture.surfaces++)] = count;
    if (triangle == Renderer::kNoTriangle) {
      backdrop_queue_.add(slot, triangle, ray, depth);
    } else {
      __builtin_prefetch(&surfaces_.facet(triangle));  // nobody can guess which comes next
      surface_queue_.add(slot, triangle, ray, depth);
    }
  };
  if (seen[0] == seen[1] && seen[0] == seen[2] && seen[0] == seen[3]) {
    show(seen[0], ray_W, inverse_depth, 4);
    return;
  }
  constexpr std::array<float, 4> kBeside{-0.25F, 0.25F, -0.25F, 0.25F};
  constexpr std::array<float, 4> kBelow{-0.25F, -0.25F, 0.25F, 0.25F};
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
    show(seen[i], ray, share * depth, count);
  }
}

float InfraredShader::mixed(int u) const {
  const Mixture& mixture = mixtures_[static_cast<std::size_t>(u)];
  const float* light = &scattered_lx_[4 * static_cast<std::size_t>(u)];
  if (mixture.surfaces == 1) return light[0];
  float total = 0;
  for (int i = 0; i < mixture.surfaces; ++i) {
    total += mixture.samples[static_cast<std::size_t>(i)] * light[i];
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
        for (int i = 0; i < 8; ++i) mixtures_[static_cast<std::size_t>(u++)].surfaces = 0;
        continue;
      }
      const int end = std::min(u + 8, camera_.width);
      for (; u < end; ++u) split_pixel(view, row_W, u, v, inverse_depth[u]);
    }
    shade_queues(view);
    for (int u = 0; u < camera_.width; ++u) {
      if (mixtures_[static_cast<std::size_t>(u)].surfaces > 0) light[u] = mixed(u);
    }
  }
}

}  // namespace arex::sim
