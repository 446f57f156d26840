#pragma once

#include <array>
#include <cstdint>
#include <limits>
#include <span>
#include <string>
#include <vector>

#include "mapping/occupancy_map_2d.h"
#include "math/pose.h"
#include "scoring/figures.h"
#include "scoring/path_meter.h"
#include "scoring/reachable_space.h"
#include "scoring/surface_samples.h"
#include "scoring/visibility.h"
#include "sensors/scene.h"
#include "worlds/world.h"

namespace arex::sim {

struct CoverageConfig {
  double band_low_m = 0.0;
  double band_high_m = 2.0;
  bool band_above_terrain = true;
  double reach_m = 0.15;
  ReachableSpaceConfig space;
  SurfaceSampleConfig surface;
  VisibilityConfig visibility;
  PathMeterConfig path;

  void fields(auto& f) {
    f("band_low_m", band_low_m, "lower edge of the 2D map's height band (paper: forest 0)");
    f("band_high_m", band_high_m, "upper edge of the 2D map's height band (paper: forest 2)");
    f("band_above_terrain", band_above_terrain,
      "the band follows the true ground; otherwise it is z in O (paper: garage -10 to -5)");
    f("reach_m", reach_m, "a surface sample is mapped when a map point is this near");
    f("space", space, "true free space that the vehicle can reach");
    f("surface", surface, "true surface samples");
    f("visibility", visibility, "which of them can be seen from that space");
    f("path", path, "revisits and turns of the flown path");
    f.check(band_low_m < band_high_m, "band_low_m < band_high_m");
    f.check(reach_m > 0, "reach_m > 0");
  }
};

/// Coverage at one time; a row of coverage.csv. Not a number: not scored yet, or there is nothing
/// to be a share of.
struct CoverageRow {
  static constexpr double kUnknown = std::numeric_limits<double>::quiet_NaN();
  Stamp stamp = 0;
  double distance_m = 0;               ///< flown so far
  double area_fraction = kUnknown;     ///< of the reachable free area in the band, in the 2D map
  double surface_fraction = kUnknown;  ///< of the visible surface samples, near a map point
  double volume_m3 = kUnknown;         ///< free volume of the 3D map
};

struct ClassCoverage {
  std::size_t visible = 0;  ///< samples
  std::size_t mapped = 0;   ///< of those, near a map point
};

/// Not a number: never reached, or there was nothing to measure.
struct CoverageResult {
  static constexpr double kUnknown = std::numeric_limits<double>::quiet_NaN();
  double area_fraction = kUnknown;
  double surface_fraction = kUnknown;
  double volume_m3 = kUnknown;
  // When the area fraction first reached the share.
  double t50_s = kUnknown;
  double t90_s = kUnknown;
  double t95_s = kUnknown;
  double revisit_ratio = kUnknown;
  double heading_change_radpm = kUnknown;

  // The denominators.
  double area_m2 = 0;
  std::size_t surface_samples = 0;
  double reachable_volume_m3 = 0;
  std::array<ClassCoverage, worlds::kSurfaceClassNames.size()> classes;  ///< by SurfaceClass
  std::vector<CoverageRow> rows;
};

/// How much of what the vehicle could have explored it did explore. The truth (what can be reached
/// and seen) is worked out once; an update costs as much as its new points.
class CoverageScorer {
 public:
  /// @param scene of `world`; neither is read after construction
  /// @param X_WO O in W at the start, where the vehicle stands; level
  /// @param region what it is told to explore
  /// @throws std::invalid_argument if the vehicle does not fit at its start
  CoverageScorer(const CoverageConfig& config, const worlds::World& world, const Scene& scene,
                 const Pose& X_WO, const ScoredRegion& region, double vehicle_radius_m);

  /// The vehicle's true position, as often as its path bends (10 Hz will do).
  void add_position(const Vec3& p_WB);

  /// The map as it stands, and the points added to its cloud since the last update.
  /// @param free_volume_m3 of the 3D map's free cells; @param X_WO where O is taken to lie
  void update(Stamp stamp, double distance_m, const OccupancyMap2D& map, double free_volume_m3,
              std::span<const Vec3f> new_points_O, const Pose& X_WO);

  [[nodiscard]] const CoverageRow& latest() const { return latest_; }
  [[nodiscard]] CoverageResult result() const;

  /// The denominators themselves, for pictures and tests: middles of the cells of the area, in W
  /// (z: the middle of the reachable cells in the band), and the visible samples.
  [[nodiscard]] const std::vector<Vec3f>& area_cells_W() const { return area_cells_W_; }
  [[nodiscard]] const std::vector<SurfaceSample>& samples() const { return samples_; }
  [[nodiscard]] bool is_mapped(std::size_t sample) const { return mapped_[sample] != 0; }

 private:
  void collect_area(const worlds::World& world, const ReachableSpace& space, const Pose& X_WO);
  void collect_surface(const worlds::World& world, const Scene& scene, const ReachableSpace& space,
                       const Pose& X_WO, const ScoredRegion& region);
  void index_samples();
  /// A cell is known if the map shows it, and not another storey's floor above or below it.
  void count_area(const OccupancyMap2D& map, const Pose& X_WO);
  void place_area(const OccupancyMap2D& map, const Pose& X_WO);
  void mark_near(const Vec3f& p_W);

  CoverageConfig config_;
  double reachable_volume_m3_ = 0;

  worlds::GridGeometry column_grid_;          ///< one layer
  std::vector<std::int32_t> cell_of_column_;  ///< index into area_cells_W_; -1 if not counted
  std::vector<Vec3f> area_cells_W_;
  std::vector<std::uint8_t> known_;
  std::size_t known_count_ = 0;
  // Where the area's cells lie in the map, as long as the map's frame stays: index or -1; and how
  // high, m in O.
  std::vector<std::int32_t> place_in_map_;
  std::vector<float> height_in_map_;
  OccupancyMap2D placed_map_;  ///< its geometry only
  Pose placed_X_WO_;

  std::vector<SurfaceSample> samples_;  ///< visible ones
  std::vector<std::uint8_t> mapped_;
  std::size_t mapped_count_ = 0;
  /// Buckets of the samples not mapped yet: bucket b holds sample_ids_[bucket_begin_[b] ..
  /// bucket_end_[b]).
  worlds::GridGeometry bucket_grid_;
  std::vector<std::uint32_t> bucket_begin_, bucket_end_, sample_ids_;

  PathMeter path_;
  CoverageRow latest_;
  std::vector<CoverageRow> rows_;
};

/// Sets the figures `coverage.*`.
void add_figures(const CoverageResult& coverage, Figures& figures);

/// coverage.csv, header included.
std::string write_coverage_csv(std::span<const CoverageRow> rows);

}  // namespace arex::sim
