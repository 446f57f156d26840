#include "sensors/survey_lidar.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <utility>

namespace arex::sim {
namespace {

constexpr double kTile_m = 2;
// A ray may meet the near side of what is thin, or the ground a little before the point.
constexpr float kSameSurface_m = 0.05F;

Eigen::Vector2i tile_of(const Vec2& p, const Vec2& low) {
  return ((p - low) / kTile_m).array().floor().cast<int>();
}

}  // namespace

SurveyLidar::SurveyLidar(const SurveyConfig& config, const Scene& scene,
                         std::vector<Vec3f> points_W, const Pose& X_BS)
    : config_(config), scene_(scene), X_BS_(X_BS), points_W_(std::move(points_W)) {
  Eigen::AlignedBox2d extent;
  for (const Vec3f& p : points_W_) extent.extend(p.head<2>().cast<double>());
  if (!points_W_.empty()) {
    low_ = extent.min();
    tiles_ = tile_of(extent.max(), low_) + Eigen::Vector2i::Ones();
  }
  // Counting sort: the order within a tile stays.
  const auto index = [&](const Vec3f& p) {
    const Eigen::Vector2i tile = tile_of(p.head<2>().cast<double>(), low_);
    return static_cast<std::size_t>(tile.y()) * static_cast<std::size_t>(tiles_.x()) +
           static_cast<std::size_t>(tile.x());
  };
  first_of_tile_.assign(
      static_cast<std::size_t>(tiles_.x()) * static_cast<std::size_t>(tiles_.y()) + 1, 0);
  for (const Vec3f& p : points_W_) ++first_of_tile_[index(p) + 1];
  for (std::size_t i = 1; i < first_of_tile_.size(); ++i) {
    first_of_tile_[i] += first_of_tile_[i - 1];
  }
  std::vector<std::size_t> next = first_of_tile_;
  std::vector<Vec3f> sorted(points_W_.size());
  for (const Vec3f& p : points_W_) sorted[next[index(p)]++] = p;
  points_W_ = std::move(sorted);
}

Stamp SurveyLidar::period() const { return from_seconds(1 / config_.rate_hz); }

std::vector<Vec3f> SurveyLidar::points_near(const Vec3& p_W) const {
  std::vector<Vec3f> near;
  if (points_W_.empty()) return near;
  const Vec2 reach = Vec2::Constant(config_.range_m);
  const Vec2 p = p_W.head<2>();
  const Eigen::Vector2i from = tile_of(p - reach, low_).cwiseMax(0);
  const Eigen::Vector2i to = tile_of(p + reach, low_).cwiseMin(tiles_ - Eigen::Vector2i::Ones());
  const Vec3f centre = p_W.cast<float>();
  const auto range2 = static_cast<float>(config_.range_m * config_.range_m);
  for (int y = from.y(); y <= to.y(); ++y) {
    for (int x = from.x(); x <= to.x(); ++x) {
      const auto tile = static_cast<std::size_t>(y) * static_cast<std::size_t>(tiles_.x()) +
                        static_cast<std::size_t>(x);
      std::copy_if(points_W_.begin() + static_cast<std::ptrdiff_t>(first_of_tile_[tile]),
                   points_W_.begin() + static_cast<std::ptrdiff_t>(first_of_tile_[tile + 1]),
                   std::back_inserter(near),
                   [&](const Vec3f& q) { return (q - centre).squaredNorm() <= range2; });
    }
  }
  return near;
}

LidarScan SurveyLidar::scan(std::span<const Truth> ticks, Stamp frame_begin) const {
  if (ticks.size() < 2) throw std::invalid_argument("a LiDAR scan needs at least two ticks");
  LidarScan scan;
  scan.stamp = ticks.front().stamp;
  scan.end = ticks.back().stamp;
  // The last part of a frame has its moment.
  if (scan.end != frame_begin / period() * period() + period()) return scan;
  const Pose X_WL = ticks.back().X_WB * X_BS_;
  const Vec3f origin = X_WL.p.cast<float>();
  const std::vector<Vec3f> targets = points_near(X_WL.p);
  std::vector<Ray> rays;
  std::vector<float> distances;
  for (const Vec3f& target : targets) {
    const Vec3f way = target - origin;
    const float distance = way.norm();
    if (!(distance > kSameSurface_m)) continue;
    distances.push_back(distance);
    rays.push_back({origin, way / distance, 0, distance + kSameSurface_m});
  }
  std::vector<RayHit> hits(rays.size());
  scene_.cast(rays, hits);
  const Eigen::Matrix3f R_LW = X_WL.R.transpose().cast<float>();
  for (std::size_t i = 0; i < hits.size(); ++i) {
    if (!hits[i].valid() || hits[i].distance_m < distances[i] - kSameSurface_m) continue;
    LidarPoint point;
    point.p_L = hits[i].distance_m * (R_LW * rays[i].direction_W);
    point.intensity = std::min(150.0F, 150 * hits[i].reflectivity);
    point.offset_ns = static_cast<std::uint32_t>(scan.end - scan.stamp);
    scan.points.push_back(point);
  }
  return scan;
}

LidarScan SurveyLidar::frame(Stamp /*begin*/, Stamp end, std::span<const LidarScan> parts) const {
  // All of it was seen at once: a frame of a millisecond.
  LidarScan frame;
  frame.stamp = end - kNanosecondsPerTick;
  frame.end = end;
  for (const LidarScan& part : parts) {
    for (LidarPoint point : part.points) {
      point.offset_ns = static_cast<std::uint32_t>(end - frame.stamp);
      frame.points.push_back(point);
    }
  }
  return frame;
}

}  // namespace arex::sim
