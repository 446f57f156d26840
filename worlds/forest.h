#pragma once

#include <optional>
#include <vector>

#include "worlds/poisson_disc.h"
#include "worlds/tree.h"

namespace arex::worlds {

/// A disc without trees, undergrowth or low branches.
struct Clearing {
  Vec2 centre_m = Vec2::Zero();
  double radius_m = 5;

  void fields(auto& f) {
    f("centre_m", centre_m, "x, y from the start");
    f("radius_m", radius_m, "of the disc");
    f.check(radius_m > 0 && radius_m <= 1000, "0 < radius_m <= 1000");
  }
};

/// A way through the forest without trees, undergrowth or low branches.
struct Corridor {
  std::vector<Vec2> points_m;
  double width_m = 3;

  void fields(auto& f) {
    f("points_m", points_m, "x, y of its corners, from the start");
    f("width_m", width_m, "of the way");
    f.check(points_m.size() >= 2 && points_m.size() <= 1000, "points_m has 2 to 1000 corners");
    f.check(width_m > 0 && width_m <= 1000, "0 < width_m <= 1000");
  }
};

struct UndergrowthRecipe {
  double shrub_density_per_m2 = 0.05;
  double shrub_height_m = 0.75;
  int shrub_leaves = 110;
  double fern_density_per_m2 = 0.10;
  double fern_length_m = 0.55;
  double log_density_per_m2 = 0.012;
  double log_length_m = 4.0;
  double log_radius_m = 0.13;

  void fields(auto& f) {
    f("shrub_density_per_m2", shrub_density_per_m2, "shrubs: stems, twigs and leaves");
    f("shrub_height_m", shrub_height_m, "their mean height");
    f("shrub_leaves", shrub_leaves, "leaf quads of a shrub of mean height");
    f("fern_density_per_m2", fern_density_per_m2, "ferns: fronds only, nothing to collide with");
    f("fern_length_m", fern_length_m, "mean length of a frond");
    f("log_density_per_m2", log_density_per_m2,
      "fallen logs; those that would lie across a trunk are left out");
    f("log_length_m", log_length_m, "their mean length");
    f("log_radius_m", log_radius_m, "their mean radius");
    f.check(shrub_density_per_m2 >= 0 && shrub_density_per_m2 <= 2,
            "0 <= shrub_density_per_m2 <= 2");
    f.check(shrub_height_m > 0 && shrub_height_m <= 3, "0 < shrub_height_m <= 3");
    f.check(shrub_leaves >= 0 && shrub_leaves <= 5000, "0 <= shrub_leaves <= 5000");
    f.check(fern_density_per_m2 >= 0 && fern_density_per_m2 <= 5, "0 <= fern_density_per_m2 <= 5");
    f.check(fern_length_m > 0 && fern_length_m <= 2, "0 < fern_length_m <= 2");
    f.check(log_density_per_m2 >= 0 && log_density_per_m2 <= 0.2, "0 <= log_density_per_m2 <= 0.2");
    f.check(log_length_m > 0.2 && log_length_m <= 20, "0.2 < log_length_m <= 20");
    f.check(log_radius_m > 0.02 && log_radius_m <= 0.5, "0.02 < log_radius_m <= 0.5");
  }
};

/// A broad-leaved forest on rolling ground, the start pad at its middle, heading along x.
struct ForestRecipe {
  Vec2 size_m = {60, 50};
  double edge_m = 3;
  double tree_density_per_m2 = 0.10;
  double min_spacing_m = 1.6;
  double relief_m = 0.5;
  double relief_wavelength_m = 14;
  double roughness_m = 0.02;
  double ground_spacing_m = 0.5;
  double start_radius_m = 2.0;
  TreeRecipe tree;
  UndergrowthRecipe undergrowth;
  std::vector<Clearing> clearings;
  std::vector<Corridor> corridors;

  static constexpr double kMostTriangles = 1e7;  ///< about 2 GB with the tree for the rays
  /// Roughly, and rather too many: nothing is taken off for what is cleared.
  /// @param flown as that of build()
  [[nodiscard]] double expected_triangles(
      const std::optional<Eigen::AlignedBox2d>& flown = {}) const;
  /// Trees and shrubs further than this from where a mission leads, and than twice this from the
  /// start, are coarse, m: no nearer than the maps' rays reach from there.
  static constexpr double kDetail = 20;
  /// Where they are not: within those distances, or everywhere without `flown`.
  [[nodiscard]] Eigen::AlignedBox2d detailed(const std::optional<Eigen::AlignedBox2d>& flown) const;
  /// The ground, along x and y from the start, m.
  [[nodiscard]] Eigen::AlignedBox2d extent() const { return {-0.5 * size_m, 0.5 * size_m}; }

  void fields(auto& f) {
    f("size_m", size_m, "extent of the ground along x and y, the start in its middle");
    f("edge_m", edge_m, "margin of the ground that bears no tree");
    f("tree_density_per_m2", tree_density_per_m2, "trees on the wooded ground");
    f("min_spacing_m", min_spacing_m, "no two trees stand closer (Poisson disc)");
    f("relief_m", relief_m, "amplitude of the ground's swell: sqrt 2 times its RMS height");
    f("relief_wavelength_m", relief_wavelength_m, "typical length of the swell");
    f("roughness_m", roughness_m, "amplitude of the bumps on it, 1-3 m long");
    f("ground_spacing_m", ground_spacing_m, "distance of the height field's samples");
    f("start_radius_m", start_radius_m, "level ground around the start, free up to the sky");
    f("tree", tree, "one tree");
    f("undergrowth", undergrowth, "what grows and lies between the trees");
    f("clearings", clearings, "treeless discs");
    f("corridors", corridors, "treeless ways");
    f.check(size_m.minCoeff() >= 10 && size_m.maxCoeff() <= 500, "10 <= size_m <= 500");
    f.check(edge_m >= 1 && 2 * edge_m < size_m.minCoeff(), "1 <= edge_m < half the least size_m");
    f.check(tree_density_per_m2 >= 0, "tree_density_per_m2 >= 0");
    f.check(min_spacing_m >= 0.2 && min_spacing_m <= 100, "0.2 <= min_spacing_m <= 100");
    f.check(can_pack(tree_density_per_m2, min_spacing_m),
            "tree_density_per_m2 <= 0.637 / min_spacing_m^2 (denser cannot be packed)");
    f.check(relief_m >= 0 && relief_m <= 5, "0 <= relief_m <= 5");
    f.check(relief_wavelength_m >= 2, "relief_wavelength_m >= 2");
    f.check(roughness_m >= 0 && roughness_m <= 0.2, "0 <= roughness_m <= 0.2");
    f.check(ground_spacing_m >= 0.05 && ground_spacing_m <= 2, "0.05 <= ground_spacing_m <= 2");
    f.check(start_radius_m >= 0.5, "start_radius_m >= 0.5");
    f.check(clearings.size() <= 1000, "at most 1000 clearings");
    f.check(corridors.size() <= 100, "at most 100 corridors");
    f.check(size_m.prod() <= 4e6 * ground_spacing_m * ground_spacing_m,
            "size_m / ground_spacing_m at most 4e6 samples of the ground in all");
    // Of a mission that stays at the start; build() knows where it leads.
    const Eigen::AlignedBox2d start(Vec2(0, 0));
    f.check(expected_triangles(start) <= kMostTriangles,
            "at most 1e7 triangles (expected of size_m, tree_density_per_m2, tree.leaves, "
            "tree.branches, tree.twigs_per_branch, undergrowth.shrub_density_per_m2, "
            "undergrowth.shrub_leaves, undergrowth.fern_density_per_m2, "
            "undergrowth.log_density_per_m2, ground_spacing_m)");
  }
};

/// A pine plantation past its first thinnings: 0.18 stems/m^2 of 0.22 m mean diameter, 19.4 m high
/// (a surveyed stand), straight and bare but for dead branches up to its high, narrow crowns, on
/// ground with little growth.
ForestRecipe pine_stand();

/// W's origin is at the start's x and y. World::bounds spans the ground and reaches the highest
/// leaf.
/// @param flown where the mission leads, along x and y from the start, m: what is far from it is
/// coarse. Without it nothing is.
/// @throws ConfigError (without FILE:LINE) if more than kMostTriangles are to be expected.
World build(const ForestRecipe& recipe, std::uint64_t seed,
            const std::optional<Eigen::AlignedBox2d>& flown = {});

/// Where a tree stands, x and y; the index names its random stream, so that it grows the same
/// whichever others are cleared away.
struct TreeSite {
  Vec2 position;
  std::uint64_t index;
};

/// Poisson-disc points less those on cleared ground.
std::vector<TreeSite> place_trees(const ForestRecipe& recipe, std::uint64_t seed);

}  // namespace arex::worlds
