#include <gtest/gtest.h>

#include <cstdio>
#include <nlohmann/json.hpp>
#include <sstream>

#include "arex_binary.h"
#include "support/process.h"

// What `arex semantics` writes, replaces and refuses.
namespace arex {
namespace {

using Result = test::ProcessResult;
using test::read_text;
using test::TemporaryFolder;
using test::write_text;

// The world is built again, and the score is the flight's own.
TEST(SemanticsCommand, ScoresTheSemanticMapOfARunAgainstItsWorld) {
  const TemporaryFolder folder;
  const Result flown =
      run_arex({"run", AREX_SOURCE_DIR "/scenarios/forest_small.yaml", "--set",
                "mission.max_time_s=12", "--set", "depth.rate_hz=1", "--set",
                "scoring.tour.enabled=false", "--set", "semantics.enabled=true", "--seed", "7",
                "--quiet", "--no-report", "--out", (folder / "run").string()});
  EXPECT_EQ(flown.exit_code, 1) << flown.err;  // timed out
  const auto expected = nlohmann::json::parse(read_text(folder / "run/summary.json"))["semantic"];
  ASSERT_TRUE(expected["trunk"]["f1"].is_number());
  const Result map =
      run_arex({"semantics", (folder / "run").string(), "--out", (folder / "map").string()});
  EXPECT_EQ(map.exit_code, 0) << map.err;
  EXPECT_NE(map.out.find("against the world"), std::string::npos) << map.out;
  std::istringstream lines(read_text(folder / "map/semantic_score.csv"));
  std::string line;
  std::getline(lines, line);
  EXPECT_EQ(line.substr(0, 34), "class,precision,recall,f1,position");
  std::getline(lines, line);
  double precision = 0, recall = 0, f1 = 0, position = 0;
  ASSERT_EQ(std::sscanf(line.c_str(), "trunk,%lf,%lf,%lf,%lf", &precision, &recall, &f1, &position),
            4)
      << line;
  EXPECT_NEAR(precision, expected["trunk"]["precision"].get<double>(), 1e-4);
  EXPECT_NEAR(recall, expected["trunk"]["recall"].get<double>(), 1e-4);
  EXPECT_NEAR(f1, expected["trunk"]["f1"].get<double>(), 1e-4);
  EXPECT_NEAR(position, expected["trunk"]["position_median_m"].get<double>(), 1e-3);

  // A cloud alone has no world, and neither has a folder whose flight is not over.
  std::filesystem::remove(folder / "run/summary.json");
  const Result unfinished =
      run_arex({"semantics", (folder / "run").string(), "--out", (folder / "other").string()});
  EXPECT_EQ(unfinished.exit_code, 0) << unfinished.err;
  EXPECT_FALSE(std::filesystem::exists(folder / "other/semantic_score.csv"));
}

TEST(SemanticsCommand, RefusesACloudOfNoPlace) {
  const TemporaryFolder folder;
  std::string pcd = "FIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nWIDTH 200\nHEIGHT 1\nDATA ascii\n";
  for (int i = 0; i < 200; ++i) {
    pcd += std::to_string(i) + "e7 " + std::to_string(i * i % 101) + "e7 " +
           std::to_string(i * i % 13) + "e7\n";  // in no plane, which would be told first
  }
  write_text(folder / "far.pcd", pcd);
  const std::string out = (folder / "map").string();
  const Result result = run_arex({"semantics", (folder / "far.pcd").string(), "--out", out});
  EXPECT_EQ(result.exit_code, 2) << result.err;
  EXPECT_NE(result.err.find("kilometres from each other"), std::string::npos) << result.err;
  EXPECT_FALSE(std::filesystem::exists(folder / "map/objects.csv"));
}

// Written again, the map of another cloud leaves nothing of the first; refused, all of it.
TEST(SemanticsCommand, ASemanticMapIsReplacedAsAWhole) {
  const TemporaryFolder folder;
  const auto write_cloud = [&](const std::string& name, double relief_m) {
    std::string pcd = "FIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nWIDTH 900\nHEIGHT 1\nDATA ascii\n";
    for (int i = 0; i < 900; ++i) {
      pcd += std::to_string(0.2 * (i % 30)) + " " + std::to_string(0.2 * (i / 30)) + " " +
             std::to_string(relief_m * (i * 7 % 11)) + "\n";
    }
    write_text(folder / name, pcd);
    return (folder / name).string();
  };
  const std::string out = (folder / "map").string();
  std::filesystem::create_directory(folder / "map");
  for (const char* name : {"semantic_score.csv", "objects.csv", "semantic.png", "of_mine.txt"}) {
    write_text(folder / "map" / name, "old");
  }
  const Result flat = run_arex({"semantics", write_cloud("flat.pcd", 0), "--out", out});
  EXPECT_EQ(flat.exit_code, 2);
  EXPECT_NE(flat.err.find("in one plane"), std::string::npos) << flat.err;
  EXPECT_EQ(std::count(flat.err.begin(), flat.err.end(), '\n'), 1) << flat.err;
  EXPECT_EQ(read_text(folder / "map/objects.csv"), "old");
  EXPECT_EQ(read_text(folder / "map/semantic_score.csv"), "old");
  const Result map = run_arex({"semantics", write_cloud("rough.pcd", 0.01), "--out", out});
  EXPECT_EQ(map.exit_code, 0) << map.err;
  EXPECT_NE(read_text(folder / "map/objects.csv"), "old");
  EXPECT_NE(read_text(folder / "map/semantic.png"), "old");
  EXPECT_FALSE(std::filesystem::exists(folder / "map/semantic_score.csv"));
  EXPECT_EQ(read_text(folder / "map/of_mine.txt"), "old");
  EXPECT_EQ(std::distance(std::filesystem::directory_iterator(folder / "map"), {}), 4);
}

}  // namespace
}  // namespace arex
