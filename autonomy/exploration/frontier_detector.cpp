#include "exploration/frontier_detector.h"

#include <algorithm>

#include "exploration/mean_shift.h"
#include "mapping/line_walk.h"

namespace arex {
namespace {

constexpr std::size_t kScanAll = 32;  ///< fewer vertices than this are compared one by one

}  // namespace

Growth grow_line(const ExplorationSpace& space, const Vec2& from, const Vec2& to) {
  Growth growth;
  walk_line(space.map(), from, to, [&](const Eigen::Vector2i& cell) {
    growth.cell = cell;
    if (space.is_free(cell)) return true;
    growth.end = space.is_unknown(cell) ? Growth::End::kFrontier : Growth::End::kBlocked;
    return false;
  });
  return growth;
}

void VertexSet::reset(const Vec2& low, const Vec2& high) {
  const Eigen::Vector2i size = ((high - low) / bucket_m_).array().floor().cast<int>().max(0) + 1;
  if (low == low_ && size == size_) {
    for (const Vec2& p : points_) {
      const Eigen::Vector2i b = bucket_of(p);
      buckets_[static_cast<std::size_t>(b.y() * size_.x() + b.x())].clear();
    }
  } else {
    low_ = low;
    size_ = size;
    buckets_.assign(static_cast<std::size_t>(size.x()) * static_cast<std::size_t>(size.y()), {});
  }
  points_.clear();
}

Eigen::Vector2i VertexSet::bucket_of(const Vec2& p) const {
  const Eigen::Vector2i b = ((p - low_) / bucket_m_).array().floor().cast<int>();
  return b.cwiseMax(Eigen::Vector2i::Zero()).cwiseMin(size_ - Eigen::Vector2i::Ones());
}

void VertexSet::add(const Vec2& p) {
  const Eigen::Vector2i b = bucket_of(p);
  buckets_[static_cast<std::size_t>(b.y() * size_.x() + b.x())].push_back(
      static_cast<std::uint32_t>(points_.size()));
  points_.push_back(p);
}

const Vec2& VertexSet::nearest(const Vec2& p) const {
  std::uint32_t best = 0;
  double best2 = (points_.front() - p).squaredNorm();
  const auto consider = [&](std::uint32_t i) {
    const double d2 = (points_[i] - p).squaredNorm();
    if (d2 > best2 || (d2 == best2 && i >= best)) return;
    best = i;
    best2 = d2;
  };
  if (points_.size() < kScanAll) {
    for (std::uint32_t i = 1; i < points_.size(); ++i) consider(i);
    return points_[best];
  }
  const Eigen::Vector2i centre = bucket_of(p);
  const int furthest = size_.maxCoeff();
  for (int ring = 0; ring <= furthest; ++ring) {
    // Everything in this ring and beyond is at least ring - 1 whole buckets away.
    const double near = std::max(0, ring - 1) * bucket_m_;
    if (near * near > best2) break;
    for (int y = std::max(0, centre.y() - ring); y <= std::min(size_.y() - 1, centre.y() + ring);
         ++y) {
      const bool whole_row = std::abs(y - centre.y()) == ring;
      const int stride = whole_row || ring == 0 ? 1 : 2 * ring;
      for (int x = centre.x() - ring; x <= centre.x() + ring; x += stride) {
        if (x < 0 || x >= size_.x()) continue;
        for (const std::uint32_t i : buckets_[static_cast<std::size_t>(y * size_.x() + x)]) {
          consider(i);
        }
      }
    }
  }
  return points_[best];
}

FrontierDetector::FrontierDetector(const FrontierDetectorConfig& config, std::uint64_t seed)
    : config_(config),
      local_random_(seed, "exploration.local_rrt"),
      global_random_(seed, "exploration.global_rrt"),
      local_(1.0),
      global_(1.0) {}

const std::vector<FrontierPoint>& FrontierDetector::update(const ExplorationSpace& space) {
  drop_known(space);
  if (!space.has_start()) return points_;
  area_ = space.bounds().extent();
  grow_local(space);
  grow_global(space);
  cluster(space);
  return points_;
}

bool FrontierDetector::grow_once(const ExplorationSpace& space, double step_m, RandomStream& random,
                                 VertexSet& tree) {
  const double x = random.uniform(area_.min().x(), area_.max().x());
  const double y = random.uniform(area_.min().y(), area_.max().y());
  const Vec2 sample(x, y);
  const Vec2 from = tree.nearest(sample);
  const double distance = (sample - from).norm();
  if (distance < space.map().resolution) return false;
  const Vec2 to = from + (sample - from) * std::min(1.0, step_m / distance);
  const Growth growth = grow_line(space, from, to);
  if (growth.end == Growth::End::kFrontier) {
    points_.push_back({space.map().centre_of(growth.cell), from});
    return true;
  }
  if (growth.end == Growth::End::kFree && space.is_reachable(growth.cell) &&
      space.is_inside(growth.cell) && (to - from).norm() >= config_.vertex_spacing_m &&
      (tree.nearest(to) - to).norm() >= config_.vertex_spacing_m) {
    tree.add(to);
  }
  return false;
}

void FrontierDetector::grow_local(const ExplorationSpace& space) {
  const auto restart = [&] {
    local_.reset(area_.min(), area_.max());
    local_.add(space.start());
  };
  restart();
  for (int i = 0; i < config_.local_iterations; ++i) {
    if (grow_once(space, config_.local_step_m, local_random_, local_)) restart();
  }
}

void FrontierDetector::grow_global(const ExplorationSpace& space) {
  // The map may have changed its mind about a vertex: only those that can be reached stay. The
  // vehicle's own place joins them, so that the tree can always grow.
  const std::vector<Vec2> before = global_.points();
  global_.reset(area_.min(), area_.max());
  for (const Vec2& p : before) {
    if (space.is_reachable(space.map().cell_of(p))) global_.add(p);
  }
  if (global_.points().empty() ||
      (global_.nearest(space.start()) - space.start()).norm() >= config_.vertex_spacing_m) {
    global_.add(space.start());
  }
  for (int i = 0; i < config_.global_iterations; ++i) {
    grow_once(space, config_.global_step_m, global_random_, global_);
  }
}

void FrontierDetector::drop_known(const ExplorationSpace& space) {
  std::erase_if(points_, [&](const FrontierPoint& p) {
    return !space.is_frontier(space.map().cell_of(p.point));
  });
}

void FrontierDetector::cluster(const ExplorationSpace& space) {
  const OccupancyMap2D& map = space.map();
  const auto index = [&](const FrontierPoint& p) { return map.index(map.cell_of(p.point)); };
  std::stable_sort(points_.begin(), points_.end(),
                   [&](const auto& a, const auto& b) { return index(a) < index(b); });
  points_.erase(std::unique(points_.begin(), points_.end(),
                            [&](const auto& a, const auto& b) { return index(a) == index(b); }),
                points_.end());
  std::vector<Vec2> places;
  for (const FrontierPoint& p : points_) places.push_back(p.point);
  const Clusters clusters = mean_shift(places, config_.cluster_bandwidth_m);
  std::vector<std::size_t> chosen(clusters.modes.size(), points_.size());
  for (std::size_t i = 0; i < places.size(); ++i) {
    const Vec2& mode = clusters.modes[clusters.label[i]];
    std::size_t& best = chosen[clusters.label[i]];
    if (best == points_.size() ||
        (places[i] - mode).squaredNorm() < (places[best] - mode).squaredNorm()) {
      best = i;
    }
  }
  std::sort(chosen.begin(), chosen.end());
  std::vector<FrontierPoint> kept;
  for (const std::size_t i : chosen) {
    if (i < points_.size()) kept.push_back(points_[i]);
  }
  points_ = std::move(kept);
}

}  // namespace arex
