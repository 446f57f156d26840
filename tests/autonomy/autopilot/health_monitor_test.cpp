#include "autopilot/health_monitor.h"

#include <gtest/gtest.h>

#include <cmath>
#include <string>

#include "autopilot/allocation.h"
#include "math/random.h"

namespace arex {
namespace {

const VehicleConfig kVehicle;
const double kWeight = kVehicle.mass_kg * kGravity;
const Allocation kAllocation(kVehicle);

/// What flying for a while with such thrusts missing tells; the wrench that is missing is noisy, as
/// gusts and the flight's own manoeuvres make it.
/// @param more missing from the start, @param from_s when the thrusts begin to be missing
std::string tell(const Vec4& missing_n, std::uint64_t seed, const Vec4& more = Vec4::Zero(),
                 double seconds = 10, double from_s = 0) {
  HealthMonitor monitor(HealthConfig{}, kAllocation.mix(), kWeight);
  RandomStream noise(seed, "gusts");
  const double dt = 0.004;
  Vec4 gust = Vec4::Zero();
  std::string told;
  for (int i = 0; i < static_cast<int>(seconds / dt); ++i) {
    const Vec4 draw(noise.normal(), noise.normal(), noise.normal(), noise.normal());
    // Half a newton and 15 mN m RMS, over a second.
    gust += dt * (-gust + std::sqrt(2 / dt) * draw.cwiseProduct(Vec4(0.5, 0.015, 0.015, 0.001)));
    HealthMonitor::Flight flight;
    flight.armed = flight.in_air = true;
    flight.missing.steady = more + gust;
    if (i * dt >= from_s) flight.missing.steady -= kAllocation.effectiveness() * missing_n;
    flight.missing.at_once = flight.missing.steady;
    monitor.update(from_seconds(i * dt), flight, dt);
    for (const Event& event : monitor.take_notices()) {
      if (event.kind == EventKind::kVehicleFault) told += event.detail + ";";  // not of the sensors
    }
  }
  return told;
}

TEST(MotorWatch, NamesTheMotorThatIsWeak) {
  for (int motor = 0; motor < 4; ++motor) {
    for (const double share : {0.1, 0.3, 0.6}) {  // the last: 30 % of twice its hover thrust
      for (std::uint64_t seed = 1; seed <= 5; ++seed) {
        Vec4 missing = Vec4::Zero();
        missing[motor] = share * kWeight / 4;
        const std::string told = tell(missing, seed);
        EXPECT_EQ(told.substr(0, 13), "motor " + std::to_string(motor + 1) + " weak:")
            << share << " seed " << seed << ": " << told;
        EXPECT_EQ(told.find("stopped"), std::string::npos) << told;
      }
    }
  }
}

TEST(MotorWatch, NeitherMassNorCentreNorWindIsAWeakMotor) {
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    EXPECT_EQ(tell(Vec4::Zero(), seed), "");
    EXPECT_EQ(tell(Vec4::Constant(0.1 * kWeight / 4), seed), "") << "10 % too heavy";
    EXPECT_EQ(tell(Vec4::Zero(), seed, Vec4(0, 0.05, 0, 0)), "") << "load to one side";
    EXPECT_EQ(tell(Vec4::Zero(), seed, Vec4(0, 0, 0.08, 0)), "") << "drag";
  }
}

// Side by side, across and three or all four of them: as if the vehicle were heavier, or loaded to
// one side, from one moment on.
TEST(MotorWatch, NamesEachOfSeveralMotorsThatBecomeWeak) {
  for (std::uint64_t seed = 1; seed <= 5; ++seed) {
    for (int motors = 1; motors < 16; ++motors) {
      Vec4 missing = Vec4::Zero();
      for (int i = 0; i < 4; ++i) missing[i] = (motors >> i & 1) * 0.2 * kWeight / 4;
      // Loaded to one side as well.
      const std::string told = tell(missing, seed, Vec4(0, 0.02, 0.01, 0), 25, 12);
      for (int i = 0; i < 4; ++i) {
        const bool named = told.find("motor " + std::to_string(i + 1) + " weak") != told.npos;
        EXPECT_EQ(named, (motors >> i & 1) != 0) << motors << ": " << told;
      }
    }
  }
}

TEST(MotorWatch, AStoppedMotorIsToldAtOnce) {
  const std::string told = tell(Vec4(0, 0, kWeight / 4, 0), 1, Vec4::Zero(), 0.2);
  EXPECT_EQ(told.substr(0, 16), "motor 3 stopped:") << told;
}

TEST(PackWatch, FindsTheInnerResistanceWhateverTheCharge) {
  for (const double resistance : {0.028, 0.08}) {
    PackWatch watch(0.028);
    RandomStream load(3, "load");
    EXPECT_FALSE(watch.resistance_ohm());
    double current = 18, open_v = 16.5;
    for (int i = 0; i < 2000; ++i) {
      current += 0.5 * load.normal() + 0.05 * (18 - current);
      open_v -= 2e-6;
      watch.add({i * 5 * kNanosecondsPerTick, open_v - resistance * current, current});
    }
    ASSERT_TRUE(watch.resistance_ohm());
    EXPECT_NEAR(*watch.resistance_ohm(), resistance, 1e-4);
  }
}

// 60 A at once are no fall of the voltage, a cell that ends is, whatever the current makes of it.
TEST(PackWatch, TellsACellThatEndsFromALoadThatGrows) {
  const auto fall_v = [](double lost_v, double resistance, double load_a) {
    PackWatch watch(0.028);
    RandomStream noise(4, "power");
    for (int i = 0; i < 400; ++i) {
      const bool after = i >= 380;
      const double current = after ? load_a : 1;
      const double r = after ? resistance : 0.028;
      const double v = 16.2 - (after ? lost_v : 0) - r * current + 0.05 * noise.normal();
      watch.add({i * 5 * kNanosecondsPerTick, v, current});
    }
    return watch.fall_v();
  };
  EXPECT_FALSE(fall_v(0, 0.028, 60));
  EXPECT_FALSE(fall_v(0.3, 0.035, 18));
  ASSERT_TRUE(fall_v(4, 0.028, 18));
  EXPECT_NEAR(*fall_v(4, 0.028, 18), 4, 0.3);
  ASSERT_TRUE(fall_v(1, 0.328, 18));
  EXPECT_NEAR(*fall_v(1, 0.328, 18), 1 + 0.3 * 18, 0.4);
}

// The pack gives out while the vehicle hovers: before it has fallen far.
TEST(HealthMonitor, TellsAPackThatGivesOutAtOnceWithinATenthOfASecond) {
  HealthMonitor monitor(HealthConfig{}, kAllocation.mix(), kWeight);
  std::string told;
  Stamp told_at = 0;
  for (int i = 0; i < 800; ++i) {
    const Stamp now = i * 5 * kNanosecondsPerTick;
    const bool fails = i >= 600;
    monitor.add_battery(now, {now, 15.6 - (fails ? 4 + 18 : 0.028 * 18), 18});
    monitor.update(now, {}, 0.005);
    for (const Event& event : monitor.take_notices()) {
      if (event.kind != EventKind::kVehicleFault) continue;
      told += event.detail + ";";
      told_at = now;
    }
  }
  EXPECT_EQ(told.substr(0, 20), "battery cell weak: i") << told;
  EXPECT_LE(told_at, 3'100 * kNanosecondsPerTick);
}

// A sensor that jumps about shows low voltages in a row now and then; no cell has ended for that.
TEST(HealthMonitor, TakesANoisyPowerSensorForNoPackThatGivesOut) {
  for (std::uint64_t seed = 1; seed <= 10; ++seed) {
    HealthMonitor monitor(HealthConfig{}, kAllocation.mix(), kWeight);
    RandomStream noise(seed, "power");
    std::string told;
    for (int i = 0; i < 60'000; ++i) {
      const Stamp now = i * 5 * kNanosecondsPerTick;
      const double noise_v = (i < 600 ? 0.01 : 2) * noise.normal();
      monitor.add_battery(now, {now, 15.6 - 0.028 * 18 + noise_v, 18});
      monitor.update(now, {}, 0.005);
      for (const Event& event : monitor.take_notices()) told += event.detail + ";";
    }
    EXPECT_NE(told.find("power noisy"), std::string::npos) << seed;
    EXPECT_EQ(told.find("voltage fell"), std::string::npos) << seed << ": " << told;
  }
}

TEST(HealthMonitor, NamesASensorThatHasBeenDeadFromTheStart) {
  HealthMonitor monitor(HealthConfig{}, kAllocation.mix(), kWeight);
  RandomStream noise(1, "imu");
  std::string told;
  for (int i = 0; i < 3000; ++i) {
    const Stamp now = i * kNanosecondsPerTick;
    ImuSample imu;
    imu.stamp = now;
    imu.gyro_radps = 0.01 * noise.normal3();
    monitor.add_imu(now, imu);
    if (i % 20 == 0) monitor.add_barometer(now, {now, 101325 + noise.normal()});
    if (i % 10 == 0) monitor.add_battery(now, {now, 15.6 + 0.01 * noise.normal(), 1});
    if (i % 4 == 0) monitor.update(now, {}, 0.004);
    for (const Event& event : monitor.take_notices()) told += event.detail + ";";
  }
  EXPECT_EQ(told, "magnetometer silent;");
}

TEST(HealthMonitor, TellsOfALeanThatNobodyFlies) {
  HealthMonitor monitor(HealthConfig{}, kAllocation.mix(), kWeight);
  HealthMonitor::Flight flight;
  flight.armed = flight.in_air = true;
  std::string told;
  for (int i = 0; i < 250; ++i) {
    flight.tilt_rad = i < 125 ? 0.8 : 1.2;
    monitor.update(i * 4 * kNanosecondsPerTick, flight, 0.004);
    for (const Event& event : monitor.take_notices()) {
      told += std::string(kEventKindNames[static_cast<std::size_t>(event.kind)]) + " " +
              event.detail + ";";
    }
  }
  EXPECT_EQ(told, "vehicle_fault out of control: leans by 69 degrees;");
}

TEST(HealthMonitor, KnowsANoisyBarometerFromOneThatClimbs) {
  const auto told = [](double noise_pa, double climb_pa_per_s) {
    HealthMonitor monitor(HealthConfig{}, kAllocation.mix(), kWeight);
    RandomStream noise(5, "barometer");
    std::string text;
    for (int i = 0; i < 500; ++i) {
      const Stamp now = i * 20 * kNanosecondsPerTick;
      monitor.add_barometer(
          now, {now, 101325 + climb_pa_per_s * to_seconds(now) + noise_pa * noise.normal()});
      monitor.update(now, {}, 0.02);
      for (const Event& event : monitor.take_notices()) {
        if (event.detail.starts_with("barometer")) text += event.detail + ";";
      }
    }
    return text;
  };
  EXPECT_EQ(told(1, 0), "");
  EXPECT_EQ(told(1, -60), "");  // 5 m/s
  EXPECT_EQ(told(30, 0), "barometer noisy;");
}

TEST(HealthMonitor, KnowsANoisyPowerSensorFromALoadThatChanges) {
  const auto told = [](double noise_v, double step_a, int every) {
    HealthMonitor monitor(HealthConfig{}, kAllocation.mix(), kWeight);
    RandomStream noise(6, "power");
    std::string text;
    for (int i = 0; i < 1000; ++i) {
      const Stamp now = i * 10 * kNanosecondsPerTick;
      const double current_a = 18 + (i / every % 2 == 0 ? 0 : step_a);
      const double voltage_v = 15.6 - 0.028 * current_a + noise_v * noise.normal();
      monitor.add_battery(now, {now, voltage_v, current_a});
      monitor.update(now, {}, 0.01);
      for (const Event& event : monitor.take_notices()) {
        if (event.detail.starts_with("power")) text += event.detail + ";";
      }
    }
    return text;
  };
  EXPECT_EQ(told(0.01, 0, 1), "");
  EXPECT_EQ(told(0.01, 15, 5), "");  // full thrust and back, ten times a second
  EXPECT_EQ(told(0.5, 0, 1), "power noisy;");
}

}  // namespace
}  // namespace arex
