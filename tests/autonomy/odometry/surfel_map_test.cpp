#include "odometry/surfel_map.h"

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <map>
#include <numbers>
#include <tuple>

#include "math/random.h"

namespace arex {
namespace {

struct Cloud {
  std::vector<Vec3f> points;
  std::vector<float> variances;
  void add(const Vec3& p, double variance) {
    points.push_back(p.cast<float>());
    variances.push_back(static_cast<float>(variance));
  }
};

/// A tilted plane, a cylinder and clutter.
Cloud make_cloud(std::uint64_t seed, int count) {
  RandomStream random(seed, "cloud");
  Cloud cloud;
  for (int i = 0; i < count; ++i) {
    const double u = random.uniform(-3, 3), v = random.uniform(-3, 3);
    const double variance = random.uniform(0.5e-4, 4e-4);
    const Vec3 noise = std::sqrt(variance) * random.normal3();
    cloud.add(Vec3(u, v, 0.2 * u - 0.1 * v) + noise, variance);
    cloud.add(Vec3(0.2 * std::cos(u), 0.2 * std::sin(u), v) + noise, variance);
    if (i % 5 == 0) cloud.add({u, v, random.uniform(0, 2)}, variance);
  }
  return cloud;
}

struct Answer {
  SurfelMatch match;
  std::vector<std::size_t> points;  ///< in the cell of each level that holds the query
};

/// The answer from all points: no table, no moments, no caches.
std::optional<Answer> brute_force(const Cloud& cloud, const SurfelMapConfig& config,
                                  const Vec3& q) {
  std::optional<SurfelMatch> best;
  std::vector<std::size_t> points;
  for (int l = 0; l < config.levels; ++l) {
    const double edge = config.finest_edge_m * (1 << l);
    const auto cell_of = [&](const Vec3& p) {
      return ((SurfelMap::kR_GO * p / edge).array().floor()).matrix().eval();
    };
    std::vector<std::pair<Vec3, double>> inside;
    double W = 0;
    Vec3 mean = Vec3::Zero();
    for (std::size_t i = 0; i < cloud.points.size(); ++i) {
      const Vec3 p = cloud.points[i].cast<double>();
      if (cell_of(p) != cell_of(q)) continue;
      const double w = 1 / static_cast<double>(cloud.variances[i]);
      inside.emplace_back(p, w);
      W += w;
      mean += w * p;
    }
    points.push_back(inside.size());
    const double n = static_cast<double>(inside.size());
    if (n < config.min_points) continue;
    mean /= W;
    Mat3 C = Mat3::Zero();
    for (const auto& [p, w] : inside) C += w / W * (p - mean) * (p - mean).transpose();
    const Eigen::SelfAdjointEigenSolver<Mat3> solver(C);
    const double s2 = (n * solver.eigenvalues()[0] + 3 * n / W) / n;
    if (std::sqrt(s2) > config.max_thickness_ratio * edge) continue;
    double variance = s2 * (1 + 1 / n);
    Mat3 normal_covariance = Mat3::Zero();
    for (int k = 1; k < 3; ++k) {
      const Vec3 axis = solver.eigenvectors().col(k);
      const double tilt = s2 / (n * solver.eigenvalues()[k]);
      variance += tilt * std::pow(axis.dot(q - mean), 2);
      normal_covariance += tilt * axis * axis.transpose();
    }
    if (!best || variance < best->variance_m2) {
      best = SurfelMatch{solver.eigenvectors().col(0), mean, variance, normal_covariance, l};
    }
  }
  if (!best) return std::nullopt;
  return Answer{*best, points};
}

TEST(SurfelMap, AnswersLikeBruteForce) {
  SurfelMapConfig config;
  config.capacity = 5000;
  config.refresh_growth = 1;       // fit after every point
  config.saturation_weight = 1e9;  // never full
  for (std::uint64_t seed = 1; seed <= 3; ++seed) {
    const Cloud cloud = make_cloud(seed, 3000);
    SurfelMap map(config);
    map.insert(cloud.points, cloud.variances);
    RandomStream random(seed, "queries");
    int answered = 0, silent = 0;
    for (int i = 0; i < 300; ++i) {
      const double u = random.uniform(-3.5, 3.5), v = random.uniform(-3.5, 3.5);
      const Vec3 q(u, v, 0.2 * u - 0.1 * v + (i % 3 == 0 ? random.uniform(-1, 1) : 0));
      const auto expected = brute_force(cloud, config, q);
      const auto actual = map.find(q);
      ASSERT_EQ(actual.has_value(), expected.has_value());
      if (!expected) {
        ++silent;
        continue;
      }
      ++answered;
      const SurfelMatch& match = expected->match;
      // Cells are nested: two levels whose cells hold equally many points hold the same ones, fit
      // the same plane, and rounding says which answers. Otherwise the level is the oracle's.
      const auto points = [&](int level) {
        return expected->points[static_cast<std::size_t>(level)];
      };
      EXPECT_EQ(points(actual->level), points(match.level)) << q.transpose();
      EXPECT_LT((actual->mean - match.mean).norm(), 1e-5);
      EXPECT_GT(std::abs(actual->normal.dot(match.normal)), 1 - 1e-5);
      EXPECT_NEAR(actual->variance_m2 / match.variance_m2, 1, 2e-3);
      EXPECT_LT((actual->normal_covariance - match.normal_covariance).norm(),
                2e-3 * match.normal_covariance.norm());
    }
    EXPECT_GT(answered, 150);
    EXPECT_GT(silent, 10);
  }
}

// Noise of sigma, a plane h below a face of the cells: a cell loses the upper tail and holds the
// plane for sigma phi(h/sigma) / Phi(h/sigma) too low, over its whole length (the mean of a
// truncated normal; also the proof that the test can fail). What a building is made of never runs
// so: floors, walls of any heading, the ramp; a cell cuts them along a line, not along their faces.
TEST(SurfelMap, WhatABuildingIsMadeOfIsNotBent) {
  constexpr double kSigma = 0.01, kHalf = 0.5;
  SurfelMapConfig config;
  config.saturation_weight = 1e9;
  config.levels = 1;
  // How far a query on the plane finds the surface from where it is, RMS over the plane.
  const auto bent = [&](const Vec3& normal, double offset, std::uint64_t seed) {
    const Vec3 u = normal.unitOrthogonal(), v = normal.cross(u);
    RandomStream random(seed, "plane");
    Cloud cloud;
    for (int i = 0; i < 20000; ++i) {
      cloud.add(random.uniform(-kHalf, kHalf) * u + random.uniform(-kHalf, kHalf) * v +
                    (offset + kSigma * random.normal()) * normal,
                kSigma * kSigma);
    }
    SurfelMap map(config);
    map.insert(cloud.points, cloud.variances);
    double sum = 0;
    int count = 0;
    for (int i = 0; i < 500; ++i) {
      const Vec3 p =
          random.uniform(-kHalf, kHalf) * u + random.uniform(-kHalf, kHalf) * v + offset * normal;
      const auto match = map.find(p);
      if (!match || std::abs(match->normal.dot(normal)) < 0.5) continue;
      sum += std::pow(match->normal.dot(p - match->mean), 2);
      ++count;
    }
    EXPECT_GT(count, 400);
    return std::sqrt(sum / count);
  };
  for (const double below : {0.002, 0.005, 0.01}) {
    const double x = below / kSigma;
    const double phi = std::exp(-0.5 * x * x) / std::sqrt(2 * std::numbers::pi);
    const double tail = kSigma * phi / (0.5 * std::erfc(-x / std::numbers::sqrt2));
    const Vec3 face = SurfelMap::kR_GO.row(0);
    EXPECT_GT(bent(face, config.finest_edge_m - below, 1), 0.8 * tail);
    for (const double heading : {0.0, 0.3, 0.9, 1.4}) {
      const Vec3 wall(std::cos(heading), std::sin(heading), 0);
      EXPECT_LT(bent(wall, config.finest_edge_m - below, 2), 0.3 * kSigma);
    }
    EXPECT_LT(bent(Vec3::UnitZ(), config.finest_edge_m - below, 3), 0.3 * kSigma);
    EXPECT_LT(bent({-0.5, 0, std::sqrt(0.75)}, config.finest_edge_m - below, 4), 0.3 * kSigma);
  }
}

TEST(SurfelMap, KeepsToItsMemoryAndForgetsWhatItLongHasNotSeen) {
  SurfelMapConfig config;
  config.capacity = 1000;
  SurfelMap map(config);
  RandomStream random(1, "walk");
  const auto patch = [&](double x) {  // a floor of 2 m x 2 m at x
    Cloud cloud;
    for (int i = 0; i < 3000; ++i) {
      cloud.add({x + random.uniform(0, 2), random.uniform(0, 2), 0.01 + 0.005 * random.normal()},
                1e-4);
    }
    map.insert(cloud.points, cloud.variances);
  };
  for (int i = 0; i < 80; ++i) patch(2.0 * i);
  const std::size_t bytes = map.memory_bytes();  // all levels are full
  for (int i = 80; i < 160; ++i) patch(2.0 * i);
  EXPECT_EQ(map.memory_bytes(), bytes);
  EXPECT_LE(map.cells(0), 1000U);
  EXPECT_TRUE(map.find({319, 1, 0.01}).has_value());
  EXPECT_EQ(map.find({319, 1, 0.01}).has_value(), true);
  const auto old = map.find({1, 1, 0.01});
  EXPECT_TRUE(!old || old->level > 0);  // the finest level had to make room
}

// The oracle of the table: a std::map of what CLOCK, run by hand, would keep.
TEST(SurfelMap, TheTableHoldsExactlyWhatClockKeeps) {
  SurfelMapConfig config;
  config.capacity = 1000;
  config.levels = 1;
  config.finest_edge_m = 1;
  config.min_points = 4;
  SurfelMap map(config);
  using Key = std::tuple<int, int, int>;
  std::vector<Key> ring;
  std::map<Key, std::pair<std::size_t, bool>> table;  // place in the ring, seen
  std::map<Key, int> counts;
  std::size_t hand = 0;
  RandomStream random(7, "clock");
  for (int i = 0; i < 20000; ++i) {
    const int spread = 4 + i / 2500;
    const Key key{random.uniform_int(-spread, spread), random.uniform_int(-spread, spread),
                  random.uniform_int(-2, 2)};
    const auto [a, b, c] = key;
    Cloud one;
    for (int k = 0; k < 4; ++k) {
      const Vec3 p_G(a + random.uniform(0.2, 0.8), b + random.uniform(0.2, 0.8), c + 0.5);
      one.add(SurfelMap::kR_GO.transpose() * p_G, 1e-4);
    }
    map.insert(one.points, one.variances);
    if (const auto found = table.find(key); found != table.end()) {
      found->second.second = true;
    } else if (ring.size() < 1000) {
      table[key] = {ring.size(), true};
      ring.push_back(key);
    } else {
      while (table[ring[hand]].second) {
        table[ring[hand]].second = false;
        hand = (hand + 1) % ring.size();
      }
      table.erase(ring[hand]);
      ring[hand] = key;
      table[key] = {hand, true};
      hand = (hand + 1) % ring.size();
    }
  }
  int present = 0;
  for (int a = -12; a <= 12; ++a) {
    for (int b = -12; b <= 12; ++b) {
      for (int c = -2; c <= 2; ++c) {
        const bool kept = table.count({a, b, c}) > 0;
        present += kept;
        const Vec3 centre_G(a + 0.5, b + 0.5, c + 0.5);
        EXPECT_EQ(map.find(SurfelMap::kR_GO.transpose() * centre_G).has_value(), kept);
      }
    }
  }
  EXPECT_EQ(present, 1000);
}

// Fit many noisy samples of one plane: the told variance of its height is that of the fits.
TEST(SurfelMap, TheFitsOwnDoubtIsItsSpread) {
  constexpr int kFits = 2000, kPoints = 12;
  constexpr double kNoise = 0.01;
  const Vec3 query(0.2, -0.15, 0);
  double sum_squares = 0, sum_told = 0;
  RandomStream random(3, "fits");
  for (int f = 0; f < kFits; ++f) {
    Vec3 mean = Vec3::Zero();
    std::vector<Vec3> points;
    for (int i = 0; i < kPoints; ++i) {
      points.emplace_back(random.uniform(-0.125, 0.125), random.uniform(-0.125, 0.125),
                          kNoise * random.normal());
      mean += points.back() / kPoints;
    }
    Mat3 C = Mat3::Zero();
    for (const Vec3& p : points) C += (p - mean) * (p - mean).transpose() / kPoints;
    const auto fit = SurfelMap::fit(kPoints, kPoints / (kNoise * kNoise), mean, C);
    const double height = -fit.normal.dot(query - fit.mean) / fit.normal.z();
    sum_squares += height * height;
    const Vec3 d = query - fit.mean;
    sum_told += fit.thickness_m2 / kPoints + d.dot(fit.regression * d);
  }
  EXPECT_NEAR(std::sqrt(sum_told / sum_squares), 1, 0.15);
}

}  // namespace
}  // namespace arex
