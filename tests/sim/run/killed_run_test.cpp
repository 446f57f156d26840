#include <gtest/gtest.h>
#include <pcl/io/pcd_io.h>
#include <pcl/point_types.h>

#include <algorithm>
#include <fstream>
#include <iterator>
#include <thread>

#include "math/random.h"
#include "report/run_record.h"
#include "support/process.h"

// A machine may die at any moment of a flight: what was flown until then stays readable, and
// nothing of it looks finished.
namespace arex {
namespace {

using test::TemporaryFolder;

/// Runs killed a while after that moment.
constexpr int kFromStart = 8, kFromFlight = 7, kFromFirstCloud = 5;
constexpr double kLatest = 5.0;  ///< the longest while, s of wall time

// By PCL itself, which a user would take: header and data agree.
std::size_t points_of(const std::filesystem::path& file) {
  pcl::PointCloud<pcl::PointXYZ> cloud;
  EXPECT_EQ(pcl::io::loadPCDFile(file.string(), cloud), 0) << file;
  return cloud.size();
}

// Only what a kill may cut: the last line of a text file.
void expect_readable(const std::filesystem::path& folder) {
  const sim::RunRecord record = sim::read_run(folder, 1'000'000);
  EXPECT_FALSE(record.summary);
  EXPECT_FALSE(record.resolved_yaml.empty());
  for (std::size_t i = 1; i < record.truth.size(); ++i) {
    ASSERT_NEAR(record.truth[i].time_s - record.truth[i - 1].time_s, 0.005, 1e-9);
  }
  const std::filesystem::path cloud = folder / "cloud.pcd";
  if (std::filesystem::exists(cloud)) {
    EXPECT_GT(record.cloud.total, 0u);
    EXPECT_EQ(points_of(cloud), record.cloud.total);
  }
}

struct Remains {
  double flown_s = 0;
  std::size_t events = 0;
  bool cloud = false;
};

/// What the seconds until a kill count from: how fast the host is must not decide what they meet.
enum class From { kStart, kFlight, kFirstCloud };

/// Until the file has so many whole lines.
void wait_for(const std::filesystem::path& file, std::ptrdiff_t lines) {
  const auto is_there = [&] {
    std::ifstream in(file, std::ios::binary);
    return std::count(std::istreambuf_iterator<char>(in), {}, '\n') >= lines;
  };
  for (int i = 0; i < 6000 && !is_there(); ++i) {
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
  }
  ASSERT_TRUE(is_there()) << file;
}

Remains kill_after(double seconds, From from, std::uint64_t seed) {
  const TemporaryFolder folder;
  const std::filesystem::path out = folder / "run";
  const test::Process process(
      AREX_BINARY,
      {"run", AREX_SOURCE_DIR "/scenarios/waypoints.yaml", "--quiet", "--seed",
       std::to_string(seed), "--set", "depth.rate_hz=1", "--out", out.string()},
      folder.path());
  if (from == From::kFlight) {
    wait_for(out / "truth.tum", 3);   // two poses make a duration
    wait_for(out / "events.csv", 2);  // one beside the header
  }
  if (from == From::kFirstCloud) wait_for(out / "cloud.pcd", 1);
  std::this_thread::sleep_for(std::chrono::duration<double>(seconds));
  process.signal(SIGKILL);
  EXPECT_EQ(process.wait().exit_code, 128 + SIGKILL);
  if (!std::filesystem::exists(out / "resolved.yaml")) return {};  // before the flight
  expect_readable(out);
  const sim::RunRecord record = sim::read_run(out, 1);
  return {record.duration_s(), record.events.rows.size(), !record.cloud.points_O.empty()};
}

TEST(KilledRun, IsUnfinishedAndReadableWheneverItDied) {
  RandomStream random(11, "killed_run_test");
  int flying = 0, with_events = 0;
  for (int i = 0; i < kFromStart + kFromFlight + kFromFirstCloud; ++i) {
    const From from = i < kFromStart                 ? From::kStart
                      : i < kFromStart + kFromFlight ? From::kFlight
                                                     : From::kFirstCloud;
    const double moment = random.uniform(0, from == From::kFirstCloud ? 1 : kLatest);
    SCOPED_TRACE("run " + std::to_string(i) + " killed after " + std::to_string(moment) + " s");
    const Remains remains = kill_after(moment, from, static_cast<std::uint64_t>(1 + i));
    flying += remains.flown_s > 0;
    with_events += remains.events > 0;
    EXPECT_TRUE(remains.cloud || from != From::kFirstCloud);
  }
  // Otherwise the test has looked at nothing.
  EXPECT_GE(flying, kFromFlight + kFromFirstCloud);
  EXPECT_GE(with_events, kFromFlight + kFromFirstCloud);
}

}  // namespace
}  // namespace arex
