#include "sensors/spinning_lidar.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <stdexcept>

#include "math/so3.h"

namespace arex::sim {
namespace {

/// The vehicle at a time between two ticks.
Pose between(const Truth& from, const Truth& to, Stamp stamp) {
  const double share =
      static_cast<double>(stamp - from.stamp) / static_cast<double>(to.stamp - from.stamp);
  const Vec3 turned = so3::Log(from.X_WB.R.transpose() * to.X_WB.R);
  return {from.X_WB.R * so3::Exp(share * turned), from.X_WB.p + share * (to.X_WB.p - from.X_WB.p)};
}

}  // namespace

struct SpinningLidar::Firing {
  std::int64_t number = 0;  ///< since the start
  Stamp stamp = 0;
  std::uint8_t ring = 0;
  Vec3 d_L;  ///< unit
};

SpinningLidar::SpinningLidar(const SpinningLidarConfig& config, const Scene& scene,
                             const Pose& X_BL,
                             const std::vector<worlds::CollisionShape>& airframe_B,
                             std::uint64_t seed)
    : config_(config),
      scene_(scene),
      X_BL_(X_BL),
      airframe_(airframe_B, X_BL),
      stream_(seed, "spinning_lidar") {
  for (int i = 0; i < config.rings; ++i) {
    const double share = config.rings > 1 ? static_cast<double>(i) / (config.rings - 1) : 0.5;
    const double elevation =
        to_radians(config.lowest_deg + share * (config.highest_deg - config.lowest_deg));
    fan_L_.emplace_back(std::cos(elevation), 0, std::sin(elevation));
  }
}

Stamp SpinningLidar::period() const { return from_seconds(1 / config_.rate_hz); }

SpinningLidar::Firing SpinningLidar::firing(std::int64_t number) const {
  const std::int64_t of_turn = std::int64_t{config_.columns} * config_.rings;
  const std::int64_t in_turn = number % of_turn;
  const std::int64_t column = in_turn / config_.rings, ring = in_turn % config_.rings;
  const double azimuth = -2 * std::numbers::pi * static_cast<double>(column) / config_.columns;
  return {number, number / of_turn * period() + in_turn * period() / of_turn,
          static_cast<std::uint8_t>(ring),
          so3::from_yaw(azimuth) * fan_L_[static_cast<std::size_t>(ring)]};
}

LidarScan SpinningLidar::scan(std::span<const Truth> ticks, Stamp frame_begin) const {
  if (ticks.size() < 2) throw std::invalid_argument("a LiDAR scan needs at least two ticks");
  LidarScan scan;
  scan.stamp = ticks.front().stamp;
  scan.end = ticks.back().stamp;
  const std::int64_t of_turn = std::int64_t{config_.columns} * config_.rings;
  const Stamp from = std::max(scan.stamp, frame_begin);
  std::int64_t number =
      from / period() * of_turn + (from % period() * of_turn + period() - 1) / period();
  std::vector<Firing> firings;
  std::vector<Ray> rays;
  std::size_t tick = 0;
  for (Firing next = firing(number); next.stamp < scan.end; next = firing(++number)) {
    while (ticks[tick + 1].stamp <= next.stamp) ++tick;
    const Pose X_WL = between(ticks[tick], ticks[tick + 1], next.stamp) * X_BL_;
    rays.push_back({X_WL.p.cast<float>(), (X_WL.R * next.d_L).cast<float>(), 0,
                    static_cast<float>(config_.range_max_m)});
    firings.push_back(next);
  }
  std::vector<RayHit> hits(rays.size());
  scene_.cast(rays, hits);
  for (std::size_t i = 0; i < hits.size(); ++i) {
    auto point = receive(firings[i], rays[i], hits[i]);
    if (!point) continue;
    point->offset_ns = static_cast<std::uint32_t>(firings[i].stamp - scan.stamp);
    scan.points.push_back(*point);
  }
  return scan;
}

LidarScan SpinningLidar::frame(Stamp begin, Stamp end, std::span<const LidarScan> parts) const {
  LidarScan frame;
  frame.stamp = begin;
  frame.end = end;
  for (const LidarScan& part : parts) {
    for (LidarPoint point : part.points) {
      point.offset_ns = static_cast<std::uint32_t>(part.stamp + point.offset_ns - begin);
      frame.points.push_back(point);
    }
  }
  return frame;
}

std::optional<LidarPoint> SpinningLidar::receive(const Firing& firing, const Ray& ray,
                                                 const RayHit& hit) const {
  const double range = static_cast<double>(hit.distance_m);
  if (!hit.valid() || range < config_.range_min_m) return {};
  const Vec3f d = firing.d_L.cast<float>();
  // The airframe is nearer than the least range: what it stops returns nothing.
  if (airframe_.near_body(d.x(), d.y(), d.z()) && airframe_.cast(firing.d_L).distance_m < range) {
    return {};
  }
  const double cosine = std::abs(static_cast<double>(hit.normal_W.dot(ray.direction_W)));
  const double light = static_cast<double>(hit.reflectivity) * cosine;
  LidarPoint point;
  point.line = firing.ring;
  point.intensity = static_cast<float>(std::min(255.0, std::round(255 * light)));
  double error = 0;
  if (!config_.noise_free) {
    // Light falls with the square of the range.
    if (light < 0.1 * std::pow(range / config_.range_at_tenth_m, 2)) return {};
    RandomStream stream = stream_.fork(static_cast<std::uint64_t>(firing.number));
    if (stream.uniform() < config_.dropout_probability) return {};
    error = config_.range_sigma_m * stream.normal();
  }
  point.p_L = ((range + error) * firing.d_L).cast<float>();
  return point;
}

}  // namespace arex::sim
