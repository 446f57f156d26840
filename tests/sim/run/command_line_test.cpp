#include <gtest/gtest.h>
#include <sys/resource.h>

#include <chrono>
#include <map>
#include <nlohmann/json.hpp>
#include <sstream>
#include <thread>

#include "arex_binary.h"
#include "support/process.h"
#include "support/sanitized.h"

// The contract of the command line, kept by the binary itself.
namespace arex {
namespace {

using Result = test::ProcessResult;
using test::read_text;
using test::TemporaryFolder;
using test::write_text;

constexpr const char* kWaypoints = AREX_SOURCE_DIR "/scenarios/waypoints.yaml";

test::Process start(const std::vector<std::string>& arguments, const TemporaryFolder& folder) {
  return {AREX_BINARY, arguments, folder.path()};
}

void wait_for(const std::filesystem::path& file, std::size_t bytes) {
  for (int i = 0; i < 1200; ++i) {
    std::error_code ignored;
    if (std::filesystem::exists(file, ignored) &&
        std::filesystem::file_size(file, ignored) > bytes) {
      return;
    }
    std::this_thread::sleep_for(std::chrono::milliseconds(50));
  }
  FAIL() << file << " did not grow";
}

// Exit code 2, one line that begins with the position, nothing written.
void expect_refused(const std::string& yaml, const std::vector<std::string>& extra,
                    const std::string& expected) {
  const TemporaryFolder folder;
  write_text(folder / "bad.yaml", yaml);
  std::vector<std::string> arguments{"run", (folder / "bad.yaml").string(), "--quiet", "--out",
                                     (folder / "out").string()};
  arguments.insert(arguments.end(), extra.begin(), extra.end());
  const Result result = run_arex(arguments);
  EXPECT_EQ(result.exit_code, 2) << yaml;
  EXPECT_NE(result.err.find(expected), std::string::npos) << result.err;
  EXPECT_EQ(std::count(result.err.begin(), result.err.end(), '\n'), 1) << result.err;
  EXPECT_FALSE(std::filesystem::exists(folder / "out"));
}

TEST(CommandLine, RefusesBadInputWithOneLineAndWritesNothing) {
  expect_refused("seed: 1\nplan: 2\n", {}, "bad.yaml:2: unknown key 'plan'");
  expect_refused("mission:\n  max_time_s: long\n", {}, "bad.yaml:2: 'max_time_s' is 'long'");
  expect_refused("mission:\n  max_time_s: -1\n", {},
                 "bad.yaml:2: out of range: expected max_time_s > 0");
  expect_refused("mission:\n  max_time_s: .nan\n", {}, "bad.yaml:2: 'max_time_s' is '.nan'");
  expect_refused("seed: 1\nseed: 2\n", {}, "bad.yaml:2: duplicate key 'seed'");
  expect_refused("seed: 1\n", {"--set", "misson.max_time_s=1"}, "did you mean 'mission'?");
  expect_refused("seed: 1\n", {"--set", "seed"}, "expected key=value");
  expect_refused("seed: 1\n", {"--threads", "none"}, "--threads");
  expect_refused("seed: 1\n", {"--seed", "-1"}, "--seed");
  expect_refused("seed: 1\n", {"--require", "colisions==0"}, "did you mean 'collisions'?");
  expect_refused("seed: 1\n", {"--junit", "/does/not/exist/x.xml"}, "/does/not/exist/x.xml");
  expect_refused("seed: 1\n", {"--bag", "/does/not/exist/x.bag"}, "/does/not/exist/x.bag");
  const Result missing = run_arex({"run", "/does/not/exist.yaml"});
  EXPECT_EQ(missing.exit_code, 2);
  EXPECT_EQ(missing.err, "/does/not/exist.yaml:1: cannot be read, expected a YAML file\n");
  EXPECT_EQ(run_arex({"fly"}).exit_code, 2);
  EXPECT_EQ(run_arex({}).exit_code, 2);
}

/// Processor time of the programs that ended so far: what a loaded host does not stretch.
double cpu_of_children_s() {
  rusage usage{};
  getrusage(RUSAGE_CHILDREN, &usage);
  const auto seconds = [](const timeval& t) {
    return static_cast<double>(t.tv_sec) + 1e-6 * static_cast<double>(t.tv_usec);
  };
  return seconds(usage.ru_utime) + seconds(usage.ru_stime);
}

// Exit code 2 and one printable line that names the option, within a second.
void expect_option_refused(const std::vector<std::string>& arguments, const std::string& expected) {
  const double begin_s = cpu_of_children_s();
  const Result result = run_arex(arguments);
  const double took_s = cpu_of_children_s() - begin_s;
  EXPECT_EQ(result.exit_code, 2) << expected;
  EXPECT_NE(result.err.find(expected), std::string::npos) << result.err;
  EXPECT_EQ(std::count(result.err.begin(), result.err.end(), '\n'), 1) << result.err;
  EXPECT_LT(result.err.size(), 300u) << result.err;
  EXPECT_LT(took_s, 1 * test::kSlowdown) << expected;
  for (const char c : result.err) EXPECT_TRUE(c == '\n' || static_cast<unsigned char>(c) >= 0x20);
}

TEST(CommandLine, NumbersOfOptionsAreReadAsThoseOfFiles) {
  const std::string bad(310, '7');
  for (const std::string& seed : {std::string("abc"), std::string("-1"), std::string("0x10"),
                                  std::string("1e3"), std::string("18446744073709551616"), bad}) {
    for (const char* command : {"run", "params", "validate"}) {
      expect_option_refused({command, kWaypoints, "--seed", seed}, "--seed: is '");
    }
    expect_option_refused({"world", kWaypoints, "--out", "/does/not/exist", "--seed", seed},
                          "--seed: is '");
  }
  const std::string folder = "/does/not/exist";
  for (const char* number : {"nan", "inf", "-inf", "1e400", "1e10", "x"}) {
    for (const char* option : {"--from", "--to", "--time", "--speed"}) {
      expect_option_refused({"render", folder, "--out", "x.mp4", option, number},
                            std::string(option) + ": is '" + number + "'");
    }
  }
  expect_option_refused({"render", folder, "--out", "x.mp4", "--speed", "0"}, "--speed: is '0'");
  expect_option_refused({"render", folder, "--out", "x.mp4", "--fps", "1e2"}, "--fps: is '1e2'");
  expect_option_refused({"run", kWaypoints, "--threads", "4294967297"}, "--threads: is '");
  expect_option_refused({"pattern", "--shots", "2147483647"}, "--shots: is '2147483647'");
  expect_option_refused({"sweep", "s.yaml", "--out", folder, "--jobs", "010x"}, "--jobs: is '");
  // 010 is ten wherever it stands.
  for (const char* seed : {"010", "18446744073709551615"}) {
    const Result params = run_arex({"params", kWaypoints, "--seed", seed});
    EXPECT_EQ(params.exit_code, 0) << params.err;
    EXPECT_EQ(run_arex({"params", kWaypoints, "--set", std::string("seed=") + seed}).out,
              params.out);
  }
  EXPECT_NE(run_arex({"params", kWaypoints, "--seed", "010"}).out.find("  10  "),
            std::string::npos);
}

// The value of a parameter as `arex params` lists it: `key  value  unit  meaning`.
std::map<std::string, std::string> listed(const std::string& params) {
  std::map<std::string, std::string> values;
  std::istringstream lines(params);
  for (std::string line; std::getline(lines, line);) {
    const auto key_end = line.find(' ');
    const auto begin = line.find_first_not_of(' ', key_end);
    values[line.substr(0, key_end)] = line.substr(begin, line.find("  ", begin) - begin);
  }
  return values;
}

TEST(CommandLine, RunSweepAndParamsMeanTheSameScenario) {
  const TemporaryFolder folder;
  write_text(folder / "base.yaml",
             "seed: 18446744073709551615\nworld: {kind: empty, empty: {size_m: [20, 20]}}\n"
             "mapping: {enabled: false, use_depth: false}\nodometry: {source: mocap}\n"
             "mission: {kind: waypoints, waypoints_m: [[1, 0, 1]], max_time_s: 0.2}\n");
  const std::string base = (folder / "base.yaml").string();
  int number = 0;
  for (const std::string& setting :
       {std::string("mission.hold_s=1"), std::string("physics.battery.capacity_ah=0.2"),
        std::string("physics.battery.cells=6"), std::string("exploration.consumption.full_v=25")}) {
    const std::filesystem::path out = folder / std::to_string(++number);
    const auto equals = setting.find('=');
    write_text(folder / "sweep.yaml", "base: base.yaml\nset: {" + setting.substr(0, equals) + ": " +
                                          setting.substr(equals + 1) + "}\n");
    EXPECT_EQ(run_arex({"validate", base, "--set", setting}).exit_code, 0);
    EXPECT_EQ(run_arex({"run", base, "--set", setting, "--quiet", "--no-report", "--out",
                        (out / "run").string()})
                  .exit_code,
              1);  // timed out
    const Result sweep =
        run_arex({"sweep", (folder / "sweep.yaml").string(), "--out", (out / "sweep").string()});
    EXPECT_EQ(sweep.exit_code, 0) << sweep.err;
    const std::string resolved = read_text(out / "run/resolved.yaml");
    ASSERT_FALSE(resolved.empty());
    for (const auto& flown : std::filesystem::directory_iterator(out / "sweep/runs")) {
      EXPECT_EQ(read_text(flown.path() / "resolved.yaml"), resolved) << setting;
      const auto alone = nlohmann::json::parse(read_text(out / "run/summary.json"));
      const auto swept = nlohmann::json::parse(read_text(flown.path() / "summary.json"));
      EXPECT_EQ(swept["trajectory_hash"], alone["trajectory_hash"]) << setting;
    }
    EXPECT_EQ(run_arex({"params", (out / "run/resolved.yaml").string()}).out,
              run_arex({"params", base, "--set", setting}).out);
    const auto values = listed(run_arex({"params", base, "--set", setting}).out);
    EXPECT_EQ(values.at("seed"), "18446744073709551615");
    for (const auto& [key, value] : values) {
      const auto next = values.upper_bound(key);
      if (next != values.end() && next->first.starts_with(key + ".")) continue;  // a section
      const std::string leaf = key.substr(key.rfind('.') + 1);
      EXPECT_NE(resolved.find(leaf + ": " + value + "\n"), std::string::npos) << key;
    }
  }
}

TEST(CommandLine, RefusesHostileFilesWithinASecond) {
  std::string bomb = "a: &a [1, 1, 1, 1, 1, 1, 1, 1, 1]\n";
  for (char name = 'b'; name < 'l'; ++name) {
    const std::string before = std::string("*") + static_cast<char>(name - 1);
    bomb += std::string(1, name) + ": &" + name + " [";
    for (int i = 0; i < 9; ++i) bomb += (i ? ", " : "") + before;
    bomb += "]\n";
  }
  const std::vector<std::pair<std::string, std::string>> files{
      {"a: &a [*a]\n", ":1: an alias"},
      {bomb, ":1: more than 100000 values, aliases followed"},
      {"seed: 1\n---\nseed: 2\n", ":2: a second document"},
      {"x: &x {seed: 1}\nmission:\n  <<: *x\n", ":3: a merge key '<<'"},
      {"seed: !!int 1\n", ":1: has the tag"},
      {"seed: \"\\e[31m\"\n", ":1: 'seed' is '\\x1b[31m'"},
      {"\x1b[31m: 1\n", ":1: control character \\x1b"},
      {"seed: \xff\n", ":1: no UTF-8"},
      {"", ":1: the file is empty"},
      {"seed: " + std::string(100'000, '[') + "\n", ":1: "},
      {"# " + std::string(3 << 20, 'x'), ":1: longer than"},
      {"mapping: {resolution_m: 0.001}\n", ":1: out of range: expected 0.02 <= resolution_m"},
  };
  const TemporaryFolder folder;
  const std::string file = (folder / "bad.yaml").string();
  for (const auto& [text, expected] : files) {
    write_text(folder / "bad.yaml", text);
    for (const char* command : {"run", "params", "validate"}) {
      expect_option_refused({command, file}, file + expected);
    }
    expect_option_refused({"sweep", file, "--out", (folder / "out").string()}, file + ":");
    expect_option_refused({"world", file, "--out", (folder / "out").string()}, file + ":");
    write_text(folder / "sweep.yaml", "base: bad.yaml\n");
    expect_option_refused(
        {"sweep", (folder / "sweep.yaml").string(), "--out", (folder / "out").string()},
        file + expected);
  }
  EXPECT_FALSE(std::filesystem::exists(folder / "out"));
}

TEST(CommandLine, ListsParametersAndValidatesScenarios) {
  const Result params = run_arex({"params", kWaypoints, "--set", "mission.max_time_s=77"});
  EXPECT_EQ(params.exit_code, 0);
  EXPECT_NE(params.out.find("mission.max_time_s"), std::string::npos);
  EXPECT_NE(params.out.find("  77 "), std::string::npos);
  EXPECT_EQ(run_arex({"params"}).exit_code, 0);
  EXPECT_EQ(run_arex({"validate", kWaypoints}).exit_code, 0);
  EXPECT_EQ(run_arex({"--help"}).exit_code, 0);
}

TEST(CommandLine, PrintsThePatternOfTheDevice) {
  const Result result = run_arex({"pattern", "--mode", "table", "--shots", "100"});
  EXPECT_EQ(result.exit_code, 0);
  std::istringstream lines(result.out);
  std::string line;
  std::getline(lines, line);
  EXPECT_EQ(line, "time_s,line,azimuth_deg,elevation_deg");
  int count = 0;
  while (std::getline(lines, line)) ++count;
  EXPECT_EQ(count, 400);
  EXPECT_EQ(run_arex({"pattern", "--mode", "other"}).exit_code, 2);
}

TEST(CommandLine, ARunThatFailsStillLeavesEverythingAndRunsAgainFromItsResolvedForm) {
  const TemporaryFolder folder;
  const Result first = run_arex({"run", kWaypoints, "--set", "mission.max_time_s=6", "--seed", "5",
                                 "--quiet", "--out", (folder / "a").string()});
  EXPECT_EQ(first.exit_code, 1) << first.err;  // timed out
  const auto summary = nlohmann::json::parse(read_text(folder / "a/summary.json"));
  EXPECT_EQ(summary["outcome"], "timed_out");
  EXPECT_EQ(summary["seed"], 5);
  EXPECT_EQ(summary["scenario"], "waypoints");
  EXPECT_DOUBLE_EQ(summary["sim_time_s"].get<double>(), 6.0);
  for (const char* key : {"reason", "wall_time_s", "cpu_time_s", "real_time_factor",
                          "trajectory_hash", "distance_m", "targets", "coverage", "map", "odometry",
                          "planner", "clearance", "collisions", "battery", "build"}) {
    EXPECT_TRUE(summary.contains(key)) << key;
  }
  for (const char* file :
       {"resolved.yaml", "truth.tum", "estimate.tum", "events.csv", "timing.csv", "report.html"}) {
    EXPECT_GT(std::filesystem::file_size(folder / "a" / file), 0u) << file;
  }
  const Result again =
      run_arex({"run", (folder / "a/resolved.yaml").string(), "--quiet", "--threads", "2",
                "--no-report", "--out", (folder / "b").string()});
  EXPECT_EQ(again.exit_code, 1);
  EXPECT_FALSE(std::filesystem::exists(folder / "b/report.html"));
  const auto summary_again = nlohmann::json::parse(read_text(folder / "b/summary.json"));
  EXPECT_EQ(summary_again["trajectory_hash"], summary["trajectory_hash"]);
  EXPECT_EQ(summary_again["sensor_hash"], summary["sensor_hash"]);
}

TEST(CommandLine, RequirementsDecideTheExitCodeOfASuccessAndAreReported) {
  const TemporaryFolder folder;
  const std::string junit = (folder / "junit.xml").string();
  std::vector<std::string> arguments{"run",
                                     AREX_SOURCE_DIR "/scenarios/yaw_burst.yaml",
                                     "--set",
                                     "mission.yaw_rates_radps=[1]",
                                     "--set",
                                     "mission.yaw_burst_s=1",
                                     "--quiet",
                                     "--out",
                                     (folder / "run").string(),
                                     "--junit",
                                     junit,
                                     "--require",
                                     "collisions==0"};
  const Result met = run_arex(arguments);
  EXPECT_EQ(met.exit_code, 0) << met.err;
  EXPECT_NE(read_text(junit).find("tests=\"2\" failures=\"0\""), std::string::npos);
  arguments.insert(arguments.end(), {"--require", "distance_m>=100"});
  const Result violated = run_arex(arguments);
  EXPECT_EQ(violated.exit_code, 1);
  EXPECT_EQ(violated.err.find("arex: required distance_m>=100, but distance_m is "), 0u)
      << violated.err;
  EXPECT_EQ(std::count(violated.err.begin(), violated.err.end(), '\n'), 1) << violated.err;
  EXPECT_NE(read_text(junit).find("tests=\"3\" failures=\"1\""), std::string::npos);
}

TEST(CommandLine, AnInterruptedRunKeepsWhatItFlew) {
  const TemporaryFolder folder;
  const auto process =
      start({"run", kWaypoints, "--quiet", "--out", (folder / "run").string()}, folder);
  wait_for(folder / "run/truth.tum", 100'000);
  process.signal(SIGINT);
  EXPECT_EQ(process.wait().exit_code, 130);
  const auto summary = nlohmann::json::parse(read_text(folder / "run/summary.json"));
  EXPECT_EQ(summary["outcome"], "interrupted");
}

TEST(CommandLine, AKilledRunLeavesNothingThatLooksFinished) {
  const TemporaryFolder folder;
  const auto process =
      start({"run", kWaypoints, "--quiet", "--out", (folder / "run").string()}, folder);
  wait_for(folder / "run/truth.tum", 100'000);
  process.signal(SIGKILL);
  EXPECT_EQ(process.wait().exit_code, 128 + SIGKILL);
  EXPECT_FALSE(std::filesystem::exists(folder / "run/summary.json"));
  EXPECT_NE(read_text(folder / "run/events.csv").find("mission_state"), std::string::npos);
}

TEST(CommandLine, ReportTellsWhatIsMissingFromWhatIsNoRun) {
  const TemporaryFolder folder;
  std::filesystem::create_directory(folder / "empty");
  write_text(folder / "file", "");
  const auto said = [&](const char* name) {
    const Result result = run_arex({"report", (folder / name).string()});
    EXPECT_EQ(result.exit_code, 2) << name;
    return result.err.substr(std::min(result.err.size(), folder.path().string().size() + 1));
  };
  const std::string expected = ", expected a run folder or the folder of a sweep\n";
  EXPECT_EQ(said("nowhere"), "nowhere: No such file or directory" + expected);
  EXPECT_EQ(said("file"), "file: is no folder" + expected);
  EXPECT_EQ(said("empty"),
            "empty: holds neither a run (resolved.yaml) nor a sweep (sweep.json)" + expected);
  EXPECT_TRUE(std::filesystem::is_empty(folder / "empty"));
}

TEST(CommandLine, NamesTheNearestCommandAndOption) {
  const auto said = [](const std::vector<std::string>& arguments) {
    const Result result = run_arex(arguments);
    EXPECT_EQ(result.exit_code, 2);
    EXPECT_EQ(std::count(result.err.begin(), result.err.end(), '\n'), 1) << result.err;
    return result.err;
  };
  EXPECT_EQ(said({"runn", "x.yaml"}),
            "arex: unknown command 'runn'; did you mean 'run'? See arex --help\n");
  EXPECT_NE(said({"swep"}).find("did you mean 'sweep'?"), std::string::npos);
  EXPECT_EQ(said({"run", kWaypoints, "--quite"}),
            "arex run: unknown option '--quite'; did you mean '--quiet'? See arex run --help\n");
  EXPECT_NE(said({"sweep", "x.yaml", "--jbos=3"}).find("did you mean '--jobs'?"),
            std::string::npos);
  // A value that was left out is not the next option.
  EXPECT_EQ(said({"run", kWaypoints, "--bag", "--quiet"}),
            "arex run: --bag needs a value before --quiet; see arex run --help\n");
  EXPECT_EQ(said({"run", kWaypoints, "--threads", "--seed=3"}),
            "arex run: --threads needs a value before --seed; see arex run --help\n");
  EXPECT_NE(said({"pattern", "--shot", "3"}).find("did you mean '--shots'?"), std::string::npos);
  // What does not belong on a terminal does not get there.
  EXPECT_EQ(said({"\x1b[31mrun"}).find('\x1b'), std::string::npos);
}

TEST(CommandLine, SaysItsVersion) {
  const Result result = run_arex({"--version"});
  EXPECT_EQ(result.exit_code, 0);
  EXPECT_EQ(result.out.find("arex 0."), 0u) << result.out;
  EXPECT_NE(result.out.find("compiled by g++ "), std::string::npos) << result.out;
}

// A tenth of a second that ends by timed_out.
std::vector<std::string> short_run(const TemporaryFolder& folder) {
  return {"run",   kWaypoints,
          "--set", "mission.max_time_s=0.1",
          "--set", "lidar.enabled=false",
          "--set", "odometry.source=mocap",
          "--set", "mapping.use_depth=false",
          "--out", (folder / "run").string()};
}

TEST(CommandLine, AFailedMissionIsOneLineWhenQuietAndFiveFiguresOtherwise) {
  const TemporaryFolder folder;
  std::vector<std::string> arguments = short_run(folder);
  const Result loud = run_arex(arguments);
  EXPECT_EQ(loud.exit_code, 1);
  EXPECT_EQ(loud.out.find("timed_out: "), 0u) << loud.out;
  for (const char* figure : {"time 0.1 s", "distance ", "odometry error ", "clearance "}) {
    EXPECT_NE(loud.out.find(figure), std::string::npos) << loud.out;
  }
  EXPECT_NE(loud.out.find((folder / "run/report.html").string()), std::string::npos) << loud.out;
  arguments.emplace_back("--quiet");
  const Result quiet = run_arex(arguments);
  EXPECT_EQ(quiet.exit_code, 1);
  EXPECT_EQ(quiet.out, "");
  EXPECT_EQ(quiet.err.find("arex: timed_out after 0.1 s: "), 0u) << quiet.err;
  EXPECT_EQ(std::count(quiet.err.begin(), quiet.err.end(), '\n'), 1) << quiet.err;
}

TEST(CommandLine, ACloudThatIsCutIsAnEvent) {
  const TemporaryFolder folder;
  const Result result =
      run_arex({"run", kWaypoints, "--quiet", "--no-report", "--set", "mission.max_time_s=4",
                "--set", "odometry.source=mocap", "--set", "mapping.use_depth=false", "--set",
                "mapping.cloud.max_points=1000", "--out", (folder / "run").string()});
  EXPECT_EQ(result.exit_code, 1) << result.err;
  const std::string events = read_text(folder / "run/events.csv");
  const auto at = events.find(",map_full,");
  ASSERT_NE(at, std::string::npos) << events;
  EXPECT_EQ(events.find(",map_full,", at + 1), std::string::npos) << "once";
}

TEST(CommandLine, ParametersListTheNamesThatTheyMayHave) {
  const std::string params = run_arex({"params"}).out;
  const auto line_of = [&](const std::string& key) {
    const auto at = params.find("\n" + key + " ");
    return at == std::string::npos ? "" : params.substr(at + 1, params.find('\n', at + 1) - at);
  };
  EXPECT_NE(line_of("mission.kind").find("(waypoints|goals|explore|yaw_burst)"), std::string::npos)
      << line_of("mission.kind");
  EXPECT_NE(line_of("odometry.source").find("|mocap"), std::string::npos);
  EXPECT_NE(line_of("world.kind").find("forest|"), std::string::npos);
}

TEST(CommandLine, RenderRefusesMomentsOutsideOfTheFlight) {
  const TemporaryFolder folder;
  ASSERT_EQ(run_arex(short_run(folder)).exit_code, 1);
  const auto expect = [&](const std::vector<std::string>& options, const char* file,
                          const std::string& said) {
    std::vector<std::string> arguments{"render", (folder / "run").string(), "--out",
                                       (folder / file).string()};
    arguments.insert(arguments.end(), options.begin(), options.end());
    const Result result = run_arex(arguments);
    EXPECT_EQ(result.exit_code, 2) << said;
    EXPECT_NE(result.err.find(said), std::string::npos) << result.err;
    EXPECT_FALSE(std::filesystem::exists(folder / file));
  };
  expect({"--time", "1000"}, "x.png", "--time 1000: lies outside of the flight");
  expect({"--time", "-1"}, "x.png", "--time -1: lies outside of the flight");
  expect({"--from", "1000"}, "x.mp4", "--from 1000: lies behind the end of the flight");
  expect({"--from", "0.08", "--to", "0.02"}, "x.mp4", "--from 0.08: lies behind --to 0.02");
  expect({"--to", "-3"}, "x.mp4", "--to -3: lies before the start of the flight");
}

TEST(CommandLine, ReportsUnfinishedRunsAndComparesSeveral) {
  const TemporaryFolder folder;
  for (const char* name : {"a", "b"}) {
    std::filesystem::create_directory(folder / name);
    write_text(folder / name / "resolved.yaml", "seed: 1\n");
  }
  const std::string a = (folder / "a").string(), b = (folder / "b").string();
  EXPECT_EQ(run_arex({"report", a}).out, a + "/report.html (unfinished run)\n");
  EXPECT_FALSE(std::filesystem::exists(folder / "report.html"));
  EXPECT_EQ(run_arex({"report", a, b}).exit_code, 0);
  EXPECT_NE(read_text(folder / "report.html").find("href=\"./a/report.html\""), std::string::npos);
}

TEST(CommandLine, RenderRefusesWhatItCannotDraw) {
  const TemporaryFolder folder;
  const std::string name = folder.path().string();
  EXPECT_EQ(run_arex({"render", name, "--out", name + "/x.gif"}).err,
            "--out " + name + "/x.gif: expected FILE.png or FILE.mp4\n");
  const Result result = run_arex({"render", name, "--out", name + "/x.mp4"});
  EXPECT_EQ(result.exit_code, 2);
  EXPECT_EQ(result.err, name + ": holds no run, expected a run folder\n");
  write_text(folder / "resolved.yaml", "seed: 1\n");
  EXPECT_EQ(run_arex({"render", name, "--out", name + "/x.mp4"}).err,
            name + "/truth.tum: holds no flight, expected two poses and more\n");
  std::filesystem::remove(folder / "resolved.yaml");
  EXPECT_TRUE(std::filesystem::is_empty(folder.path()));
}

// A straight flight of 2 m with a step aside, and an estimate 0.1 m beside it.
void write_flight(const TemporaryFolder& folder) {
  std::string truth, estimate;
  for (int i = 0; i <= 200; ++i) {
    const std::string time_and_x = std::to_string(0.01 * i) + " " + std::to_string(0.01 * i);
    const std::string z = i < 100 ? " 0" : " 1";
    truth += time_and_x + " 0" + z + " 0 0 0 1\n";
    estimate += time_and_x + " 0.1" + z + " 0 0 0 1\n";
  }
  std::filesystem::create_directory(folder / "run");
  write_text(folder / "run/truth.tum", truth);
  write_text(folder / "lio.tum", estimate);
  write_text(folder / "vio.tum", truth);
}

TEST(CommandLine, EvaluatesEstimatesAgainstARunOrATrajectory) {
  const TemporaryFolder folder;
  write_flight(folder);
  const std::string lio = (folder / "lio.tum").string(), vio = (folder / "vio.tum").string();
  const std::string flown = (folder / "run").string(), out = (folder / "out").string();
  const Result one = run_arex({"evaluate", lio, flown, "--out", out});
  EXPECT_EQ(one.exit_code, 0) << one.err;
  EXPECT_NE(one.out.find("position error (ATE), RMSE, m"), std::string::npos) << one.out;
  EXPECT_NE(one.out.find(out + "/evaluation.html\n"), std::string::npos) << one.out;
  const auto json = nlohmann::json::parse(read_text(folder / "out/evaluation.json"));
  const auto& estimate = json["estimates"][0];
  EXPECT_EQ(estimate["matched"], 201);
  EXPECT_NEAR(estimate["ate"]["translation_m"]["rmse"].get<double>(), 0.1, 1e-9);
  EXPECT_EQ(json["options"]["delta_m"], (nlohmann::json{1.0, 10.0}));

  const Result two = run_arex(
      {"evaluate", lio, vio, "--truth", flown, "--align", "se3", "--delta", "0.5,2", "--out", out});
  EXPECT_EQ(two.exit_code, 0) << two.err;
  const auto both = nlohmann::json::parse(read_text(folder / "out/evaluation.json"));
  ASSERT_EQ(both["estimates"].size(), 2u);
  EXPECT_NEAR(both["estimates"][0]["ate"]["translation_m"]["max"].get<double>(), 0, 1e-9);
  EXPECT_EQ(both["estimates"][1]["name"], "vio");
  EXPECT_EQ(both["options"]["delta_m"], (nlohmann::json{0.5, 2.0}));
}

TEST(CommandLine, EvaluateRefusesWhatItCannotCompareAndWritesNothing) {
  const TemporaryFolder folder;
  write_flight(folder);
  write_text(folder / "late.tum", "100 0 0 0 0 0 0 1\n101 0 0 0 0 0 0 1\n");
  write_text(folder / "open.txt", "1403636579763555584 1 2 3 1 0 0 0\n");
  std::filesystem::create_directory(folder / "empty");
  const std::string lio = (folder / "lio.tum").string(), flown = (folder / "run").string();
  const auto expect = [&](std::vector<std::string> arguments, const std::string& expected) {
    arguments.insert(arguments.begin(), "evaluate");
    arguments.insert(arguments.end(), {"--out", (folder / "out").string()});
    const Result result = run_arex(arguments);
    EXPECT_EQ(result.exit_code, 2) << expected;
    EXPECT_NE(result.err.find(expected), std::string::npos) << result.err;
    EXPECT_EQ(std::count(result.err.begin(), result.err.end(), '\n'), 1) << result.err;
    EXPECT_FALSE(std::filesystem::exists(folder / "out"));
  };
  expect({lio}, "alone, expected estimates and behind them");
  expect({lio, (folder / "empty").string()}, "/empty: holds no truth.tum, expected a run folder");
  expect({(folder / "none.tum").string(), flown}, "/none.tum:1: cannot be read");
  expect({(folder / "late.tum").string(), flown}, "/late.tum: 0 of 2 poses have a partner in");
  expect({(folder / "open.txt").string(), flown}, "/open.txt:1: may be TUM or EuRoC");
  expect({lio, flown, "--delta", "1,0"}, "--delta: is '0', expected metres above 0");
  expect({lio, flown, "--align", "so3"}, "--align");
  expect({lio, flown, "--max-time-difference", "nan"}, "--max-time-difference: is 'nan'");
  expect({lio, flown, "--alignn", "se3"}, "did you mean '--align'?");
}

}  // namespace
}  // namespace arex
