#include "sensors/infrared_shader.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <type_traits>

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
                               const Scene& scene, const PinholeCamera& camera, int strips)
    : camera_(camera),
      fine_(finer(camera, kSamples)),
      lamps_(lit(light, find_lamps(world, scene))),
      sun_(light, world),
      grid_(light, world, scene, sun_, lamps_),
      sun_lx_(light.sun ? static_cast<float>(light.sun_lx) : 0),
      surfaces_(world, lamps_, grid_, sun_, sun_lx_),
      backdrop_(light, world),
      renderer_(world, fine_, renderer_options(light, strips)),
      lamp_lx_(static_cast<float>(light.lamp_flux_lm / kStripArea)),
      pixel_rad_(static_cast<float>(1 / camera.fx)),
      off_surface_m_(static_cast<float>(0.6 * grid_.spacing_m())) {
  if (light.projector) projector_.emplace(light);
  for (std::size_t i = 0; i < renderer_.strips(); ++i) strips_.push_back(make_strip(i));
}

InfraredShader::Strip InfraredShader::make_strip(std::size_t index) const {
  const Renderer::Columns samples = renderer_.columns(index);
  Strip strip;
  strip.index = index;
  strip.first = static_cast<std::size_t>(samples.first / kSamples);
  const auto width = static_cast<std::size_t>(samples.count / kSamples);
  for (std::size_t u = strip.first; u < strip.first + width; ++u) {
    strip.column_x.push_back(
        static_cast<float>((static_cast<double>(u) - camera_.cx) / camera_.fx));
  }
  for (std::vector<float>& axis : strip.row_rays_W) axis.resize(width);
  strip.band_inverse_depth.resize(kSamples * kSamples * kBand * width);
  strip.band_triangles.resize(strip.band_inverse_depth.size());
  strip.queues.resize(surfaces_.kinds() + 1);
  strip.mixtures.resize(kBand * width);
  return strip;
}

/// @param u the first of them, @param q their inverse depths
void InfraredShader::eight_pixels(const View& view, const Strip& strip, std::size_t u,
                                  std::uint32_t triangle, const Float8& q, float* light) const {
  const SurfaceFacet& facet = surfaces_.facet(triangle);
  const Material& material = surfaces_.material(facet);
  const Float8 z = 1 / q;
  std::array<Float8, 3> ray, p;
  Float8 towards{}, squared{};
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const auto k = static_cast<Eigen::Index>(axis);
    ray[axis] = load_eight(&strip.row_rays_W[axis][u]);
    p[axis] = view.eye_W[k] + z * ray[axis];
    towards += facet.normal_W[k] * ray[axis];
    squared += ray[axis] * ray[axis];
  }
  Float8 lux;
  const bool from_behind = towards[0] > 0;
  if (facet.glows() || facet.small()) {
    lux = (facet.glows() ? lamp_lx_ : from_behind ? facet.back : facet.front) - Float8{};
  } else {
    const Vec3f normal = from_behind ? Vec3f(-facet.normal_W) : facet.normal_W;
    // The baked light is smooth: known at both ends, it is known between.
    const auto indirect = [&](int i) {
      const auto sides =
          grid_.sides(Vec3f(p[0][i], p[1][i], p[2][i]) + off_surface_m_ * normal, normal);
      return material.translucency == 0 ? sides.near
                                        : sides.near + material.translucency * sides.far;
    };
    const float begin = indirect(0), end = indirect(7);
    lux = begin + (end - begin) * (1.0F / 7) * Float8{0, 1, 2, 3, 4, 5, 6, 7};
    const float facing = normal.dot(sun_.direction_W());
    const float sun_lx = sun_lx_ * (facing > 0 ? facing : -facing * material.translucency);
    if (sun_lx > 0) {
      const Vec3f off = (facing > 0 ? off_towards_sun() : -off_towards_sun()) * normal;
      lux += sun_lx * sun_.visible({p[0] + off.x(), p[1] + off.y(), p[2] + off.z()});
    }
    lux *= facet.albedo;
  }
  if (!facet.glows()) {
    const Float8 footprint = footprint_of(z, towards, squared);
    const Float8 &a = p[facet.first_axis()], &b = p[facet.second_axis()];
    lux *= texture_at(material, facet.key, a, b, footprint);
    if (material.seam_m > 0) {
      const Float8 spacing = material.seam_m - Float8{};
      lux *= seam(a, spacing, footprint) * seam(b, spacing, footprint);
    }
  }
  std::memcpy(light, &lux, sizeof lux);
}

/// Notes what a pixel of several surfaces shows: each of its triangles once, in the middle of its
/// samples. @param ray_W the pixel's
void InfraredShader::split_pixel(const View& view, Strip& strip, const Vec3f& ray_W,
                                 const std::array<std::uint32_t, 4>& seen,
                                 const std::array<float, 4>& q, float* light) const {
  constexpr std::array<float, 4> kBeside{-0.25F, 0.25F, -0.25F, 0.25F};
  constexpr std::array<float, 4> kBelow{-0.25F, -0.25F, 0.25F, 0.25F};
  Mixture& mixture = strip.mixtures[strip.mixed++];
  mixture.pixel = light;
  mixture.surfaces = 0;
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
    mixture.samples[mixture.surfaces] = count;
    show(view, strip.queues, seen[i], ray, share * depth, &mixture.light_lx[mixture.surfaces++]);
  }
}

/// @param depths of the row's samples, first its upper ones, @param triangles theirs
void InfraredShader::draw_row(const View& view, Strip& strip, int v, const float* depths,
                              const std::uint32_t* triangles, InfraredScene& out) const {
  const std::size_t width = strip.column_x.size();
  std::array<std::vector<float>, 3>& rays_W = strip.row_rays_W;
  const Vec3f row_W =
      static_cast<float>((v - camera_.cy) / camera_.fy) * view.down_W + view.ahead_W;
  for (std::size_t k = 0; k < 3; ++k) {
    const auto axis = static_cast<Eigen::Index>(k);
    for (std::size_t u = 0; u < width; ++u) {
      rays_W[k][u] = row_W[axis] + strip.column_x[u] * view.right_W[axis];
    }
  }
  const auto ray = [&](std::size_t u) { return Vec3f(rays_W[0][u], rays_W[1][u], rays_W[2][u]); };
  const float* below = depths + kSamples * width;
  const std::uint32_t* triangles_below = triangles + kSamples * width;
  const std::size_t row =
      static_cast<std::size_t>(v) * static_cast<std::size_t>(camera_.width) + strip.first;
  float* light = &out.light_lx[row];
  float* inverse_depth = &out.inverse_depth[row];
  const auto one_pixel = [&](std::size_t u) {
    const std::size_t i = kSamples * u;
    const std::array<std::uint32_t, 4> seen{triangles[i], triangles[i + 1], triangles_below[i],
                                            triangles_below[i + 1]};
    const std::array<float, 4> q{depths[i], depths[i + 1], below[i], below[i + 1]};
    inverse_depth[u] = 0.25F * ((q[0] + q[1]) + (q[2] + q[3]));
    if (seen[0] == seen[1] && seen[0] == seen[2] && seen[0] == seen[3]) {
      show(view, strip.queues, seen[0], ray(u), inverse_depth[u], light + u);
    } else {
      split_pixel(view, strip, ray(u), seen, q, light + u);
    }
  };
  std::size_t u = 0;
  for (; u + 8 <= width; u += 8) {
    const auto sum = [&](const float* samples) {
      const Float8 low = load_eight(samples + kSamples * u);
      const Float8 high = load_eight(samples + kSamples * u + 8);
      return every_other<false>(low, high) + every_other<true>(low, high);
    };
    const auto seen = [&](const std::uint32_t* samples, auto odd) {
      Uint8 low, high;
      std::memcpy(&low, samples + kSamples * u, sizeof low);
      std::memcpy(&high, samples + kSamples * u + 8, sizeof high);
      return every_other<odd.value>(low, high);
    };
    const Float8 q = 0.25F * (sum(depths) + sum(below));
    std::memcpy(inverse_depth + u, &q, sizeof q);
    const Uint8 first = seen(triangles, std::false_type{});
    const unsigned same = lanes_of((Int8)(first == seen(triangles, std::true_type{})) &
                                   (Int8)(first == seen(triangles_below, std::false_type{})) &
                                   (Int8)(first == seen(triangles_below, std::true_type{})));
    if (same == 0xFFU && first[0] != Renderer::kNoTriangle &&
        lanes_of((Int8)(first == first[0] - Uint8{})) == 0xFFU) {
      eight_pixels(view, strip, u, first[0], q, light + u);
      continue;
    }
    for (std::size_t i = 0; i < 8; ++i) one_pixel(u + i);
  }
  for (; u < width; ++u) one_pixel(u);
}

void InfraredShader::draw_band(const View& view, Strip& strip, int v_first,
                               InfraredScene& out) const {
  const int rows = std::min(kBand, camera_.height - v_first);
  float* depths = strip.band_inverse_depth.data();
  std::uint32_t* triangles = strip.band_triangles.data();
  renderer_.read_rows(strip.index, kSamples * v_first, kSamples * rows, depths, triangles);
  strip.mixed = 0;
  for (int i = 0; i < rows; ++i) {
    const std::size_t first =
        static_cast<std::size_t>(kSamples * i) * strip.column_x.size() * kSamples;
    draw_row(view, strip, v_first + i, depths + first, triangles + first, out);
  }
  for (std::size_t kind = 0; kind < strip.queues.size(); ++kind) shade(view, strip.queues, kind);
  for (std::size_t i = 0; i < strip.mixed; ++i) {
    const Mixture& mixture = strip.mixtures[i];
    float total = 0;
    for (std::size_t k = 0; k < mixture.surfaces; ++k) {
      total += mixture.samples[k] * mixture.light_lx[k];
    }
    *mixture.pixel = 0.25F * total;
  }
  for (int i = 0; projector_ && i < rows; ++i) {
    const std::size_t first =
        static_cast<std::size_t>(kSamples * i) * strip.column_x.size() * kSamples;
    add_dots(view, strip, v_first + i, depths + first, triangles + first, out);
  }
}

/// The projector's light on a row's samples. @param depths, triangles as draw_row()'s
void InfraredShader::add_dots(const View& view, const Strip& strip, int v, const float* depths,
                              const std::uint32_t* triangles, InfraredScene& out) const {
  const std::size_t width = strip.column_x.size();
  float* light =
      &out.steady_lx[static_cast<std::size_t>(v) * static_cast<std::size_t>(camera_.width) +
                     strip.first];
  for (std::size_t i = 0; i < kSamples * kSamples * width; ++i) {
    if (triangles[i] == Renderer::kNoTriangle) continue;
    const std::size_t row = i / (kSamples * width), column = i % (kSamples * width);
    const auto u_fine = static_cast<double>(kSamples * strip.first + column);
    const auto v_fine = static_cast<double>(kSamples * static_cast<std::size_t>(v) + row);
    const auto x = static_cast<float>((u_fine - fine_.cx) / fine_.fx);
    const auto y = static_cast<float>((v_fine - fine_.cy) / fine_.fy);
    const float q = depths[i], a = x - view.projector_x_m * q;
    const SurfaceFacet& facet = surfaces_.facet(triangles[i]);
    const Vec3f ray_W = a * view.right_W + y * view.down_W + view.ahead_W;
    const float lx = projector_->at(a, y) * q * q * std::abs(facet.normal_W.dot(ray_W));
    light[column / kSamples] += lx * facet.albedo / (kSamples * kSamples);
  }
}

void InfraredShader::draw_strip(const View& view, Strip& strip, InfraredScene& out) {
  renderer_.draw_strip(strip.index);
  for (int v = 0; v < camera_.height; v += kBand) draw_band(view, strip, v, out);
}

void InfraredShader::draw(const Pose& X_WC, InfraredScene& out, const Split& split,
                          double projector_x_m) {
  renderer_.find_visible(X_WC);
  const Eigen::Matrix3f R = X_WC.R.cast<float>();
  const View view{X_WC.p.cast<float>(), R.col(0), R.col(1), R.col(2),
                  static_cast<float>(projector_x_m)};
  const std::size_t pixels =
      static_cast<std::size_t>(camera_.width) * static_cast<std::size_t>(camera_.height);
  out.light_lx.resize(pixels);
  out.inverse_depth.resize(pixels);
  out.steady_lx.assign(projector_ ? pixels : 0, 0);
  split(strips_.size(), [&](std::size_t i) { draw_strip(view, strips_[i], out); });
}

}  // namespace arex::sim
