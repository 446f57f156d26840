#include "stack/health_watch.h"

#include <gtest/gtest.h>

#include <cmath>
#include <string>
#include <vector>

#include "math/random.h"

namespace arex {
namespace {

/// Frames of a slanted wall at 10 Hz, and what the watch tells of them.
class Camera {
 public:
  explicit Camera(std::uint64_t seed = 1) : noise_(seed, "camera") {}

  /// @param glare chance of each block of 16 pixels to be drowned by light
  /// @param sky share of the image, from the top, in which nothing is in range
  void run(int frames, double noise_fraction, double valid_share, double glare = 0,
           double sky = 0) {
    for (int i = 0; i < frames; ++i, now_ += kNanosecondsPerSecond / 10) {
      DepthImage image;
      image.stamp = now_;
      image.camera = {320, 240, 160, 160, 160, 120};
      image.depth_m.resize(320 * 240);
      for (std::size_t k = 0; k < image.depth_m.size(); ++k) {
        const double slant = 1.5 + 0.0015 * static_cast<double>(k % 320);
        const double depth = slant * (1 + (noise_fraction + 0.002) * noise_.normal());
        const bool seen = noise_.uniform() < valid_share && static_cast<double>(k) >= sky * 76800;
        image.depth_m[k] = seen ? static_cast<float>(depth) : 0.0F;
      }
      for (int block = 0; glare > 0 && block < 20 * 15; ++block) {
        if (noise_.uniform() >= glare) continue;
        for (int pixel = 0; pixel < 256; ++pixel) {
          const int u = 16 * (block % 20) + pixel % 16, v = 16 * (block / 20) + pixel / 16;
          image.depth_m[static_cast<std::size_t>(320 * v + u)] = 0;
        }
      }
      if (lidar_m_ > 0) watch_.add_scan(now_, scan());
      watch_.add_depth(now_, image);
      for (const Event& event : watch_.update(now_, {})) told += event.detail + ";";
    }
  }
  /// From now on a LiDAR beside it meets what stands so far away; 0: there is none.
  void set_lidar(double distance_m) { lidar_m_ = distance_m; }
  std::string told;

 private:
  /// In the middle of the image, on a sphere about the LiDAR.
  LidarScanPtr scan() {
    const VehicleConfig vehicle;
    const Pose X_LC = vehicle.X_BL().inverse() * vehicle.X_BC();
    auto scan = std::make_shared<LidarScan>();
    scan->end = now_;
    for (int i = 0; i < 200; ++i) {
      const Vec3 p_C = lidar_m_ * Vec3(noise_.uniform() - 0.5, noise_.uniform() - 0.5, 1);
      const Vec3 p_L = X_LC * p_C;
      scan->points.push_back({.p_L = (lidar_m_ * p_L.normalized()).cast<float>()});
    }
    return scan;
  }

  HealthWatch watch_{HealthWatchConfig{}};
  RandomStream noise_;
  Stamp now_ = 0;
  double lidar_m_ = 0;
};

TEST(HealthWatch, TellsACameraThatIsBlindedInPartFromOneThatSeesLess) {
  for (std::uint64_t seed = 1; seed <= 5; ++seed) {
    Camera camera(seed);
    camera.run(30, 0, 0.97);
    camera.run(30, 0, 0.97, 0, 0.4);  // half of the wall ends
    camera.run(30, 0, 0.93);          // leaves with gaps
    EXPECT_EQ(camera.told, "") << seed;
    camera.run(20, 0, 0.97, 0.2);
    EXPECT_EQ(camera.told, "depth blinded in part;") << seed;
    camera.run(20, 0, 0.97);
    EXPECT_EQ(camera.told, "depth blinded in part;depth not blinded in part any more;") << seed;
  }
}

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

TEST(HealthWatch, TellsNoiseThatComesAndGoesOnce) {
  Camera camera;
  camera.run(40, 0, 0.9);
  camera.run(10, 0.05, 0.9);
  for (int i = 0; i < 20; ++i) {
    camera.run(3, 0, 0.9);
    camera.run(6, 0.05, 0.9);
  }
  EXPECT_EQ(camera.told, "depth noisy;");
  camera.run(20, 0, 0.9);
  EXPECT_EQ(camera.told, "depth noisy;depth not noisy any more;");
}

// Above the edge of a roof there is nothing to measure; the LiDAR says so.
TEST(HealthWatch, TakesAViewOfNothingForNoBlindness) {
  for (std::uint64_t seed = 1; seed <= 3; ++seed) {
    Camera camera(seed);
    camera.set_lidar(2);
    camera.run(40, 0, 0.9);
    camera.set_lidar(20);
    camera.run(20, 0, 0.97, 0, 0.95);  // the wall ends, but for a strip
    camera.set_lidar(2);
    camera.run(20, 0, 0.9);
    EXPECT_EQ(camera.told, "") << seed;
    camera.run(20, 0, 0.1);  // it stands there, and is not measured
    EXPECT_EQ(camera.told, "depth blinded;") << seed;
    camera.set_lidar(20);
    camera.run(20, 0, 0.1);  // whether it would be, nobody knows
    EXPECT_EQ(camera.told, "depth blinded;") << seed;
    camera.set_lidar(2);
    camera.run(20, 0, 0.9);
    EXPECT_EQ(camera.told, "depth blinded;depth not blinded any more;") << seed;
  }
}

// Its last scan lies too long ago to say anything.
TEST(HealthWatch, TellsABlindedCameraOfAVehicleWhoseLidarIsSilent) {
  Camera camera;
  camera.set_lidar(20);
  camera.run(40, 0, 0.9);
  camera.set_lidar(0);
  camera.run(20, 0, 0.1);
  EXPECT_EQ(camera.told, "depth blinded;");
}

/// Images of an infrared pair, and what the watch tells of them in flight.
class Pair {
 public:
  Pair(std::uint64_t seed, double rate_hz)
      : noise_(seed, "pixels"), period_(from_seconds(1 / rate_hz)) {}

  enum class Doing { kSound, kSilent, kStuck, kBlack, kWhite };
  /// @param late_s beyond the usual delay
  void run(double seconds, Doing doing, double late_s = 0) {
    const Stamp end = now_ + from_seconds(seconds);
    for (; now_ < end; now_ += kNanosecondsPerTick * 5) {
      if (now_ >= next_) {
        if (doing != Doing::kSilent) watch_.add_images(now_, image(doing, from_seconds(late_s)));
        next_ += period_;
      }
      for (const Event& event : watch_.update(now_, {.in_air = true})) told += event.detail + ";";
    }
  }
  std::string told;

 private:
  StereoImage image(Doing doing, Stamp late) {
    StereoImage image;
    image.time_ns = next_ - from_seconds(0.04) - late;
    image.width = 848;
    image.height = 480;
    if (doing != Doing::kStuck) {
      pixels_.assign(std::size_t{848} * 480, doing == Doing::kWhite ? 255 : 0);
      if (doing == Doing::kSound) {
        for (std::uint8_t& grey : pixels_)
          grey = static_cast<std::uint8_t>(90 + noise_.uniform_int(0, 3));
      }
    }
    image.left = pixels_;
    return image;
  }

  HealthWatch watch_{HealthWatchConfig{}};
  RandomStream noise_;
  Stamp period_, now_ = 0, next_ = 0;
  std::vector<std::uint8_t> pixels_;
};

TEST(HealthWatch, TellsAnInfraredPairThatIsSilentStuckOrLate) {
  using Doing = Pair::Doing;
  for (const double rate_hz : {10.0, 5.0, 2.0}) {
    Pair pair(1, rate_hz);
    pair.run(12, Doing::kSound);
    EXPECT_EQ(pair.told, "") << rate_hz;
    pair.run(3, Doing::kSilent);
    EXPECT_EQ(pair.told, "infrared silent;") << rate_hz;
    pair.run(4, Doing::kSound);
    EXPECT_EQ(pair.told, "infrared silent;infrared sound again;") << rate_hz;
    pair.told.clear();
    pair.run(4, Doing::kStuck);
    EXPECT_EQ(pair.told, "infrared stuck;") << rate_hz;
    pair.run(4, Doing::kSound);
    EXPECT_EQ(pair.told, "infrared stuck;infrared sound again;") << rate_hz;
    pair.told.clear();
    pair.run(8, Doing::kSound, 0.2);
    EXPECT_EQ(pair.told, "infrared late;") << rate_hz;
  }
}

TEST(HealthWatch, TakesNeitherASlowPairNorTheDarkForAFault) {
  using Doing = Pair::Doing;
  Pair slow(2, 1);
  slow.run(30, Doing::kSound);
  EXPECT_EQ(slow.told, "");
  Pair pair(3, 10);
  pair.run(3, Doing::kSound);
  pair.run(3, Doing::kBlack);
  pair.run(3, Doing::kWhite);
  EXPECT_EQ(pair.told, "");
}

// A few pixels in range, as many in each image, are no image that hangs.
TEST(HealthWatch, TakesAViewOfLittleForNoStuckCamera) {
  HealthWatch watch{HealthWatchConfig{}};
  RandomStream random(4, "depth");
  DepthImage image;
  image.camera = {320, 240, 160, 160, 160, 120};
  std::string told;
  const auto run = [&](int frames, bool hangs) {
    for (int i = 0; i < frames; ++i, image.stamp += kNanosecondsPerSecond / 10) {
      if (!hangs) {
        image.depth_m.assign(std::size_t{320} * 240, 0);
        for (std::size_t k = 0; k < 320 * 8; ++k) {
          image.depth_m[k] = static_cast<float>(8 + 0.1 * random.normal());
        }
      }
      watch.add_depth(image.stamp, image);
      for (const Event& event : watch.update(image.stamp, {.in_air = true})) {
        told += event.detail + ";";
      }
    }
  };
  run(30, false);
  EXPECT_EQ(told, "");
  run(10, true);
  EXPECT_EQ(told, "depth stuck;");
}

/// Nine axes at 200 Hz, of which the field is what a magnetometer of `rate_hz` gave last.
class NineAxes {
 public:
  NineAxes(std::uint64_t seed, int rate_hz) : noise_(seed, "magnetometer"), every_(200 / rate_hz) {}

  struct Doing {
    double turns_radps = 0;
    bool in_air = true;
    bool hangs = false;      ///< the magnetometer, or it is silent
    double noise_gauss = 0;  ///< beyond its own
    double passes_mps = 0;   ///< a steel pillar, half a metre away
  };
  void run(double seconds, const Doing& doing) {
    const int first = tick_;
    for (; tick_ < first + static_cast<int>(200 * seconds); ++tick_) {
      const double t = (tick_ - first) / 200.0;
      yaw_ += doing.turns_radps / 200;
      if (tick_ % every_ == 0 && !doing.hangs) {
        // The pillar's: a dipole with half of the Earth's field at 0.5 m.
        const Vec3 away(doing.passes_mps * (t - 0.5 * seconds), 0.5, 0);
        const double r = away.norm();
        const Vec3 steel =
            doing.passes_mps > 0
                ? Vec3(0.2 * std::pow(0.5 / r, 3) * (3 * away.y() / (r * r) * away - Vec3(0, 1, 0)))
                : Vec3(Vec3::Zero());
        const Vec3 earth(0.375 * std::sin(yaw_), 0.375 * std::cos(yaw_), -0.253);
        field_ = earth + steel + (0.0057 + doing.noise_gauss) * noise_.normal3();
      }
      watch_.add(field_);
      if (auto event = watch_.update(doing.in_air)) told += *event + ";";
    }
  }
  std::string told;

 private:
  FieldWatch watch_{HealthWatchConfig{}.field_step_gauss};
  RandomStream noise_;
  int every_;
  int tick_ = 0;
  double yaw_ = 0;
  Vec3 field_ = Vec3::Zero();
};

TEST(FieldWatch, NeitherTurnsNorSteelNorStandingAreAFault) {
  for (std::uint64_t seed = 1; seed <= 5; ++seed) {
    for (const int rate_hz : {200, 100, 50}) {
      NineAxes axes(seed, rate_hz);
      axes.run(2, {.in_air = false});
      axes.run(5, {.turns_radps = 3.5});  // the vehicle's limit
      axes.run(4, {.passes_mps = 2});
      EXPECT_EQ(axes.told, "") << rate_hz << " Hz, seed " << seed;
    }
  }
}

TEST(FieldWatch, TellsAMagnetometerThatHangsAndANoisyOne) {
  for (std::uint64_t seed = 1; seed <= 5; ++seed) {
    for (const int rate_hz : {200, 100, 50}) {
      NineAxes axes(seed, rate_hz);
      axes.run(2, {.in_air = false});
      axes.run(2, {});
      axes.run(1, {.hangs = true});
      EXPECT_EQ(axes.told, "imu's magnetometer stuck;") << rate_hz << " Hz, seed " << seed;
      axes.run(1, {});
      EXPECT_EQ(axes.told, "imu's magnetometer stuck;imu's magnetometer sound again;");
      axes.told.clear();
      axes.run(2, {.noise_gauss = 0.2});
      EXPECT_EQ(axes.told, "imu's magnetometer noisy;") << rate_hz << " Hz, seed " << seed;
    }
  }
}

TEST(FieldWatch, AnImuWithoutAMagnetometerHasNoneThatHangs) {
  FieldWatch watch(HealthWatchConfig{}.field_step_gauss);
  for (int i = 0; i < 2000; ++i) {
    watch.add(Vec3::Zero());
    EXPECT_FALSE(watch.update(true));
  }
}

// What the stack reads and has never heard of is told once the vehicle is armed: what is on its way
// or is not read at all is no fault.
TEST(HealthWatch, TellsASensorThatHasBeenDeadFromTheStart) {
  HealthWatch watch(HealthWatchConfig{}, {}, {.imu = true, .depth = true});
  RandomStream noise(1, "imu");
  std::string told;
  const auto run = [&](int from_ms, int to_ms, bool armed) {
    for (int ms = from_ms; ms < to_ms; ms += 5) {
      const Stamp now = ms * kNanosecondsPerTick;
      ImuSample imu;
      imu.stamp = now;
      imu.gyro_radps = 0.01 * noise.normal3();
      watch.add_imu(now, imu);
      for (const Event& event : watch.update(now, {.armed = armed})) told += event.detail + ";";
    }
  };
  run(0, 5000, false);
  EXPECT_EQ(told, "");
  run(5000, 8000, true);
  EXPECT_EQ(told, "depth silent;");
}

TEST(HealthWatch, KnowsWhenTheImuSaysNothingOfOthers) {
  HealthWatch watch{HealthWatchConfig{}};
  RandomStream noise(2, "imu");
  Stamp now = 0;
  const auto run = [&](double seconds, double noise_radps) {
    for (const Stamp end = now + from_seconds(seconds); now < end; now += 5 * kNanosecondsPerTick) {
      ImuSample imu;
      imu.stamp = now;
      imu.gyro_radps = (0.01 + noise_radps) * noise.normal3();
      imu.accel_mps2 = Vec3(0, 0, kGravity) + 0.1 * noise.normal3();
      watch.add_imu(now, imu);
      watch.update(now, {.armed = true, .in_air = true});
    }
  };
  run(3, 0);
  EXPECT_TRUE(watch.imu_sound(now));
  run(0.2, 0.8);  // the fault's own default: before the third scan comes
  EXPECT_FALSE(watch.imu_sound(now));
  run(1, 0);
  EXPECT_FALSE(watch.imu_sound(now));  // what was estimated with it is not over
  run(5, 0);
  EXPECT_TRUE(watch.imu_sound(now));
  now += kNanosecondsPerSecond;  // silent
  watch.update(now, {.armed = true, .in_air = true});
  EXPECT_FALSE(watch.imu_sound(now));
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
