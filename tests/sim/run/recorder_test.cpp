#include "run/recorder.h"

#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "math/fingerprint.h"
#include "support/temporary_folder.h"

namespace arex::sim {
namespace {

using test::read_text;
using test::TemporaryFolder;

TEST(Recorder, WritesTumRowsThatReadBack) {
  const TemporaryFolder folder;
  const Pose X{so3::Exp({0.1, -0.2, 0.3}), {1, -2, 3}};
  {
    Recorder recorder(folder / "run", "seed: 1\n");
    FlightSample sample;
    sample.truth_X_OB = X;
    recorder.sample(1'234'567'890, sample);
    recorder.flush();
  }
  std::istringstream lines(read_text(folder / "run/truth.tum"));
  std::string header;
  std::getline(lines, header);
  EXPECT_EQ(header.front(), '#');
  double t = 0, x = 0, y = 0, z = 0, qx = 0, qy = 0, qz = 0, qw = 0;
  ASSERT_TRUE(lines >> t >> x >> y >> z >> qx >> qy >> qz >> qw);
  EXPECT_DOUBLE_EQ(t, 1.23456789);
  EXPECT_NEAR((Vec3(x, y, z) - X.p).norm(), 0, 1e-6);
  EXPECT_NEAR((Quat(qw, qx, qy, qz).toRotationMatrix() - X.R).norm(), 0, 1e-8);
}

TEST(Recorder, AFolderIsUnfinishedUntilItsSummaryIsThere) {
  const TemporaryFolder folder;
  { Recorder recorder(folder / "run", "seed: 1\n"); }
  EXPECT_FALSE(std::filesystem::exists(folder / "run/summary.json"));
  EXPECT_EQ(read_text(folder / "run/resolved.yaml"), "seed: 1\n");
  {
    Recorder recorder(folder / "run", "seed: 2\n");
    recorder.write_summary({{"outcome", "succeeded"}});
  }
  EXPECT_EQ(nlohmann::json::parse(read_text(folder / "run/summary.json"))["outcome"], "succeeded");
  // A new run in the same folder takes the old summary away before it writes anything.
  { Recorder recorder(folder / "run", "seed: 3\n"); }
  EXPECT_FALSE(std::filesystem::exists(folder / "run/summary.json"));
}

TEST(Recorder, QuotesDetailsWithCommas) {
  const TemporaryFolder folder;
  Recorder recorder(folder / "run", "");
  recorder.event({1'500'000'000, EventKind::kStuck, "a, \"b\""});
  recorder.flush();
  EXPECT_EQ(read_text(folder / "run/events.csv"),
            "time_s,kind,detail\n1.500,stuck,\"a, \"\"b\"\"\"\n");
}

TEST(Recorder, TellsWhenTheCloudGrew) {
  const TemporaryFolder folder;
  Recorder recorder(folder / "run", "");
  recorder.write_cloud({{1, 2, 3}, {4, 5, 6}, {7, 8, 9}}, {{500'000'000, 1}, {2'000'000'000, 3}});
  EXPECT_EQ(read_text(folder / "run/cloud_growth.csv"), "time_s,points\n0.500,1\n2.000,3\n");
  EXPECT_TRUE(std::filesystem::exists(folder / "run/cloud.pcd"));
  // A new run in the same folder does not inherit it.
  { const Recorder next(folder / "run", ""); }
  EXPECT_FALSE(std::filesystem::exists(folder / "run/cloud_growth.csv"));
}

TEST(Recorder, SaysWhichFileCannotBeWritten) {
  const TemporaryFolder folder;
  test::write_text(folder / "file", "not a folder");
  EXPECT_THROW(Recorder(folder / "file", ""), std::runtime_error);
}

TEST(Fingerprint, ChangesWithEveryBitAndWithTheOrder) {
  const std::vector<double> values{0.1, 0.2, 0.3};
  auto hash_of = [](std::span<const double> v) {
    Fingerprint hash;
    hash.add(v);
    return hash.text();
  };
  const std::string reference = hash_of(values);
  EXPECT_EQ(reference.size(), 16u);
  EXPECT_EQ(hash_of(values), reference);
  for (std::size_t i = 0; i < values.size(); ++i) {
    auto changed = values;
    changed[i] = std::nextafter(changed[i], 1.0);
    EXPECT_NE(hash_of(changed), reference);
  }
  EXPECT_NE(hash_of(std::vector<double>{0.2, 0.1, 0.3}), reference);
  EXPECT_NE(hash_of(std::vector<double>{-0.0}), hash_of(std::vector<double>{0.0}));
}

}  // namespace
}  // namespace arex::sim
