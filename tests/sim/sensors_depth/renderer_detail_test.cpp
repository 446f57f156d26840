#include "sensors/renderer_detail.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <numbers>
#include <set>
#include <utility>

#include "depth_scenes.h"
#include "sensors/d430_stereo.h"
#include "sensors/renderer.h"
#include "sensors/renderer_culling.h"
#include "worlds/mesh_builder.h"

namespace arex::sim {
namespace {

using worlds::SurfaceClass;

/// Of samples half as far apart as the camera's pixels, as the infrared imager takes them.
PinholeCamera fine_camera() {
  PinholeCamera camera = D430Config{}.camera();
  camera.width *= 2;
  camera.height *= 2;
  camera.fx *= 2;
  camera.fy *= 2;
  camera.cx = 2 * camera.cx + 0.5;
  camera.cy = 2 * camera.cy + 0.5;
  return camera;
}

const PinholeCamera kCamera = fine_camera();

/// 861 upright leaves that face the start, `side` wide, about 0.5 m apart, at x; none lies across
/// the border of two chunks.
void add_sheet_of_leaves(worlds::MeshBuilder& builder, double x, double side) {
  const auto object = builder.add_object(SurfaceClass::kLeaf, 0.5);
  const Vec3 across(0, side / 2, 0), up(0, 0, side / 2);
  RandomStream random(7, "leaves");
  for (int y = -20; y <= 20; ++y) {
    for (int z = 0; z <= 20; ++z) {
      const Vec3 middle(x, 0.5 * y + 0.25 + random.uniform(-0.1, 0.1),
                        0.5 * z + 0.5 + random.uniform(-0.1, 0.1));
      builder.add_quad(object, middle - across - up, middle + across - up, middle + across + up,
                       middle - across + up);
    }
  }
}

struct Sight {
  std::set<std::uint32_t> leaves;  ///< by the first of their triangles
  std::size_t pixels = 0, drawn = 0;
};

Sight look(const worlds::World& world, const Vec3& eye, double yaw,
           const RendererOptions& options) {
  Renderer renderer(world, kCamera, options);
  std::vector<float> inverse_depth;
  std::vector<std::uint32_t> triangles;
  renderer.render_triangles(Pose{so3::from_yaw(yaw), eye} * forward_camera(), inverse_depth,
                            triangles);
  Sight sight;
  sight.drawn = renderer.last_frame().triangles;
  for (const std::uint32_t t : triangles) {
    if (t == Renderer::kNoTriangle) continue;
    sight.leaves.insert(t / 2);
    ++sight.pixels;
  }
  return sight;
}

TEST(DetailOfMesh, KnowsLeavesAndHowWideSolidsLook) {
  worlds::MeshBuilder builder;
  const auto branch = builder.add_object(SurfaceClass::kBranch, 0.4);
  const auto wall = builder.add_object(SurfaceClass::kWall, 0.4);
  const auto leaf = builder.add_object(SurfaceClass::kLeaf, 0.4);
  const Pose X_WP{so3::Exp({0.3, 0.2, 0.9}), Vec3(1, 2, 3)};
  builder.add_cylinder(branch, X_WP, 0.01, 0.8, 24);
  builder.add_box(wall, X_WP, {1, 1, 0.01});  // thin, and wide to see from nearly everywhere
  builder.add_quad(leaf, {9, 0, 0}, {9.3, 0, 0}, {9.3, 0.3, 0}, {9, 0.3, 0});
  builder.add_triangle(leaf, {12, 0, 0}, {12.3, 0, 0}, {12.3, 0.3, 0});
  builder.add_quad(wall, {15, 0, 0}, {15.3, 0, 0}, {15.3, 0.3, 0}, {15, 0.3, 0});
  const worlds::World world = builder.finish();
  const DetailOfMesh detail(world, outward_winding(world.mesh));
  int leaves = 0;
  for (std::size_t t = 0; t < world.mesh.triangles.size(); ++t) {
    const Vec3f a = world.mesh.vertices[world.mesh.triangles[t][0]];
    const worlds::SurfaceClass of = world.objects[world.mesh.object_of_triangle[t]].surface_class;
    leaves += detail.leaf[t] != DetailOfMesh::Part::kNone ? 1 : 0;
    if (of == SurfaceClass::kBranch) {
      EXPECT_NEAR(detail.width_m[t], 0.02F, 0.0006F);  // its two ends count, too
    } else if (a.x() < 8) {
      EXPECT_GT(detail.width_m[t], 0.5F);
    } else if (a.x() < 10) {
      EXPECT_NEAR(detail.width_m[t], 0.3F, 1e-5F);
      EXPECT_NE(detail.leaf[t], DetailOfMesh::Part::kNone);
    } else {
      EXPECT_EQ(detail.width_m[t], DetailOfMesh::kAlways);  // half a leaf, and no foliage
    }
  }
  EXPECT_EQ(leaves, 2);
}

TEST(RendererDetail, ChangesNothingThatIsLargeEnough) {
  RandomStream random(3, "poses");
  for (std::uint64_t seed = 1; seed <= 3; ++seed) {
    const worlds::World world = small_forest(seed);
    const RendererOptions all{.far_m = 45};
    const RendererOptions less{.far_m = 45, .least_leaf_px = 8, .least_width_px = 0.7};
    // The smallest leaf and the thinnest twig are as large as that at this distance, 1/m.
    const DetailOfMesh detail(world, outward_winding(world.mesh));
    double least_q = 0;
    for (std::size_t t = 0; t < detail.width_m.size(); ++t) {
      const bool leaf = detail.leaf[t] != DetailOfMesh::Part::kNone;
      const double least_px = leaf ? less.least_leaf_px : less.least_width_px;
      const auto width_m = static_cast<double>(detail.width_m[t]);
      least_q = std::max(least_q, least_px / (kCamera.fx * width_m));
    }
    Renderer whole(world, kCamera, all), coarse(world, kCamera, less);
    std::vector<float> expected, found;
    int near = 0, different = 0;
    const Pose X_WC = flying_pose(world, random) * forward_camera();
    whole.render_inverse_depth(X_WC, expected);
    coarse.render_inverse_depth(X_WC, found);
    for (std::size_t i = 0; i < expected.size(); ++i) {
      const bool is_near = static_cast<double>(expected[i]) > 1.5 * least_q;  // of a whole cluster
      different += expected[i] != found[i] ? 1 : 0;
      near += is_near ? 1 : 0;
      if (is_near) {
        EXPECT_EQ(expected[i], found[i]);
      }
    }
    EXPECT_GT(near, 1000);
    EXPECT_GT(different, 100);
    EXPECT_LT(coarse.last_frame().triangles, whole.last_frame().triangles);
  }
}

// As many pixels of fewer leaves, and from farther away none that was not there before.
TEST(RendererDetail, InHowManyStripsAPictureIsDrawnChangesNoBit) {
  const worlds::World world = small_forest(9);
  RendererOptions options{.far_m = 60, .least_leaf_px = 8, .least_width_px = 0.7};
  Renderer whole(world, kCamera, options);
  EXPECT_EQ(whole.strips(), 1U);
  for (const auto& [strips, align] : {std::pair{2, 16}, {3, 1}, {7, 16}, {4, 500}}) {
    options.strips = strips;
    options.strip_align_px = align;
    Renderer cut(world, kCamera, options);
    int column = 0;
    for (std::size_t i = 0; i < cut.strips(); ++i) {
      EXPECT_EQ(cut.columns(i).first, column);
      EXPECT_EQ(column % align, 0);
      column += cut.columns(i).count;
    }
    EXPECT_EQ(column, kCamera.width);
    EXPECT_LE(cut.strips(), static_cast<std::size_t>(strips));
    RandomStream random(9, "poses");
    for (int i = 0; i < 4; ++i) {
      const Pose X_WC = flying_pose(world, random) * forward_camera();
      std::vector<float> depth, depth_cut;
      std::vector<std::uint32_t> seen, seen_cut;
      whole.render_triangles(X_WC, depth, seen);
      cut.render_triangles(X_WC, depth_cut, seen_cut);
      ASSERT_EQ(depth, depth_cut) << strips;
      ASSERT_EQ(seen, seen_cut) << strips;
      EXPECT_LT(cut.last_frame().triangles, cut.strips() * whole.last_frame().triangles);
    }
  }
}

TEST(RendererDetail, MergedLeavesCoverWhatAllOfThemDoAndAreAmongThem) {
  worlds::MeshBuilder builder;
  add_sheet_of_leaves(builder, 49, 0.15);
  const worlds::World world = builder.finish();
  const RendererOptions all{.far_m = 200}, less{.far_m = 200, .least_leaf_px = 5};
  std::set<std::uint32_t> before;
  for (const double distance : {20.0, 30.0, 40.0, 45.0, 60.0, 80.0}) {
    const Vec3 eye(49 - distance, 0, 5);
    const Sight whole = look(world, eye, 0, all), merged = look(world, eye, 0, less);
    const double width_px = 0.15 * kCamera.fx / distance;
    if (width_px > 5 * 1.2) {
      EXPECT_EQ(merged.pixels, whole.pixels);
      EXPECT_EQ(merged.leaves, whole.leaves);
      continue;
    }
    // Of each of some dozens of clusters the last leaf is smaller; the sheet's border is farther
    // away than its middle, and large leaves in the same place hide each other.
    const double share =
        static_cast<double>(merged.leaves.size()) / static_cast<double>(whole.leaves.size());
    EXPECT_NEAR(share, (width_px / 5) * (width_px / 5), 0.08) << distance;
    EXPECT_NEAR(static_cast<double>(merged.pixels) / static_cast<double>(whole.pixels), 1, 0.03)
        << distance;
    EXPECT_TRUE(std::includes(whole.leaves.begin(), whole.leaves.end(), merged.leaves.begin(),
                              merged.leaves.end()));
    // The view is wider from afar: of the leaves seen before none comes anew.
    std::set<std::uint32_t> seen_before;
    const Sight nearer = look(world, eye + Vec3(5, 0, 0), 0, all);
    std::set_intersection(merged.leaves.begin(), merged.leaves.end(), nearer.leaves.begin(),
                          nearer.leaves.end(), std::inserter(seen_before, seen_before.end()));
    const Sight nearer_merged = look(world, eye + Vec3(5, 0, 0), 0, less);
    EXPECT_TRUE(std::includes(nearer_merged.leaves.begin(), nearer_merged.leaves.end(),
                              seen_before.begin(), seen_before.end()))
        << distance;
  }
}

TEST(RendererDetail, ATurningCameraSeesTheSameLeaves) {
  worlds::MeshBuilder builder;
  add_sheet_of_leaves(builder, 49, 0.15);
  const worlds::World world = builder.finish();
  const RendererOptions less{.far_m = 200, .least_leaf_px = 5};
  const Sight ahead = look(world, Vec3(0, 0, 5), 0, less);
  for (const double yaw : {-0.4, -0.2, 0.1, 0.3, 0.5}) {
    EXPECT_EQ(look(world, Vec3(0, 0, 5), yaw, less).drawn, ahead.drawn);
  }
}

TEST(RendererDetail, LeavesOutWhatIsThinnerThanAPartOfAPixel) {
  worlds::MeshBuilder builder;
  const auto object = builder.add_object(SurfaceClass::kBranch, 0.4);
  builder.add_cylinder(object, {Mat3::Identity(), Vec3(0, 0.01, 0)}, 0.02, 1, 12);
  builder.add_cylinder(object, {Mat3::Identity(), Vec3(0, 1, 0)}, 0.2, 1, 12);
  const worlds::World world = builder.finish();
  const RendererOptions less{.far_m = 200, .least_width_px = 0.6};
  const double limit_m = 0.04 * kCamera.fx / 0.6;
  for (const double share : {0.5, 0.9, 1.1, 1.5}) {
    const Sight sight = look(world, Vec3(-share * limit_m, 0, 0), 0, less);
    EXPECT_EQ(sight.drawn, share < 1 ? 88U : 44U) << share;
    EXPECT_GT(sight.pixels, 0U);
  }
}

}  // namespace
}  // namespace arex::sim
