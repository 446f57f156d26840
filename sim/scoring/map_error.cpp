#include "scoring/map_error.h"

#include <algorithm>
#include <cmath>

#include "math/random.h"

namespace arex::sim {
namespace {

// One index from each of `count` equal parts of [0, size): even over the cloud, whatever its order,
// and without the beat of a fixed stride.
std::vector<std::size_t> choose(std::size_t size, std::size_t count) {
  std::vector<std::size_t> chosen(std::min(size, count));
  RandomStream random(0, "map_error");
  for (std::size_t i = 0; i < chosen.size(); ++i) {
    const std::size_t low = i * size / chosen.size();
    const std::size_t high = (i + 1) * size / chosen.size();
    chosen[i] = low + static_cast<std::size_t>(random.uniform() * static_cast<double>(high - low));
  }
  return chosen;
}

double quantile(std::vector<double>& values, double fraction) {
  const auto rank = static_cast<std::ptrdiff_t>(fraction * static_cast<double>(values.size() - 1));
  std::nth_element(values.begin(), values.begin() + rank, values.end());
  return values[static_cast<std::size_t>(rank)];
}

}  // namespace

MapScore score_map(const std::vector<Vec3f>& cloud_O, const Pose& X_WO, const Scene& scene,
                   const MapErrorConfig& config) {
  MapScore score;
  score.points = cloud_O.size();
  std::vector<double> distances;
  std::size_t outliers = 0;
  for (const std::size_t i : choose(cloud_O.size(), static_cast<std::size_t>(config.max_points))) {
    const Vec3 p_W = X_WO * cloud_O[i].cast<double>();
    const double distance =
        scene.distance_to_surface(p_W, config.max_distance_m, worlds::ClassSet::all());
    if (distance <= config.foliage_m) {
      // A hair further, so that the solid surface that is itself the nearest is found.
      const double limit = distance + 1e-6;
      if (scene.distance_to_surface(p_W, limit, kWithoutFoliage) >= limit) {
        ++score.foliage;
        continue;
      }
    }
    distances.push_back(distance);
    outliers += distance > config.outlier_m;
  }
  score.scored = distances.size();
  if (distances.empty()) return score;
  score.median_m = quantile(distances, 0.5);
  score.p95_m = quantile(distances, 0.95);
  score.outlier_fraction = static_cast<double>(outliers) / static_cast<double>(distances.size());
  return score;
}

void add_figures(const MapScore& score, Figures& figures) {
  figures.set("map.points", score.points);
  figures.set("map.median_m", score.median_m);
  figures.set("map.p95_m", score.p95_m);
  figures.set("map.outlier_fraction", score.outlier_fraction);
  figures.set("map.scored", score.scored);
  figures.set("map.foliage", score.foliage);
}

}  // namespace arex::sim
