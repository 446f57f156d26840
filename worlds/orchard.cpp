#include "worlds/orchard.h"

#include <array>
#include <cmath>
#include <vector>

#include "worlds/level_ground.h"
#include "worlds/mesh_builder.h"
#include "worlds/reflectivity.h"
#include "worlds/sampling.h"
#include "worlds/undergrowth.h"

namespace arex::worlds {
namespace {

constexpr ReflectivityBand kPostReflectivity{0.25, 0.40};  ///< weathered wood (estimate)
constexpr ReflectivityBand kWireReflectivity{0.35, 0.55};  ///< galvanised steel (estimate)
constexpr double kOffRow = 0.04;  // standard deviation of a trunk's place, across and along, m
constexpr int kPostSides = 10;
constexpr int kWireSides = 3;

void add_trellis(MeshBuilder& builder, const OrchardRecipe& recipe, double y,
                 RandomStream& random) {
  const double length = recipe.row_length_m();
  const int spans = std::max(1, static_cast<int>(std::lround(length / recipe.post_spacing_m)));
  const auto x_of = [&](int post) { return length * (static_cast<double>(post) / spans - 0.5); };
  for (int post = 0; post <= spans; ++post) {
    builder.add_solid_cylinder(
        builder.add_object(SurfaceClass::kPillar, kPostReflectivity.draw(random)),
        {Mat3::Identity(), {x_of(post), y, recipe.post_height_m / 2}}, recipe.post_radius_m,
        recipe.post_height_m / 2, kPostSides);
  }
  const double radius = recipe.wire_diameter_m / 2;
  for (const double z : recipe.wire_heights_m) {
    const std::uint32_t wire =
        builder.add_object(SurfaceClass::kPipe, kWireReflectivity.draw(random));
    for (int span = 0; span < spans; ++span) {
      const std::array<Vec3, 2> ends{Vec3(x_of(span), y, z), Vec3(x_of(span + 1), y, z)};
      builder.add_tube(wire, ends, std::array<double, 2>{radius, radius}, kWireSides);
      builder.add_collision_capsule(wire, ends[0], ends[1], radius);
    }
  }
}

}  // namespace

int OrchardRecipe::rows() const {
  const long half = std::lround((size_m.y() / 2 - headland_m) / row_spacing_m);
  return 2 * std::max(1, static_cast<int>(half));
}

double OrchardRecipe::row_y_m(int row) const { return (row - (rows() - 1) / 2.0) * row_spacing_m; }

double OrchardRecipe::expected_triangles() const {
  // Of a trunk, of each branch or twig, of a tuft, and of a metre of trellis, on average.
  constexpr double kTrunk = 300, kBranch = 24, kTuft = 60, kTrellis = 20;
  const double of_tree =
      kTrunk + kBranch * tree.branches * (1.0 + tree.twigs_per_branch) + 2.0 * tree.leaves;
  return rows() * row_length_m() * (of_tree / tree_spacing_m + kTrellis) +
         kTuft * grass_density_per_m2 * size_m.prod();
}

World build(const OrchardRecipe& recipe, std::uint64_t seed) {
  MeshBuilder builder;
  RandomStream ground_stream(seed, "worlds/orchard/ground");
  const HeightField terrain = level_ground(-0.5 * recipe.size_m, 0.5 * recipe.size_m);
  builder.add_height_field(
      builder.add_object(SurfaceClass::kGround, kForestFloorReflectivity.draw(ground_stream)),
      terrain);

  const Vec2 border = -terrain.origin - Vec2::Constant(0.15);
  const Allowed allowed = [&](const Vec3& p) {
    return p.head<2>().norm() >= recipe.start_radius_m &&
           (p.head<2>().cwiseAbs().array() <= border.array()).all();
  };
  const RandomStream row_stream(seed, "worlds/orchard/row");
  const int trees = static_cast<int>(recipe.row_length_m() / recipe.tree_spacing_m) + 1;
  for (int row = 0; row < recipe.rows(); ++row) {
    RandomStream random = row_stream.fork(static_cast<std::uint64_t>(row));
    add_trellis(builder, recipe, recipe.row_y_m(row), random);
    for (int i = 0; i < trees; ++i) {
      RandomStream of_tree = random.fork(static_cast<std::uint64_t>(i));
      const bool missing = of_tree.uniform() < recipe.missing_share;
      const double dx = kOffRow * of_tree.normal(), dy = kOffRow * of_tree.normal();
      if (missing) continue;
      const double x = (i - (trees - 1) / 2.0) * recipe.tree_spacing_m;
      add_tree(builder, recipe.tree, {x + dx, recipe.row_y_m(row) + dy, 0}, allowed,
               of_tree.fork(0));
    }
  }

  RandomStream grass(seed, "worlds/orchard/grass");
  const auto tufts =
      static_cast<int>(std::lround(recipe.grass_density_per_m2 * recipe.size_m.prod()));
  for (int i = 0; i < tufts; ++i) {
    const double length = recipe.grass_length_m * grass.uniform(0.6, 1.4);
    const Vec2 p = 2 * (border - Vec2::Constant(recipe.grass_length_m))
                           .cwiseProduct(Vec2(grass.uniform() - 0.5, grass.uniform() - 0.5));
    const RandomStream of_tuft = grass.fork(static_cast<std::uint64_t>(i));
    if (p.norm() > recipe.start_radius_m + length) {
      add_fern(builder, {p.x(), p.y(), 0}, length, of_tuft);
    }
  }

  World world = builder.finish();
  world.bounds.low.head<2>() = terrain.origin;
  world.bounds.high.head<2>() = -terrain.origin;
  return world;
}

}  // namespace arex::worlds
