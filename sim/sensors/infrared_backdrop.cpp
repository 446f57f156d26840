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

float Backdrop::sky(const Vec3f& direction, float pixel_rad) const {
  // Clouds on a plane overhead; near the horizon they are too far to be told apart.
  const float slope = std::max(direction.z() / direction.norm(), 0.02F);
  const Eigen::Vector2f p = direction.head<2>() / (direction.norm() * slope);
  const float cloud = texture_at(clouds_, kSkyKey, p.x(), p.y(), pixel_rad / (slope * slope));
  const float haze = 1.3F - 0.6F * slope;  // brighter towards the horizon
  return sky_lx_ * cloud * haze;
}

float Backdrop::ground(const Vec3f& from, const Vec3f& direction, float pixel_rad) const {
  const float down = std::max(-direction.z(), 1e-4F);
  const float t = std::max(from.z(), 0.0F) / down;
  const Vec3f p = from + t * direction;
  const float footprint = pixel_rad * t * direction.squaredNorm() / down;
  return ground_lx_ * texture_at(ground_, kGroundKey, p.x(), p.y(), footprint);
}

float Backdrop::at(const Vec3f& eye, const Vec3f& direction, float pixel_rad) const {
  // How far along the ray its wall stands.
  const Vec3f from = eye - middle_;
  float wall = std::numeric_limits<float>::infinity();
  int axis = 0;
  for (int i = 0; i < 2; ++i) {
    if (direction[i] == 0) continue;
    const float side = direction[i] > 0 ? half_[i] : -half_[i];
    const float t = (side - from[i]) / direction[i];
    if (t > 0 && t < wall) {
      wall = t;
      axis = i;
    }
  }
  if (!(wall < std::numeric_limits<float>::infinity())) return sky(direction, pixel_rad);
  // Where one ends and another begins, a pixel has its share of both.
  const float footprint = pixel_rad * wall * direction.norm();
  const Vec3f p = from + wall * direction;
  const float above_ground = std::clamp(p.z() / footprint + 0.5F, 0.0F, 1.0F);
  float light = 0;
  if (above_ground < 1) light += (1 - above_ground) * ground(from, direction, pixel_rad);
  if (above_ground == 0) return light;
  const std::uint32_t key = kTreesKey + static_cast<std::uint32_t>(2 * axis) +
                            static_cast<std::uint32_t>(direction[axis] > 0);
  const float along = p[1 - axis];
  const float crown = texture_at(trees_, key ^ 0x55U, along, 0, footprint) - 1;
  const float top = kTreeHeight + kCrown * crown;
  const float below_sky = std::clamp((top - p.z()) / footprint + 0.5F, 0.0F, 1.0F);
  if (below_sky < 1) light += above_ground * (1 - below_sky) * sky(direction, pixel_rad);
  if (below_sky == 0) return light;
  // Dark between the stems, bright in the crowns.
  const float height = std::clamp(p.z() / kTreeHeight, 0.0F, 1.0F);
  const float trees = texture_at(trees_, key, along, p.z(), footprint);
  return light + above_ground * below_sky * wall_lx_ * (0.35F + 0.65F * height) * trees;
}

}  // namespace arex::sim
