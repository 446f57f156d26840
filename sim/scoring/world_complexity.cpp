#include "scoring/world_complexity.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <numbers>
#include <vector>

namespace arex::sim {
namespace {

using worlds::SurfaceClass;
using worlds::World;

/// Ways of which some ended at something and the others were only not followed any further.
struct FreeWays {
  double length_m = 0;
  std::size_t ends = 0;

  [[nodiscard]] double mean_m() const {
    return ends > 0 ? length_m / static_cast<double>(ends) : WorldComplexity::kUnknown;
  }
};

std::vector<Vec3> horizontal_directions(int count) {
  std::vector<Vec3> directions;
  for (int i = 0; i < count; ++i) {
    const double angle = 2 * std::numbers::pi * i / count;
    directions.emplace_back(std::cos(angle), std::sin(angle), 0);
  }
  return directions;
}

/// The area from above.
class AreaMask {
 public:
  AreaMask(std::span<const Vec3f> area_cells_W, double cell_m) : cell_(cell_m) {
    Eigen::AlignedBox2d box;
    for (const Vec3f& cell : area_cells_W) box.extend(cell.head<2>().cast<double>());
    low_ = box.min().array() - 0.5 * cell_m;
    size_ = (box.sizes() / cell_m).array().round().cast<int>() + 1;
    inside_.assign(static_cast<std::size_t>(size_.prod()), 0);
    for (const Vec3f& cell : area_cells_W) {
      inside_[index(cell_of(cell.head<2>().cast<double>()))] = 1;
    }
  }
  [[nodiscard]] Eigen::Vector2i cell_of(const Vec2& p_W) const {
    return ((p_W - low_) / cell_).array().floor().cast<int>();
  }
  [[nodiscard]] bool at(const Vec2& p_W) const {
    const Eigen::Vector2i cell = cell_of(p_W);
    return (cell.array() >= 0).all() && (cell.array() < size_.array()).all() &&
           inside_[index(cell)] != 0;
  }

 private:
  [[nodiscard]] std::size_t index(const Eigen::Vector2i& cell) const {
    return static_cast<std::size_t>(cell.y()) * static_cast<std::size_t>(size_.x()) +
           static_cast<std::size_t>(cell.x());
  }
  double cell_;
  Vec2 low_;
  Eigen::Vector2i size_;
  std::vector<std::uint8_t> inside_;
};

/// Trunks that stand in the region, for each square metre of it.
double stem_density(const World& world, const Pose& X_WO, const ScoredRegion& region) {
  constexpr float kFoot = 1.0F;  // m: so much of a trunk says where it stands
  struct Trunk {
    float lowest = std::numeric_limits<float>::infinity();
    Eigen::AlignedBox3f foot;
  };
  std::vector<Trunk> trunks(world.objects.size());
  const auto each_corner = [&](const auto& visit) {
    for (std::size_t t = 0; t < world.mesh.triangles.size(); ++t) {
      if (world.class_of_triangle(t) != SurfaceClass::kTrunk) continue;
      for (const std::uint32_t v : world.mesh.triangles[t]) {
        visit(trunks[world.mesh.object_of_triangle[t]], world.mesh.vertices[v]);
      }
    }
  };
  each_corner([](Trunk& trunk, const Vec3f& p) { trunk.lowest = std::min(trunk.lowest, p.z()); });
  each_corner([](Trunk& trunk, const Vec3f& p) {
    if (p.z() <= trunk.lowest + kFoot) trunk.foot.extend(p);
  });
  const Pose X_OW = X_WO.inverse();
  std::size_t all = 0, inside = 0;
  for (const Trunk& trunk : trunks) {
    if (trunk.foot.isEmpty()) continue;
    ++all;
    const Vec3 p_O = X_OW * trunk.foot.center().cast<double>();
    inside += region.bounds.contains(p_O.head<2>());
  }
  if (all == 0) return WorldComplexity::kUnknown;
  return static_cast<double>(inside) / region.bounds.area_m2();
}

/// Follows lines of sight from one place. What does not end one is seen through.
void look_around(const World& world, const Scene& scene, const Vec3& from_W,
                 const std::vector<Vec3>& directions, double range_m, FreeWays& sight) {
  constexpr float kOn = 0.001F;  // m, behind what is seen through
  std::vector<Ray> rays;
  for (const Vec3& direction : directions) {
    rays.push_back({from_W.cast<float>(), direction.cast<float>(), 0, static_cast<float>(range_m)});
  }
  while (!rays.empty()) {
    std::vector<RayHit> hits(rays.size());
    scene.cast(rays, hits);
    std::vector<Ray> on;
    for (std::size_t i = 0; i < rays.size(); ++i) {
      if (!hits[i].valid()) {
        sight.length_m += range_m;
        continue;
      }
      const SurfaceClass met = world.objects[hits[i].object].surface_class;
      const bool terrain = met == SurfaceClass::kGround && world.terrain.columns > 0;
      if (met == SurfaceClass::kLeaf || terrain) {
        on.push_back(rays[i]);
        on.back().min_distance_m = hits[i].distance_m + kOn;
        continue;
      }
      sight.length_m += static_cast<double>(hits[i].distance_m);
      ++sight.ends;
    }
    rays.swap(on);
  }
}

}  // namespace

WorldComplexity measure_complexity(const WorldComplexityConfig& config, const World& world,
                                   const Scene& scene, const Pose& X_WO, const ScoredRegion& region,
                                   std::span<const Vec3f> area_cells_W, double cell_m,
                                   double vehicle_radius_m) {
  WorldComplexity complexity;
  complexity.stems_per_m2 = stem_density(world, X_WO, region);
  if (area_cells_W.empty()) return complexity;
  const AreaMask area(area_cells_W, cell_m);
  const Pose X_OW = X_WO.inverse();
  const std::vector<Vec3> directions = horizontal_directions(config.directions);
  constexpr double kMostPlaces = 10000;  // of a large area; enough for a mean
  const double spacing_m = std::max(
      config.spacing_m, cell_m * std::sqrt(static_cast<double>(area_cells_W.size()) / kMostPlaces));
  const int stride = std::max(1, static_cast<int>(std::lround(spacing_m / cell_m)));
  const int steps = static_cast<int>(std::lround(config.range_m / cell_m));
  FreeWays sight, flight;
  for (const Vec3f& cell : area_cells_W) {
    const Vec3 p = cell.cast<double>();
    const Eigen::Vector2i at = area.cell_of(p.head<2>());
    if (at.x() % stride != 0 || at.y() % stride != 0) continue;
    look_around(world, scene, p, directions, config.range_m, sight);
    for (const Vec3& direction : directions) {
      int step = 1;
      while (step <= steps && area.at((p + step * cell_m * direction).head<2>())) ++step;
      // To the border of the cell that is not free, on average.
      flight.length_m += (step - 0.5) * cell_m;
      const Vec3 end = p + step * cell_m * direction;
      flight.ends += step <= steps && world.bounds.contains(end) &&
                     region.bounds.contains((X_OW * end).head<2>());
    }
  }
  complexity.mean_free_path_m = sight.mean_m();
  complexity.traversability = flight.mean_m() / vehicle_radius_m;
  return complexity;
}

void add_figures(const WorldComplexity& complexity, Figures& figures) {
  figures.set("world.stems_per_m2", complexity.stems_per_m2);
  figures.set("world.mean_free_path_m", complexity.mean_free_path_m);
  figures.set("world.traversability", complexity.traversability);
}

}  // namespace arex::sim
