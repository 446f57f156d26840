#include <gtest/gtest.h>

#include <cmath>

#include "report/table.h"
#include "run/simulation.h"
#include "sensors/infrared_exposure.h"
#include "sensors/infrared_pair.h"
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

// The file says enough to take each picture again.
TEST(InfraredFlight, RecordsFromWhereEachFrameWasTaken) {
  const TemporaryFolder folder;
  const Scenario scenario =
      load_scenario(AREX_SOURCE_DIR "/scenarios/forest_small.yaml",
                    std::vector<std::string>{"infrared.enabled=true", "mission.max_time_s=8"}, 1);
  {
    Recorder recorder(folder.path(), scenario.resolved_yaml());
    static_cast<void>(fly(scenario, 1, &recorder));
  }
  const ScenarioConfig& config = scenario.config;
  const worlds::World world =
      worlds::build_world(config.world, config.seed, load_airframe().radius_m);
  const Scene scene(world);
  InfraredPair pair(config.infrared, config.depth.model.as_built(config.seed), world, scene,
                    load_airframe().X_BC, config.seed);
  const Table table = read_table(folder / "infrared.csv");
  const auto column = [&](const char* name) { return table.numbers(name); };
  const auto times = column("time_s"), exposure = column("exposure_s"), gain = column("gain");
  const auto mean = column("mean_grey");
  ASSERT_GT(times.size(), 60U);
  int moving = 0;
  for (std::size_t i = 30; i < times.size(); i += 5) {
    InfraredShot shot;
    shot.stamp = from_seconds(times[i]);
    shot.X_WB.p = Vec3(column("x_m")[i], column("y_m")[i], column("z_m")[i]);
    shot.X_WB.R =
        Quat(column("qw")[i], column("qx")[i], column("qy")[i], column("qz")[i]).toRotationMatrix();
    shot.v_WB = Vec3(column("vx_mps")[i], column("vy_mps")[i], column("vz_mps")[i]);
    shot.w_WB_B = Vec3(column("wx_radps")[i], column("wy_radps")[i], column("wz_radps")[i]);
    shot.exposure = {exposure[i], gain[i]};
    shot.right = false;
    const auto again = pair.capture(shot);
    EXPECT_NEAR(central_mean(again->left, again->width, again->height), mean[i], 0.006) << i;
    moving += shot.v_WB.norm() > 0.5;
    shot.X_WB.p.z() += 0.02;  // two centimetres and a wrong moment are seen
    const auto beside = pair.capture(shot);
    EXPECT_GT(std::abs(central_mean(beside->left, beside->width, beside->height) - mean[i]), 0.006)
        << i;
  }
  EXPECT_GT(moving, 2);
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
