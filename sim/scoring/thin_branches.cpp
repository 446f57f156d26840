#include "scoring/thin_branches.h"

#include <algorithm>
#include <cmath>

#include "physics/shape_index.h"
#include "planning/free_space.h"

namespace arex::sim {
namespace {

using worlds::CollisionShape;

constexpr double kSpacing = 0.05;  ///< m between points of a branch
constexpr double kJoined = 1e-6;   ///< m between the ends of a chain's capsules, rounding

bool is_branch(const worlds::World& world, const CollisionShape& shape) {
  return shape.kind == CollisionShape::Kind::kCapsule &&
         world.objects[shape.object].surface_class == worlds::SurfaceClass::kBranch;
}

/// End of a capsule's axis; `side` -1 or 1.
Vec3 end_of(const CollisionShape& capsule, double side) {
  return capsule.X_WS * Vec3(0, 0, side * capsule.size.y());
}

/// Chains [first, last) of capsules that begin where the one before ends.
template <class Visit>
void for_each_branch(const worlds::World& world, Visit visit) {
  const std::vector<CollisionShape>& shapes = world.collision_shapes;
  for (std::size_t first = 0, last = 0; first < shapes.size(); first = last) {
    last = first + 1;
    if (!is_branch(world, shapes[first])) continue;
    while (last < shapes.size() && is_branch(world, shapes[last]) &&
           shapes[last].object == shapes[first].object &&
           (end_of(shapes[last], -1) - end_of(shapes[last - 1], 1)).norm() < kJoined) {
      ++last;
    }
    visit(first, last);
  }
}

}  // namespace

ThinBranchMeter::ThinBranchMeter(const ThinBranchConfig& config, const worlds::World& world,
                                 const StoppingModel& stopping)
    : config_(config), stopping_(stopping) {
  const std::vector<CollisionShape>& shapes = world.collision_shapes;
  std::vector<char> is_thin(shapes.size(), 0);
  for_each_branch(world, [&](std::size_t first, std::size_t last) {
    const bool thin = std::all_of(shapes.begin() + static_cast<std::ptrdiff_t>(first),
                                  shapes.begin() + static_cast<std::ptrdiff_t>(last),
                                  [&](const CollisionShape& shape) {
                                    return 2 * shape.size.x() <= config.max_diameter_m + kJoined;
                                  });
    std::fill(is_thin.begin() + static_cast<std::ptrdiff_t>(first),
              is_thin.begin() + static_cast<std::ptrdiff_t>(last), thin);
  });
  std::vector<CollisionShape> thick;
  for (std::size_t i = 0; i < shapes.size(); ++i) {
    if (!is_thin[i]) thick.push_back(shapes[i]);
  }
  const ShapeIndex index(thick);
  std::vector<ShapeIndex::Neighbour> near;
  const auto is_apart = [&](const Vec3& p) {
    if (world.terrain.columns > 0 && p.z() - world.terrain.at(p.x(), p.y()) < config.apart_m) {
      return false;
    }
    index.find(p, config.apart_m, near);
    return near.empty();
  };
  int branch = 0;
  for_each_branch(world, [&](std::size_t first, std::size_t last) {
    if (!is_thin[first]) return;
    for (std::size_t i = first; i < last; ++i) {
      const CollisionShape& shape = shapes[i];
      const double length = 2 * shape.size.y();
      const int n = std::max(1, static_cast<int>(std::lround(length / kSpacing)));
      for (int k = 0; k < n; ++k) {
        const Vec3 p = shape.X_WS * Vec3(0, 0, length * ((k + 0.5) / n - 0.5));
        if (is_apart(p)) points_.push_back({p, shape.size.x(), branch, config.look_m});
      }
    }
    ++branch;
  });
}

void ThinBranchMeter::observe(const Truth& truth, const Pose& X_OB, const GridView& grid) {
  const Pose X_OW = X_OB * truth.X_WB.inverse();
  const double speed = truth.v_WB.norm();
  const double stopping = stopping_.radius_m + speed * stopping_.reaction_s +
                          speed * speed / (2 * stopping_.braking_mps2);
  for (Point& point : points_) {
    const Vec3 to_vehicle = truth.X_WB.p - point.p_W;
    if (to_vehicle.squaredNorm() > config_.look_m * config_.look_m) continue;
    const bool in_grid = clearance(grid, X_OW * point.p_W, config_.match_m) < config_.match_m;
    observe(point, to_vehicle.norm() - point.radius_m, stopping, in_grid);
  }
}

void ThinBranchMeter::observe(Point& point, double distance, double stopping, bool in_grid) const {
  point.seen |= in_grid;
  if (distance > point.closest_m) return;
  point.closest_m = distance;
  if (point.decided) return;
  point.seen_in_time = point.seen;
  point.in_grid = in_grid;
  point.decided = distance <= stopping;
}

ThinBranchScore ThinBranchMeter::score() const {
  ThinBranchScore score;
  for (auto point = points_.begin(); point != points_.end();) {
    const int branch = point->branch;
    auto nearest = point;
    for (; point != points_.end() && point->branch == branch; ++point) {
      if (point->closest_m < nearest->closest_m) nearest = point;
    }
    if (nearest->closest_m > config_.corridor_m) continue;
    ++score.branches;
    score.seen_in_time += nearest->seen_in_time;
    score.in_grid += nearest->in_grid;
  }
  return score;
}

void add_figures(const ThinBranchScore& score, Figures& figures) {
  figures.set("thin.branches", score.branches);
  figures.set("thin.seen_in_time", score.seen_in_time);
  // Of no branch there is no share: 0 / 0.
  figures.set("thin.seen_in_time_fraction",
              score.seen_in_time / static_cast<double>(score.branches));
  figures.set("thin.in_grid_fraction", score.in_grid / static_cast<double>(score.branches));
}

}  // namespace arex::sim
