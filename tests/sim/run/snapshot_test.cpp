#include <gtest/gtest.h>
#include <octomap/octomap.h>

#include <cmath>
#include <nlohmann/json.hpp>
#include <set>

#include "clouds/pcd_reader.h"
#include "support/process.h"

// Snapshots of a flight, written by the binary, read back by others.
namespace arex {
namespace {

using test::read_text;
using test::run_process;
using test::TemporaryFolder;
using test::write_text;

// Before a wall of pillars: a lift-off, a climb and a few metres.
constexpr const char* kScenario = AREX_SOURCE_DIR "/scenarios/gaps.yaml";

test::ProcessResult fly(const std::filesystem::path& out, const std::vector<std::string>& more) {
  std::vector<std::string> arguments{"run",     kScenario,     "--set", "mission.max_time_s=9",
                                     "--quiet", "--no-report", "--out", out.string()};
  arguments.insert(arguments.end(), more.begin(), more.end());
  return run_process(AREX_BINARY, arguments);
}

std::vector<Vec3> points_of(const std::filesystem::path& file) {
  const std::string bytes = read_text(file);
  return read_pcd(parse_pcd_header(bytes, bytes.size()), bytes).points;
}

/// A flight of 9 s with snapshots, flown once for all tests.
class Snapshots : public testing::Test {
 protected:
  static void SetUpTestSuite() {
    folder_ = new TemporaryFolder;
    result_ = fly(run(), {"--snapshot", "8.5", "--snapshot", "1", "--snapshot", "8.5"});
  }
  static void TearDownTestSuite() { delete folder_; }
  static std::filesystem::path run() { return *folder_ / "run"; }
  static std::filesystem::path late() { return run() / "snapshots" / "8.5"; }
  static nlohmann::json description() {
    return nlohmann::json::parse(read_text(late() / "snapshot.json"));
  }
  static test::ProcessResult render(const std::vector<std::string>& more) {
    std::vector<std::string> arguments{"render", run().string(), "--out",
                                       (*folder_ / "x.png").string()};
    arguments.insert(arguments.end(), more.begin(), more.end());
    return run_process(AREX_BINARY, arguments);
  }

  static inline TemporaryFolder* folder_ = nullptr;
  static inline test::ProcessResult result_;
};

TEST_F(Snapshots, StandInTheRunFolderByTheirTimes) {
  EXPECT_EQ(result_.exit_code, 1) << result_.err;  // timed out
  std::set<std::string> names;
  for (const auto& entry : std::filesystem::directory_iterator(run() / "snapshots")) {
    names.insert(entry.path().filename());
  }
  EXPECT_EQ(names, (std::set<std::string>{"1", "8.5"}));
  const auto json = description();
  EXPECT_EQ(json["time_s"], 8.5);
  EXPECT_GT(json["grid_time_s"], 8.2);
  EXPECT_LT(json["grid_time_s"], 8.5);
  EXPECT_EQ(json["inflation_m"], 0.5);
  // Before the first grid there is nothing to see.
  const auto early = nlohmann::json::parse(read_text(run() / "snapshots/1/snapshot.json"));
  EXPECT_TRUE(early["grid_time_s"].is_null());
  EXPECT_EQ(early["own_cell"], "unknown");
}

TEST_F(Snapshots, TheCloudIsOfAllFramesAndTheScanOneOfThem) {
  const auto scan = points_of(late() / "scan.pcd"), cloud = points_of(late() / "cloud.pcd");
  EXPECT_GT(scan.size(), 5000U);  // of 20,000 firings, half of them into the sky
  EXPECT_GT(cloud.size(), 4 * scan.size());
  const auto key = [](const Vec3& p) { return std::array{p.x(), p.y(), p.z()}; };
  std::set<std::array<double, 3>> all;
  for (const Vec3& p : cloud) all.insert(key(p));
  for (const Vec3& p : scan) ASSERT_TRUE(all.contains(key(p)));
}

// The paper's inflation by its definition, from the occupied cells alone.
TEST_F(Snapshots, TheInflatedGridIsTheOccupiedOneExpanded) {
  const double resolution = 0.1, inflation = description()["inflation_m"];
  const auto cell = [&](const Vec3& p) {
    const Eigen::Vector3i c = (p / resolution).array().floor().cast<int>();
    return std::array{c.x(), c.y(), c.z()};
  };
  std::set<std::array<int, 3>> occupied, inflated, expanded;
  for (const Vec3& p : points_of(late() / "grid.pcd")) occupied.insert(cell(p));
  Eigen::Vector3i low = Eigen::Vector3i::Constant(1 << 20), high = -low;
  for (const Vec3& p : points_of(late() / "inflated_grid.pcd")) {
    const auto c = cell(p);
    inflated.insert(c);
    low = low.cwiseMin(Eigen::Vector3i(c[0], c[1], c[2]));
    high = high.cwiseMax(Eigen::Vector3i(c[0], c[1], c[2]));
  }
  ASSERT_GT(occupied.size(), 200U);
  const int n = static_cast<int>(std::lround(inflation / resolution));
  for (const auto& [x, y, z] : occupied) {
    for (int dx = -n; dx <= n; ++dx) {
      for (int dy = -n; dy <= n; ++dy) {
        for (int dz = -n; dz <= n; ++dz) {
          const Eigen::Vector3i c(x + dx, y + dy, z + dz);
          // Beyond the grid's edge there is no cell to be inflated.
          if ((c.array() < low.array()).any() || (c.array() > high.array()).any()) continue;
          expanded.insert({c.x(), c.y(), c.z()});
        }
      }
    }
  }
  EXPECT_EQ(inflated, expanded);
}

TEST_F(Snapshots, OctomapReadsTheGridsAsTheCloudsHaveThem) {
  for (const char* name : {"grid", "inflated_grid"}) {
    octomap::OcTree tree((late() / (std::string(name) + ".bt")).string());
    const auto cells = points_of(late() / (std::string(name) + ".pcd"));
    std::size_t occupied = 0;
    tree.expand();
    for (auto leaf = tree.begin_leafs(); leaf != tree.end_leafs(); ++leaf) {
      occupied += tree.isNodeOccupied(*leaf);
    }
    EXPECT_EQ(occupied, cells.size()) << name;
    for (std::size_t i = 0; i < cells.size(); i += 37) {
      const auto* node = tree.search(cells[i].x(), cells[i].y(), cells[i].z());
      ASSERT_NE(node, nullptr);
      EXPECT_TRUE(tree.isNodeOccupied(node));
    }
  }
}

TEST_F(Snapshots, AreDrawnByPartAndTime) {
  for (const char* what : {"scan", "cloud", "grid", "inflated_grid"}) {
    const auto drawn = render({"--what", what, "--time", "8.5"});
    EXPECT_EQ(drawn.exit_code, 0) << drawn.err;
    EXPECT_TRUE(read_text(*folder_ / "x.png").starts_with("\x89PNG"));
  }
  const auto refused = [&](const std::vector<std::string>& more, const std::string& why) {
    const auto result = render(more);
    EXPECT_EQ(result.exit_code, 2) << why;
    EXPECT_NE(result.err.find(why), std::string::npos) << result.err;
    EXPECT_EQ(std::count(result.err.begin(), result.err.end(), '\n'), 1) << result.err;
  };
  refused({"--what", "cloud"}, "holds several snapshots, expected --time with one of 1, 8.5");
  refused({"--what", "cloud", "--time", "3"}, "--time 3: no snapshot of that time");
  refused({"--what", "clouds"}, "--what");
}

TEST_F(Snapshots, UnfinishedAndDamagedOnesAreRefusedByName) {
  const TemporaryFolder copy;
  const std::filesystem::path damaged = copy / "run";
  std::filesystem::copy(run(), damaged, std::filesystem::copy_options::recursive);
  const auto why = [&] {
    return run_process(AREX_BINARY, {"render", damaged.string(), "--what", "grid", "--time", "8.5",
                                     "--out", (copy / "x.png").string()});
  };
  write_text(damaged / "snapshots/8.5/grid.pcd", "# .PCD v0.7\nVERSION 0.7\n");
  EXPECT_EQ(why().exit_code, 2);
  EXPECT_NE(why().err.find("grid.pcd: "), std::string::npos) << why().err;
  std::filesystem::remove(damaged / "snapshots/8.5/snapshot.json");
  EXPECT_EQ(why().exit_code, 2);
  EXPECT_NE(why().err.find("is unfinished"), std::string::npos) << why().err;
  std::filesystem::remove_all(damaged / "snapshots");
  EXPECT_EQ(why().exit_code, 2);
  EXPECT_NE(why().err.find("holds no snapshot"), std::string::npos) << why().err;
}

TEST(Snapshot, TimesThatAMissionCannotHaveAreRefusedBeforeTheFlight) {
  const TemporaryFolder folder;
  for (const char* time :
       {"0", "-1", "9.5", "x", "nan", "inf", "1e400", "9", "1e-12", "0.0004", "1.0005"}) {
    const auto result = fly(folder / "run", {"--snapshot", time});
    EXPECT_EQ(result.exit_code, 2) << time;
    EXPECT_NE(result.err.find("--snapshot: is '"), std::string::npos) << result.err;
    EXPECT_FALSE(std::filesystem::exists(folder / "run"));
  }
}

TEST(Snapshot, OfAnOlderRunGoesWithIt) {
  const TemporaryFolder folder;
  const std::filesystem::path run = folder / "run";
  ASSERT_EQ(fly(run, {"--snapshot", "0.5", "--set", "mission.max_time_s=1"}).exit_code, 1);
  ASSERT_TRUE(std::filesystem::exists(run / "snapshots/0.5/snapshot.json"));
  write_text(run / "snapshots/mine.txt", "a note");
  ASSERT_EQ(fly(run, {"--set", "mission.max_time_s=1"}).exit_code, 1);
  EXPECT_FALSE(std::filesystem::exists(run / "snapshots/0.5"));
  EXPECT_EQ(read_text(run / "snapshots/mine.txt"), "a note");  // nobody else's is touched
}

}  // namespace
}  // namespace arex
