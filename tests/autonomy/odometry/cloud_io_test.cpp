#include "mapping/cloud_io.h"

#include <gtest/gtest.h>
#include <pcl/io/pcd_io.h>
#include <pcl/point_types.h>

#include "files/files.h"
#include "support/temporary_folder.h"

namespace arex {
namespace {

TEST(CloudIo, PclReadsBackWhatWasWritten) {
  const test::TemporaryFolder folder;
  const std::vector<Vec3f> points{{1, 2, 3}, {-4.5F, 0, 1e-3F}, {100, -200, 8}};
  const auto file = folder.path() / "cloud.pcd";
  write_pcd(file, points);
  write_pcd(file, points);  // over the one before
  pcl::PointCloud<pcl::PointXYZ> cloud;
  ASSERT_EQ(pcl::io::loadPCDFile(file.string(), cloud), 0);
  ASSERT_EQ(cloud.size(), points.size());
  for (std::size_t i = 0; i < points.size(); ++i) {
    EXPECT_EQ(Vec3f(cloud[i].getVector3fMap()), points[i]);
  }
  EXPECT_EQ(std::distance(std::filesystem::directory_iterator(folder.path()), {}), 1);
}

TEST(CloudIo, SaysThatItCouldNotWrite) {
  const test::TemporaryFolder folder;
  EXPECT_THROW(write_pcd(folder.path() / "missing" / "cloud.pcd", std::vector<Vec3f>{{1, 2, 3}}),
               DiskError);
}

}  // namespace
}  // namespace arex
