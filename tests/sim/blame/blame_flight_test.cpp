#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "support/process.h"

// Failures of known origin, provoked in short flights, and whom `arex blame` lays them to.
namespace arex {
namespace {

using test::ProcessResult;
using test::read_text;
using test::run_process;
using test::TemporaryFolder;

constexpr const char* kLegs = AREX_SOURCE_DIR "/scenarios/legs.yaml";
// Where the sensors do not matter they need not be simulated.
const std::vector<std::string> kBlind{"odometry.source=mocap", "lidar.enabled=false",
                                      "mapping.use_depth=false"};

/// A provoked failure, and the blame for it.
class Failure {
 public:
  explicit Failure(const std::vector<std::string>& overrides) {
    std::vector<std::string> arguments{"run",         kLegs,   "--quiet",
                                       "--no-report", "--out", run().string()};
    for (const std::string& assignment : overrides) {
      arguments.insert(arguments.end(), {"--set", assignment});
    }
    flight_ = run_process(AREX_BINARY, arguments);
    EXPECT_EQ(flight_.exit_code, 1) << "it should have failed: " << flight_.err;
    blame_ = run_process(AREX_BINARY, {"blame", run().string(), "--jobs", "2"});
    EXPECT_EQ(blame_.exit_code, 0) << blame_.err;
    json_ = nlohmann::json::parse(read_text(folder("blame.json")), nullptr, false);
  }
  [[nodiscard]] std::filesystem::path run() const { return folder_ / "run"; }
  [[nodiscard]] std::filesystem::path folder(const std::string& name) const {
    return folder_ / "run-blame" / name;
  }
  [[nodiscard]] const nlohmann::json& json() const { return json_; }
  [[nodiscard]] std::string verdict() const { return json_["verdict"]["text"]; }
  [[nodiscard]] const ProcessResult& blame() const { return blame_; }
  [[nodiscard]] std::string outcome_with(const std::string& name) const {
    for (const auto& flight : json_["flights"]) {
      if (flight["name"] == name) return flight["outcome"];
    }
    return "not flown";
  }

 private:
  TemporaryFolder folder_;
  ProcessResult flight_, blame_;
  nlohmann::json json_;
};

std::vector<std::string> blind(std::vector<std::string> more) {
  more.insert(more.end(), kBlind.begin(), kBlind.end());
  return more;
}

TEST(Blame, LaysWindThatNoTrackerHoldsToTheTracking) {
  const Failure failure(blind({"physics.wind.mean_mps=[0, 14, 0]"}));
  EXPECT_TRUE(failure.verdict().starts_with("tracking: ")) << failure.blame().out;
  EXPECT_EQ(failure.outcome_with("tracking"), "succeeded");
  EXPECT_EQ(failure.outcome_with("odometry"), "not flown");  // it is truth already
  EXPECT_EQ(failure.outcome_with("maps"), "not flown");      // legs have none
  // Each flight is a run that can be looked at and flown again; a page and a table tell of all.
  EXPECT_TRUE(std::filesystem::exists(failure.folder("tracking") / "summary.json"));
  EXPECT_NE(failure.blame().out.find(failure.verdict()), std::string::npos);
  const std::string page = read_text(failure.folder("blame.html"));
  EXPECT_NE(page.find("who failed?"), std::string::npos);
  EXPECT_NE(page.find("<polyline"), std::string::npos);
}

TEST(Blame, LaysAJumpOfTheOriginToTheOdometry) {
  const Failure failure(blind({"mocap.fault_jump_from_s=9", "mocap.fault_jump_m=[0, 5, 0]"}));
  EXPECT_TRUE(failure.verdict().starts_with("odometry: ")) << failure.blame().out;
  EXPECT_EQ(failure.outcome_with("tracking"), failure.json()["failed"]["outcome"]);
}

// Home is not reached in this time anyway: that is no reason to say that nothing ends the
// collision.
TEST(Blame, TellsThatTheCollisionIsGoneAndWhatComesThen) {
  const Failure failure(blind(
      {"mocap.fault_jump_from_s=9", "mocap.fault_jump_m=[0, 5, 0]", "mission.max_time_s=25"}));
  EXPECT_EQ(failure.json()["failed"]["outcome"], "collided");
  EXPECT_EQ(failure.outcome_with("odometry"), "timed_out");
  EXPECT_TRUE(failure.verdict().starts_with("odometry: the collision disappears"))
      << failure.blame().out;
  EXPECT_EQ(failure.json()["verdict"]["kind"], "module");
  EXPECT_EQ(failure.json()["verdict"]["then"]["outcome"], "timed_out");
}

TEST(Blame, LaysALegThroughTreesToThePlanning) {
  const Failure failure(blind({"mission.waypoints_m=[[12, 9, 1.5], [-12, -9, 1.5]]"}));
  EXPECT_EQ(failure.json()["failed"]["outcome"], "collided");
  EXPECT_TRUE(failure.verdict().starts_with("planning: ")) << failure.blame().out;
}

TEST(Blame, LaysAMissionWithoutTimeToNobody) {
  const Failure failure(blind({"mission.max_time_s=20"}));
  EXPECT_EQ(failure.json()["failed"]["outcome"], "timed_out");
  EXPECT_TRUE(failure.verdict().starts_with("time: ")) << failure.blame().out;
}

// Through no module: a vehicle that sees nothing lands, whatever its odometry knows.
TEST(Blame, LaysASilentLidarToTheSensors) {
  const Failure failure({"lidar.fault_silent_from_s=9", "lidar.fault_silent_for_s=100"});
  EXPECT_TRUE(failure.verdict().starts_with("sensors: ")) << failure.blame().out;
  EXPECT_EQ(failure.json()["verdict"]["through"], nlohmann::json::array());
  EXPECT_EQ(failure.outcome_with("odometry"), failure.json()["failed"]["outcome"]);
}

TEST(Blame, RefusesWhatCannotBeBlamedWithOneLine) {
  const TemporaryFolder folder;
  const auto expect_refused = [](const std::vector<std::string>& arguments,
                                 const std::string& why) {
    const ProcessResult result = run_process(AREX_BINARY, arguments);
    EXPECT_EQ(result.exit_code, 2) << why;
    EXPECT_NE(result.err.find(why), std::string::npos) << result.err;
    EXPECT_EQ(std::count(result.err.begin(), result.err.end(), '\n'), 1) << result.err;
  };
  expect_refused({"blame", "/does/not/exist"}, "/does/not/exist: does not exist");
  expect_refused({"blame", folder.path().string()}, "holds no run");
  expect_refused({"blame", folder.path().string(), "--jobs", "0"}, "--jobs: is '0'");
  const std::filesystem::path run = folder / "run";
  std::vector<std::string> arguments{"run",   kLegs,        "--quiet", "--no-report",
                                     "--out", run.string(), "--set",   "mission.max_time_s=1"};
  for (const std::string& assignment : kBlind) {
    arguments.insert(arguments.end(), {"--set", assignment});
  }
  ASSERT_EQ(run_process(AREX_BINARY, arguments).exit_code, 1);
  expect_refused({"blame", run.string(), "--out", run.string()}, "holds a run or a sweep");
  const std::string summary = read_text(run / "summary.json");
  std::filesystem::remove(run / "summary.json");
  expect_refused({"blame", run.string()}, "is unfinished");
  std::string interrupted = summary;
  interrupted.replace(interrupted.find("timed_out"), 9, "interrupted");
  test::write_text(run / "summary.json", interrupted);
  expect_refused({"blame", run.string()}, "was interrupted");
  const std::string file = (run / "summary.json").string();
  for (const auto& [text, why] : std::vector<std::pair<std::string, std::string>>{
           {"{}", ": lacks 'outcome', expected a text"},
           {"[]", ": is no JSON object"},
           {"{\"outcome\": ", ": is no JSON object"},
           {R"({"outcome": 7})", ": has an odd 'outcome', expected a text"},
           {R"({"outcome": "collided", "reason": "hit"})", ": lacks 'scenario'"},
           {R"({"outcome": "collided", "reason": "hit", "scenario": "s", "seed": 1})",
            ": lacks 'sim_time_s', expected a number"},
           {R"({"outcome": "burnt", "reason": "", "scenario": "s", "seed": 1, "sim_time_s": 1})",
            ": has the outcome 'burnt', expected succeeded, collided"},
           {R"({"outcome": "lost", "reason": "", "scenario": "s", "seed": -1, "sim_time_s": 1})",
            ": has an odd 'seed', expected an integer"}}) {
    test::write_text(file, text);
    expect_refused({"blame", run.string()}, file + why);
  }
  test::write_text(file, R"({"replay": {}})");
  expect_refused({"blame", run.string()}, "is a replay");
  test::write_text(file, summary);
  const std::string resolved = read_text(run / "resolved.yaml");
  std::filesystem::remove(run / "resolved.yaml");
  expect_refused({"blame", run.string()}, (run / "resolved.yaml").string() + ":1: ");
  test::write_text(run / "resolved.yaml", resolved + "of_another_version: 1\n");
  expect_refused({"blame", run.string()}, "unknown key 'of_another_version'");
  test::write_text(run / "resolved.yaml", resolved);
  std::filesystem::create_directory(folder / "sweep");
  test::write_text(folder / "sweep/sweep.json", "{}");
  expect_refused({"blame", (folder / "sweep").string()}, "is the folder of a sweep");
  EXPECT_FALSE(std::filesystem::exists(folder / "run-blame"));
  std::string succeeded = summary;
  succeeded.replace(succeeded.find("timed_out"), 9, "succeeded");
  test::write_text(run / "summary.json", succeeded);
  const ProcessResult nothing = run_process(AREX_BINARY, {"blame", run.string()});
  EXPECT_EQ(nothing.exit_code, 0);
  EXPECT_NE(nothing.out.find("nothing to blame"), std::string::npos) << nothing.out;
}

}  // namespace
}  // namespace arex
