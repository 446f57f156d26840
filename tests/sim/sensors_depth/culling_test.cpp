#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <set>

#include "depth_scenes.h"
#include "sensors/d430_stereo.h"
#include "sensors/renderer_culling.h"

namespace arex::sim {
namespace {

bool pixel_sees(const PinholeCamera& camera, const Pose& X_CW, const Vec3& p_W, double far_m) {
  const Vec3 p = X_CW * p_W;
  if (p.z() <= 0 || p.z() > far_m) return false;
  const double u = camera.cx + camera.fx * p.x() / p.z(), v = camera.cy + camera.fy * p.y() / p.z();
  return u >= -0.5 && u <= camera.width - 0.5 && v >= -0.5 && v <= camera.height - 0.5;
}

TEST(ViewVolume, TouchesEveryBoxThatHoldsAPointInView) {
  const PinholeCamera camera = D430Config{}.camera();
  RandomStream random(1, "boxes");
  int inside = 0, rejected = 0;
  for (int i = 0; i < 5000; ++i) {
    const Pose X_WC{so3::Exp(3 * random.normal3()), 5 * random.normal3()};
    const ViewVolume view(camera, X_WC, 12);
    const Vec3 low = 8 * random.normal3();
    const Eigen::AlignedBox3f box(
        low.cast<float>(),
        (low + Vec3(random.uniform(), random.uniform(), random.uniform()) * 4).cast<float>());
    bool seen = false;
    for (int k = 0; k < 50; ++k) {
      const Vec3 t(random.uniform(), random.uniform(), random.uniform());
      const Vec3 p = box.min().cast<double>() + t.cwiseProduct(box.sizes().cast<double>());
      seen = seen || pixel_sees(camera, X_WC.inverse(), p, 12);
    }
    inside += seen ? 1 : 0;
    rejected += view.touches(box) ? 0 : 1;
    if (seen) {
      EXPECT_TRUE(view.touches(box));
    }
  }
  EXPECT_GT(inside, 300);     // the loop has tested something,
  EXPECT_GT(rejected, 2500);  // and culling culls
}

TEST(ClusterChunk, KeepsEveryTriangleOnceWithinItsClustersBounds) {
  const worlds::World world = small_forest(3);
  const std::vector<std::int8_t> winding = outward_winding(world.mesh);
  std::set<std::uint32_t> sources;
  for (const worlds::Chunk& chunk : world.mesh.chunks) {
    const ClusteredChunk clustered = cluster_chunk(world.mesh, chunk, winding, 64);
    ASSERT_EQ(clustered.triangles.size(), chunk.triangle_count);
    std::uint32_t next = 0;
    for (const worlds::Chunk& cluster : clustered.clusters) {
      EXPECT_EQ(cluster.first_triangle, next);
      EXPECT_LE(cluster.triangle_count, 64U);
      next += cluster.triangle_count;
      for (std::uint32_t t = cluster.first_triangle; t < next; ++t) {
        EXPECT_TRUE(sources.insert(clustered.source[t]).second);
        const auto& source = world.mesh.triangles[clustered.source[t]];
        EXPECT_TRUE(
            std::is_permutation(source.begin(), source.end(), clustered.triangles[t].begin()));
        for (const std::uint32_t vertex : source) {
          EXPECT_TRUE(cluster.bounds.contains(world.mesh.vertices[vertex]));
        }
      }
    }
    EXPECT_EQ(next, chunk.triangle_count);
  }
  EXPECT_EQ(sources.size(), world.mesh.triangles.size());
}

TEST(OutwardWinding, TellsSolidsFromSheetsWhateverTheirWinding) {
  worlds::MeshBuilder builder;
  const auto object = builder.add_object(worlds::SurfaceClass::kTrunk, 0.4);
  const Vec3 centre(3, -2, 1);
  const Pose X_WP{so3::Exp({0.3, 0.2, 0.9}), centre};
  builder.add_box(object, X_WP, {1, 0.5, 0.25});
  builder.add_cylinder(object, {X_WP.R, centre + Vec3(5, 0, 0)}, 0.3, 1, 12);
  builder.add_quad(object, {0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0});
  worlds::Mesh mesh = builder.finish().mesh;
  for (std::size_t t = 0; t < mesh.triangles.size(); t += 3) {
    std::swap(mesh.triangles[t][0], mesh.triangles[t][2]);  // winding carries no meaning
  }
  const std::vector<std::int8_t> winding = outward_winding(mesh);
  int solid = 0;
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    const Vec3 a = mesh.vertices[mesh.triangles[t][0]].cast<double>();
    const Vec3 b = mesh.vertices[mesh.triangles[t][1]].cast<double>();
    const Vec3 c = mesh.vertices[mesh.triangles[t][2]].cast<double>();
    const Vec3 inside = a.x() > 5.5 ? Vec3(centre + Vec3(5, 0, 0)) : centre;
    const double outward = (b - a).cross(c - a).dot(a - inside);
    const bool sheet = std::abs(a.z()) + std::abs(b.z()) + std::abs(c.z()) < 1e-9;
    EXPECT_EQ(winding[t], sheet ? 0 : outward > 0 ? 1 : -1);
    solid += winding[t] != 0 ? 1 : 0;
  }
  EXPECT_EQ(solid, 12 + 24 + 20);
}

TEST(VisibleChunks, ComeNearestFirst) {
  const worlds::World world = small_forest(4);
  const Pose X_WC = Pose{Mat3::Identity(), Vec3(0, 0, 2)} * forward_camera();
  const ViewVolume view(D430Config{}.camera(), X_WC, 12);
  const auto visible = visible_chunks(world.mesh.chunks, view);
  ASSERT_GT(visible.size(), 3U);
  EXPECT_LT(visible.size(), world.mesh.chunks.size());
  EXPECT_TRUE(std::is_sorted(visible.begin(), visible.end(), [&](auto a, auto b) {
    return view.nearest_depth(world.mesh.chunks[a].bounds) <
           view.nearest_depth(world.mesh.chunks[b].bounds);
  }));
}

}  // namespace
}  // namespace arex::sim
