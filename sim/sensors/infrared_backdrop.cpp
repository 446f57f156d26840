#include "sensors/infrared_backdrop.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace arex::sim {
namespace {

constexpr float kBeyond = 9;      // from the world's edge to the wall of trees, m
constexpr float kTreeHeight = 9;  // mean, m
constexpr float kCrown = 2.5F;    // by which it varies, m
constexpr double kGroundAlbedo = 0.3, kFoliageAlbedo = 0.35;  // as in worlds/reflectivity.h
constexpr double kUnderTrees = 0.4;  // share of the light that comes through
constexpr std::uint32_t kGroundKey = 0x51ED270BU, kTreesKey = 0x2545F491U, kSkyKey = 0x7F4A7C15U;

/// Height at which the ground goes on: the terrain's along one border, else that of the start.
float border_height(const worlds::World& world) {
  if (world.terrain.columns == 0) {
    return static_cast<float>(world.X_WS.p.z());
  }
  const worlds::HeightField& terrain = world.terrain;
  double sum = 0;
  for (int i = 0; i < terrain.columns; ++i) {
    sum += static_cast<double>(terrain.height_m[static_cast<std::size_t>(i)]);
  }
  return static_cast<float>(sum / terrain.columns);
}

}  // namespace

Backdrop::Backdrop(const InfraredLightConfig& light, const worlds::World& world)
    : ground_(noise_material({6, 1.5F, 0.4F, 0.1F}, {0.35F, 0.35F, 0.4F, 0.35F})),
      // Stems and crowns are taller than wide.
      trees_(noise_material({3, 1.0F, 0.4F, 0.15F}, {0.35F, 0.45F, 0.45F, 0.35F}, 0.6F)),
      clouds_(noise_material({1.2F, 0.5F, 0.2F, 0.08F}, {0.2F, 0.12F, 0.06F, 0.03F}, 2)) {
  Eigen::AlignedBox3f box;
  for (const Vec3f& vertex : world.mesh.vertices) box.extend(vertex);
  if (box.isEmpty()) box = Eigen::AlignedBox3f(Vec3f::Zero(), Vec3f::Zero());
  middle_ = box.center();
  middle_.z() = border_height(world);
  half_ = 0.5F * box.sizes().head<2>() + Eigen::Vector2f::Constant(kBeyond);
  const double sun_lx = light.sun ? light.sun_lx : 0;
  const double level_lx = light.sky_lx + sun_lx * std::sin(light.sun_elevation_rad);
  // As under the trees that stand around it.
  ground_lx_ = static_cast<float>(kGroundAlbedo * kUnderTrees * level_lx);
  wall_lx_ = static_cast<float>(kFoliageAlbedo * 0.5 * level_lx);
  sky_lx_ = static_cast<float>(light.sky_darkness * light.sky_lx);
}

Float8 Backdrop::sky(const Rays& direction, const Float8& norm, float pixel_rad) const {
  // Clouds on a plane overhead; near the horizon they are too far to be told apart.
  const Float8 rise = direction[2] / norm, least = Float8{} + 0.02F;
  const Float8 slope = rise < least ? least : rise;
  const Float8 along = norm * slope;
  const Float8 cloud = texture_at(clouds_, kSkyKey, direction[0] / along, direction[1] / along,
                                  pixel_rad / (slope * slope));
  const Float8 haze = 1.3F - 0.6F * slope;  // brighter towards the horizon
  return sky_lx_ * cloud * haze;
}

Float8 Backdrop::ground(const Vec3f& from, const Rays& direction, const Float8& squared,
                        float pixel_rad) const {
  const Float8 least = Float8{} + 1e-4F;
  const Float8 down = -direction[2] < least ? least : -direction[2];
  const Float8 t = std::max(from.z(), 0.0F) / down;
  const Float8 footprint = pixel_rad * t * squared / down;
  return ground_lx_ * texture_at(ground_, kGroundKey, from.x() + t * direction[0],
                                 from.y() + t * direction[1], footprint);
}

Float8 Backdrop::at(const Vec3f& eye, const Rays& direction, float pixel_rad) const {
  const Float8 zero{}, one = zero + 1.0F;
  const auto share = [&](const Float8& x) { return x < zero ? zero : one < x ? one : x; };
  const Float8 squared =
      direction[0] * direction[0] + (direction[1] * direction[1] + direction[2] * direction[2]);
  const Float8 norm = root(squared);
  // How far along the ray its wall stands.
  const Vec3f from = eye - middle_;
  Float8 wall = zero + std::numeric_limits<float>::infinity();
  Int8 across{};  // -1: it stands across y, not x
  for (std::size_t i = 0; i < 2; ++i) {
    const auto k = static_cast<Eigen::Index>(i);
    const Float8 side = direction[i] > zero ? zero + half_[k] : zero - half_[k];
    const Float8 t = (side - from[k]) / direction[i];
    const Int8 nearer = (direction[i] != zero) & (t > zero) & (t < wall);
    wall = nearer ? t : wall;
    across = i == 1 ? across | nearer : across;
  }
  const Int8 walled = wall < std::numeric_limits<float>::infinity();
  const Float8 reach = walled ? wall : one;
  // Where one ends and another begins, a pixel has its share of both.
  const Float8 footprint = pixel_rad * reach * norm;
  const Float8 height = from.z() + reach * direction[2];
  const Float8 above_ground = walled ? share(height / footprint + 0.5F) : one;
  Float8 light = zero;
  if (any(above_ground < one)) {
    light += (one - above_ground) * ground(from, direction, squared, pixel_rad);
  }
  if (!any(above_ground > zero)) return light;
  const Float8 along = across ? from.x() + reach * direction[0] : from.y() + reach * direction[1];
  const Int8 axis = across ? Int8{} + 1 : Int8{};
  const Int8 ahead = (across ? direction[1] : direction[0]) > zero;  // -1: it is
  const Uint8 key = kTreesKey + (Uint8)(2 * axis - ahead);
  Float8 below_sky = zero;
  if (any(walled)) {
    const Float8 crown = texture_at(trees_, key ^ 0x55U, along, zero, footprint) - 1.0F;
    const Float8 top = kTreeHeight + kCrown * crown;
    below_sky = walled ? share((top - height) / footprint + 0.5F) : zero;
  }
  if (any(below_sky < one)) {
    light += above_ground * (one - below_sky) * sky(direction, norm, pixel_rad);
  }
  if (!any(below_sky > zero)) return light;
  // Dark between the stems, bright in the crowns.
  const Float8 trees = texture_at(trees_, key, along, height, footprint);
  return light + above_ground * below_sky * wall_lx_ *
                     (0.35F + 0.65F * share(height / kTreeHeight)) * trees;
}

float Backdrop::at(const Vec3f& eye, const Vec3f& direction, float pixel_rad) const {
  const Float8 zero{};
  return at(eye, {zero + direction.x(), zero + direction.y(), zero + direction.z()}, pixel_rad)[0];
}

}  // namespace arex::sim
