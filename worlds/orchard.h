#pragma once

#include <algorithm>
#include <vector>

#include "worlds/tree.h"
#include "worlds/world.h"

namespace arex::worlds {

/// A slender spindle on dwarfing rootstock: pruned to a narrow wall of leaves along the row, three
/// to three and a half metres high (Robinson, The evolution towards more competitive apple orchard
/// systems, Acta Horticulturae 772, 2008).
inline TreeRecipe slender_spindle() {
  TreeRecipe tree;
  tree.trunk_radius_m = 0.035;
  tree.trunk_radius_spread_m = 0.006;
  tree.trunk_radius_min_m = 0.02;
  tree.trunk_radius_max_m = 0.06;
  tree.height_m = 3.3;
  tree.height_spread_m = 0.2;
  tree.root_flare = 0.2;
  tree.lean_rad = 0.02;
  tree.bend_m = 0.03;
  tree.crown_base_fraction = 0.2;
  tree.crown_radius_m = 0.7;
  tree.branches = 14;
  tree.twigs_per_branch = 2;
  tree.low_branches = 0;
  tree.twig_diameter_m = 0.006;
  tree.leaves = 350;
  tree.leaf_length_m = 0.11;
  return tree;
}

/// Rows of trees along x on a trellis of posts and wires, grass alleys between them, a headland
/// round them. The start pad is in the middle of an alley, heading along it.
struct OrchardRecipe {
  Vec2 size_m = {60, 50};
  double headland_m = 5;
  double row_spacing_m = 3.8;
  double tree_spacing_m = 1.2;
  double missing_share = 0.03;
  double post_spacing_m = 8;
  double post_radius_m = 0.05;
  double post_height_m = 3.0;
  std::vector<double> wire_heights_m = {0.7, 1.4, 2.1, 2.8};
  double wire_diameter_m = 0.0025;
  double grass_density_per_m2 = 1.0;
  double grass_length_m = 0.15;
  double start_radius_m = 1.0;
  TreeRecipe tree = slender_spindle();

  static constexpr double kMostTriangles = 1e7;
  [[nodiscard]] int rows() const;  ///< an even number: an alley lies in the middle
  [[nodiscard]] double row_length_m() const { return size_m.x() - 2 * headland_m; }
  [[nodiscard]] double row_y_m(int row) const;
  [[nodiscard]] double expected_triangles() const;
  [[nodiscard]] Eigen::AlignedBox2d extent() const { return {-0.5 * size_m, 0.5 * size_m}; }

  void fields(auto& f) {
    f("size_m", size_m, "extent of the ground along the rows and across, the start in its middle");
    f("headland_m", headland_m, "grass between the rows' ends and the border, to turn on");
    f("row_spacing_m", row_spacing_m, "between the trunks of neighbouring rows");
    f("tree_spacing_m", tree_spacing_m, "between the trunks in a row");
    f("missing_share", missing_share, "of the trees, where one has died");
    f("post_spacing_m", post_spacing_m, "of the trellis, in a row");
    f("post_radius_m", post_radius_m, "of a post");
    f("post_height_m", post_height_m, "above the ground");
    f("wire_heights_m", wire_heights_m, "of the trellis, above the ground");
    f("wire_diameter_m", wire_diameter_m, "of a wire");
    f("grass_density_per_m2", grass_density_per_m2, "tufts in alleys and headland, not felt");
    f("grass_length_m", grass_length_m, "mean length of a blade");
    f("start_radius_m", start_radius_m, "free around the start, up to the sky");
    f("tree", tree, "one tree");
    f.check(size_m.minCoeff() >= 10 && size_m.maxCoeff() <= 500, "10 <= size_m <= 500");
    f.check(headland_m >= 1 && 2 * headland_m + 2 < size_m.minCoeff(),
            "1 <= headland_m < half the least size_m less 1");
    f.check(row_spacing_m >= 1 && row_spacing_m <= 20, "1 <= row_spacing_m <= 20");
    f.check(tree_spacing_m >= 0.3 && tree_spacing_m <= 20, "0.3 <= tree_spacing_m <= 20");
    f.check(missing_share >= 0 && missing_share <= 1, "0 <= missing_share <= 1");
    f.check(post_spacing_m >= 1 && post_spacing_m <= 50, "1 <= post_spacing_m <= 50");
    f.check(post_radius_m >= 0.01 && post_radius_m <= 0.3, "0.01 <= post_radius_m <= 0.3");
    f.check(post_height_m > 0 && post_height_m <= 10, "0 < post_height_m <= 10");
    f.check(wire_heights_m.size() <= 20 &&
                std::all_of(wire_heights_m.begin(), wire_heights_m.end(),
                            [&](double h) { return h > 0 && h <= post_height_m; }),
            "at most 20 wire_heights_m, above 0 and up to post_height_m");
    f.check(wire_diameter_m >= 0.001 && wire_diameter_m <= 0.05,
            "0.001 <= wire_diameter_m <= 0.05");
    f.check(grass_density_per_m2 >= 0 && grass_density_per_m2 <= 20,
            "0 <= grass_density_per_m2 <= 20");
    f.check(grass_length_m > 0.02 && grass_length_m <= 1, "0.02 < grass_length_m <= 1");
    f.check(start_radius_m >= 0.5 && start_radius_m < row_spacing_m / 2,
            "0.5 <= start_radius_m < row_spacing_m / 2");
    f.check(
        expected_triangles() <= kMostTriangles,
        "at most 1e7 triangles (expected of size_m, row_spacing_m, tree_spacing_m, tree.leaves, "
        "tree.branches, tree.twigs_per_branch, grass_density_per_m2)");
  }
};

/// W's origin is at the start.
World build(const OrchardRecipe& recipe, std::uint64_t seed);

}  // namespace arex::worlds
