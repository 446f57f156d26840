#include "worlds/undergrowth.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <vector>

#include "worlds/reflectivity.h"
#include "worlds/sampling.h"

namespace arex::worlds {

void add_shrub(MeshBuilder& builder, const Vec3& root, double height, int leaves,
               RandomStream random, Detail detail) {
  const double merged = detail == Detail::kCoarse ? kLeavesMerged : 1;
  leaves = static_cast<int>(std::lround(leaves / merged));
  const std::uint32_t object =
      builder.add_object(SurfaceClass::kShrub, kShrubReflectivity.draw(random));
  const int stems = random.uniform_int(3, 6);
  std::vector<std::array<Vec3, 3>> axes;
  for (int i = 0; i < stems; ++i) {
    const double azimuth = 2 * std::numbers::pi * (i + random.uniform(-0.3, 0.3)) / stems;
    const double length = height * random.uniform(0.6, 1.1);
    const double steep = random.uniform(0.9, 1.35);
    const Vec3 foot = root + 0.05 * direction(azimuth, 0) - 0.1 * Vec3::UnitZ();
    const Vec3 knee = foot + 0.5 * length * direction(azimuth, steep) + 0.1 * Vec3::UnitZ();
    const Vec3 tip = knee + 0.5 * length * direction(azimuth, steep - 0.35);
    axes.push_back({foot, knee, tip});
    const std::array<double, 3> radii{0.011, 0.008, 0.004};
    builder.add_tube(object, axes.back(), radii, 4);
    builder.add_collision_capsule(object, foot, knee, radii[0]);
    builder.add_collision_capsule(object, knee, tip, radii[1]);
  }
  for (int i = 0; i < leaves; ++i) {
    const auto& [foot, knee, tip] = axes[static_cast<std::size_t>(i) % axes.size()];
    const double t = random.uniform(0.1, 1.05);
    const Vec3 base =
        (t < 0.5 ? Vec3(foot + 2 * t * (knee - foot)) : Vec3(knee + (2 * t - 1) * (tip - knee))) +
        0.15 * height * random.normal3().cwiseProduct(Vec3(1, 1, 0.6));
    if (base.z() < root.z() + 0.04) continue;
    const Vec3 normal = (0.7 * random.normal3() + Vec3::UnitZ()).normalized();
    Vec3 along = base - root + 0.4 * random.normal3();
    along = (along - along.dot(normal) * normal).normalized();
    const double length = std::sqrt(merged) * random.uniform(0.08, 0.15);
    const Vec3 across = 0.28 * length * normal.cross(along);
    const Vec3 middle = base + 0.45 * length * along;
    builder.add_quad(object, base, middle + across, base + length * along, middle - across);
  }
}

void add_fern(MeshBuilder& builder, const Vec3& root, double length, RandomStream random) {
  const std::uint32_t object =
      builder.add_object(SurfaceClass::kShrub, kShrubReflectivity.draw(random));
  const int fronds = random.uniform_int(6, 10);
  for (int i = 0; i < fronds; ++i) {
    const double azimuth = 2 * std::numbers::pi * (i + random.uniform(-0.3, 0.3)) / fronds;
    const Vec3 side = direction(azimuth + std::numbers::pi / 2, 0);
    const double step = length * random.uniform(0.75, 1.2) / 3;
    double elevation = random.uniform(0.9, 1.25);
    Vec3 point = root - 0.02 * Vec3::UnitZ();
    constexpr std::array<double, 4> kHalfWidth{0.015, 0.07, 0.055, 0.004};
    for (std::size_t k = 0; k < 3; ++k) {
      const Vec3 next = point + step * direction(azimuth, elevation);
      const double scale = length / 0.55;
      builder.add_quad(
          object, point - scale * kHalfWidth[k] * side, point + scale * kHalfWidth[k] * side,
          next + scale * kHalfWidth[k + 1] * side, next - scale * kHalfWidth[k + 1] * side);
      point = next;
      elevation -= random.uniform(0.5, 0.7);
    }
  }
}

void add_log(MeshBuilder& builder, const HeightField& terrain, const Vec2& middle, double heading,
             double length, double radius, RandomStream random) {
  const std::uint32_t object =
      builder.add_object(SurfaceClass::kLog, kDeadWoodReflectivity.draw(random));
  const Vec3 along = direction(heading, 0);
  const Vec3 across = direction(heading + std::numbers::pi / 2, 0);
  // A straight axis that lies on the ground at both ends; a little of it has sunk in.
  const auto resting = [&](double s, double r) {
    const Vec2 p = middle + s * along.head<2>();
    return Vec3(p.x(), p.y(), terrain.at(p.x(), p.y()) + 0.75 * r);
  };
  const double radius_top = 0.6 * radius;
  const Vec3 butt = resting(-0.5 * length, radius);
  const Vec3 top = resting(0.5 * length, radius_top);
  constexpr int kSegments = 4;
  std::vector<Vec3> points;
  std::vector<double> radii;
  const double bow = 0.02 * length * random.normal();
  for (int i = 0; i <= kSegments; ++i) {
    const double t = static_cast<double>(i) / kSegments;
    points.emplace_back(butt + t * (top - butt) + bow * std::sin(std::numbers::pi * t) * across);
    radii.push_back(radius + t * (radius_top - radius));
  }
  builder.add_tube(object, points, radii, 9);
  for (std::size_t i = 0; i + 1 < points.size(); ++i) {
    builder.add_collision_capsule(object, points[i], points[i + 1], radii[i]);
  }
  const int stubs = random.uniform_int(1, 4);
  for (int i = 0; i < stubs; ++i) {
    const double t = random.uniform(0.35, 0.95);
    const double roll = random.uniform(0.15, 0.85) * std::numbers::pi;
    const Vec3 out = std::cos(roll) * across + std::sin(roll) * Vec3::UnitZ() + 0.7 * along;
    const std::array<Vec3, 2> snag{
        butt + t * (top - butt),
        butt + t * (top - butt) + random.uniform(0.3, kMaxStubLength) * out.normalized()};
    const std::array<double, 2> snag_radii{0.022, 0.007};
    builder.add_tube(object, snag, snag_radii, 5);
    builder.add_collision_capsule(object, snag[0], snag[1], snag_radii[0]);
  }
}

}  // namespace arex::worlds
