#include <gtest/gtest.h>

#include <cmath>

#include "report/table.h"
#include "run/simulation.h"
#include "sensors/infrared_exposure.h"
#include "support/temporary_folder.h"

namespace arex::sim {
namespace {

using arex::test::TemporaryFolder;

const std::vector<std::string> kOn{"infrared.enabled=true", "infrared.right_every=3"};

Scenario scenario_of(const std::vector<std::string>& settings) {
  std::vector<std::string> all = settings;
  all.emplace_back("mission.max_time_s=3");
  return load_scenario(AREX_SOURCE_DIR "/scenarios/forest_small.yaml", all, 1);
}

FlightResult fly(const Scenario& scenario, int threads, Recorder* recorder = nullptr) {
  Simulation simulation(scenario, threads);
  if (recorder) simulation.record_to(*recorder);
  while (simulation.tick()) {
  }
  return simulation.finish();
}

TEST(InfraredFlight, ImagesAreTheSameForAnyNumberOfThreadsAndChangeNoFlight) {
  const FlightResult one = fly(scenario_of(kOn), 1), many = fly(scenario_of(kOn), 3);
  EXPECT_EQ(one.device_hashes.at("infrared"), many.device_hashes.at("infrared"));
  EXPECT_EQ(one.sensor_hash, many.sensor_hash);
  const FlightResult off = fly(scenario_of({}), 1);
  EXPECT_FALSE(off.device_hashes.contains("infrared"));
  EXPECT_EQ(one.trajectory_hash, off.trajectory_hash);
}

// What each frame was exposed with follows from the frames that had been delivered when its shutter
// opened, and from nothing else.
TEST(InfraredFlight, ExposureFollowsTheImagesDeliveredBefore) {
  const TemporaryFolder folder;
  const Scenario scenario =
      scenario_of({"infrared.enabled=true", "infrared.rate_hz=20", "infrared.latency_s=0.06"});
  const InfraredConfig& config = scenario.config.infrared;
  {
    Recorder recorder(folder.path(), scenario.resolved_yaml());
    static_cast<void>(fly(scenario, 1, &recorder));
  }
  const Table table = read_table(folder / "infrared.csv");
  const auto time = table.numbers("time_s"), exposure = table.numbers("exposure_s");
  const auto gain = table.numbers("gain"), mean = table.numbers("mean_grey");
  ASSERT_GT(time.size(), 40U);
  EXPECT_EQ(exposure[0], config.sensor.exposure_s);
  AutoExposure expected(config.sensor);
  std::size_t delivered = 0;
  int changes = 0;
  for (std::size_t i = 0; i < time.size(); ++i) {
    const double opened = time[i] - 0.5 * exposure[i];
    EXPECT_NEAR(opened, static_cast<double>(i) / config.rate_hz, 1e-6);
    while (delivered < i && time[delivered] + 0.5 * exposure[delivered] + config.latency_s <
                                std::ceil(opened * 1000 - 1e-3) * 1e-3) {
      expected.add(mean[delivered], {exposure[delivered], gain[delivered]});
      ++delivered;
    }
    EXPECT_NEAR(expected.next().exposure_s, exposure[i], 2.1e-6) << i;
    EXPECT_NEAR(expected.next().gain, gain[i], 1e-3) << i;
    changes += i > 0 && exposure[i] != exposure[i - 1];
  }
  EXPECT_GE(changes, 3);  // daylight is not what it began with
  EXPECT_NEAR(mean.back(), config.sensor.mean_target, 0.1 * config.sensor.mean_target);
}

TEST(InfraredFlight, RefusesWhatNoImagerCanDo) {
  for (const std::string setting :
       {"infrared.rate_hz=200", "infrared.exposure_s=0.02", "infrared.right_every=0",
        "infrared.light.sun_elevation_rad=-1", "infrared.gain=0.5", "infrared.vignetting=1"}) {
    EXPECT_THROW(static_cast<void>(scenario_of({setting})), ConfigError) << setting;
  }
}

}  // namespace
}  // namespace arex::sim
