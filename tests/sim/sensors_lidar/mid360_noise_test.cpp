#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "math/random.h"
#include "sensors/mid360.h"
#include "sim/sensors_lidar/test_world.h"

namespace arex::sim {
namespace {

using test::rest;
using test::WorldMaker;

constexpr double kDegree = std::numbers::pi / 180;

/// Ground of reflectivity 0.9 seen from 1 m, the sensor leaning so that its beams graze it.
struct Grazing {
  worlds::World world =
      WorldMaker().object(0.9F).quad({-90, -90, 0}, {180, 0, 0}, {0, 180, 0}).world();
  Scene scene{world};
  Pose X_WB{so3::Exp({0, 1.2, 0}), {0, 0, 1}};
  Mid360Pattern pattern{PatternMode::kDevice};

  [[nodiscard]] Vec3 direction_L(Stamp offset_ns) const {
    return pattern.direction(offset_ns / Mid360Pattern::kFiringPeriod);
  }
};

double model_range_sigma(double range, double cosine) {
  return std::hypot(0.0034, 0.00073 * range) / std::pow(std::max(cosine, 0.05), 0.78);
}

double model_return_probability(double incidence_deg) {
  const std::array<double, 6> x{78, 79.5, 82.5, 85, 88, 90}, y{1, .76, .5, .22, .08, 0};
  if (incidence_deg <= x[0]) return 1;
  std::size_t i = 1;
  while (incidence_deg > x[i]) ++i;
  return y[i - 1] + (incidence_deg - x[i - 1]) / (x[i] - x[i - 1]) * (y[i] - y[i - 1]);
}

TEST(Mid360Noise, ModelHoldsThePrintedFormulas) {
  const EchoModel echo{EchoConfig{}};
  RandomStream stream(1, "formulas");
  for (int i = 0; i < 20'000; ++i) {
    const double range = stream.uniform(0.1, 70), cosine = stream.uniform();
    const double sigma = model_range_sigma(range, cosine);
    ASSERT_NEAR(echo.range_sigma(range, cosine), sigma, 1e-12);
    ASSERT_NEAR(echo.fast_range_sigma(static_cast<float>(range), static_cast<float>(cosine)), sigma,
                2e-3 * sigma);
    const double probability = model_return_probability(std::acos(cosine) / kDegree);
    ASSERT_NEAR(echo.return_probability(cosine), probability, 1e-9);
    ASSERT_NEAR(echo.fast_return_probability(static_cast<float>(cosine)), 0.995 * probability,
                2e-3);
    const double reflectivity = stream.uniform();
    const double limit = std::min(70.0, 40 * std::pow(reflectivity * cosine / 0.1, 0.269));
    ASSERT_NEAR(echo.max_range(reflectivity, cosine), limit, 1e-9);
    if (std::abs(range - limit) > 0.02) {
      ASSERT_EQ(echo.bright_enough(static_cast<float>(range), static_cast<float>(reflectivity),
                                   static_cast<float>(cosine)),
                range < limit);
    }
  }
  // Both datasheet points.
  EXPECT_NEAR(echo.max_range(0.1, 1), 40, 1e-9);
  EXPECT_NEAR(echo.max_range(0.8, 1), 70, 0.1);
}

TEST(Mid360Noise, RangeAndAngleErrorsHaveTheModelsSigmas) {
  const Grazing setup;
  // Bins over incidence; the plane ties range to incidence, so a second height parts the two.
  const std::array<double, 6> edges_deg{20, 45, 60, 70, 78, 82};
  for (const double height : {1.0, 4.0}) {
    Pose X_WB = setup.X_WB;
    X_WB.p.z() = height;
    Mid360Config config;
    config.echo.false_alarm_probability = 0;
    const Mid360 lidar(config, setup.scene, Pose{}, {}, 2);
    struct Sums {
      double range = 0, up = 0, side = 0, mean = 0;
      int count = 0;
    };
    std::array<Sums, 5> bins;
    for (const LidarPoint& point : lidar.scan(rest(X_WB, 2000)).points) {
      const Vec3 d = setup.direction_L(point.offset_ns);
      const double cosine = -(X_WB.R * d).z();
      const double range = height / cosine;
      const Vec3 p = point.p_L.cast<double>();
      const double incidence = std::acos(cosine) / kDegree;
      for (std::size_t i = 0; i < bins.size(); ++i) {
        if (incidence < edges_deg[i] || incidence >= edges_deg[i + 1]) continue;
        const double along = (p.dot(d) - range) / model_range_sigma(range, cosine);
        const Vec3 side = d.cross(Vec3::UnitZ()).normalized(), up = side.cross(d);
        bins[i].mean += along;
        bins[i].range += along * along;
        bins[i].side += std::pow(p.dot(side) / range / (0.10 * kDegree), 2);
        bins[i].up += std::pow(p.dot(up) / range / (0.10 * kDegree), 2);
        ++bins[i].count;
      }
    }
    for (const Sums& bin : bins) {
      ASSERT_GT(bin.count, 3'000);
      EXPECT_NEAR(std::sqrt(bin.range / bin.count), 1, 0.05);
      EXPECT_NEAR(std::sqrt(bin.side / bin.count), 1, 0.05);
      EXPECT_NEAR(std::sqrt(bin.up / bin.count), 1, 0.05);
      EXPECT_NEAR(bin.mean / bin.count, 0, 4 / std::sqrt(bin.count));
    }
  }
}

TEST(Mid360Noise, StressCaseIsOneKey) {
  const Grazing setup;
  Mid360Config config;
  config.echo.range_noise_floor_m = 0.02;
  const Mid360 lidar(config, setup.scene, Pose{}, {}, 2);
  double sum = 0;
  int count = 0;
  for (const LidarPoint& point : lidar.scan(rest(setup.X_WB, 500)).points) {
    const Vec3 d = setup.direction_L(point.offset_ns);
    const double range = -1 / (setup.X_WB.R * d).z();
    if (range < 0 || range > 3 || point.p_L.norm() > 5) continue;
    sum += std::pow(point.p_L.cast<double>().dot(d) - range, 2);
    ++count;
  }
  ASSERT_GT(count, 10'000);
  EXPECT_NEAR(std::sqrt(sum / count), 0.02, 0.05 * 0.02);
}

TEST(Mid360Noise, ReturnsAtGrazingIncidenceAsOftenAsTheModelSays) {
  const Grazing setup;
  const Mid360 lidar({}, setup.scene, Pose{}, {}, 3);
  constexpr int kTicks = 4000, kScans = 2;
  std::vector<bool> returned;
  for (int scan = 0; scan < kScans; ++scan) {
    const std::size_t first = returned.size();
    returned.resize(first + kTicks * 200, false);
    const std::vector<Truth> ticks = rest(setup.X_WB, kTicks, scan * kTicks * kNanosecondsPerTick);
    for (const LidarPoint& point : lidar.scan(ticks).points) {
      returned[first + point.offset_ns / Mid360Pattern::kFiringPeriod] = true;
    }
  }
  const std::array<double, 6> edges_deg{0, 77, 79, 82, 84.5, 87};
  std::array<double, 5> expected{}, seen{}, variance{};
  for (std::size_t i = 0; i < returned.size(); ++i) {
    const double cosine =
        -(setup.X_WB.R * setup.pattern.direction(static_cast<std::int64_t>(i))).z();
    const double incidence = std::acos(cosine) / kDegree;
    for (std::size_t k = 0; k < expected.size(); ++k) {
      if (incidence < edges_deg[k] || incidence >= edges_deg[k + 1]) continue;
      const double p = 0.995 * model_return_probability(incidence);
      expected[k] += p;
      variance[k] += p * (1 - p);
      seen[k] += returned[i] ? 1 : 0;
    }
  }
  for (std::size_t k = 0; k < expected.size(); ++k) {
    EXPECT_NEAR(seen[k], expected[k], 0.05 * expected[k]) << "bin " << k;
    EXPECT_LT(3 * std::sqrt(variance[k]), 0.05 * expected[k]) << "too few firings to tell";
  }
}

TEST(Mid360Noise, FalseAlarmsComeAtTheirRateAndAnywhere) {
  const worlds::World nothing;
  const Scene scene(nothing);
  for (const double probability : {1e-4, 0.01}) {
    Mid360Config config;
    config.echo.false_alarm_probability = probability;
    const Mid360 lidar(config, scene, Pose{}, {}, 4);
    const int scans = probability > 1e-3 ? 1 : 10;
    double range_sum = 0, count = 0;
    for (int i = 0; i < scans; ++i) {
      for (const LidarPoint& point :
           lidar.scan(rest(Pose{}, 2000, i * 2 * kNanosecondsPerSecond)).points) {
        range_sum += point.p_L.norm();
        ++count;
        ASSERT_GE(point.p_L.norm(), 0.099F);
        ASSERT_LE(point.p_L.norm(), 70.01F);
      }
    }
    const double expected = 400'000 * scans * probability;  // 400, then 4000
    EXPECT_NEAR(count, expected, 3.3 * std::sqrt(expected));
    EXPECT_NEAR(range_sum / count, 35.05, 3.3 * 20.2 / std::sqrt(count));
  }
}

TEST(Mid360Noise, FaultsStartAndEndWhenTold) {
  const worlds::World world = WorldMaker().object(0.6F).box(Pose{}, {5, 5, 5}).world();
  const Scene scene(world);
  Mid360Config config;
  config.fault_dropout_fraction = 0.3;
  config.fault_silent_from_s = 0.1;
  config.fault_silent_for_s = 0.05;
  config.fault_false_burst_from_s = 0.3;
  config.fault_false_burst_for_s = 0.1;
  config.fault_false_burst_fraction = 0.2;
  const Mid360 lidar(config, scene, Pose{}, {}, 5);
  int normal = 0, silent = 0, on_wall_in_burst = 0, off_wall_in_burst = 0;
  for (const LidarPoint& point : lidar.scan(rest(Pose{}, 400)).points) {
    const double time_s = 1e-9 * point.offset_ns;
    const bool on_wall = std::abs(point.p_L.cwiseAbs().maxCoeff() - 5) < 0.1;
    if (time_s < 0.1) ++normal;
    if (time_s >= 0.1 && time_s < 0.15) ++silent;
    if (time_s >= 0.3) (on_wall ? on_wall_in_burst : off_wall_in_burst) += 1;
  }
  EXPECT_NEAR(normal, 20'000 * 0.7 * 0.995, 200);
  EXPECT_EQ(silent, 0);
  EXPECT_NEAR(off_wall_in_burst, 20'000 * 0.2, 250);
  EXPECT_NEAR(on_wall_in_burst, 20'000 * 0.8 * 0.7 * 0.995, 250);
}

/// A plate in front of a wall; its edges lie at y = +-0.5 and z = +-0.5.
worlds::World plate_before_wall(double gap) {
  return WorldMaker()
      .object(0.5F)
      .quad({4, -0.5, -0.5}, {0, 1, 0}, {0, 0, 1})
      .object(0.5F)
      .quad({4 + gap, -20, -20}, {0, 40, 0}, {0, 0, 40})
      .world();
}

TEST(Mid360Noise, MixedPixelsLieBetweenTheSurfacesAndOnlyAtEdges) {
  Mid360Config config;
  config.merged_share = 1;
  config.echo.range_noise_m = config.echo.range_noise_per_m = 0;
  config.echo.angle_noise_deg = 0;
  config.echo.false_alarm_probability = 0;
  const double half_width = config.beam_half_angle_deg * kDegree;
  for (const double gap : {0.4, 2.0}) {  // within and beyond the echoes' separation
    const worlds::World world = plate_before_wall(gap);
    const Scene scene(world);
    const Mid360 lidar(config, scene, Pose{}, {}, 6);
    int mixed = 0, near_edge = 0;
    double share = 0;
    for (const LidarPoint& point : lidar.scan(rest(Pose{}, 4000)).points) {
      const Vec3 p = point.p_L.cast<double>();
      ASSERT_GT(p.x(), 4 - 1e-4);
      ASSERT_LT(p.x(), 4 + gap + 1e-4);
      // How far the beam passes from the plate's outline, as an angle.
      const double off = std::max(std::abs(p.y() / p.x()), std::abs(p.z() / p.x())) - 0.125;
      near_edge += std::abs(off) < half_width ? 1 : 0;
      if (p.x() < 4 + 1e-3 || p.x() > 4 + gap - 1e-3) continue;
      ++mixed;
      share += (p.x() - 4) / gap;
      ASSERT_LT(std::abs(off), 1.1 * half_width);
    }
    ASSERT_GT(near_edge, 300);
    if (gap > config.echo_separation_m) {
      EXPECT_EQ(mixed, 0);
      continue;
    }
    // The second ray's place across the edge is uniform in +-w: from e inside it lies beyond with
    // probability (w - e) / 2w, on average over e a quarter.
    EXPECT_NEAR(static_cast<double>(mixed) / near_edge, 0.25, 0.06);
    EXPECT_NEAR(share / mixed, 0.5, 0.06);  // as often from in front as from behind
  }
}

TEST(Mid360Noise, SmoothSurfacesHaveNoMixedPixels) {
  // Beams at grazing incidence and at a room's corners cross surfaces, not edges.
  Mid360Config config;
  config.merged_share = 1;
  config.echo.range_noise_m = config.echo.range_noise_per_m = 0;
  config.echo.angle_noise_deg = 0;
  config.echo.false_alarm_probability = 0;
  const worlds::World world = WorldMaker().object(0.6F).box(Pose{}, {9, 3, 0.8}).world();
  const Scene scene(world);
  const Mid360 lidar(config, scene, Pose{}, {}, 7);
  int count = 0;
  for (const LidarPoint& point : lidar.scan(rest(Pose{}, 500)).points) {
    const Vec3 p = point.p_L.cast<double>().cwiseAbs();
    ASSERT_NEAR((p.array() / Eigen::Array3d(9, 3, 0.8)).maxCoeff(), 1, 1e-4);
    ++count;
  }
  EXPECT_GT(count, 50'000);
}

}  // namespace
}  // namespace arex::sim
