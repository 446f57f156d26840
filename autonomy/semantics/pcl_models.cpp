// The only file of the room that sees PCL. It is compiled so that Eigen takes its heap blocks from
// malloc, as Debian's PCL does (see CMakeLists.txt and ArexOptions.cmake); besides, no cloud and no
// dynamic matrix is made on one side and freed on the other: PCL's objects live and die here.
#include "semantics/pcl_models.h"

#include <pcl/ModelCoefficients.h>
#include <pcl/console/print.h>
#include <pcl/point_cloud.h>
#include <pcl/point_types.h>
#include <pcl/sample_consensus/method_types.h>
#include <pcl/sample_consensus/model_types.h>
#include <pcl/search/kdtree.h>
#include <pcl/segmentation/extract_clusters.h>
#include <pcl/segmentation/sac_segmentation.h>

#include <algorithm>

namespace arex {
namespace {

using Cloud = pcl::PointCloud<pcl::PointXYZ>;

/// PCL prints what it does not find.
struct Quiet {
  Quiet() { pcl::console::setVerbosityLevel(pcl::console::L_ALWAYS); }
};
const Quiet kQuiet;

}  // namespace

bool has_pcl() { return true; }

std::optional<Vec3> ransac_circle(const std::vector<Vec2>& points, double tolerance,
                                  const Vec2& radii) {
  constexpr std::size_t kFewest = 6;
  constexpr int kRounds = 60;
  if (points.size() < kFewest) return std::nullopt;
  // About their middle: PCL's circles are in single precision.
  Vec2 middle = Vec2::Zero();
  for (const Vec2& p : points) middle += p / static_cast<double>(points.size());
  const Cloud::Ptr cloud(new Cloud);
  for (const Vec2& p : points) {
    const Vec2 q = p - middle;
    cloud->push_back({static_cast<float>(q.x()), static_cast<float>(q.y()), 0.0F});
  }
  pcl::SACSegmentation<pcl::PointXYZ> sac;
  sac.setModelType(pcl::SACMODEL_CIRCLE2D);
  sac.setMethodType(pcl::SAC_RANSAC);
  sac.setDistanceThreshold(tolerance);
  sac.setRadiusLimits(radii.x(), radii.y());
  sac.setMaxIterations(kRounds);
  sac.setOptimizeCoefficients(false);
  sac.setInputCloud(cloud);
  pcl::PointIndices inliers;
  pcl::ModelCoefficients circle;
  sac.segment(inliers, circle);
  if (inliers.indices.size() < kFewest || circle.values.size() != 3) return std::nullopt;
  return Vec3(static_cast<double>(circle.values[0]) + middle.x(),
              static_cast<double>(circle.values[1]) + middle.y(),
              static_cast<double>(circle.values[2]));
}

std::vector<std::vector<std::uint32_t>> euclidean_clusters(const std::vector<Vec3f>& points,
                                                           double tolerance, int fewest) {
  std::vector<std::vector<std::uint32_t>> groups;
  if (points.empty()) return groups;
  const Cloud::Ptr cloud(new Cloud);
  for (const Vec3f& p : points) cloud->push_back({p.x(), p.y(), p.z()});
  const pcl::search::KdTree<pcl::PointXYZ>::Ptr tree(new pcl::search::KdTree<pcl::PointXYZ>);
  tree->setInputCloud(cloud);
  pcl::EuclideanClusterExtraction<pcl::PointXYZ> extraction;
  extraction.setClusterTolerance(tolerance);
  extraction.setMinClusterSize(fewest);
  extraction.setSearchMethod(tree);
  extraction.setInputCloud(cloud);
  std::vector<pcl::PointIndices> clusters;
  extraction.extract(clusters);
  for (const pcl::PointIndices& cluster : clusters) {
    auto& group = groups.emplace_back(cluster.indices.begin(), cluster.indices.end());
    std::sort(group.begin(), group.end());
  }
  std::sort(groups.begin(), groups.end());
  return groups;
}

}  // namespace arex
