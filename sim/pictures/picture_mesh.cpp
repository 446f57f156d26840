#include "pictures/picture_mesh.h"

#include <algorithm>
#include <cmath>

#include "math/random.h"
#include "messages/vehicle.h"
#include "worlds/mesh_builder.h"

namespace arex::sim {
namespace {

using worlds::SurfaceClass;
using Colour = std::array<std::uint8_t, 4>;

// The class byte of things that are no part of a world.
constexpr std::uint8_t kOverlayClass = 255;

Colour pack(const Vec3& linear, std::uint8_t surface_class) {
  // The square root keeps dark shades apart in eight bits; the shader squares it again.
  const auto byte = [](double value) {
    return static_cast<std::uint8_t>(std::lround(255 * std::sqrt(std::clamp(value, 0.0, 1.0))));
  };
  return {byte(linear.x()), byte(linear.y()), byte(linear.z()), surface_class};
}

Vec3 grey(double value) { return Vec3::Constant(value); }

/// Paints of cars, tried by chance: mostly grey scale, as on the road.
Vec3 car_paint(RandomStream& random) {
  static const std::array<Vec3, 9> kPaints{
      Vec3(0.70, 0.70, 0.70), Vec3(0.03, 0.03, 0.035), Vec3(0.30, 0.32, 0.34),
      Vec3(0.45, 0.03, 0.03), Vec3(0.04, 0.10, 0.38),  Vec3(0.10, 0.11, 0.12),
      Vec3(0.03, 0.20, 0.12), Vec3(0.60, 0.32, 0.04),  Vec3(0.05, 0.25, 0.45)};
  return kPaints[static_cast<std::size_t>(random.uniform_int(0, 8))];
}

Vec3 base_colour(const worlds::Object& object, RandomStream& random) {
  const auto reflectivity = static_cast<double>(object.reflectivity);
  const double hue = random.uniform(), shade = random.uniform(0.75, 1.25);
  switch (object.surface_class) {
    case SurfaceClass::kGround:
      return {0.16, 0.125, 0.065};
    case SurfaceClass::kTrunk:
    case SurfaceClass::kBranch:
      return shade * Vec3(0.115 + 0.03 * hue, 0.085 + 0.02 * hue, 0.055);
    case SurfaceClass::kLog:
      return shade * Vec3(0.16, 0.11, 0.06);
    case SurfaceClass::kLeaf:
      return shade * Vec3(0.07 + 0.09 * hue, 0.20 + 0.03 * hue, 0.025);
    case SurfaceClass::kShrub:
      return shade * Vec3(0.05 + 0.04 * hue, 0.15, 0.03);
    case SurfaceClass::kCar:
      if (reflectivity < 0.0475) return grey(0.012);            // rubber
      if (reflectivity < 0.0625) return {0.025, 0.035, 0.045};  // glass
      return car_paint(random);
    case SurfaceClass::kDoor:
      return {0.05, 0.16, 0.22};
    case SurfaceClass::kPipe:
      return hue < 0.35 ? Vec3(0.42, 0.05, 0.03) : grey(0.42);
    case SurfaceClass::kPillar:
    case SurfaceClass::kKerb:
      if (reflectivity > 0.55) return {0.75, 0.47, 0.02};  // safety paint
      return Vec3(1.0, 0.98, 0.94) * (0.95 * reflectivity);
    case SurfaceClass::kFloor:
    case SurfaceClass::kRamp:
      if (reflectivity > 0.5) return grey(0.75);  // markings
      return Vec3(0.92, 0.97, 1.0) * (0.75 * reflectivity);
    case SurfaceClass::kWall:
    case SurfaceClass::kCeiling:
    case SurfaceClass::kBeam:
      return Vec3(1.0, 0.98, 0.94) * std::min(reflectivity * 1.1, 0.8);
  }
  return grey(0.3);
}

constexpr float kSmoothBelow = 0.77F;  // cosine of the sharpest bend that is not a crease

/// The built world's triangles with one colour per object, appended.
void append(const worlds::World& world, const std::vector<Colour>& colours,
            std::vector<PictureVertex>& out) {
  const auto vertices = picture_vertices(world.mesh, colours);
  out.insert(out.end(), vertices.begin(), vertices.end());
}

void add_vehicle(worlds::MeshBuilder& builder, std::vector<Colour>& colours, const Pose& X_WB) {
  const VehicleConfig vehicle;
  const auto part = [&](const Vec3& colour) {
    colours.push_back(pack(colour, kOverlayClass));
    return builder.add_object(SurfaceClass::kCar, 0.5);
  };
  const std::uint32_t frame = part({0.03, 0.03, 0.035});
  builder.add_box(frame, X_WB * Pose{Mat3::Identity(), {0, 0, 0}}, {0.10, 0.045, 0.03});
  builder.add_box(frame, X_WB * Pose{Mat3::Identity(), {-0.02, 0, 0.045}}, {0.06, 0.035, 0.02});
  builder.add_box(part({0.5, 0.52, 0.55}), X_WB * Pose{vehicle.X_BC().R, vehicle.X_BC().p},
                  {0.045, 0.012, 0.012});
  builder.add_cylinder(part({0.10, 0.20, 0.35}), X_WB * vehicle.X_BL(), 0.0325, 0.03, 24);
  for (const double x : {1.0, -1.0}) {
    for (const double y : {1.0, -1.0}) {
      const Vec3 rotor(x * vehicle.rotor_offset_m.x(), y * vehicle.rotor_offset_m.y(), 0.03);
      const std::array<Vec3, 2> arm{X_WB.p, X_WB * rotor};
      const std::array<double, 2> radii{0.012, 0.012};
      builder.add_tube(frame, arm, radii, 8);
      const std::uint32_t disc = part(x > 0 ? Vec3(0.75, 0.25, 0.05) : Vec3(0.3, 0.32, 0.35));
      builder.add_cylinder(disc, X_WB * Pose{Mat3::Identity(), rotor}, 0.114, 0.003, 32);
      const std::array<Vec3, 2> leg{X_WB * rotor,
                                    X_WB * Vec3(rotor.x(), rotor.y(), -vehicle.ground_offset_m)};
      builder.add_tube(frame, leg, radii, 6);
    }
  }
}

}  // namespace

std::vector<Colour> object_colours(const worlds::World& world) {
  const RandomStream stream(0, "picture");
  std::vector<Colour> colours;
  colours.reserve(world.objects.size());
  for (std::size_t i = 0; i < world.objects.size(); ++i) {
    RandomStream random = stream.fork(i);
    worlds::Object object = world.objects[i];
    // Ground without a terrain is paved: a forecourt.
    if (object.surface_class == SurfaceClass::kGround && world.terrain.columns == 0) {
      object.surface_class = SurfaceClass::kFloor;
    }
    colours.push_back(
        pack(base_colour(object, random), static_cast<std::uint8_t>(object.surface_class)));
  }
  return colours;
}

std::vector<PictureVertex> picture_vertices(const worlds::Mesh& mesh,
                                            const std::vector<Colour>& colours) {
  std::vector<Vec3f> flat(mesh.triangles.size());
  std::vector<Vec3f> smooth(mesh.vertices.size(), Vec3f::Zero());
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    const auto& [a, b, c] = mesh.triangles[t];
    const Vec3f& p = mesh.vertices[a];
    flat[t] = (mesh.vertices[b] - p).cross(mesh.vertices[c] - p);  // long where the area is large
    for (const std::uint32_t vertex : mesh.triangles[t]) {
      // Winding carries no meaning: each contribution is turned towards the sum so far.
      smooth[vertex] += smooth[vertex].dot(flat[t]) < 0 ? Vec3f(-flat[t]) : flat[t];
    }
  }
  std::vector<PictureVertex> out;
  out.reserve(3 * mesh.triangles.size());
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    const Vec3f normal = flat[t].normalized();
    for (const std::uint32_t vertex : mesh.triangles[t]) {
      Vec3f mean = smooth[vertex].normalized();
      if (mean.dot(normal) < 0) mean = -mean;
      out.push_back({mesh.vertices[vertex], mean.dot(normal) > kSmoothBelow ? mean : normal,
                     colours[mesh.object_of_triangle[t]]});
    }
  }
  return out;
}

std::vector<PictureVertex> overlay_vertices(const PictureOverlay& overlay) {
  worlds::MeshBuilder builder;
  std::vector<Colour> colours;
  for (const PictureOverlay::Path& path : overlay.paths) {
    const std::uint32_t object = builder.add_object(SurfaceClass::kPipe, 0.5);
    colours.push_back(pack(path.colour, kOverlayClass));
    // A tube needs points apart from each other; recorded paths rest in places.
    std::vector<Vec3> points;
    for (const Vec3& p : path.points_W) {
      if (points.empty() || (p - points.back()).norm() > path.radius_m) points.push_back(p);
    }
    if (points.size() < 2) continue;
    builder.add_tube(object, points, std::vector<double>(points.size(), path.radius_m), 8);
  }
  for (const Pose& X_WB : overlay.vehicles) add_vehicle(builder, colours, X_WB);
  std::vector<PictureVertex> out;
  if (!colours.empty()) append(builder.finish(), colours, out);
  return out;
}

}  // namespace arex::sim
