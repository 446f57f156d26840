#include "sensors/infrared_sun.h"

#include <algorithm>
#include <cmath>

#include "sensors/renderer.h"

namespace arex::sim {
namespace {

// The sun's place, in radii of the world: at its border, rays differ from parallel ones by a
// seventh of a degree, less than the sun is wide. Further off, single precision would have too few
// digits.
constexpr double kDistance = 400;
constexpr double kLeast = 1.0;       // radius of a world, m
constexpr double kLiftTexels = 2.5;  // of a surface before it is asked for, against shading itself

Pose look_from_sun(const Vec3& direction, const Vec3& middle, double distance) {
  const Vec3 z = -direction;
  const Vec3 x =
      std::abs(direction.z()) > 0.999 ? Vec3::UnitX() : Vec3(z.cross(Vec3::UnitZ()).normalized());
  const Vec3 y = z.cross(x).normalized();
  Mat3 R;
  R << y.cross(z), y, z;
  return {R, middle + distance * direction};
}

}  // namespace

Vec3 sun_direction(const InfraredLightConfig& light) {
  const double level = std::cos(light.sun_elevation_rad);
  return {level * std::cos(light.sun_azimuth_rad), level * std::sin(light.sun_azimuth_rad),
          std::sin(light.sun_elevation_rad)};
}

SunMap::SunMap(const InfraredLightConfig& light, const worlds::World& world, int texels) {
  const Vec3 direction = sun_direction(light);
  direction_ = direction.cast<float>();
  Eigen::AlignedBox3d box;
  for (const Vec3f& vertex : world.mesh.vertices) box.extend(vertex.cast<double>());
  if (box.isEmpty()) box = Eigen::AlignedBox3d(Vec3::Zero(), Vec3::Zero());
  const double radius = std::max(0.5 * box.diagonal().norm(), kLeast);
  const double distance = kDistance * radius;
  const Pose X_WS = look_from_sun(direction, box.center(), distance);
  const Pose X_SW = X_WS.inverse();
  // The picture's borders: all of the world's corners, and a texel or two.
  double half_x = 0, half_y = 0;
  for (int i = 0; i < 8; ++i) {
    const auto corner = static_cast<Eigen::AlignedBox3d::CornerType>(i);
    const Vec3 p = X_SW * Vec3(box.corner(corner));
    half_x = std::max(half_x, std::abs(p.x() / p.z()));
    half_y = std::max(half_y, std::abs(p.y() / p.z()));
  }
  const double half = std::max({half_x, half_y, 1e-6});
  const double focal = (0.5 * texels - 2) / half;
  const auto side = [&](double extent) {
    return 2 * static_cast<int>(std::ceil(focal * extent)) + 4;
  };
  const PinholeCamera camera{
      side(half_x), side(half_y), focal, focal, 0.5 * side(half_x) - 0.5, 0.5 * side(half_y) - 0.5};
  Renderer renderer(world, camera, {.near_m = 1, .far_m = distance + 2 * radius});
  renderer.render_inverse_depth(X_WS, inverse_depth_);
  texel_m_ = distance / focal;
  axes_ = X_SW.R.cast<float>();
  eye_ = X_WS.p.cast<float>();
  lift_ = Vec3f(0, 0, static_cast<float>(-kLiftTexels * texel_m_));
  fx_ = static_cast<float>(focal);
  cx_ = static_cast<float>(camera.cx);
  cy_ = static_cast<float>(camera.cy);
  last_u_ = static_cast<float>(camera.width - 1);
  last_v_ = static_cast<float>(camera.height - 1);
  width_ = camera.width;
}

}  // namespace arex::sim
