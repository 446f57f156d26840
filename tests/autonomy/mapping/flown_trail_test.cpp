#include "mapping/flown_trail.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <set>

#include "math/random.h"

namespace arex {
namespace {

OccupancyMap2D geometry() {
  OccupancyMap2D map;
  map.origin = {-3, -2};
  map.resolution = 0.1;
  map.width = 60;
  map.height = 40;
  return map;
}

TEST(FlownTrail, IsAChainOfAllCellsBetweenThePlaces) {
  const OccupancyMap2D map = geometry();
  for (std::uint64_t seed = 1; seed <= 5; ++seed) {
    RandomStream random(seed, "flight");
    FlownTrail trail(map);
    std::set<std::uint32_t> flown;
    Vec2 p(0.03, 0.04);
    trail.add({p.x(), p.y(), 1.5});
    for (int k = 0; k < 400; ++k) {
      // Inside the map, in steps of up to three cells.
      Vec2 next = p + Vec2(random.uniform(-0.3, 0.3), random.uniform(-0.3, 0.3));
      next = next.cwiseMax(Vec2(-2.95, -1.95)).cwiseMin(Vec2(2.95, 1.95));
      trail.add({next.x(), next.y(), 1.5});
      for (int i = 0; i <= 100; ++i) {
        const Vec2 on = p + (next - p) * (i / 100.0);
        flown.insert(static_cast<std::uint32_t>(map.index(map.cell_of(on))));
      }
      p = next;
    }
    const std::vector<std::uint32_t>& cells = trail.cells();
    const std::set<std::uint32_t> seen(cells.begin(), cells.end());
    EXPECT_EQ(seen.size(), cells.size()) << "a cell stands in it twice";
    EXPECT_TRUE(std::includes(seen.begin(), seen.end(), flown.begin(), flown.end()));
    EXPECT_LT(seen.size(), 1.15 * static_cast<double>(flown.size()));  // corners that samples miss
    // Every cell but the first shares a side with one before it.
    std::set<std::uint32_t> before;
    for (const std::uint32_t c : cells) {
      const bool joins = before.contains(c - 1) || before.contains(c + 1) ||
                         before.contains(c - 60) || before.contains(c + 60);
      EXPECT_TRUE(joins || before.empty());
      before.insert(c);
    }
  }
}

TEST(FlownTrail, LeavesOutWhatLiesOffTheMap) {
  FlownTrail trail(geometry());
  trail.add({2.75, 0.05, 1});
  trail.add({3.75, 0.05, 1});  // the map ends at 3
  trail.add({3.75, -5, 1});
  EXPECT_EQ(trail.cells().size(), 3u);
}

TEST(FlownTrail, KnowsHowHighItWasAndBridgesNoJump) {
  FlownTrail trail(geometry());
  trail.add({0.05, 0.05, 1.0});
  trail.add({0.25, 0.05, 1.8});
  trail.add({2.05, 1.05, 0.5});  // a jump of the pose: nobody flew there
  ASSERT_EQ(trail.cells().size(), 4u);
  EXPECT_EQ(trail.heights_m(), (std::vector<float>{1.0F, 1.8F, 1.8F, 0.5F}));
}

}  // namespace
}  // namespace arex
