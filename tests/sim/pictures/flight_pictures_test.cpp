#include "pictures/flight_pictures.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "run/scenario.h"

namespace arex::sim {
namespace {

using View = FlightPictures::View;

// A straight flight along +x at 1 m/s, 20 s, 1.5 m above the pad of the small forest.
class FlightPicturesTest : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    const Scenario scenario = load_scenario(AREX_SOURCE_DIR "/scenarios/forest_small.yaml", {}, {});
    world_ = std::make_unique<worlds::World>(scenario.build_world());
    X_WO_ = start_pose(*world_);
  }
  static void TearDownTestSuite() { world_.reset(); }

  static FlightPictures pictures(View view) {
    std::vector<TimedPose> truth;
    for (int i = 0; i <= 4000; ++i) {
      const double t = 0.005 * i;
      truth.push_back({t, {Mat3::Identity(), Vec3(t - 10, 0, 1.5)}});
    }
    PictureOptions options;
    options.width = 240;
    options.height = 136;
    return {*world_, X_WO_, truth, view, options};
  }

  static std::unique_ptr<worlds::World> world_;
  static Pose X_WO_;
};
std::unique_ptr<worlds::World> FlightPicturesTest::world_;
Pose FlightPicturesTest::X_WO_;

// Pixels that are as orange as a path and the vehicle's front rotors: red well above blue.
std::ptrdiff_t orange(const Picture& picture) {
  std::ptrdiff_t count = 0;
  for (std::size_t i = 0; i < picture.rgb.size(); i += 3) {
    if (picture.rgb[i] > picture.rgb[i + 2] + 90) ++count;
  }
  return count;
}

TEST_F(FlightPicturesTest, ThePathGrowsSeenFromAbove) {
  FlightPictures top = pictures(View::kTop);
  const Picture early = top.at(4, 4);
  const Picture late = top.at(18, 18);
  EXPECT_EQ(early.rgb.size(), 240U * 136U * 3U);
  EXPECT_GT(orange(early), 20);
  EXPECT_GT(orange(late), orange(early) + 60);
}

TEST_F(FlightPicturesTest, TheChaseViewKeepsTheVehicleInItsMiddle) {
  FlightPictures chase = pictures(View::kChase);
  for (const double t : {2.0, 6.0, 17.0}) {
    Picture whole = chase.at(t, 0);  // no path
    Picture middle{whole.width, whole.height, std::move(whole.rgb)};
    for (int v = 0; v < middle.height; ++v) {
      for (int u = 0; u < middle.width; ++u) {
        const bool inside = std::abs(u - 120) < 48 && std::abs(v - 68) < 40;
        if (inside) continue;
        std::fill_n(middle.rgb.begin() + 3 * (v * middle.width + u), 3, std::uint8_t{0});
      }
    }
    EXPECT_GT(orange(middle), 10) << t << " s";
  }
}

TEST_F(FlightPicturesTest, BothViewsShareAPicture) {
  FlightPictures both = pictures(View::kBoth);
  FlightPictures chase = pictures(View::kChase);
  const Picture shared = both.at(10, 10);
  const Picture alone = chase.at(10, 10);
  ASSERT_EQ(shared.rgb.size(), alone.rgb.size());
  // The same on the left half; framed in white in the upper right corner.
  for (int v = 0; v < shared.height; ++v) {
    const auto begin = 3 * v * shared.width;
    ASSERT_TRUE(std::equal(shared.rgb.begin() + begin, shared.rgb.begin() + begin + 3 * 120,
                           alone.rgb.begin() + begin))
        << "row " << v;
  }
  const auto pixel = [&](int u, int v) { return shared.rgb.begin() + 3 * (v * shared.width + u); };
  EXPECT_EQ(std::count(pixel(240 - 12 - 80, 11), pixel(240 - 12, 11), 255), 3 * 80);
  EXPECT_NE(shared.rgb, alone.rgb);
}

TEST_F(FlightPicturesTest, MomentsOutsideTheFlightAreItsEnds) {
  FlightPictures top = pictures(View::kTop);
  EXPECT_EQ(top.at(-5, -5).rgb, top.at(0, -5).rgb);
  EXPECT_EQ(top.at(30, 30).rgb, top.at(20, 30).rgb);
}

}  // namespace
}  // namespace arex::sim
