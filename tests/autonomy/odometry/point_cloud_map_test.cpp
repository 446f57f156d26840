#include "mapping/point_cloud_map.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <map>
#include <tuple>

#include "math/random.h"

namespace arex {
namespace {

std::vector<Vec3f> cloud(std::uint64_t seed, int count, double size) {
  RandomStream random(seed, "cloud");
  std::vector<Vec3f> points;
  for (int i = 0; i < count; ++i) points.emplace_back((size * random.normal3()).cast<float>());
  return points;
}

TEST(PointCloudMap, HoldsTheMeanOfEveryVoxel) {
  PointCloudMapConfig config;
  config.voxel_m = 0.25;
  for (std::uint64_t seed = 1; seed <= 3; ++seed) {
    const auto points = cloud(seed, 200000, 2.0);
    PointCloudMap map(config);
    map.insert(points);
    std::map<std::tuple<int, int, int>, std::pair<Vec3, int>> expected;
    const auto key = [](const Vec3f& p) {
      const auto c = (p.cast<double>() / 0.25).array().floor().cast<int>().eval();
      return std::tuple(c.x(), c.y(), c.z());
    };
    for (const Vec3f& p : points) {
      auto& [sum, n] = expected.try_emplace(key(p), Vec3::Zero(), 0).first->second;
      sum += p.cast<double>();
      ++n;
    }
    ASSERT_EQ(map.size(), expected.size());
    for (const Vec3f& p : map.points()) {
      const auto& [sum, n] = expected.at(key(p));
      EXPECT_LT((sum / n - p.cast<double>()).norm(), 1e-4);
    }
  }
}

TEST(PointCloudMap, StopsAtItsBoundAndSaysSo) {
  PointCloudMapConfig config;
  config.max_points = 1000;
  PointCloudMap map(config);
  const auto points = cloud(1, 5000, 50);
  map.insert(points);
  EXPECT_EQ(map.size(), 1000U);
  EXPECT_EQ(map.refused(), 4000U);
  map.insert(points);  // what is known still counts
  EXPECT_EQ(map.refused(), 8000U);
  const Vec3f nothing = Vec3f::Constant(std::numeric_limits<float>::quiet_NaN());
  map.insert({&nothing, 1});
  EXPECT_EQ(map.size(), 1000U);
}

}  // namespace
}  // namespace arex
