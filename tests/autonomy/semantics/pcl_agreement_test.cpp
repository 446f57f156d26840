// What PCL writes, we read; what we write, PCL reads.
#include <gtest/gtest.h>
#include <pcl/io/pcd_io.h>
#include <pcl/io/ply_io.h>

#include "semantics/cloud_file.h"
#include "support/temporary_folder.h"

namespace arex::test {
namespace {

pcl::PointCloud<pcl::PointXYZI> some_cloud() {
  pcl::PointCloud<pcl::PointXYZI> cloud;
  for (int i = 0; i < 5000; ++i) {
    pcl::PointXYZI p;
    p.x = 0.25F * static_cast<float>(i % 37);
    p.y = -0.5F * static_cast<float>(i % 11);
    p.z = 0.125F * static_cast<float>(i);
    p.intensity = static_cast<float>(i % 256);
    cloud.push_back(p);
  }
  return cloud;
}

void expect_same(const CloudFile& read, const pcl::PointCloud<pcl::PointXYZI>& cloud) {
  ASSERT_EQ(read.points.size(), cloud.size());
  ASSERT_EQ(read.intensity.size(), cloud.size());
  for (std::size_t i = 0; i < cloud.size(); ++i) {
    ASSERT_EQ(read.points[i], Vec3f(cloud[i].x, cloud[i].y, cloud[i].z)) << i;
    ASSERT_EQ(read.intensity[i], cloud[i].intensity) << i;
  }
}

TEST(PclAgreement, WeReadWhatPclWrites) {
  const auto cloud = some_cloud();
  const TemporaryFolder folder;
  const std::string file = (folder / "cloud.pcd").string();
  pcl::PCDWriter writer;
  ASSERT_EQ(writer.writeASCII(file, cloud), 0);
  expect_same(read_cloud_file(file), cloud);
  ASSERT_EQ(writer.writeBinary(file, cloud), 0);
  expect_same(read_cloud_file(file), cloud);
  ASSERT_EQ(writer.writeBinaryCompressed(file, cloud), 0);
  expect_same(read_cloud_file(file), cloud);
  pcl::PLYWriter ply;
  for (const bool binary : {false, true}) {
    ASSERT_EQ(ply.write((folder / "cloud.ply").string(), cloud, binary, false), 0);
    expect_same(read_cloud_file(folder / "cloud.ply"), cloud);
  }
}

TEST(PclAgreement, PclReadsWhatWeWrite) {
  CloudFile cloud;
  SemanticMap map;
  for (int i = 0; i < 200; ++i) {
    cloud.points.emplace_back(static_cast<float>(i), 0.5F, -1.0F);
    cloud.intensity.push_back(static_cast<float>(2 * i));
    map.labels.push_back(static_cast<SemanticClass>(i % 13));
  }
  const TemporaryFolder folder;
  write_text(folder / "semantic.pcd", semantic_pcd(cloud, map));
  pcl::PointCloud<pcl::PointXYZL> labels;
  ASSERT_EQ(pcl::io::loadPCDFile((folder / "semantic.pcd").string(), labels), 0);
  pcl::PointCloud<pcl::PointXYZI> bright;
  ASSERT_EQ(pcl::io::loadPCDFile((folder / "semantic.pcd").string(), bright), 0);
  ASSERT_EQ(labels.size(), cloud.points.size());
  for (std::size_t i = 0; i < labels.size(); ++i) {
    EXPECT_EQ(labels[i].x, cloud.points[i].x());
    EXPECT_EQ(labels[i].label, static_cast<std::uint32_t>(map.labels[i]));
    EXPECT_EQ(bright[i].intensity, cloud.intensity[i]);
  }
}

}  // namespace
}  // namespace arex::test
