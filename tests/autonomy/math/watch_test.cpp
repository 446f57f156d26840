#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <string>

#include "math/random.h"
#include "math/stream_watch.h"
#include "math/vibration_watch.h"

namespace arex {
namespace {

constexpr Stamp kPeriod = 5 * kNanosecondsPerTick;  // 200 Hz
constexpr StreamWatchConfig kConfig{.silent_s = 0.05, .stuck_readings = 20, .late_s = 0.01};

/// A sensor of 200 Hz, and what its watch tells.
struct Sensor {
  StreamWatch watch{"imu", kConfig};
  RandomStream noise{1, "sensor"};
  Stamp now = 0;
  double value = 0;
  std::string told;

  enum class Does { kMeasures, kRepeats, kNothing };
  void run(double seconds, Does does, double delay_s = 0, double lost = 0, bool lively = true) {
    for (const Stamp end = now + from_seconds(seconds); now < end; now += kPeriod) {
      if (does == Does::kMeasures) value = noise.normal();
      if (does != Does::kNothing && noise.uniform() >= lost) {
        watch.add(now, now - from_seconds(delay_s), {&value, 1});
      }
      if (const auto change = watch.update(now, lively)) told += *change + ";";
    }
  }
};

TEST(StreamWatch, TellsWhatIsWrongWithAStreamAndWhenItIsOver) {
  using Does = Sensor::Does;
  Sensor sensor;
  sensor.run(3, Does::kMeasures);
  EXPECT_EQ(sensor.told, "");
  sensor.run(1, Does::kNothing);
  EXPECT_EQ(sensor.told, "imu silent;");
  sensor.run(5, Does::kMeasures);
  EXPECT_EQ(sensor.told, "imu silent;imu sound again;");
  sensor.told.clear();
  sensor.run(1, Does::kRepeats);
  sensor.run(3, Does::kMeasures);
  EXPECT_EQ(sensor.told, "imu stuck;imu sound again;");
  sensor.told.clear();
  sensor.run(2, Does::kMeasures, 0, 0.2);
  EXPECT_EQ(sensor.told.substr(0, 21), "imu readings missing;");
}

TEST(StreamWatch, SaysOfASensorThatNeverSpokeOnlyWhatIsExpectedOfIt) {
  using Does = Sensor::Does;
  Sensor unknown;
  unknown.run(5, Does::kNothing);
  EXPECT_EQ(unknown.told, "");
  Sensor dead;
  dead.watch.expect(dead.now);
  dead.run(0.9, Does::kNothing);  // it may take a moment
  EXPECT_EQ(dead.told, "");
  dead.run(5, Does::kNothing);
  EXPECT_EQ(dead.told, "imu silent;");
  dead.run(5, Does::kMeasures);
  EXPECT_EQ(dead.told, "imu silent;imu sound again;");
  Sensor sound;
  sound.watch.expect(sound.now);
  sound.run(5, Does::kMeasures);
  EXPECT_EQ(sound.told, "");
}

TEST(StreamWatch, AReadingThatRestsIsNoStuckOneWhileTheVehicleRests) {
  Sensor sensor;
  sensor.run(3, Sensor::Does::kRepeats, 0, 0, false);
  EXPECT_EQ(sensor.told, "");
}

TEST(StreamWatch, AClockThatIsOffIsNotLateButADelayThatGrowsIs) {
  for (const double offset_s : {-0.05, 0.0, 0.05}) {
    Sensor sensor;
    sensor.run(3, Sensor::Does::kMeasures, offset_s);
    EXPECT_EQ(sensor.told, "") << offset_s;
    sensor.run(1, Sensor::Does::kMeasures, offset_s + 0.02);
    EXPECT_EQ(sensor.told, "imu late;") << offset_s;
  }
}

TEST(StreamWatch, RareLossesAreNone) {
  Sensor sensor;
  sensor.run(20, Sensor::Does::kMeasures, 0, 0.002);
  EXPECT_EQ(sensor.told, "");
}

/// A second of a line on one axis, upon noise.
std::string shake(VibrationWatch& watch, double amplitude, double frequency_hz, double sample_hz) {
  RandomStream noise(7, "shake");
  std::string told;
  for (int i = 0; i < static_cast<int>(sample_hz); ++i) {
    const double t = i / sample_hz;
    const Vec3 line =
        amplitude * std::sin(2 * std::numbers::pi * frequency_hz * t + 0.3) * Vec3(0.1, 1, 0.2);
    watch.add(line + 0.01 * noise.normal3(), Vec3(0, 0, kGravity) + 0.1 * noise.normal3());
    if (const auto change = watch.update()) told += *change + ";";
  }
  return told;
}

TEST(VibrationWatch, MeasuresALinesStrengthAndFrequency) {
  for (const double sample_hz : {200.0, 1000.0}) {
    for (const double frequency_hz : {20.0, 47.0, 80.0}) {
      for (const double amplitude : {0.2, 3.0}) {
        VibrationWatch watch({.gyro_limit_radps = 1}, sample_hz);
        shake(watch, amplitude, frequency_hz, sample_hz);
        const double rms = amplitude / std::numbers::sqrt2;
        EXPECT_NEAR(watch.newest().gyro_radps, rms, 0.05 * rms) << frequency_hz << " Hz";
        EXPECT_NEAR(watch.newest().frequency_hz, frequency_hz, 2) << sample_hz << " Hz";
        EXPECT_NEAR(watch.newest().accel_mps2, 0.1, 0.03);
        EXPECT_EQ(watch.shakes(), rms > 1);
      }
    }
  }
}

TEST(VibrationWatch, TellsOnceWhenItBeginsAgainWhenItDoublesAndWhenItIsOver) {
  VibrationWatch watch({.gyro_limit_radps = 1}, 1000);
  EXPECT_EQ(shake(watch, 1.2, 80, 1000), "");  // 0.85 rad/s RMS
  EXPECT_EQ(shake(watch, 2.0, 80, 1000).substr(0, 26), "gyro 1.41 rad/s RMS at 80 ");
  EXPECT_EQ(shake(watch, 2.0, 80, 1000), "");
  EXPECT_EQ(shake(watch, 4.5, 80, 1000).substr(0, 19), "gyro 3.18 rad/s RMS");
  EXPECT_EQ(shake(watch, 0.1, 80, 1000), "over;");
}

}  // namespace
}  // namespace arex
