// CPU time of the autopilot's millisecond: `autopilot_bench`. Each row is the least of several
// passes over the same samples; the loops run at their own rates, so a row is the mean tick.

#include <algorithm>
#include <cstdio>
#include <ctime>
#include <limits>
#include <vector>

#include "autopilot/autopilot.h"
#include "math/random.h"

namespace {

using namespace arex;

constexpr int kInitialisation = 4000, kPasses = 9, kTicks = 100000;

double cpu_seconds() { return static_cast<double>(std::clock()) / CLOCKS_PER_SEC; }

/// A hovering vehicle's samples: gravity, a little shaking, ready before the clock starts.
std::vector<ImuSample> hover_samples() {
  RandomStream random(1, "bench.imu");
  std::vector<ImuSample> samples;
  for (int i = 1; i <= kInitialisation + kTicks; ++i) {
    const double shake = i <= kInitialisation ? 0.01 : 0.5;
    samples.push_back({i * kNanosecondsPerTick, 1e-3 * random.normal3(),
                       Vec3(0, 0, kGravity) + shake * random.normal3()});
  }
  return samples;
}

struct Row {
  double imu_ns = std::numeric_limits<double>::infinity();
  double both_ns = std::numeric_limits<double>::infinity();
};

void millisecond(Autopilot& autopilot, const ImuSample& imu, AutopilotMode mode, bool tick) {
  autopilot.add_imu(imu);
  if (imu.stamp % (20 * kNanosecondsPerTick) == 0) {
    autopilot.add_magnetometer({imu.stamp, Vec3(0.375, 0, -0.253)});
    autopilot.add_barometer({imu.stamp, 101325});
    autopilot.add_battery({imu.stamp, 15.5, 18});
  }
  if (!tick) return;
  if (imu.stamp % (10 * kNanosecondsPerTick) == 0) {
    AttitudeCommand command;
    command.stamp = imu.stamp;
    command.mode = mode;
    command.thrust_n = VehicleConfig{}.mass_kg * kGravity;
    autopilot.command(command);
  }
  autopilot.tick(imu.stamp);
}

/// @return ns a millisecond, and false if the vehicle did not fly.
double measure(const std::vector<ImuSample>& samples, bool tick, bool& flew) {
  Autopilot autopilot(AutopilotConfig{}, VehicleConfig{});
  for (int i = 0; i < kInitialisation; ++i) {
    const bool still = i < kInitialisation / 2 + kInitialisation / 4;
    millisecond(autopilot, samples[static_cast<std::size_t>(i)],
                still ? AutopilotMode::kDisarmed : AutopilotMode::kAttitude, true);
  }
  const double begin = cpu_seconds();
  for (std::size_t i = kInitialisation; i < samples.size(); ++i) {
    millisecond(autopilot, samples[i], AutopilotMode::kAttitude, tick);
  }
  const double ns = 1e9 * (cpu_seconds() - begin) / kTicks;
  flew = autopilot.state() == AutopilotState::kFlying;
  return ns;
}

}  // namespace

int main() {
  const std::vector<ImuSample> samples = hover_samples();
  Row row;
  bool flew = true, unused = false;
  for (int pass = 0; pass < kPasses; ++pass) {
    row.imu_ns = std::min(row.imu_ns, measure(samples, false, unused));
    bool pass_flew = false;
    row.both_ns = std::min(row.both_ns, measure(samples, true, pass_flew));
    flew = flew && pass_flew;
  }
  std::printf("%-44s %8s\n", "mean of a millisecond, least of passes", "ns");
  std::printf("%-44s %8.0f\n", "sensors (add_imu 1 kHz, the rest 50 Hz)", row.imu_ns);
  std::printf("%-44s %8.0f\n", "sensors, commands (100 Hz) and tick", row.both_ns);
  if (!flew) std::printf("the vehicle did not fly: not a measurement\n");
  return flew ? 0 : 1;
}
