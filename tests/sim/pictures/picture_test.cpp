#include "pictures/picture.h"

#include <gtest/gtest.h>

#include <array>
#include <filesystem>
#include <fstream>

#include "sim/sensors_depth/depth_scenes.h"

namespace arex::sim {
namespace {

std::array<int, 3> pixel(const Picture& picture, int u, int v) {
  const auto i = 3 * (static_cast<std::size_t>(v) * static_cast<std::size_t>(picture.width) +
                      static_cast<std::size_t>(u));
  return {picture.rgb[i], picture.rgb[i + 1], picture.rgb[i + 2]};
}

PictureOptions small_picture() {
  PictureOptions options;
  options.width = 160;
  options.height = 120;
  return options;
}

TEST(LookAt, PutsTheTargetOnTheOpticalAxisAndTheWorldUpright) {
  const Pose X_WC = look_at({1, 2, 3}, {4, -2, 1});
  const Vec3 target = X_WC.inverse() * Vec3(4, -2, 1);
  EXPECT_NEAR(target.head<2>().norm(), 0, 1e-12);
  EXPECT_GT(target.z(), 0);
  EXPECT_NEAR((X_WC.R * X_WC.R.transpose() - Mat3::Identity()).norm(), 0, 1e-12);
  EXPECT_NEAR(X_WC.R.determinant(), 1, 1e-12);
  EXPECT_NEAR(X_WC.R(2, 0), 0, 1e-12);  // x stays level
  EXPECT_LT(X_WC.R(2, 1), 0);           // y points down
}

TEST(Picture, ShowsSkyAboveGroundBelowAndThePathWhereItRuns) {
  worlds::MeshBuilder builder;
  const auto ground = builder.add_object(worlds::SurfaceClass::kGround, 0.3);
  worlds::HeightField terrain;
  terrain.origin = Vec2(-20, -20);
  terrain.spacing_m = 1;
  terrain.columns = terrain.rows = 41;
  terrain.height_m.assign(41 * 41, 0.0F);
  builder.add_height_field(ground, terrain);
  const worlds::World world = builder.finish();
  PictureRenderer renderer(world);
  const Pose X_WC = look_at({-5, 0, 1}, {0, 0, 1});
  const Picture bare = renderer.render(X_WC, small_picture());
  const auto [sky_r, sky_g, sky_b] = pixel(bare, 80, 10);
  EXPECT_GT(sky_b, sky_r);
  const auto [ground_r, ground_g, ground_b] = pixel(bare, 80, 110);
  EXPECT_GT(ground_g, ground_b);

  PictureOverlay overlay;
  overlay.paths.push_back({{Vec3(0, -1, 1), Vec3(0, 1, 1)}, Vec3(0.9, 0.0, 0.0), 0.2});
  overlay.vehicles.push_back({Mat3::Identity(), Vec3(0, 0, 1.5)});
  const Picture drawn = renderer.render(X_WC, small_picture(), overlay);
  const auto [r, g, b] = pixel(drawn, 80, 60);
  EXPECT_GT(r, 2 * g);
  EXPECT_GT(r, 2 * b);
  EXPECT_EQ(pixel(bare, 80, 10), pixel(drawn, 80, 10));
  EXPECT_EQ(renderer.render(X_WC, small_picture()).rgb, bare.rgb);
  // The world of a view that stands still is drawn once; nobody sees that.
  EXPECT_EQ(PictureRenderer(world).render(X_WC, small_picture(), overlay).rgb, drawn.rgb);
  PictureOverlay buried;
  buried.paths.push_back({{Vec3(0, -1, -1), Vec3(0, 1, -1)}, Vec3(0.9, 0.0, 0.0), 0.2});
  EXPECT_EQ(renderer.render(X_WC, small_picture(), buried).rgb, bare.rgb);
  EXPECT_NE(renderer.render(look_at({-5, 0, 2}, {0, 0, 1}), small_picture()).rgb, bare.rgb);
}

TEST(Picture, LooksUnderACeilingThatIsCutAway) {
  worlds::MeshBuilder builder;
  const auto ceiling = builder.add_object(worlds::SurfaceClass::kCeiling, 0.3);
  builder.add_box(ceiling, {Mat3::Identity(), Vec3(0, 0, 3)}, {10, 10, 0.1});
  const auto car = builder.add_object(worlds::SurfaceClass::kFloor, 0.3);
  builder.add_box(car, {Mat3::Identity(), Vec3(0, 0, 0)}, {10, 10, 0.1});
  PictureRenderer renderer(builder.finish());
  const Pose above = look_at({0, -1, 12}, {0, 0, 0});
  PictureOptions cut = small_picture();
  cut.cut_above_m = 2;
  const Picture closed = renderer.render(above, small_picture());
  const Picture open = renderer.render(above, cut);
  EXPECT_NE(pixel(closed, 80, 60), pixel(open, 80, 60));
  EXPECT_EQ(renderer.render(above, small_picture()).rgb, closed.rgb);
}

// A mine of 330 m is seen whole from 520 m above.
TEST(Picture, ShowsAWholeWorldFromAsFarAsTheHazeLetsItBeSeen) {
  worlds::MeshBuilder builder;
  const auto ground = builder.add_object(worlds::SurfaceClass::kGround, 0.3);
  builder.add_box(ground, Pose(), {400, 400, 0.1});
  PictureRenderer renderer(builder.finish());
  PictureOptions clear = small_picture();
  clear.visibility_m = 20000;
  const auto [near_r, near_g, near_b] =
      pixel(renderer.render(look_at({0, -1, 200}, {0, 0, 0}), clear), 80, 60);
  const auto [far_r, far_g, far_b] =
      pixel(renderer.render(look_at({0, -1, 900}, {0, 0, 0}), clear), 80, 60);
  EXPECT_GT(near_g, near_b);
  EXPECT_GT(far_g, far_b);
}

TEST(Picture, IsSavedAsPng) {
  Picture picture{3, 2, {}};
  picture.rgb.assign(18, 200);
  const auto file = std::filesystem::temp_directory_path() / "arex_picture_test.png";
  save_png(picture, file);
  std::ifstream in(file, std::ios::binary);
  std::array<char, 24> header{};
  in.read(header.data(), header.size());
  EXPECT_EQ(std::string(header.data() + 1, 3), "PNG");
  EXPECT_EQ(header[19], 3);  // width, big endian
  EXPECT_EQ(header[23], 2);  // height
  std::filesystem::remove(file);
  EXPECT_THROW(save_png(picture, "/nonexistent/directory/file.png"), std::runtime_error);
}

}  // namespace
}  // namespace arex::sim
