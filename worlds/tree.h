#pragma once

#include <cstdint>
#include <functional>

#include "math/random.h"
#include "worlds/mesh_builder.h"

namespace arex::worlds {

/// How a tree grows. Means are over trees; a broad-leaved stand of pole to timber size.
/// All figures are estimates for a managed subtropical campus forest unless a source is given.
struct TreeRecipe {
  double trunk_radius_m = 0.11;
  double trunk_radius_spread_m = 0.035;
  double trunk_radius_min_m = 0.05;
  double trunk_radius_max_m = 0.28;
  double height_m = 10.0;
  double height_spread_m = 1.5;
  double taper_exponent = 0.8;
  double root_flare = 0.5;
  double lean_rad = 0.04;
  double bend_m = 0.12;
  double crown_base_fraction = 0.36;
  double crown_radius_m = 2.5;
  int branches = 13;
  int twigs_per_branch = 3;
  double low_branches = 1.6;
  double low_branch_low_m = 0.8;
  double low_branch_high_m = 3.0;
  double low_branch_length_m = 1.1;
  double twig_diameter_m = 0.01;
  int leaves = 700;
  double leaf_length_m = 0.23;

  void fields(auto& f) {
    f("trunk_radius_m", trunk_radius_m, "mean radius at breast height (1.3 m)");
    f("trunk_radius_spread_m", trunk_radius_spread_m, "standard deviation of that radius");
    f("trunk_radius_min_m", trunk_radius_min_m, "thinnest trunk at breast height");
    f("trunk_radius_max_m", trunk_radius_max_m, "thickest trunk at breast height");
    f("height_m", height_m, "mean height of a tree of mean radius");
    f("height_spread_m", height_spread_m, "standard deviation of the height at a given radius");
    f("taper_exponent", taper_exponent, "radius ~ (distance from the top)^this; 1 is a cone");
    f("root_flare", root_flare, "share by which the radius grows at the ground");
    f("lean_rad", lean_rad, "standard deviation of the trunk's lean, each axis");
    f("bend_m", bend_m, "standard deviation of the sideways wander of the trunk, each axis");
    f("crown_base_fraction", crown_base_fraction, "where the crown begins, share of the height");
    f("crown_radius_m", crown_radius_m, "reach of the longest branches of a tree of mean height");
    f("branches", branches, "branches of the crown");
    f("twigs_per_branch", twigs_per_branch, "side branches on each of them");
    f("low_branches", low_branches, "mean number of bare branches below the crown");
    f("low_branch_low_m", low_branch_low_m, "lowest height of those above the ground");
    f("low_branch_high_m", low_branch_high_m, "greatest height of those above the ground");
    f("low_branch_length_m", low_branch_length_m, "their mean length");
    f("twig_diameter_m", twig_diameter_m, "diameter at which every branch ends");
    f("leaves", leaves, "leaf quads of a tree of mean height");
    f("leaf_length_m", leaf_length_m, "mean length of a leaf spray");
    f.check(trunk_radius_min_m > 0, "trunk_radius_min_m > 0");
    f.check(trunk_radius_min_m <= trunk_radius_m && trunk_radius_m <= trunk_radius_max_m,
            "trunk_radius_min_m <= trunk_radius_m <= trunk_radius_max_m");
    f.check(trunk_radius_spread_m >= 0, "trunk_radius_spread_m >= 0");
    f.check(trunk_radius_max_m <= 3, "trunk_radius_max_m <= 3");
    f.check(height_m >= 3 && height_m <= 60, "3 <= height_m <= 60");
    f.check(height_spread_m >= 0 && height_spread_m <= 20, "0 <= height_spread_m <= 20");
    f.check(taper_exponent > 0 && taper_exponent <= 2, "0 < taper_exponent <= 2");
    f.check(root_flare >= 0 && root_flare <= 2, "0 <= root_flare <= 2");
    f.check(lean_rad >= 0 && lean_rad <= 0.3, "0 <= lean_rad <= 0.3");
    f.check(bend_m >= 0 && bend_m <= 1, "0 <= bend_m <= 1");
    f.check(crown_base_fraction > 0 && crown_base_fraction < 0.9, "0 < crown_base_fraction < 0.9");
    f.check(crown_radius_m > 0 && crown_radius_m <= 10, "0 < crown_radius_m <= 10");
    f.check(branches >= 0 && branches <= 200, "0 <= branches <= 200");
    f.check(twigs_per_branch >= 0 && twigs_per_branch <= 50, "0 <= twigs_per_branch <= 50");
    f.check(low_branches >= 0 && low_branches <= 30, "0 <= low_branches <= 30");
    f.check(low_branch_low_m > 0 && low_branch_low_m <= low_branch_high_m,
            "0 < low_branch_low_m <= low_branch_high_m");
    f.check(low_branch_length_m > 0 && low_branch_length_m <= 10, "0 < low_branch_length_m <= 10");
    f.check(twig_diameter_m > 0 && twig_diameter_m <= 2 * trunk_radius_min_m,
            "0 < twig_diameter_m <= 2 trunk_radius_min_m");
    f.check(leaves >= 0 && leaves <= 20000, "0 <= leaves <= 20000");
    f.check(leaf_length_m > 0 && leaf_length_m <= 1, "0 < leaf_length_m <= 1");
  }
};

/// Whether wood and leaves may stand at a point of W.
using Allowed = std::function<bool(const Vec3&)>;

/// How closely a plant is drawn. A coarse one stands where the full one would, as thick and as
/// high, with as much surface of leaves, in a sixth of its triangles: for what is only ever seen
/// from afar.
enum class Detail : std::uint8_t { kFull, kCoarse };
/// So many leaves of a full plant are one of a coarse plant, of the same area.
inline constexpr double kLeavesMerged = 6;

/// Grows one tree at `root` (on the ground): trunk, branches and leaves are three objects. A branch
/// that would enter a forbidden place is left out with all that it bears. Every piece of wood below
/// 4 m above the root has collision capsules, above that the thicker ones only. A coarse tree's
/// branches are straight, and its twigs only bear its leaves.
void add_tree(MeshBuilder& builder, const TreeRecipe& recipe, const Vec3& root,
              const Allowed& allowed, RandomStream random, Detail detail = Detail::kFull);

}  // namespace arex::worlds
