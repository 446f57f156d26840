#include "sensors/renderer_detail.h"

#include <cmath>
#include <numbers>
#include <set>
#include <span>

#include "math/types.h"
#include "sensors/mesh_surfaces.h"

namespace arex::sim {
namespace {

double area(const worlds::Mesh& mesh, std::uint32_t triangle) {
  const auto& [a, b, c] = mesh.triangles[triangle];
  const Vec3 p = mesh.vertices[a].cast<double>();
  return 0.5 *
         (mesh.vertices[b].cast<double>() - p).cross(mesh.vertices[c].cast<double>() - p).norm();
}

/// Two triangles of foliage with an edge in common, one behind the other.
bool is_leaf(const worlds::World& world, std::span<const std::uint32_t> surface) {
  if (surface.size() != 2 || surface[1] != surface[0] + 1) return false;
  const worlds::SurfaceClass of =
      world.objects[world.mesh.object_of_triangle[surface[0]]].surface_class;
  if (of != worlds::SurfaceClass::kLeaf && of != worlds::SurfaceClass::kShrub) return false;
  std::set<std::uint32_t> corners;
  for (const std::uint32_t t : surface) {
    corners.insert(world.mesh.triangles[t].begin(), world.mesh.triangles[t].end());
  }
  return corners.size() == 4;
}

}  // namespace

DetailOfMesh::DetailOfMesh(const worlds::World& world, const std::vector<std::int8_t>& winding)
    : width_m(world.mesh.triangles.size(), kAlways),
      leaf(world.mesh.triangles.size(), Part::kNone) {
  const worlds::Mesh& mesh = world.mesh;
  const MeshSurfaces surfaces(mesh);
  surfaces.each([&](std::span<const std::uint32_t> surface, std::uint32_t) {
    const bool is_of_foliage = is_leaf(world, surface);
    if (!is_of_foliage && winding[surface[0]] == 0) return;
    double whole = 0;
    Eigen::AlignedBox3f bounds;
    for (const std::uint32_t t : surface) {
      whole += area(mesh, t);
      for (const std::uint32_t vertex : mesh.triangles[t]) bounds.extend(mesh.vertices[vertex]);
    }
    // A convex body covers a quarter of its surface on average (Cauchy), a rod of length l and
    // diameter d has pi d l of it.
    const double width =
        is_of_foliage ? std::sqrt(whole) : whole / (std::numbers::pi * bounds.diagonal().norm());
    for (const std::uint32_t t : surface) width_m[t] = static_cast<float>(width);
    if (is_of_foliage) {
      leaf[surface[0]] = Part::kFirst;
      leaf[surface[1]] = Part::kSecond;
    }
  });
}

}  // namespace arex::sim
