#include <gtest/gtest.h>

#include <filesystem>
#include <limits>
#include <set>

#include "run/scenario.h"
#include "support/temporary_folder.h"
#include "sweep/sweep_plan.h"

namespace arex::sim {
namespace {

using test::TemporaryFolder;
using test::write_text;

/// Two small scenarios and a sweep file beside them.
class PlanTest : public ::testing::Test {
 protected:
  PlanTest() {
    write_text(folder_ / "one.yaml", "mission:\n  max_time_s: 10\n");
    write_text(folder_ / "two.yaml", "planning:\n  inflation_m: 0.6\n");
  }
  SweepPlan plan(const std::string& yaml, const std::string& build = "build") {
    write_text(folder_ / "sweep.yaml", yaml);
    return expand(load_sweep_file(folder_ / "sweep.yaml"), build);
  }
  // The message without the folder's name.
  std::string error_of(const std::string& yaml) {
    try {
      plan(yaml);
    } catch (const ConfigError& error) {
      const std::string text = error.what();
      const std::string prefix = folder_.path().string() + "/";
      return text.starts_with(prefix) ? text.substr(prefix.size()) : text;
    }
    return "no error";
  }
  // One line a run: scenario variant values seed repeat.
  static std::vector<std::string> lines(const SweepPlan& plan) {
    std::vector<std::string> lines;
    for (const PlannedRun& run : plan.runs) {
      std::string line = run.scenario + " " + run.variant;
      for (const std::string& value : run.values) line += " " + value;
      lines.push_back(line + " " + std::to_string(run.seed) + " " + std::to_string(run.repeat));
    }
    return lines;
  }
  // What the run's own configuration says.
  static std::string value_in(const PlannedRun& run, const std::string& key) {
    ScenarioConfig config;
    read_config(parse_yaml(run.resolved, "resolved"), config);
    for (const ParameterInfo& parameter : list_parameters(config)) {
      if (parameter.key == key) return parameter.value;
    }
    return "none";
  }

  TemporaryFolder folder_;
};

TEST_F(PlanTest, AGridIsTheProductOfItsKeysTheLastRunningFastestAndThenTheSeeds) {
  const SweepPlan p = plan(R"(base: one.yaml
set: {mission.max_time_s: 20}
grid:
  planning.inflation_m: [0.10, 0.5]
  exploration.direction_aware: [true, false]
seeds: [7, 2]
)");
  EXPECT_EQ(p.keys,
            (std::vector<std::string>{"planning.inflation_m", "exploration.direction_aware"}));
  EXPECT_EQ(lines(p), (std::vector<std::string>{"one  0.1 true 7 1", "one  0.1 true 2 1",
                                                "one  0.1 false 7 1", "one  0.1 false 2 1",
                                                "one  0.5 true 7 1", "one  0.5 true 2 1",
                                                "one  0.5 false 7 1", "one  0.5 false 2 1"}));
  EXPECT_EQ(value_in(p.runs[2], "mission.max_time_s"), "20");
  EXPECT_EQ(value_in(p.runs[2], "planning.inflation_m"), "0.1");
  EXPECT_EQ(value_in(p.runs[2], "exploration.direction_aware"), "false");
  EXPECT_EQ(value_in(p.runs[2], "seed"), "7");
}

TEST_F(PlanTest, AListKeepsWhatBelongsTogetherAndMayNameItsOwnBase) {
  const SweepPlan p = plan(R"(base: one.yaml
list:
  - {name: plain}
  - {name: wide, planning.inflation_m: 0.7}
  - {name: other, base: two.yaml, exploration.weight_distance: 2}
seeds: 1..2
repeats: 2
)");
  EXPECT_TRUE(p.has_variants);
  EXPECT_EQ(p.keys,
            (std::vector<std::string>{"planning.inflation_m", "exploration.weight_distance"}));
  // Keys that an item does not name show the value that counts for it.
  EXPECT_EQ(lines(p), (std::vector<std::string>{
                          "one plain 0.5 1 1 1", "one plain 0.5 1 1 2", "one plain 0.5 1 2 1",
                          "one plain 0.5 1 2 2", "one wide 0.7 1 1 1", "one wide 0.7 1 1 2",
                          "one wide 0.7 1 2 1", "one wide 0.7 1 2 2", "two other 0.6 2 1 1",
                          "two other 0.6 2 1 2", "two other 0.6 2 2 1", "two other 0.6 2 2 2"}));
}

TEST_F(PlanTest, SeveralBasesAreFlownWithTheSameSeeds) {
  const SweepPlan p = plan("base: [one.yaml, two.yaml]\nseeds: [3, 5..6]\n");
  EXPECT_EQ(lines(p), (std::vector<std::string>{"one  3 1", "one  5 1", "one  6 1", "two  3 1",
                                                "two  5 1", "two  6 1"}));
}

TEST_F(PlanTest, ALatinHypercubeHitsEveryStratumOfEveryKeyOnce) {
  const SweepPlan p = plan(R"(base: one.yaml
latin_hypercube:
  samples: 8
  keys:
    planning.inflation_m: [0.2, 1.0]
    imu.gyro_noise_density: [1e-5, 1e-1, log]
    exploration.detector.local_iterations: [1, 8, integer]
seeds: [1]
)");
  ASSERT_EQ(p.runs.size(), 8u);
  std::set<int> linear, logarithmic, integer;
  for (const PlannedRun& run : p.runs) {
    linear.insert(static_cast<int>((std::stod(run.values[0]) - 0.2) / 0.1));
    logarithmic.insert(static_cast<int>((std::log10(std::stod(run.values[1])) + 5) / 0.5));
    integer.insert(std::stoi(run.values[2]));
  }
  const std::set<int> strata{0, 1, 2, 3, 4, 5, 6, 7};
  EXPECT_EQ(linear, strata);
  EXPECT_EQ(logarithmic, strata);
  EXPECT_EQ(integer, (std::set<int>{1, 2, 3, 4, 5, 6, 7, 8}));
  EXPECT_EQ(lines(p), lines(plan(test::read_text(folder_ / "sweep.yaml"))));
}

TEST_F(PlanTest, TheIdIsThatOfConfigurationSeedAndBuild) {
  const std::string yaml =
      "base: one.yaml\nset: {mission.max_time_s: 9, planning.inflation_m: 1}\n";
  const std::string same = plan(yaml).runs[0].id;
  // Neither the order, nor how a number is written, nor where the sweep file puts it counts.
  EXPECT_EQ(plan("base: one.yaml\nset: {planning.inflation_m: 1.0}\n"
                 "grid: {mission.max_time_s: [9.00]}\n")
                .runs[0]
                .id,
            same);
  std::set<std::string> ids{same};
  ids.insert(plan(yaml, "other build").runs[0].id);
  ids.insert(plan(yaml + "seeds: [2]\n").runs[0].id);
  ids.insert(plan(yaml + "repeats: 2\n").runs[1].id);
  ids.insert(
      plan("base: two.yaml\nset: {mission.max_time_s: 9, planning.inflation_m: 1}\n").runs[0].id);
  ids.insert(plan("base: one.yaml\nset: {mission.max_time_s: 9, planning.inflation_m: 1.0001}\n")
                 .runs[0]
                 .id);
  EXPECT_EQ(ids.size(), 6u);
  // Folders of today must be found tomorrow.
  EXPECT_EQ(run_id("build", "forest", 1, "seed: 1\n"), "863cf8e713235dad");
}

TEST_F(PlanTest, RowsThatAskForTheSameRunShareIt) {
  const SweepPlan p = plan("base: one.yaml\nlist:\n  - {name: a}\n  - {name: b}\nseeds: 1..3\n");
  EXPECT_EQ(p.runs.size(), 6u);
  EXPECT_EQ(p.flying_order().size(), 3u);
}

TEST_F(PlanTest, FliesSeedBySeed) {
  const SweepPlan p =
      plan("base: one.yaml\ngrid: {planning.inflation_m: [0.1, 0.2]}\nseeds: [9, 4]\n");
  std::vector<std::string> order;
  for (const PlannedRun* run : p.flying_order()) {
    order.push_back(std::to_string(run->seed) + " " + run->values[0]);
  }
  EXPECT_EQ(order, (std::vector<std::string>{"9 0.1", "9 0.2", "4 0.1", "4 0.2"}));
}

TEST_F(PlanTest, RefusesBadInputWhereItStands) {
  EXPECT_EQ(error_of("seeds: [1]\n"), "sweep.yaml:1: no 'base', expected 'base: SCENARIO.yaml'");
  EXPECT_EQ(error_of("base: one.yaml\ngird: {}\n"),
            "sweep.yaml:2: unknown key 'gird'; did you mean 'grid'?");
  EXPECT_EQ(error_of("base: one.yaml\n\ngrid:\n  planning.inflation: [1]\n"),
            "sweep.yaml:4: unknown key 'inflation'; did you mean 'inflation_m'?");
  EXPECT_EQ(error_of("base: one.yaml\nset:\n  plan.inflation_m: 1\n"),
            "sweep.yaml:3: unknown key 'plan'; did you mean 'planning'?");
  EXPECT_EQ(error_of("base: one.yaml\ngrid:\n  planning.inflation_m: [0.1,\n    wide]\n"),
            "sweep.yaml:4: 'inflation_m' is 'wide', expected a finite number");
  EXPECT_EQ(error_of("base: one.yaml\nlist:\n  - {mission.max_time_s: -1}\n"),
            "sweep.yaml:3: out of range: expected max_time_s > 0");
  EXPECT_EQ(error_of("base: one.yaml\ngrid:\n  planning.inflation_m: 1\n"),
            "sweep.yaml:3: 'planning.inflation_m' is '1', expected a list of values [..]");
  EXPECT_EQ(error_of("base: one.yaml\ngrid: {planning.inflation_m: [1]}\n"
                     "list: [{planning.inflation_m: 2}]\n"),
            "sweep.yaml:2: 'planning.inflation_m' is varied twice, expected in one of list, "
            "latin_hypercube, grid");
  EXPECT_EQ(error_of("base: one.yaml\nset: {mission: {max_time_s: 3}}\n"),
            "sweep.yaml:2: 'mission' is a map, expected dotted keys such as "
            "'mission.max_time_s: value'");
  EXPECT_EQ(error_of("base: one.yaml\nset: {seed: 3}\n"),
            "sweep.yaml:2: 'seed' stands here, expected the seeds in 'seeds: [..]'");
  EXPECT_EQ(error_of("base: one.yaml\nseeds: [1, 3, 1..2]\n"),
            "sweep.yaml:2: 'seeds' has 1 twice, expected each once");
  EXPECT_EQ(error_of("base: one.yaml\nseeds: [-1]\n"),
            "sweep.yaml:2: 'seeds' is '-1', expected an integer that is not negative");
  EXPECT_EQ(error_of("base: none.yaml\n"),
            "sweep.yaml:1: 'base' is 'none.yaml', expected a scenario file relative to this file");
  EXPECT_EQ(error_of("base: one.yaml\nrepeats: 0\n"),
            "sweep.yaml:2: 'repeats' is 0, expected 1 to 50000");
  EXPECT_EQ(error_of("base: one.yaml\nlatin_hypercube:\n  samples: 3\n  keys: {a.b: [2, 1]}\n"),
            "sweep.yaml:4: 'a.b' expects low < high");
}

TEST_F(PlanTest, WithoutSeedsEachBaseFliesItsOwn) {
  write_text(folder_ / "seventh.yaml", "seed: 7\n");
  const SweepPlan p = plan("base: [one.yaml, seventh.yaml]\n");
  EXPECT_EQ(lines(p), (std::vector<std::string>{"one  1 1", "seventh  7 1"}));
  EXPECT_EQ(value_in(p.runs[1], "seed"), "7");
}

TEST_F(PlanTest, ARunFliesWhatTheSameSettingsFlyAlone) {
  write_text(folder_ / "three.yaml",
             "seed: 18446744073709551615\nphysics: {battery: {cells: 6}}\n");
  const std::vector<std::vector<std::string>> settings{
      {},
      {"physics.battery.capacity_ah=0.2"},
      {"physics.battery.cells=6", "exploration.consumption.full_v=26"},
      {"mapping.use_depth=false", "odometry.source=mocap", "imu.noise_free=true"},
      {"mission.kind=waypoints", "mission.waypoints_m=[[1, 2, 1.5]]"},
  };
  for (const char* base : {"one", "two", "three"}) {
    for (const auto& overrides : settings) {
      std::string set;
      for (const std::string& assignment : overrides) {
        const auto equals = assignment.find('=');
        set += (set.empty() ? "" : ", ") + assignment.substr(0, equals) + ": " +
               assignment.substr(equals + 1);
      }
      const std::string file = std::string(base) + ".yaml";
      const std::string sweep = "base: " + file + "\nset: {" + set + "}\n";
      EXPECT_EQ(plan(sweep).runs.at(0).resolved,
                load_scenario(folder_ / file, overrides, {}).resolved_yaml())
          << sweep;
      EXPECT_EQ(plan(sweep + "seeds: [012]\n").runs.at(0).resolved,
                load_scenario(folder_ / file, overrides, 12).resolved_yaml())
          << sweep;
      write_text(folder_ / "resolved.yaml", plan(sweep).runs.at(0).resolved);
      EXPECT_EQ(load_scenario(folder_ / "resolved.yaml", {}, {}).resolved_yaml(),
                plan(sweep).runs.at(0).resolved);
    }
  }
}

TEST_F(PlanTest, SeedsReachToTheLastOfThem) {
  const SweepPlan p =
      plan("base: one.yaml\nseeds: [18446744073709551610..18446744073709551615, 010, 08]\n");
  ASSERT_EQ(p.runs.size(), 8u);
  EXPECT_EQ(p.runs[5].seed, std::numeric_limits<std::uint64_t>::max());
  EXPECT_NE(p.runs[5].resolved.find("seed: 18446744073709551615\n"), std::string::npos);
  EXPECT_EQ(p.runs[6].seed, 10u);
  EXPECT_EQ(p.runs[7].seed, 8u);
  EXPECT_EQ(error_of("base: one.yaml\nseeds: 0..18446744073709551615\n"),
            "sweep.yaml:2: 'seeds' has '0..18446744073709551615', more than "
            "18446744073709551615 seeds, expected at most 50000 in all");
  EXPECT_NE(error_of("base: one.yaml\nseeds: [18446744073709551616]\n")
                .find("an integer from 0 to 18446744073709551615"),
            std::string::npos);
  for (const char* seeds : {"5..4", "1..", "..3", "1...3", "1..2..3", "0x1..4", "a..b"}) {
    EXPECT_EQ(error_of(std::string("base: one.yaml\nseeds: ") + seeds + "\n")
                  .find("sweep.yaml:2: 'seeds' "),
              0u)
        << seeds;
  }
}

TEST_F(PlanTest, SweepsThatNobodyCanFlyAreRefusedAtOnce) {
  EXPECT_EQ(error_of("base: one.yaml\nlatin_hypercube:\n  samples: 1000000000\n"
                     "  keys: {planning.inflation_m: [0.1, 1]}\n"),
            "sweep.yaml:3: 'samples' is 1000000000, expected 1 to 50000");
  EXPECT_EQ(error_of("base: one.yaml\nseeds: 1..40000\nrepeats: 40000\n"),
            "sweep.yaml:1: asks for 1600000000 runs, expected at most 50000");
  std::string axes;
  for (const char* key : {"planning.inflation_m", "mission.max_time_s", "mapping.latency_s"}) {
    axes += std::string("  ") + key + ": [";
    for (int i = 1; i <= 1000; ++i) axes += (i > 1 ? ", " : "") + std::to_string(1e-5 * i);
    axes += "]\n";
  }
  EXPECT_EQ(error_of("base: one.yaml\ngrid:\n" + axes),
            "sweep.yaml:1: asks for 1000000000 runs, expected at most 50000");
  EXPECT_EQ(error_of("base: one.yaml\nretries: 2147483647\n"),
            "sweep.yaml:2: 'retries' is 2147483647, expected 0 to 100");
  EXPECT_EQ(error_of("base: one.yaml\ntimeout_s: 1e300\n"),
            "sweep.yaml:2: 'timeout_s' is '1e300', expected at most 1e+09 s");
  EXPECT_EQ(error_of("a: &a [*a]\n").find("sweep.yaml:1: an alias"), 0u);
  EXPECT_EQ(error_of("base: one.yaml\nlatin_hypercube: {samples: 2, keys: "
                     "{exploration.detector.local_iterations: [0, 1e300, integer]}}\n"),
            "sweep.yaml:2: 'exploration.detector.local_iterations' expects integers of at most "
            "2^53");
}

TEST(ShippedSweeps, AreValid) {
  for (const auto& entry :
       std::filesystem::directory_iterator(AREX_SOURCE_DIR "/scenarios/sweeps")) {
    EXPECT_GT(expand(load_sweep_file(entry.path()), "build").runs.size(), 1u) << entry.path();
  }
}

TEST(ShippedSweeps, ExpandToWhatTheirCommentsSay) {
  const auto runs = [](const std::string& name) {
    return expand(load_sweep_file(AREX_SOURCE_DIR "/scenarios/sweeps/" + name + ".yaml"), "build")
        .runs.size();
  };
  EXPECT_EQ(runs("inflation"), 40u);
  EXPECT_EQ(runs("lambda"), 135u);
  EXPECT_EQ(runs("noise"), 27u);
  EXPECT_EQ(runs("odometry"), 10u);
  EXPECT_EQ(runs("explore"), 20u);
  EXPECT_EQ(runs("direction"), 320u);
  EXPECT_EQ(runs("printed"), 560u);
  EXPECT_EQ(runs("faults_blind"), 66u);
}

}  // namespace
}  // namespace arex::sim
