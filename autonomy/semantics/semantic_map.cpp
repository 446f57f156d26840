#include "semantics/semantic_map.h"

#include <algorithm>
#include <limits>
#include <tuple>

#include "semantics/forest_reading.h"
#include "semantics/garage_reading.h"
#include "semantics/planarity.h"
#include "semantics/working_cloud.h"

namespace arex {
namespace {

void fill_rasters(const WorkingCloud& cloud, const SceneReading& reading, SemanticMap& map) {
  const Vec2 low = cloud.low.head<2>().cast<double>(), high = cloud.high.head<2>().cast<double>();
  map.canopy = Raster(low, high, WorkingCloud::kCell, std::numeric_limits<float>::quiet_NaN());
  map.density = Raster(low, high, WorkingCloud::kCell, 0);
  for (std::size_t i = 0; i < cloud.points.size(); ++i) {
    const Vec3f& p = cloud.points[i];
    const std::size_t cell =
        map.canopy.cell_of(static_cast<double>(p.x()), static_cast<double>(p.y()));
    map.density.values[cell] += 1;
    float& top = map.canopy.values[cell];
    if (!(top >= reading.heights[i])) top = reading.heights[i];
  }
}

}  // namespace

std::size_t SemanticMap::count(SemanticClass kind) const {
  return static_cast<std::size_t>(
      std::count_if(objects.begin(), objects.end(),
                    [&](const SemanticObject& object) { return object.kind == kind; }));
}

SemanticMap build_semantic_map(std::span<const Vec3f> points, std::span<const Vec3f> path,
                               const SemanticConfig& config) {
  SemanticMap map;
  map.labels.assign(points.size(), SemanticClass::kUnlabelled);
  const WorkingCloud cloud(points, config.voxel_m);
  map.points_used = cloud.points.size();
  map.planarity = planarity(cloud);
  map.scene = config.scene;
  if (map.scene == SceneKind::kAuto) {
    const bool built = map.planarity.fraction >= config.planar_fraction &&
                       map.planarity.roofed >= config.roofed_fraction;
    map.scene = built ? SceneKind::kGarage : SceneKind::kForest;
  }
  if (cloud.points.empty()) return map;
  constexpr double kSomeWalls = 0.002;  // planes of all upright surfaces; woods: below 0.001
  const bool walls = map.scene == SceneKind::kForest && map.planarity.fraction > kSomeWalls;
  SceneReading reading =
      map.scene == SceneKind::kGarage
          ? read_garage(cloud, path, config)
          : read_forest(cloud, walls ? points_on_walls(cloud) : std::vector<bool>(), config);
  for (std::size_t i = 0; i < points.size(); ++i) {
    if (cloud.of_input[i] != WorkingCloud::kNone) map.labels[i] = reading.labels[cloud.of_input[i]];
  }
  std::sort(reading.objects.begin(), reading.objects.end(),
            [](const SemanticObject& a, const SemanticObject& b) {
              return std::tuple(a.kind, a.position.x(), a.position.y(), a.position.z()) <
                     std::tuple(b.kind, b.position.x(), b.position.y(), b.position.z());
            });
  fill_rasters(cloud, reading, map);
  map.objects = std::move(reading.objects);
  map.ground = std::move(reading.ground);
  return map;
}

}  // namespace arex
