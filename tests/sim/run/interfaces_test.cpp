#include "run/interfaces.h"

#include <gtest/gtest.h>

#include <bit>
#include <cmath>
#include <stdexcept>
#include <vector>

#include "run/companion_link.h"
#include "run/dshot.h"
#include "run/serial_line.h"

namespace arex::sim {
namespace {

constexpr Stamp kTick = kNanosecondsPerTick;

TEST(Dshot, EncodesThePublishedExampleAndEveryValue) {
  EXPECT_EQ(dshot::encode(1046), 0b1000001011000110);  // Betaflight's documentation
  for (int value = 0; value <= dshot::kMost; ++value) {
    for (const bool telemetry : {false, true}) {
      EXPECT_EQ(dshot::decode(dshot::encode(value, telemetry)), value);
    }
  }
}

TEST(Dshot, FindsEveryFrameWithOneBitTurned) {
  for (int value = 0; value <= dshot::kMost; ++value) {
    for (int bit = 0; bit < dshot::kBits; ++bit) {
      EXPECT_FALSE(dshot::decode(static_cast<std::uint16_t>(dshot::encode(value) ^ 1 << bit)));
    }
  }
}

TEST(Dshot, HasTwoThousandStepsAndAStop) {
  EXPECT_EQ(dshot::value_of(0), 0);
  EXPECT_EQ(dshot::value_of(1e-9), dshot::kLeast);
  EXPECT_EQ(dshot::value_of(1), dshot::kMost);
  EXPECT_EQ(dshot::throttle_of(47), 0);  // a command of the protocol, not a throttle
  for (double throttle = 1e-4; throttle <= 1; throttle += 1e-4) {
    EXPECT_NEAR(dshot::throttle_of(dshot::value_of(throttle)), throttle, 0.5 / 1999 + 1e-12);
  }
}

MotorCommand all(double throttle) { return {{throttle, throttle, throttle, throttle}}; }

TEST(DshotWires, ChangesNothingWhereItIsOff) {
  DshotWires wires({}, 1);
  EXPECT_EQ(wires.carry({{0.1234567, 0, 1, 0.5}}).throttle[0], 0.1234567);
}

TEST(DshotWires, HoldsTheOldThrottleUntilTheFrameIsThrough) {
  DshotConfig config;
  config.enabled = true;
  DshotWires wires(config, 1);
  for (int k = 0; k < 3; ++k) static_cast<void>(wires.carry(all(0.2)));
  const double low = wires.carry(all(0.2)).throttle[2];
  const double between = wires.carry(all(0.8)).throttle[2];
  const double high = wires.carry(all(0.8)).throttle[2];
  EXPECT_NEAR(high, 0.8, 0.5 / 1999);
  constexpr double kFrame_s = 16 / 600e3;
  EXPECT_NEAR(between, high + (low - high) * kFrame_s / 1e-3, 1e-12);
}

TEST(DshotWires, RefusesAsManyFramesAsTheChecksumFinds) {
  DshotConfig config;
  config.enabled = true;
  config.bit_error_rate = 0.02;
  // Which turned bits it finds does not depend on the value: the checksum is linear.
  double expected = 0;
  for (int mask = 1; mask < 1 << 16; ++mask) {
    const auto frame = static_cast<std::uint16_t>(dshot::encode(777) ^ mask);
    const int turned = std::popcount(static_cast<unsigned>(mask));
    if (!dshot::decode(frame)) expected += std::pow(0.02, turned) * std::pow(0.98, 16 - turned);
  }
  for (const std::uint64_t seed : {1U, 2U, 3U}) {
    DshotWires wires(config, seed);
    constexpr int kTicks = 20000;
    for (int k = 0; k < kTicks; ++k) static_cast<void>(wires.carry(all(0.5)));
    const double n = 4.0 * kTicks;
    EXPECT_NEAR(static_cast<double>(wires.refused()) / n, expected,
                4 * std::sqrt(expected * (1 - expected) / n));
  }
}

TEST(DshotWires, StopsAMotorThatHearsNothing) {
  DshotConfig config;
  config.enabled = true;
  config.bit_error_rate = 0.3;
  config.signal_timeout_s = 0.002;
  DshotWires wires(config, 4);
  std::int64_t before = 0;
  int silent = 0, stopped = 0;
  for (int k = 0; k < 2000; ++k) {
    const double throttle = wires.carry(all(0.5)).throttle[0];
    silent = wires.refused() - before == 4 ? silent + 1 : 0;  // all four
    before = wires.refused();
    if (silent > 3) {
      EXPECT_EQ(throttle, 0);
      ++stopped;
    }
  }
  EXPECT_GT(stopped, 10);
}

UartConfig uart(double latency_s, double jitter_s) {
  UartConfig config;
  config.enabled = true;
  config.latency_s = latency_s;
  config.jitter_s = jitter_s;
  return config;
}

TEST(SerialLine, TakesTheTimeOfItsBytesAndItsLatency) {
  SerialLine<int> line(uart(0.001, 0), 1, "test");
  line.send(0, 92, 1);
  line.send(0, 92, 2);  // waits for the wire
  const Stamp bytes = from_seconds(920 / 921600.0), latency = from_seconds(0.001);
  EXPECT_FALSE(line.receive(bytes + latency - 2));
  EXPECT_EQ(line.receive(bytes + latency), 1);
  EXPECT_FALSE(line.receive(2 * bytes + latency - 2));
  EXPECT_EQ(line.receive(2 * bytes + latency), 2);
}

TEST(SerialLine, KeepsTheOrderWhateverTheJitter) {
  SerialLine<int> line(uart(0, 0.02), 5, "test");
  int next = 0;
  double delay = 0;
  for (int k = 0; k < 2000; ++k) {
    line.send(k * 5 * kTick, 51, k);
    for (int ms = 0; ms < 5; ++ms) {
      while (const auto arrived = line.receive((k * 5 + ms) * kTick)) {
        EXPECT_EQ(*arrived, next++);
        delay += (k - *arrived) * 5 + ms;
      }
    }
  }
  EXPECT_GT(next, 1990);
  // Later than the mean of its own jitter, for nobody overtakes; earlier than the most.
  EXPECT_GT(delay / next, 10);
  EXPECT_LT(delay / next, 20);
}

TEST(SerialLine, LosesItsShare) {
  for (const std::uint64_t seed : {1U, 2U, 3U}) {
    UartConfig config = uart(0, 0);
    config.loss = 0.2;
    SerialLine<int> line(config, seed, "test");
    int arrived = 0;
    constexpr int kSent = 5000;
    for (int k = 0; k < kSent; ++k) {
      line.send(k * kTick, 51, k);
      while (line.receive(k * kTick)) ++arrived;
    }
    EXPECT_NEAR(arrived / static_cast<double>(kSent), 0.8, 4 * std::sqrt(0.16 / kSent));
  }
}

TEST(SerialLine, RefusesWhatItsBufferHasNoRoomFor) {
  UartConfig config = uart(0, 0);
  config.rate_hz = 57600;
  config.buffer_bytes = 1000;
  SerialLine<int> line(config, 1, "test");
  int arrived = 0;
  for (int k = 0; k < 2000; ++k) {  // 10 s at 200 Hz: 15 kB/s on a line of 5.76 kB/s
    line.send(k * 5 * kTick, 75, k);
    while (line.receive(k * 5 * kTick)) ++arrived;
  }
  EXPECT_NEAR(arrived * 75, 57600, 1100);
  EXPECT_NEAR(static_cast<double>(line.refused()), 2000 - arrived, 20);
}

/// Flight software that asks for one thrust, always.
class Asking : public FlightSoftware {
 public:
  explicit Asking(double thrust_n) : thrust_n_(thrust_n) {}
  void begin(Stamp now) override { now_ = now; }
  void add_imu(const ImuSample& imu) override { imu_delays.push_back(now_ - imu.stamp); }
  void add_autopilot(const AutopilotStatus&) override {}
  void add_battery(const BatterySample&) override {}
  void add_operator(const OperatorMessage&) override {}
  void add_mocap(const MocapSample&) override {}
  void add_scan(const LidarScanPtr&) override {}
  void add_depth(const DepthImagePtr&) override {}
  [[nodiscard]] bool accepts_depth(const std::string&, Stamp) override { return false; }
  std::optional<AttitudeCommand> tick() override {
    if (now_ % (10 * kTick) != 0) return std::nullopt;
    AttitudeCommand command;
    command.stamp = now_;
    command.thrust_n = thrust_n_;
    return command;
  }
  std::vector<Event> take_events() override { return {}; }
  std::vector<Decision> take_decisions() override { return {}; }
  [[nodiscard]] FlightView view() const override { throw std::logic_error("not asked for"); }
  void read_cloud(Stamp, CloudReader) override {}
  [[nodiscard]] const PointCloudMap& cloud() const override { throw std::logic_error("none"); }
  [[nodiscard]] const Mapper& mapper() const override { throw std::logic_error("none"); }

  std::vector<Stamp> imu_delays;

 private:
  double thrust_n_;
  Stamp now_ = 0;
};

TEST(CompanionLink, IsNotThereByDefault) { EXPECT_FALSE(CompanionLink::is_needed({})); }

TEST(CompanionLink, DelaysCommandsAndSamplesByTheirBytes) {
  InterfaceConfig config;
  config.uart = uart(0.001, 0);
  auto software = std::make_unique<Asking>(18.0);
  const Asking& asking = *software;
  CompanionLink link(config, {}, {}, std::move(software), 1);
  int commands = 0;
  for (Stamp now = 0; now < 1000 * kTick; now += kTick) {
    link.begin(now);
    if (now % (5 * kTick) == 0) link.add_imu({now, Vec3::Zero(), Vec3::Zero(), Vec3::Zero()});
    const auto command = link.tick();
    if (!command) continue;
    ++commands;
    EXPECT_EQ(now - command->stamp, 2 * kTick);  // 0.55 ms of bytes, 1 ms, the next tick
    EXPECT_EQ(command->thrust_n, 18.0);
  }
  EXPECT_EQ(commands, 100);
  ASSERT_EQ(asking.imu_delays.size(), 200U);
  for (const Stamp delay : asking.imu_delays) EXPECT_EQ(delay, 2 * kTick);
}

TEST(CompanionLink, GivesLessThrustForAThrottleAsTheBatterySags) {
  InterfaceConfig config;
  config.command = InterfaceConfig::Command::kThrottle;
  const MotorBelief motor;
  const VehicleConfig vehicle;
  const MotorModel model(motor, vehicle);
  CompanionLink link(config, motor, vehicle, std::make_unique<Asking>(18.0), 1);
  for (const double voltage : {16.8, 14.8, 13.2}) {
    link.begin(0);
    link.add_battery({0, voltage, 10});
    const auto command = link.tick();
    ASSERT_TRUE(command);
    EXPECT_NEAR(command->thrust_n,
                18.0 * model.full_thrust(voltage) / model.full_thrust(config.throttle_voltage_v),
                1e-9);
  }
  CompanionLink weak(config, motor, vehicle, std::make_unique<Asking>(500.0), 1);
  weak.begin(0);
  const auto command = weak.tick();
  ASSERT_TRUE(command);
  EXPECT_NEAR(command->thrust_n, 4 * model.full_thrust(motor.nominal_voltage_v), 1e-9);
}

}  // namespace
}  // namespace arex::sim
