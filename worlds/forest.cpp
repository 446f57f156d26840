#include "worlds/forest.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <string>

#include "config/config.h"
#include "worlds/reflectivity.h"
#include "worlds/sampling.h"
#include "worlds/undergrowth.h"

namespace arex::worlds {
namespace {

/// Below this height clearings and corridors are free of branches too, m above the ground.
constexpr double kClearHeight = 4.0;

double distance_to_segment(const Vec2& p, const Vec2& a, const Vec2& b) {
  const Vec2 d = b - a;
  const double length2 = d.squaredNorm();
  const double t = length2 > 0 ? std::clamp((p - a).dot(d) / length2, 0.0, 1.0) : 0.0;
  return (p - a - t * d).norm();
}

/// Whether p, widened by `margin`, touches a clearing or a corridor.
bool is_cleared(const ForestRecipe& recipe, const Vec2& p, double margin) {
  for (const Clearing& clearing : recipe.clearings) {
    if ((p - clearing.centre_m).norm() < clearing.radius_m + margin) return true;
  }
  for (const Corridor& corridor : recipe.corridors) {
    for (std::size_t i = 0; i + 1 < corridor.points_m.size(); ++i) {
      if (distance_to_segment(p, corridor.points_m[i], corridor.points_m[i + 1]) <
          corridor.width_m / 2 + margin) {
        return true;
      }
    }
  }
  return false;
}

/// A sum of plane waves with random directions and phases: stationary, isotropic, of RMS
/// amplitude / sqrt 2.
class Swell {
 public:
  Swell(RandomStream random, double amplitude, double shortest, double longest) {
    double power = 0;
    for (Wave& wave : waves_) {
      const double length = shortest * std::pow(longest / shortest, random.uniform());
      const double heading = random.uniform(0, 2 * std::numbers::pi);
      wave.k = 2 * std::numbers::pi / length * direction(heading, 0).head<2>();
      wave.phase = random.uniform(0, 2 * std::numbers::pi);
      wave.amplitude = length;  // equal steepness
      power += length * length;
    }
    for (Wave& wave : waves_) wave.amplitude *= amplitude / std::sqrt(power);
  }
  [[nodiscard]] double at(const Vec2& p) const {
    double height = 0;
    for (const Wave& wave : waves_) height += wave.amplitude * std::cos(wave.k.dot(p) + wave.phase);
    return height;
  }

 private:
  struct Wave {
    Vec2 k = Vec2::Zero();
    double phase = 0;
    double amplitude = 0;
  };
  std::array<Wave, 24> waves_;
};

HeightField make_terrain(const ForestRecipe& recipe, const RandomStream& random) {
  const Swell swell(random.fork(0), recipe.relief_m, 0.6 * recipe.relief_wavelength_m,
                    1.8 * recipe.relief_wavelength_m);
  const Swell bumps(random.fork(1), recipe.roughness_m, 1.0, 3.0);
  HeightField field;
  // The nearest number of cells, at least the asked-for size.
  field.spacing_m = recipe.ground_spacing_m;
  field.columns = static_cast<int>(std::ceil(recipe.size_m.x() / field.spacing_m - 1e-9)) + 1;
  field.rows = static_cast<int>(std::ceil(recipe.size_m.y() / field.spacing_m - 1e-9)) + 1;
  field.origin =
      -0.5 * field.spacing_m * Vec2(static_cast<double>(field.columns - 1), field.rows - 1);
  const double start_height = swell.at(Vec2::Zero());
  for (int row = 0; row < field.rows; ++row) {
    for (int column = 0; column < field.columns; ++column) {
      const Vec2 p = field.origin + field.spacing_m * Vec2(static_cast<double>(column), row);
      // Level at the start, as the swell wants from three radii on.
      const double t = std::clamp((p.norm() / recipe.start_radius_m - 1) / 2, 0.0, 1.0);
      const double blend = t * t * (3 - 2 * t);
      const double height = swell.at(p) + bumps.at(p) - start_height;
      field.height_m.push_back(static_cast<float>(blend * height));
    }
  }
  return field;
}

/// A point of the ground for undergrowth: away from the start and from what is cleared.
bool free_for_undergrowth(const ForestRecipe& recipe, const Vec2& p, double reach) {
  return p.norm() > recipe.start_radius_m + reach && !is_cleared(recipe, p, reach);
}

/// Whether what grows at a point of the ground is seen closely, or how coarse it may be.
using DetailAt = std::function<Detail(const Vec2&)>;

void add_undergrowth(MeshBuilder& builder, const ForestRecipe& recipe, const HeightField& terrain,
                     const std::vector<TreeSite>& trees, const DetailAt& detail_at,
                     std::uint64_t seed) {
  const UndergrowthRecipe& plants = recipe.undergrowth;
  const Vec2 extent = recipe.size_m - 2 * Vec2::Constant(recipe.edge_m);
  const auto ground = [&](const Vec2& p) { return Vec3(p.x(), p.y(), terrain.at(p.x(), p.y())); };
  const auto scatter = [&](std::string_view name, double density, const auto& place) {
    RandomStream stream(seed, name);
    const auto count = static_cast<int>(std::lround(density * extent.prod()));
    for (int i = 0; i < count; ++i) {
      const Vec2 p = extent.cwiseProduct(Vec2(stream.uniform() - 0.5, stream.uniform() - 0.5));
      place(p, stream.fork(static_cast<std::uint64_t>(i)));
    }
  };
  scatter("worlds/forest/shrubs", plants.shrub_density_per_m2, [&](const Vec2& p, RandomStream r) {
    const double scale = truncated_normal(r, 1, 0.3, 0.4, 1.8);
    const double height = plants.shrub_height_m * scale;
    if (!free_for_undergrowth(recipe, p, height)) return;
    const auto leaves = static_cast<int>(std::lround(plants.shrub_leaves * scale * scale));
    add_shrub(builder, ground(p), height, leaves, r, detail_at(p));
  });
  scatter("worlds/forest/ferns", plants.fern_density_per_m2, [&](const Vec2& p, RandomStream r) {
    const double length = plants.fern_length_m * r.uniform(0.6, 1.3);
    if (free_for_undergrowth(recipe, p, length)) add_fern(builder, ground(p), length, r);
  });
  scatter("worlds/forest/logs", plants.log_density_per_m2, [&](const Vec2& p, RandomStream r) {
    const double length = plants.log_length_m * r.uniform(0.5, 1.5);
    const double radius = plants.log_radius_m * r.uniform(0.6, 1.4);
    const double heading = r.uniform(0, 2 * std::numbers::pi);
    const Vec2 along = 0.5 * length * direction(heading, 0).head<2>();
    const bool inside =
        ((p.cwiseAbs() + along.cwiseAbs()).array() < 0.5 * recipe.size_m.array()).all();
    const double gap = recipe.tree.trunk_radius_max_m + radius;  // logs fall between the trees
    const bool between = std::none_of(trees.begin(), trees.end(), [&](const TreeSite& tree) {
      return distance_to_segment(tree.position, p - along, p + along) < gap;
    });
    if (inside && between && free_for_undergrowth(recipe, p, 0.5 * length + kMaxStubLength)) {
      add_log(builder, terrain, p, heading, length, radius, r);
    }
  });
}

}  // namespace

std::vector<TreeSite> place_trees(const ForestRecipe& recipe, std::uint64_t seed) {
  const Vec2 corner = 0.5 * recipe.size_m - Vec2::Constant(recipe.edge_m);
  const double reach = recipe.tree.trunk_radius_max_m * (1 + recipe.tree.root_flare);
  std::vector<TreeSite> sites;
  std::uint64_t index = 0;
  for (const Vec2& p :
       scatter_discs(-corner, corner, recipe.tree_density_per_m2, recipe.min_spacing_m,
                     RandomStream(seed, "worlds/forest/trees"))) {
    const bool cleared = p.norm() < recipe.start_radius_m + reach || is_cleared(recipe, p, reach);
    if (!cleared) sites.push_back({p, index});
    ++index;
  }
  return sites;
}

Eigen::AlignedBox2d ForestRecipe::detailed(const std::optional<Eigen::AlignedBox2d>& flown) const {
  if (!flown) return extent();
  const Vec2 around = Vec2::Constant(kDetail);
  Eigen::AlignedBox2d box(flown->min() - around, flown->max() + around);
  box.extend(Vec2(-2 * around)).extend(Vec2(2 * around));
  return box.intersection(extent());
}

double ForestRecipe::expected_triangles(const std::optional<Eigen::AlignedBox2d>& flown) const {
  // Of a tree's trunk, of each branch or twig, of a fern and of a log, on average.
  constexpr double kTrunk = 300, kBranch = 24, kFern = 60, kLog = 200;
  constexpr double kCoarseTrunk = 150, kCoarseBranch = 8;
  const double of_tree =
      kTrunk + kBranch * (tree.branches * (1.0 + tree.twigs_per_branch) + tree.low_branches) +
      2.0 * tree.leaves;
  const double of_coarse_tree = kCoarseTrunk + kCoarseBranch * (tree.branches + tree.low_branches) +
                                2.0 * tree.leaves / kLeavesMerged;
  const double of_shrub = 2.0 * undergrowth.shrub_leaves;
  const double plants = tree_density_per_m2 * of_tree + undergrowth.shrub_density_per_m2 * of_shrub;
  const double coarse_plants = tree_density_per_m2 * of_coarse_tree +
                               undergrowth.shrub_density_per_m2 * of_shrub / kLeavesMerged;
  const double ground = undergrowth.fern_density_per_m2 * kFern +
                        undergrowth.log_density_per_m2 * kLog +
                        2 / (ground_spacing_m * ground_spacing_m);
  const double near_m2 = detailed(flown).volume();
  return plants * near_m2 + coarse_plants * (size_m.prod() - near_m2) + ground * size_m.prod();
}

ForestRecipe pine_stand() {
  ForestRecipe recipe;
  recipe.tree_density_per_m2 = 0.18;
  recipe.min_spacing_m = 1.4;
  recipe.relief_m = 0.3;
  TreeRecipe& tree = recipe.tree;
  tree.trunk_radius_m = 0.11;
  tree.trunk_radius_spread_m = 0.02;
  tree.trunk_radius_min_m = 0.07;
  tree.trunk_radius_max_m = 0.18;
  tree.height_m = 19.4;
  tree.height_spread_m = 1.2;
  tree.root_flare = 0.3;
  tree.lean_rad = 0.015;
  tree.bend_m = 0.06;
  tree.crown_base_fraction = 0.62;
  tree.crown_radius_m = 1.6;
  tree.branches = 22;
  tree.twigs_per_branch = 2;
  tree.low_branches = 5;  // dead ones
  tree.low_branch_low_m = 1.5;
  tree.low_branch_high_m = 9;
  tree.low_branch_length_m = 0.6;
  tree.leaf_length_m = 0.3;
  UndergrowthRecipe& undergrowth = recipe.undergrowth;
  undergrowth.shrub_density_per_m2 = 0.01;
  undergrowth.fern_density_per_m2 = 0.08;
  undergrowth.log_density_per_m2 = 0.008;
  undergrowth.log_radius_m = 0.1;
  return recipe;
}

World build(const ForestRecipe& recipe, std::uint64_t seed,
            const std::optional<Eigen::AlignedBox2d>& flown) {
  if (const double expected = recipe.expected_triangles(flown);
      expected > ForestRecipe::kMostTriangles) {
    throw ConfigError(
        "expected at most 1e7 triangles where the mission leads and around it, and "
        "these would be " +
        std::to_string(std::llround(expected)) +
        ": a smaller forest, fewer leaves, or less to explore");
  }
  const Eigen::AlignedBox2d detailed = recipe.detailed(flown);
  const DetailAt detail_at = [&](const Vec2& p) {
    return !flown || detailed.contains(p) ? Detail::kFull : Detail::kCoarse;
  };
  MeshBuilder builder;
  RandomStream ground_stream(seed, "worlds/forest/ground");
  const HeightField terrain = make_terrain(recipe, ground_stream.fork(0));
  builder.add_height_field(
      builder.add_object(SurfaceClass::kGround, kForestFloorReflectivity.draw(ground_stream)),
      terrain);

  constexpr double kRim = 0.15;  // wood and leaves end this far inside the ground's border, m
  const Vec2 reach = -terrain.origin - Vec2::Constant(kRim);
  const Allowed allowed = [&](const Vec3& p) {
    const Vec2 xy = p.head<2>();
    if (xy.norm() < recipe.start_radius_m || (xy.cwiseAbs().array() > reach.array()).any()) {
      return false;
    }
    return p.z() - terrain.at(p.x(), p.y()) > kClearHeight || !is_cleared(recipe, xy, 0);
  };
  const RandomStream tree_stream(seed, "worlds/forest/tree");
  const std::vector<TreeSite> sites = place_trees(recipe, seed);
  for (const auto& [p, index] : sites) {
    add_tree(builder, recipe.tree, {p.x(), p.y(), terrain.at(p.x(), p.y())}, allowed,
             tree_stream.fork(index), detail_at(p));
  }
  add_undergrowth(builder, recipe, terrain, sites, detail_at, seed);

  World world = builder.finish();
  world.bounds.low.head<2>() = terrain.origin;
  world.bounds.high.head<2>() = -terrain.origin;
  world.X_WS.p = Vec3(0, 0, terrain.at(0, 0));
  return world;
}

}  // namespace arex::worlds
