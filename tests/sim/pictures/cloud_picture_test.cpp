#include "pictures/cloud_picture.h"

#include <gtest/gtest.h>

#include <array>

namespace arex::sim {
namespace {

using Colour = std::array<int, 3>;

Colour at(const RgbImage& image, int x, int y) {
  const auto i = 3 * (static_cast<std::size_t>(y) * static_cast<std::size_t>(image.width) +
                      static_cast<std::size_t>(x));
  return {image.rgb[i], image.rgb[i + 1], image.rgb[i + 2]};
}

/// From the origin along x, a vehicle far behind it.
CloudView ahead() {
  CloudView view;
  view.width = 200;
  view.height = 100;
  view.field_of_view_rad = std::numbers::pi / 2;  // focal length 100 px
  view.low_m = -1;
  view.high_m = 1;
  return view;
}
const VehicleMark kElsewhere{{Mat3::Identity(), {-50, 0, 0}}, 0.3};

std::size_t painted(const RgbImage& image, const Colour& paper) {
  std::size_t count = 0;
  for (int y = 0; y < image.height; ++y) {
    for (int x = 0; x < image.width; ++x) count += at(image, x, y) != paper;
  }
  return count;
}

TEST(CloudPicture, APointStandsWhereAPinholeHasItInTheColourOfItsHeight) {
  // y is to the left: 2 m left and 0.5 m up at 10 m are 20 px left and 5 px up of the middle.
  const std::vector<Vec3f> points{{10, 2, 0.5F}, {10, -3, -1}, {-5, 0, 0}};
  const RgbImage image = draw_points(points, ahead(), kElsewhere);
  const Colour paper = at(image, 0, 0);
  EXPECT_NE(at(image, 80, 45), paper);
  EXPECT_EQ(painted(image, paper), 8U);  // two dots of four pixels; what lies behind shows nowhere
  const Colour high = at(image, 80, 45), low = at(image, 130, 60);
  EXPECT_EQ(low, (Colour{0, 0, 255}));
  EXPECT_GT(high[0], 200);  // three quarters up: yellow to red
  EXPECT_EQ(high[2], 0);
}

TEST(CloudPicture, TheNearerPointHidesTheOtherWhateverTheOrder) {
  const std::vector<Vec3f> one{{10, 0, 0}, {5, 0, 0}};
  const std::vector<Vec3f> other{one[1], one[0]};
  CloudView view = ahead();
  view.eye_O = {0, 0, -0.25};
  view.target_O = {1, 0, -0.25};
  EXPECT_EQ(draw_points(one, view, kElsewhere).rgb, draw_points(other, view, kElsewhere).rgb);
}

TEST(CloudPicture, ACellIsABoxWithAShadedFront) {
  // Its front face at x = 4.95, 0.1 m wide, is 2 px wide; so are its sides hidden.
  const double edge = 1;
  const std::vector<Vec3f> cells{{4.5F, 0.5F, 0.5F}, {5.5F, 0.5F, 0.5F}};
  CloudView view = ahead();
  view.eye_O = {0, 0.5, 0.5};
  view.target_O = {1, 0.5, 0.5};
  const RgbImage image = draw_cells(cells, edge, view, kElsewhere);
  const Colour paper = at(image, 0, 0);
  // The front at 4 m is 25 px wide; the cell behind it shows nothing of itself.
  EXPECT_NEAR(static_cast<double>(painted(image, paper)), 25 * 25, 60);
  EXPECT_NE(at(image, 100, 50), paper);
  EXPECT_EQ(at(image, 100 - 14, 50), paper);
  const std::vector<Vec3f> front{cells[0]};
  EXPECT_EQ(draw_cells(front, edge, view, kElsewhere).rgb, image.rgb);
}

TEST(CloudPicture, TheVehicleShowsThroughWhatHidesIt) {
  CloudView view = ahead();
  const VehicleMark vehicle{{Mat3::Identity(), {8, 0, -0.5}}, 0.5};
  std::vector<Vec3f> wall;
  for (int y = -40; y < 40; ++y) {
    for (int z = -40; z < 40; ++z) {
      wall.emplace_back(4.05F, 0.1F * static_cast<float>(y) + 0.05F,
                        0.1F * static_cast<float>(z) + 0.05F);
    }
  }
  const RgbImage hidden = draw_cells(wall, 0.1, view, vehicle);
  const RgbImage alone = draw_cells(wall, 0.1, view, kElsewhere);
  EXPECT_NE(hidden.rgb, alone.rgb);
}

TEST(CloudPicture, FourOfOneSizeMakeOne) {
  const RgbImage part = draw_points({}, ahead(), kElsewhere);
  const RgbImage all = tile_of_four(part, part, part, part);
  EXPECT_EQ(all.width, 406);
  EXPECT_EQ(all.height, 206);
  EXPECT_EQ(all.rgb.size(), 3U * 406U * 206U);
  EXPECT_EQ(at(all, 203, 103), (Colour{250, 250, 250}));
  EXPECT_EQ(at(all, 405, 205), at(part, 0, 0));
  RgbImage small = part;
  small.width = 100;
  EXPECT_THROW(tile_of_four(part, small, part, part), std::invalid_argument);
}

}  // namespace
}  // namespace arex::sim
