#include "stack/health_watch.h"

#include <gtest/gtest.h>

#include <cmath>
#include <string>

#include "math/random.h"

namespace arex {
namespace {

/// Frames of a slanted wall at 10 Hz, and what the watch tells of them.
class Camera {
 public:
  void run(int frames, double noise_fraction, double valid_share) {
    for (int i = 0; i < frames; ++i, now_ += kNanosecondsPerSecond / 10) {
      DepthImage image;
      image.stamp = now_;
      image.camera = {320, 240, 160, 160, 160, 120};
      image.depth_m.resize(320 * 240);
      for (std::size_t k = 0; k < image.depth_m.size(); ++k) {
        const double slant = 1.5 + 0.004 * static_cast<double>(k % 320);
        const double depth = slant * (1 + (noise_fraction + 0.002) * noise_.normal());
        image.depth_m[k] = noise_.uniform() < valid_share ? static_cast<float>(depth) : 0.0F;
      }
      watch_.add_depth(now_, image);
      for (const Event& event : watch_.update(now_, {})) told += event.detail + ";";
    }
  }
  std::string told;

 private:
  HealthWatch watch_{HealthWatchConfig{}};
  RandomStream noise_{1, "camera"};
  Stamp now_ = 0;
};

TEST(HealthWatch, TellsABlindedCameraAndANoisyOne) {
  Camera camera;
  camera.run(40, 0, 0.9);
  EXPECT_EQ(camera.told, "");
  camera.run(20, 0, 0.1);
  EXPECT_EQ(camera.told, "depth blinded;");
  camera.run(20, 0, 0.9);
  EXPECT_EQ(camera.told, "depth blinded;depth not blinded any more;");
  camera.told.clear();
  camera.run(20, 0.05, 0.9);
  EXPECT_EQ(camera.told, "depth noisy;");
}

TEST(HealthWatch, AutopilotAndOdometryThatContradictEachOtherAreToldIfItLasts) {
  HealthWatch watch{HealthWatchConfig{}};
  std::string told;
  const auto fly = [&](double difference_rad, double off_m, int from_ms, int to_ms) {
    for (int ms = from_ms; ms < to_ms; ms += 10) {
      const HealthWatch::Flight flight{true, true, difference_rad, off_m};
      for (const Event& event : watch.update(ms * kNanosecondsPerTick, flight)) {
        told += event.detail + ";";
      }
    }
  };
  fly(0.05, 0.3, 0, 1000);
  fly(0.3, 0.3, 1000, 1150);  // a moment is none
  fly(0.05, 1.0, 1150, 1300);
  EXPECT_EQ(told, "");
  fly(0.3, 0.3, 1300, 2000);
  fly(0.05, 1.24, 2000, 3000);
  EXPECT_EQ(told,
            "attitude: autopilot and odometry differ by 17 degrees;"
            "out of control: 1.2 m off its path;");
}

}  // namespace
}  // namespace arex
