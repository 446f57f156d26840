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
std::string tell(const Vec4& missing_n, std::uint64_t seed, const Vec4& more = Vec4::Zero(),
                 double seconds = 10) {
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
    flight.missing.steady = more + gust - kAllocation.effectiveness() * missing_n;
    flight.missing.at_once = flight.missing.steady;
    monitor.update(from_seconds(i * dt), flight, dt);
    for (const Event& event : monitor.take_notices()) told += event.detail + ";";
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

TEST(MotorWatch, AStoppedMotorIsToldAtOnce) {
  const std::string told = tell(Vec4(0, 0, kWeight / 4, 0), 1, Vec4::Zero(), 0.2);
  EXPECT_EQ(told.substr(0, 16), "motor 3 stopped:") << told;
}

TEST(PackWatch, FindsTheInnerResistanceWhateverTheCharge) {
  for (const double resistance : {0.028, 0.08}) {
    PackWatch watch;
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
      for (const Event& event : monitor.take_notices()) text += event.detail + ";";
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
        if (event.kind == EventKind::kSensorFault) text += event.detail + ";";
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
