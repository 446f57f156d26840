#include "sensors/infrared_imager.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "math/random.h"
#include "math/so3.h"
#include "sensors/d430_stereo.h"

namespace arex::sim {
namespace {

const PinholeCamera kCamera = D430Config{}.camera();

std::size_t index_of(int u, int v) {
  return static_cast<std::size_t>(v) * static_cast<std::size_t>(kCamera.width) +
         static_cast<std::size_t>(u);
}

InfraredScene even_scene(float lux, float inverse_depth = 0.25F) {
  const std::size_t pixels = index_of(0, kCamera.height);
  return {std::vector<float>(pixels, lux), std::vector<float>(pixels, inverse_depth)};
}

/// Nothing but the shutter: no noise, optics or vignetting.
InfraredSensorConfig bare_config() {
  InfraredSensorConfig config;
  config.noise_free = true;
  config.blur_kernel = 0;
  config.vignetting = 0;
  return config;
}

struct Moments {
  double mean = 0, variance = 0;
};
Moments moments(const std::vector<std::uint8_t>& grey) {
  double sum = 0, squares = 0;
  for (const std::uint8_t g : grey) {
    sum += g;
    squares += static_cast<double>(g) * g;
  }
  const auto n = static_cast<double>(grey.size());
  return {sum / n, squares / n - sum / n * (sum / n)};
}

// Shot noise is the root of the electrons, read noise is added to it, gain amplifies both; rounding
// to grey values adds 1/12.
TEST(InfraredImager, NoiseIsThatOfElectronsAndReading) {
  InfraredSensorConfig config;
  config.vignetting = 0;
  InfraredImager imager(config, kCamera);
  for (std::uint64_t seed = 1; seed <= 3; ++seed) {
    for (const double gain : {1.0, 4.0, 15.5}) {
      for (const double grey_wanted : {40.0, 100.0, 160.0}) {
        const double grey_per_electron = gain * 255 / config.full_well_e;
        const double electrons = grey_wanted / grey_per_electron;
        const double lux = electrons / (config.sensitivity_e_per_lx_s * 0.004);
        std::vector<std::uint8_t> grey;
        imager.expose(even_scene(static_cast<float>(lux)), {0.004, gain}, {}, seed, grey);
        const auto [mean, variance] = moments(grey);
        const double expected = grey_per_electron * grey_per_electron *
                                    (electrons + config.read_noise_e * config.read_noise_e) +
                                1.0 / 12;
        EXPECT_NEAR(mean, grey_wanted, 0.05 + 0.001 * grey_wanted) << gain;
        EXPECT_NEAR(variance / expected, 1, 0.02) << gain << ", " << grey_wanted;
      }
    }
  }
}

TEST(InfraredImager, NoiseOfNeighboursAndFramesIsIndependent) {
  InfraredSensorConfig config;
  config.vignetting = 0;
  InfraredImager imager(config, kCamera);
  std::vector<std::uint8_t> a, b;
  imager.expose(even_scene(80), {0.0085, 1}, {}, 1, a);
  imager.expose(even_scene(80), {0.0085, 1}, {}, 2, b);
  const auto [mean, variance] = moments(a);
  double beside = 0, below = 0, between = 0;
  int n = 0;
  for (int v = 0; v + 1 < kCamera.height; ++v) {
    for (int u = 0; u + 1 < kCamera.width; ++u, ++n) {
      const double here = a[index_of(u, v)] - mean;
      beside += here * (a[index_of(u + 1, v)] - mean);
      below += here * (a[index_of(u, v + 1)] - mean);
      between += here * (b[index_of(u, v)] - mean);
    }
  }
  for (const double sum : {beside, below, between}) EXPECT_LT(std::abs(sum / n), 0.01 * variance);
}

TEST(InfraredImager, FullLightIsWhiteAndNoneIsBlack) {
  InfraredImager imager({}, kCamera);
  std::vector<std::uint8_t> grey;
  imager.expose(even_scene(1e7F), {0.0085, 1}, {}, 1, grey);
  EXPECT_GT(moments(grey).mean, 250);
  imager.expose(even_scene(0), {0.0085, 1}, {}, 1, grey);
  EXPECT_LT(moments(grey).mean, 0.5);
}

TEST(InfraredImager, OpticsSpreadAPointByTheBinomialKernel) {
  InfraredSensorConfig config = bare_config();
  config.blur_kernel = 0.12;
  InfraredImager imager(config, kCamera);
  InfraredScene scene = even_scene(0);
  scene.light_lx[index_of(400, 200)] = 1000;
  std::vector<std::uint8_t> grey;
  imager.expose(scene, {0.0085, 1}, {}, 1, grey);
  const std::array<double, 3> kernel{0.12, 0.76, 0.12};
  double total = 0;
  for (int dv = -2; dv <= 2; ++dv) {
    for (int du = -2; du <= 2; ++du) {
      const bool inside = std::abs(du) <= 1 && std::abs(dv) <= 1;
      const double expected = inside ? 1000 * kernel[static_cast<std::size_t>(du + 1)] *
                                           kernel[static_cast<std::size_t>(dv + 1)]
                                     : 0;
      const double received = static_cast<double>(imager.received()[index_of(400 + du, 200 + dv)]);
      EXPECT_NEAR(received, expected, 1e-3) << du << ", " << dv;
      total += received;
    }
  }
  EXPECT_NEAR(total, 1000, 1e-2);
}

TEST(InfraredImager, CornersAreDarkerByTheVignetting) {
  InfraredSensorConfig config = bare_config();
  config.vignetting = 0.3;
  InfraredImager imager(config, kCamera);
  std::vector<std::uint8_t> grey;
  imager.expose(even_scene(120), {0.0085, 1}, {}, 1, grey);
  const double middle = grey[index_of(424, 240)];
  EXPECT_NEAR(grey[index_of(0, 0)] / middle, 0.7, 0.01);
  EXPECT_NEAR(grey[index_of(847, 479)] / middle, 0.7, 0.01);
  EXPECT_GT(grey[index_of(424, 0)] / middle, 0.9);
}

TEST(ImageVelocity, IsThatOfAStandingPointFromAMovingCamera) {
  RandomStream random(3, "twists");
  for (int i = 0; i < 200; ++i) {
    const CameraTwist twist{random.normal3(), random.normal3()};
    const double u = random.uniform(0, 847), v = random.uniform(0, 479),
                 z = random.uniform(0.5, 30);
    const double x = (u - kCamera.cx) / kCamera.fx, y = (v - kCamera.cy) / kCamera.fy;
    const Vec3 p = kCamera.unproject(u, v, z);
    constexpr double kStep = 1e-6;
    const auto seen_after = [&](double t) {
      const Vec3 q = so3::Exp(t * twist.w_C).transpose() * (p - t * twist.v_C);
      return Vec2(kCamera.fx * q.x() / q.z(), kCamera.fy * q.y() / q.z());
    };
    const Vec2 numeric = (seen_after(kStep) - seen_after(-kStep)) / (2 * kStep);
    const Vec2 closed = image_velocity(kCamera, twist, x, y, 1 / z);
    EXPECT_LT((closed - numeric).norm(), 1e-3 * (1 + numeric.norm()));
  }
}

/// Length of the box that a step edge was smeared by: its derivative's variance is L^2 / 12.
double smear_length(const std::vector<float>& light, int v) {
  double sum = 0, first = 0, second = 0;
  for (int u = 300; u < 548; ++u) {
    const double step =
        static_cast<double>(light[index_of(u + 1, v)]) - static_cast<double>(light[index_of(u, v)]);
    sum += step;
    first += step * u;
    second += step * u * u;
  }
  const double mean = first / sum;
  return std::sqrt(12 * std::max(0.0, second / sum - mean * mean));
}

InfraredScene step_scene(float inverse_depth) {
  InfraredScene scene = even_scene(20, inverse_depth);
  for (int v = 0; v < kCamera.height; ++v) {
    for (int u = 424; u < kCamera.width; ++u) scene.light_lx[index_of(u, v)] = 120;
  }
  return scene;
}

// f w t in the middle of the image for a turn, f v t / z for a sideways flight.
TEST(InfraredImager, BlurIsAsLongAsTheImageMoves) {
  InfraredImager imager(bare_config(), kCamera);
  std::vector<std::uint8_t> grey;
  for (const double exposure : {0.004, 0.0085, 0.02}) {
    for (const double rate : {0.5, 1.0, 3.49}) {
      imager.expose(step_scene(0.25F), {exposure, 1}, {Vec3::Zero(), {0, rate, 0}}, 1, grey);
      const double expected = kCamera.fx * rate * exposure;
      if (expected < 2) continue;
      EXPECT_NEAR(smear_length(imager.received(), 240), expected, 0.04 * expected + 0.25);
    }
    for (const double z : {0.5, 2.0}) {
      imager.expose(step_scene(static_cast<float>(1 / z)), {exposure, 1}, {{2, 0, 0}, Vec3::Zero()},
                    1, grey);
      const double expected = kCamera.fx * 2 * exposure / z;
      if (expected < 2) continue;
      EXPECT_NEAR(smear_length(imager.received(), 240), expected, 0.04 * expected + 0.25);
    }
  }
}

TEST(InfraredImager, AStandingCameraSmearsNothing) {
  InfraredImager imager(bare_config(), kCamera);
  std::vector<std::uint8_t> grey;
  const InfraredScene scene = step_scene(0.5F);
  imager.expose(scene, {0.0085, 1}, {}, 1, grey);
  EXPECT_EQ(imager.received(), scene.light_lx);
}

}  // namespace
}  // namespace arex::sim
