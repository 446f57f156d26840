#include "mapping/floor_sheet.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <map>
#include <random>
#include <vector>

namespace arex {
namespace {

constexpr int kWidth = 30, kHeight = 20;
constexpr double kTile_m = 0.8;

int column_bit(int x, int y) {
  int bit = 0;
  for (int k = 0; k < 3; ++k) bit |= (x >> k & 1) << (2 * k) | (y >> k & 1) << (2 * k + 1);
  return bit;
}

/// A world of columns: the layers in which surfaces or objects begin, seen from below.
class Site {
 public:
  Site() : layers_(static_cast<std::size_t>(kWidth * kHeight * 64)) {}

  std::vector<int>& at(int x, int y) {
    return layers_[static_cast<std::size_t>(y * kWidth * 8 + x)];
  }
  /// A surface over a rectangle of columns, by the height at (x, y) in layers.
  void add(int x0, int x1, int y0, int y1, const std::function<double(int, int)>& height) {
    for (int y = y0; y < y1; ++y) {
      for (int x = x0; x < x1; ++x) at(x, y).push_back(static_cast<int>(std::floor(height(x, y))));
    }
  }
  void give_to(FloorSheet& sheet, int from_layer = -1000) {
    for (int ty = 0; ty < kHeight; ++ty) {
      for (int tx = 0; tx < kWidth; ++tx) {
        std::map<int, std::uint64_t> feet;
        for (int y = 0; y < 8; ++y) {
          for (int x = 0; x < 8; ++x) {
            for (const int layer : at(8 * tx + x, 8 * ty + y)) {
              if (layer >= from_layer) feet[layer] |= std::uint64_t{1} << column_bit(x, y);
            }
          }
        }
        std::vector<FloorSheet::Feet> sorted;
        for (const auto& [layer, columns] : feet) sorted.push_back({layer, columns});
        sheet.set_feet(static_cast<std::size_t>(ty * kWidth + tx), std::move(sorted));
      }
    }
  }

 private:
  std::vector<std::vector<int>> layers_;
};

FloorSheet make_sheet() { return FloorSheet(kWidth, kHeight, kTile_m, 0.7, 3); }

std::size_t tile(int x, int y) { return static_cast<std::size_t>(y * kWidth + x); }

double height(const FloorSheet& sheet, int x, int y) {
  const auto plane = sheet.plane(tile(x, y));
  return plane ? plane->height : std::nan("");
}

TEST(ColumnLayers, AsksEachColumnForItsOwnHeight) {
  std::mt19937_64 random(3);
  std::uniform_real_distribution<double> rise(-1, 1), level(-50, 50);
  for (int trial = 0; trial < 50; ++trial) {
    const TilePlane plane{level(random), {rise(random), rise(random)}};
    const ColumnLayers layers(plane);
    for (int low = layers.lowest() - 2; low < layers.highest() + 2; ++low) {
      const std::uint64_t found = layers.between(low, low + 3);
      for (int y = 0; y < 8; ++y) {
        for (int x = 0; x < 8; ++x) {
          const long layer = std::lround(plane.at(x, y));
          EXPECT_EQ(found >> column_bit(x, y) & 1U, layer >= low && layer < low + 3 ? 1U : 0U);
        }
      }
    }
  }
}

TEST(FloorSheet, KnowsNothingBeforeTheVehicleStands) {
  FloorSheet sheet = make_sheet();
  EXPECT_TRUE(sheet.spread().empty());
  EXPECT_FALSE(sheet.plane(0));
}

/// A hall of level -80 under a yard of level 0, and a ramp of 30 degrees down to it, 48 columns
/// wide, between walls; noise of a layer.
Site make_garage(unsigned seed) {
  Site site;
  std::mt19937_64 random(seed);
  std::bernoulli_distribution lower(0.2);
  const double slope = std::tan(M_PI / 6);
  const double foot = 24 + 80 / slope;  // column
  const auto noisy = [&](double h) { return h + 0.5 - (lower(random) ? 1 : 0); };
  const auto yard = [&](int, int) { return noisy(0); };
  const auto hall = [&](int, int) { return noisy(-80); };
  const auto ramp = [&](int x, int) { return noisy(-slope * (x + 0.5 - 24)); };
  site.add(0, 24, 0, 160, yard);
  site.add(24, 240, 0, 56, yard);
  site.add(24, 240, 104, 160, yard);
  site.add(24, static_cast<int>(foot), 56, 104, ramp);
  site.add(static_cast<int>(foot), 240, 0, 160, hall);
  site.add(24, static_cast<int>(foot), 0, 52, hall);
  site.add(24, static_cast<int>(foot), 108, 160, hall);
  site.add(static_cast<int>(foot), 240, 56, 104, yard);  // over the hall
  return site;
}

TEST(FloorSheet, FollowsARampDownIntoAHallUnderTheYard) {
  const double slope = std::tan(M_PI / 6);
  for (const unsigned seed : {1U, 2U, 3U}) {
    FloorSheet sheet = make_sheet();
    Site site = make_garage(seed);
    site.give_to(sheet, -60);  // from above
    sheet.note_place({0, 10}, 13);
    sheet.spread();
    EXPECT_NEAR(height(sheet, 1, 10), 0, 1);
    EXPECT_NEAR(height(sheet, 1, 1), 0, 1);
    EXPECT_NEAR(height(sheet, 10, 1), 0, 1);
    EXPECT_NEAR(height(sheet, 15, 10), -slope * (8 * 15 + 4 - 24), 1.5);  // under the yard
    EXPECT_LT(height(sheet, 17, 10), -60);  // goes on down, unseen, though the yard is seen there
    EXPECT_FALSE(sheet.is_seen(tile(17, 10)));
    site.give_to(sheet);
    sheet.spread();
    for (int x = 3; x < 20; ++x) {
      const double expected = std::max(-80.0, -slope * (8 * x + 4 - 24));
      EXPECT_NEAR(height(sheet, x, 10), expected, 1.5) << x;
      EXPECT_TRUE(sheet.is_seen(tile(x, 10)));
    }
    EXPECT_NEAR(sheet.plane(tile(10, 10))->rise.x(), -slope, 0.08);
    // Down, and off to the side: now the hall's floor, but the way home stays.
    for (int x = 1; x < 24; ++x) {
      sheet.note_place(
          {x, 10}, static_cast<int>(15 - std::min(80.0, std::max(0.0, slope * (8 * x + 4 - 24)))));
      sheet.spread();
    }
    for (int y = 10; y > 3; --y) {
      sheet.note_place({24, y}, -65);
      sheet.spread();
    }
    for (int x = 24; x > 8; --x) {
      sheet.note_place({x, 4}, -65);
      sheet.spread();
    }
    EXPECT_NEAR(height(sheet, 10, 1), -80, 1);
    EXPECT_NEAR(height(sheet, 10, 4), -80, 1);
    EXPECT_NEAR(height(sheet, 28, 10), -80, 1);
    EXPECT_NEAR(height(sheet, 1, 10), 0, 1);
    for (int x = 3; x < 17; ++x) {
      EXPECT_NEAR(height(sheet, x, 10), std::max(-80.0, -slope * (8 * x + 4 - 24)), 1.5) << x;
    }
    EXPECT_NE(sheet.brinks(tile(1, 7)) | sheet.brinks(tile(1, 8)), 0U);  // the yard ends there
    EXPECT_EQ(sheet.brinks(tile(10, 4)), 0U);
  }
}

// Over a yard beneath which a hall lies, the way home keeps the yard on the map: the ramp that was
// never flown ends before it, and is to be explored.
TEST(FloorSheet, EndsARampInAMouthUnderAYardThatWasFlownOver) {
  const double slope = std::tan(M_PI / 6);
  for (const unsigned seed : {1U, 2U, 3U}) {
    FloorSheet sheet = make_sheet();
    Site site = make_garage(seed);
    site.give_to(sheet, -60);  // from above
    const auto mouths = [&] {
      std::vector<std::size_t> found;
      for (int t = 0; t < kWidth * kHeight; ++t) {
        if (sheet.is_mouth(static_cast<std::size_t>(t)))
          found.push_back(static_cast<std::size_t>(t));
      }
      return found;
    };
    sheet.note_place({0, 10}, 13);
    sheet.spread();
    EXPECT_TRUE(mouths().empty());
    for (int y = 10; y < 17; ++y) sheet.note_place({1, y}, 13);
    for (int x = 1; x < 20; ++x) sheet.note_place({x, 16}, 13);
    for (int y = 16; y > 8; --y) sheet.note_place({20, y}, 13);
    sheet.spread();
    EXPECT_NEAR(height(sheet, 20, 9), 0, 1);
    ASSERT_FALSE(mouths().empty());
    for (const std::size_t t : mouths()) {
      EXPECT_LT(sheet.plane(t)->height, -25) << t;  // not on the yard
    }
    // On round the yard, and down: the way home is up the ramp, not round the yard.
    for (int y = 8; y > 4; --y) sheet.note_place({20, y}, 13);
    for (int x = 20; x > 4; --x) sheet.note_place({x, 4}, 13);
    for (int y = 4; y < 9; ++y) sheet.note_place({4, y}, 13);
    sheet.spread();
    for (int x = 4; x < 15; ++x) {
      const double floor = -std::min(80.0, std::max(0.0, slope * (8 * x + 4 - 24)));
      sheet.note_place({x, 8}, static_cast<int>(15 + floor));
      sheet.spread();
    }
    // The yard beside the way home was left, and is nothing to climb back for.
    EXPECT_NE(sheet.brinks(tile(0, 6)) | sheet.brinks(tile(0, 7)) | sheet.brinks(tile(0, 8)), 0U);
    site.give_to(sheet);
    for (int x = 15; x < 24; ++x) {
      const double floor = -std::min(80.0, std::max(0.0, slope * (8 * x + 4 - 24)));
      sheet.note_place({x, 8}, static_cast<int>(15 + floor));
      sheet.spread();
    }
    EXPECT_TRUE(mouths().empty());
    for (const int x : {21, 22, 23}) EXPECT_NEAR(height(sheet, x, 10), -80, 1) << x;
    EXPECT_NEAR(height(sheet, 0, 10), 0, 1);
    for (int x = 4; x < 16; ++x) EXPECT_NEAR(height(sheet, x, 9), -slope * (8 * x + 4 - 24), 1.5);
  }
}

// Kerbs and walls along a ramp lift the planes beside them, across it. The end of a ramp, which is
// not seen from its top, goes on downwards; what lies beside it does not go down with the tilt.
TEST(FloorSheet, GoesOnDownARampAndNotAcrossIt) {
  const auto ramp = [](int x, int y) { return 0.5 - 0.5 * (x + 0.5 - 24) + 0.42 * (y - 83.5); };
  FloorSheet sheet = make_sheet();
  Site site;
  site.add(0, 24, 80, 88, [&](int, int) { return 0; });
  site.add(24, 104, 80, 88, ramp);
  site.give_to(sheet);
  sheet.note_place({0, 10}, 13);
  sheet.spread();
  ASSERT_NEAR(sheet.plane(tile(12, 10))->rise.y(), 0.42, 0.03);
  for (int x = 13; x < 20; ++x) {
    EXPECT_FALSE(sheet.is_seen(tile(x, 10)));
    EXPECT_NEAR(height(sheet, x, 10), ramp(8 * x + 4, 84), 3) << x;
  }
  for (int y = 0; y < kHeight; ++y) EXPECT_GT(height(sheet, 10, y), ramp(84, 84) - 6) << y;
}

// Where rays do not reach, below and behind the vehicle, what is there is its neighbours' floor:
// the foot of something, which slopes as a ramp does, leads nowhere down.
TEST(FloorSheet, TakesNoSlopingFootForARamp) {
  FloorSheet sheet = make_sheet();
  Site site;
  const auto unseen = [](int x, int y) { return x >= 16 && x < 32 && y >= 40 && y < 100; };
  for (int y = 0; y < 160; ++y) {
    for (int x = 0; x < 240; ++x) {
      if (!unseen(x, y)) site.at(x, y).push_back(0);
    }
  }
  site.add(24, 32, 40, 48, [](int, int y) { return -0.5 * (y - 39.5); });
  site.give_to(sheet);
  sheet.note_place({3, 10}, 13);
  sheet.spread();
  ASSERT_LT(sheet.plane(tile(3, 5))->rise.y(), -0.35);
  for (int x = 2; x < 5; ++x) {
    for (int y = 6; y < 13; ++y) EXPECT_NEAR(height(sheet, x, y), 0, 7) << x << " " << y;
  }
  for (int t = 0; t < kWidth * kHeight; ++t) {
    EXPECT_EQ(sheet.brinks(static_cast<std::size_t>(t)), 0U) << t % kWidth << " " << t / kWidth;
  }
}

// Where a ramp is seen at a grazing angle few of its columns are.
TEST(FloorSheet, KnowsTheSlopeOfARampOfWhichLittleIsSeen) {
  const double slope = std::tan(M_PI / 6);
  for (const unsigned seed : {1U, 2U, 3U, 4U, 5U}) {
    FloorSheet sheet = make_sheet();
    Site site = make_garage(seed);
    std::mt19937_64 random(seed);
    std::bernoulli_distribution seen(0.2);
    for (int x = 72; x < 152; ++x) {
      for (int y = 56; y < 104; ++y) {
        if (!seen(random)) site.at(x, y).clear();
      }
    }
    site.give_to(sheet);
    sheet.note_place({0, 10}, 13);
    sheet.spread();
    for (int x = 10; x < 18; ++x) {
      for (int y = 8; y < 12; ++y) {
        EXPECT_NEAR(sheet.plane(tile(x, y))->rise.x(), -slope, 0.15)
            << seed << ": " << x << " " << y;
        EXPECT_NEAR(sheet.plane(tile(x, y))->rise.y(), 0, 0.15) << seed << ": " << x << " " << y;
        EXPECT_NEAR(height(sheet, x, y), -slope * (8 * x + 4 - 24), 2.5);
      }
    }
  }
}

// Rays that graze a ramp wear it off the map again: it stays where it was seen, and beyond, where
// it never was, goes on from there.
TEST(FloorSheet, KeepsAFloorThatIsWornOffTheMap) {
  const double slope = std::tan(M_PI / 6);
  for (const unsigned seed : {1U, 2U, 3U}) {
    FloorSheet sheet = make_sheet();
    Site site = make_garage(seed);
    const auto wear_off = [&](int from, int to) {
      for (int x = from; x < to; ++x) {
        for (int y = 56; y < 104; ++y) site.at(x, y).clear();
      }
      site.give_to(sheet);
    };
    wear_off(112, 168);  // its end was never seen
    sheet.note_place({0, 10}, 13);
    sheet.spread();
    wear_off(32, 112);
    sheet.spread();
    for (int x = 4; x < 19; ++x) {
      for (int y = 8; y < 12; ++y) {
        EXPECT_EQ(sheet.is_seen(tile(x, y)), x < 14) << x << " " << y;
        EXPECT_NEAR(height(sheet, x, y), -slope * (8 * x + 4 - 24), 6) << x << " " << y;
      }
    }
    EXPECT_NEAR(height(sheet, 23, 10), -80, 1);
  }
}

// What is left of a floor may be a step of it, whose plane leads on half a metre too high.
TEST(FloorSheet, KeepsAFloorOfWhichAStepIsLeft) {
  const double slope = std::tan(M_PI / 6);
  for (const unsigned seed : {1U, 2U, 3U}) {
    FloorSheet sheet = make_sheet();
    Site site = make_garage(seed);
    site.give_to(sheet);
    sheet.note_place({0, 10}, 13);
    sheet.spread();
    for (int x = 32; x < 160; ++x) {
      for (int y = 56; y < 104; ++y) site.at(x, y).clear();
    }
    site.add(33, 38, 56, 104, [&](int, int) { return -slope * (34 - 24); });
    site.give_to(sheet);
    sheet.spread();
    for (int x = 5; x < 17; ++x) {
      for (int y = 8; y < 12; ++y) {
        EXPECT_TRUE(sheet.is_seen(tile(x, y))) << x << " " << y;
        EXPECT_NEAR(height(sheet, x, y), -slope * (8 * x + 4 - 24), 1.5) << x << " " << y;
      }
    }
  }
}

// How high a ramp's unseen end is, nobody knows: what is in the band over it need not bar it.
TEST(FloorSheet, TellsTheUnseenEndOfARampFromOtherUnseenFloor) {
  FloorSheet sheet = make_sheet();
  make_garage(1).give_to(sheet, -60);  // from above
  sheet.note_place({0, 10}, 13);
  sheet.spread();
  EXPECT_TRUE(sheet.is_unseen_ramp(tile(17, 10)));
  EXPECT_FALSE(sheet.is_unseen_ramp(tile(10, 10)));  // seen
  Site gap;
  gap.add(0, 100, 0, 160, [](int, int) { return 0.0; });
  FloorSheet level = make_sheet();
  gap.give_to(level);
  level.note_place({0, 10}, 13);
  level.spread();
  EXPECT_FALSE(level.is_seen(tile(15, 10)));
  EXPECT_FALSE(level.is_unseen_ramp(tile(15, 10)));
}

// From the yard over the parapet into the ramp's shaft: from there on the ramp is the floor.
TEST(FloorSheet, FliesOverAnEdgeToAFloorThatItKnows) {
  FloorSheet sheet = make_sheet();
  Site site = make_garage(4);
  site.give_to(sheet, -60);
  for (int y = 10; y > 5; --y) sheet.note_place({1, y}, 13);
  for (int x = 1; x < 7; ++x) sheet.note_place({x, 5}, 13);
  sheet.spread();
  const double ramp = height(sheet, 7, 9);
  EXPECT_NEAR(ramp, -std::tan(M_PI / 6) * (8 * 7 + 4 - 24), 1.5);
  for (int y = 6; y < 10; ++y) sheet.note_place({7, y}, y < 8 ? 13 : 8);
  for (int x = 8; x < 11; ++x) {
    sheet.note_place({x, 9}, static_cast<int>(15 - std::tan(M_PI / 6) * (8 * x + 4 - 24)));
  }
  sheet.spread();
  EXPECT_NEAR(height(sheet, 7, 9), ramp, 1.5);
  EXPECT_NEAR(height(sheet, 10, 9), -std::tan(M_PI / 6) * (8 * 10 + 4 - 24), 1.5);
  EXPECT_NEAR(height(sheet, 14, 9), -std::tan(M_PI / 6) * (8 * 14 + 4 - 24), 1.5);
}

// High over the ramp's shaft and on, over the yard behind it: the vehicle is over the yard, though
// the hall's floor below was seen through the portal and goes on from the ramp's.
TEST(FloorSheet, FliesOverAShaftToTheYardBehindIt) {
  const double slope = std::tan(M_PI / 6);
  for (const unsigned seed : {1U, 2U, 3U}) {
    FloorSheet sheet = make_sheet();
    Site site = make_garage(seed);
    site.give_to(sheet);
    for (int x = 0; x < 24; ++x) {
      sheet.note_place({x, 10}, 13);
      sheet.spread();
    }
    for (int x = 21; x < 26; ++x) EXPECT_NEAR(height(sheet, x, 10), 0, 1) << x;
    for (int x = 4; x < 16; ++x) EXPECT_NEAR(height(sheet, x, 10), -slope * (8 * x + 4 - 24), 1.5);
    EXPECT_NEAR(height(sheet, 10, 4), -80, 1);  // the hall beside the ramp
    // Back, and down: over the hall's floor, under the yard.
    for (int x = 24; x > 6; --x) {
      sheet.note_place({x, 10}, 13);
      sheet.spread();
    }
    for (int x = 7; x < 24; ++x) {
      const double floor = -std::min(80.0, std::max(0.0, slope * (8 * x + 4 - 24)));
      sheet.note_place({x, 10}, static_cast<int>(15 + floor));
      sheet.spread();
    }
    for (int x = 4; x < 28; ++x) {
      EXPECT_NEAR(height(sheet, x, 10), std::max(-80.0, -slope * (8 * x + 4 - 24)), 1.5) << x;
    }
    EXPECT_NEAR(height(sheet, 1, 10), 0, 1);
  }
}

TEST(FloorSheet, ClimbsNoCarAndFindsTheFloorBehindIt) {
  FloorSheet sheet = make_sheet();
  Site site;
  std::mt19937_64 random(5);
  site.add(0, 240, 0, 160, [](int, int) { return 0; });
  // 45 x 18 columns: bumper and sills 2 layers up, bonnet at 8, roof at 14; its floor not seen.
  for (int y = 60; y < 78; ++y) {
    for (int x = 60; x < 105; ++x) {
      const bool rim = x == 60 || x == 104 || y == 60 || y == 77;
      const bool roof = x > 75 && x < 95;
      site.at(x, y) = {rim ? 2 : roof ? 14 : 8};
    }
  }
  site.give_to(sheet);
  for (int x = 0; x < 5; ++x) sheet.note_place({x, 8}, 13);
  sheet.spread();
  for (int y = 0; y < kHeight; ++y) {
    for (int x = 0; x < kWidth; ++x) EXPECT_NEAR(height(sheet, x, y), 0, 0.7) << x << " " << y;
  }
}

TEST(FloorSheet, GoesOnOverTheUnseenAndTakesUpTheFloorBeyond) {
  FloorSheet sheet = make_sheet();
  Site site;
  const auto tilted = [](int x, int) { return 0.0096 * x; };  // O's tilt
  site.add(0, 80, 0, 160, tilted);
  site.add(144, 240, 0, 160, tilted);
  site.give_to(sheet);
  sheet.note_place({1, 10}, 13);
  sheet.spread();
  EXPECT_FALSE(sheet.is_seen(tile(13, 10)));
  EXPECT_NEAR(height(sheet, 13, 10), 1, 1.5);
  EXPECT_TRUE(sheet.is_seen(tile(20, 10)));
  EXPECT_NEAR(height(sheet, 20, 10), 0.0096 * 164, 1);
}

TEST(FloorSheet, HandsOutAPlaneAnewOnlyWhenItSaysSomethingElse) {
  FloorSheet sheet = make_sheet();
  Site site = make_garage(7);
  site.give_to(sheet);
  sheet.note_place({0, 10}, 13);
  EXPECT_GE(sheet.spread().size(), static_cast<std::size_t>(kWidth * kHeight));
  EXPECT_TRUE(sheet.spread().empty());  // nothing was said
  sheet.note_place({1, 10}, 13);
  EXPECT_LT(sheet.spread().size(), 60U);
}

}  // namespace
}  // namespace arex
