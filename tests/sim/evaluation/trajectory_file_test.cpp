#include "evaluation/trajectory_file.h"

#include <gtest/gtest.h>

#include <numbers>
#include <string>

#include "config/config.h"
#include "support/temporary_folder.h"

namespace arex::sim {
namespace {

using Format = TrajectoryFormat;

// One pose in the words of each format: at (1, 2, 3), turned by 90 degrees about z, at 1.5 s.
constexpr const char* kTum = "1.5 1 2 3 0 0 0.70710678 0.70710678\n";
constexpr const char* kEuroc =
    "1500000000, 1, 2, 3, 0.70710678, 0, 0, 0.70710678, 0, 0, 0, 0, 0, 0, 0, 0, 0\n";
constexpr const char* kKitti = "0 -1 0 1 1 0 0 2 0 0 1 3\n";

void expect_the_pose(const Trajectory& trajectory, Format format) {
  EXPECT_EQ(trajectory.format, format);
  ASSERT_EQ(trajectory.poses.size(), 1u);
  const TimedPose& pose = trajectory.poses.front();
  EXPECT_EQ(pose.time_s, trajectory.has_time() ? 1.5 : 0);
  EXPECT_EQ(pose.X.p, Vec3(1, 2, 3));
  EXPECT_TRUE(pose.X.R.isApprox(so3::from_yaw(std::numbers::pi / 2), 1e-8)) << pose.X.R;
}

TEST(TrajectoryFile, TellsTheFormatsApart) {
  expect_the_pose(parse_trajectory(kTum, "f"), Format::kTum);
  expect_the_pose(parse_trajectory(kEuroc, "f"), Format::kEuroc);
  expect_the_pose(parse_trajectory(kKitti, "f"), Format::kKitti);
  // An estimator's CSV: only the pose, nanoseconds of a clock that counts from 1970.
  const Trajectory estimate = parse_trajectory("1403636579763555584,1,2,3,1,0,0,0\n", "f");
  EXPECT_EQ(estimate.format, Format::kEuroc);
  EXPECT_EQ(estimate.poses[0].time_s, 1403636579.763555584);
  EXPECT_EQ(parse_trajectory("1.5,1,2,3,0,0,0,1\n", "f").format, Format::kTum);
}

void expect_refused(std::string_view text, const std::string& expected) {
  try {
    parse_trajectory(text, "f.txt");
    ADD_FAILURE() << text << " was read";
  } catch (const ConfigError& error) {
    const std::string what = error.what();
    EXPECT_EQ(what.substr(0, expected.size()), expected);
    EXPECT_EQ(what.find('\n'), std::string::npos) << what;
  }
}

TEST(TrajectoryFile, AsksWhereAFileCouldBeOfTwoFormats) {
  for (const char* open : {"1403636579763555584 1 2 3 1 0 0 0\n", "5,1,2,3,1,0,0,0\n"}) {
    expect_refused(open, "f.txt:1: may be TUM or EuRoC, expected --format tum or --format euroc");
    const Trajectory tum = parse_trajectory(open, "f", Format::kTum);
    const Trajectory euroc = parse_trajectory(open, "f", Format::kEuroc);
    EXPECT_EQ(tum.format, Format::kTum);
    EXPECT_EQ(euroc.format, Format::kEuroc);
    EXPECT_NEAR(so3::angle(tum.poses[0].X.R), std::numbers::pi, 1e-12);
    EXPECT_EQ(so3::angle(euroc.poses[0].X.R), 0);
    EXPECT_NEAR(1e9 * euroc.poses[0].time_s, tum.poses[0].time_s, 1e3);
  }
  // What a file cannot be it is not taken for.
  EXPECT_EQ(parse_trajectory(kKitti, "f", Format::kTum).format, Format::kKitti);
  EXPECT_EQ(parse_trajectory(kTum, "f", Format::kKitti).format, Format::kTum);
}

TEST(TrajectoryFile, ReadsWhatPeopleWrite) {
  const std::string numbers = "1.5 1 2 3 0 0 0.70710678 0.70710678";
  const std::vector<std::string> texts{"# time x y z qx qy qz qw\n\n" + numbers + "\n\n",
                                       numbers + "\r\n",
                                       numbers,
                                       "  1.5\t+1   2 3 0,0 , 0.70710678 0.70710678 ,\n",
                                       "\xef\xbb\xbf#BOM\n" + numbers + "\n",
                                       "time,x,y,z,qx,qy,qz,qw\n" + numbers + "\n"};
  for (const std::string& text : texts) {
    expect_the_pose(parse_trajectory(text, "f"), Format::kTum);
  }
}

TEST(TrajectoryFile, RefusesWithFileAndLine) {
  expect_refused("", "f.txt:1: no pose until here");
  expect_refused("# nothing\n\n", "f.txt:2: no pose until here");
  expect_refused("nan 1 2 3 0 0 0 1\n", "f.txt:1: no pose until here");
  expect_refused("#\n1 2 3\n", "f.txt:2: 3 numbers, expected 8 (TUM), 12 (KITTI)");
  expect_refused(std::string(kTum) + "2 1 2 3 0 0 1\n", "f.txt:2: 7 numbers, expected 8 as before");
  expect_refused(std::string(kKitti) + kTum, "f.txt:2: 8 numbers, expected 12 as before");
  expect_refused(std::string(kTum) + "2 1 2 x 0 0 0 1\n", "f.txt:2: 'x' is no number");
  expect_refused("1 1 2 0x3 0 0 0 1\n", "f.txt:1: '0x3' is no number");
  expect_refused("1,1,,2,3,0,0,0,1\n", "f.txt:1: '' is no number");
  expect_refused("a heading\nand another\n", "f.txt:2: 'and' is no number");
  expect_refused("1 1 2 3 0 0 0 0\n", "f.txt:1: the quaternion is zero");
  expect_refused("1 0 0 1 0 -1 0 2 0 0 1 3\n", "f.txt:1: the matrix is no rotation");
  expect_refused("2 0 0 1 0 1 0 2 0 0 1 3\n", "f.txt:1: the matrix is no rotation");
  const std::string garbage(5000, '\x1b');
  expect_refused("1 " + garbage + "\n", "f.txt:1: '");
}

TEST(TrajectoryFile, CountsWhatItPutRight) {
  const Trajectory trajectory = parse_trajectory(
      "3 0 0 0 0 0 0 1\n"
      "1 0 0 0 0 0 0 2\n"      // early, and no unit quaternion
      "2 nan 0 0 0 0 0 1\n"    //
      "2 0 0 inf 0 0 0 1\n"    //
      "3 1 0 0 0 0 0 1.005\n"  // again 3; as near to a unit quaternion as two decimals say
      "4 0 0 0 0 0 0 1\n"
      "5 0 0 0 0 0",  // a killed program's
      "f");
  EXPECT_EQ(trajectory.not_finite, 2u);
  EXPECT_EQ(trajectory.out_of_order, 1u);
  EXPECT_EQ(trajectory.same_stamp, 1u);
  EXPECT_EQ(trajectory.normalised, 1u);
  EXPECT_EQ(trajectory.cut_short, 1u);
  ASSERT_EQ(trajectory.poses.size(), 4u);
  EXPECT_EQ(trajectory.poses[0].time_s, 1);
  EXPECT_EQ(trajectory.poses[0].X.R, Mat3::Identity());
  EXPECT_EQ(trajectory.poses[2].X.p.x(), 1) << "the later one of two stays behind the other";
}

TEST(TrajectoryFile, LeavesOutWhatADivergedFilterWrites) {
  const Trajectory trajectory =
      parse_trajectory("1 1e300 0 0 0 0 0 1\n2 -inf 0 0 0 0 0 1\n3 0 0 1e6 0 0 0 1\n", "f");
  EXPECT_EQ(trajectory.not_finite, 2u);
  EXPECT_EQ(trajectory.poses.size(), 1u);
  // EuRoC's biases are none of the pose.
  const Trajectory euroc = parse_trajectory("1500000000,1,2,3,1,0,0,0,nan,nan\n", "f");
  EXPECT_EQ(euroc.not_finite, 0u);
}

TEST(TrajectoryFile, SaysWhatCannotBeRead) {
  const test::TemporaryFolder folder;
  const std::string missing = (folder / "none.tum").string();
  try {
    read_trajectory(missing);
    ADD_FAILURE();
  } catch (const ConfigError& error) {
    EXPECT_EQ(error.what(), missing + ":1: cannot be read, expected a trajectory");
  }
  EXPECT_THROW(read_trajectory(folder.path()), ConfigError);
  test::write_text(folder / "a.tum", kTum);
  const Trajectory read = read_trajectory(folder / "a.tum");
  EXPECT_EQ(read.file, (folder / "a.tum").string());
  expect_the_pose(read, Format::kTum);
  // A name that JSON cannot hold.
  test::write_text(folder / "\xff.tum", kTum);
  EXPECT_EQ(read_trajectory(folder / "\xff.tum").file, (folder / "\\xff.tum").string());
}

}  // namespace
}  // namespace arex::sim
