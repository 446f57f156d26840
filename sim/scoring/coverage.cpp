#include "scoring/coverage.h"

#include <algorithm>
#include <cmath>
#include <cstdio>

namespace arex::sim {
namespace {

/// The middle of a storey's free space is nearer than this to its floor, and further from others'.
constexpr double kStorey_m = 3.5;

}  // namespace

using worlds::Bounds;
using worlds::World;

CoverageScorer::CoverageScorer(const CoverageConfig& config, const World& world, const Scene& scene,
                               const Pose& X_WO, const ScoredRegion& region,
                               double vehicle_radius_m)
    : config_(config), path_(config.path) {
  const ReachableSpace space =
      find_reachable_space(world, X_WO, region, vehicle_radius_m, config.space);
  reachable_volume_m3_ = space.volume_m3();
  collect_area(world, space, X_WO);
  collect_surface(world, scene, space, X_WO, region);
  index_samples();
}

void CoverageScorer::collect_area(const World& world, const ReachableSpace& space,
                                  const Pose& X_WO) {
  const worlds::GridGeometry& grid = space.grid;
  column_grid_ = grid;
  column_grid_.size.z() = 1;
  cell_of_column_.assign(column_grid_.cells(), -1);
  const std::size_t layer = column_grid_.cells();
  std::size_t column = 0;
  for (int j = 0; j < grid.size.y(); ++j) {
    for (int i = 0; i < grid.size.x(); ++i, ++column) {
      const Vec3 c = grid.centre({i, j, 0});
      const bool terrain = config_.band_above_terrain && world.terrain.columns > 0;
      const double base = terrain ? world.terrain.at(c.x(), c.y()) : X_WO.p.z();
      // Cells whose middles lie in the band.
      const auto layer_of = [&](double height) {
        return static_cast<int>(
            std::ceil((base + height - grid.origin.z()) / grid.resolution_m - 0.5));
      };
      const int last = std::min(grid.size.z(), layer_of(config_.band_high_m));
      double sum = 0;
      int count = 0;
      for (int k = std::max(0, layer_of(config_.band_low_m)); k < last; ++k) {
        if (!space.reachable[column + static_cast<std::size_t>(k) * layer]) continue;
        sum += grid.centre({i, j, k}).z();
        ++count;
      }
      if (count == 0) continue;
      cell_of_column_[column] = static_cast<std::int32_t>(area_cells_W_.size());
      area_cells_W_.push_back(Vec3(c.x(), c.y(), sum / count).cast<float>());
    }
  }
  known_.assign(area_cells_W_.size(), 0);
}

void CoverageScorer::collect_surface(const World& world, const Scene& scene,
                                     const ReachableSpace& space, const Pose& X_WO,
                                     const ScoredRegion& region) {
  const Vec3 end = space.grid.origin + space.grid.resolution_m * space.grid.size.cast<double>();
  const Bounds box{space.grid.origin,
                   {end.x(), end.y(), end.z() + config_.surface.sample_height_m}};
  std::vector<SurfaceSample> all = sample_surfaces(world, box, config_.surface);
  const Pose X_OW = X_WO.inverse();
  std::erase_if(all, [&](const SurfaceSample& sample) {
    // What is above the region may be seen from within and counts up to its own limit.
    const Vec3 p_O = X_OW * sample.p_W.cast<double>();
    return p_O.z() < region.low_m - config_.space.margin_m ||
           !region.bounds.is_near(p_O.head<2>(), config_.space.margin_m);
  });
  const Viewpoints viewpoints(space, config_.visibility.viewpoint_spacing_m);
  const std::vector<std::uint8_t> visible =
      find_visible(scene, viewpoints, all, config_.visibility);
  for (std::size_t i = 0; i < all.size(); ++i) {
    if (visible[i]) samples_.push_back(all[i]);
  }
  samples_.shrink_to_fit();
  mapped_.assign(samples_.size(), 0);
}

void CoverageScorer::index_samples() {
  Eigen::AlignedBox3d box(Vec3::Zero());
  if (!samples_.empty()) box.setEmpty();
  for (const SurfaceSample& sample : samples_) box.extend(sample.p_W.cast<double>());
  // A ball of the reach touches two buckets along each axis at most. A little wider than that, for
  // the rounding of samples to float.
  const Vec3 pad = Vec3::Constant(0.01);
  bucket_grid_ = worlds::make_grid({box.min() - pad, box.max() + pad}, 2 * config_.reach_m);
  std::vector<std::uint32_t> bucket(samples_.size());
  bucket_begin_.assign(bucket_grid_.cells() + 1, 0);
  for (std::size_t i = 0; i < samples_.size(); ++i) {
    const auto cell = bucket_grid_.cell_of(samples_[i].p_W.cast<double>());
    bucket[i] = static_cast<std::uint32_t>(bucket_grid_.index(cell));
    ++bucket_begin_[bucket[i] + 1];
  }
  for (std::size_t b = 1; b < bucket_begin_.size(); ++b) bucket_begin_[b] += bucket_begin_[b - 1];
  bucket_end_.assign(bucket_begin_.begin(), bucket_begin_.end() - 1);
  sample_ids_.resize(samples_.size());
  for (std::size_t i = 0; i < samples_.size(); ++i) {
    sample_ids_[bucket_end_[bucket[i]]++] = static_cast<std::uint32_t>(i);
  }
}

void CoverageScorer::add_position(const Vec3& p_WB) {
  const Eigen::Vector3i column = column_grid_.cell_of(p_WB).cwiseProduct(Eigen::Vector3i(1, 1, 0));
  bool mapped = false;
  if (column_grid_.contains(column)) {
    const std::int32_t cell = cell_of_column_[column_grid_.index(column)];
    mapped = cell >= 0 && known_[static_cast<std::size_t>(cell)] != 0;
  }
  path_.add(p_WB, mapped);
}

void CoverageScorer::place_area(const OccupancyMap2D& map, const Pose& X_WO) {
  const bool unchanged =
      place_in_map_.size() == area_cells_W_.size() && placed_map_.origin == map.origin &&
      placed_map_.resolution == map.resolution && placed_map_.width == map.width &&
      placed_map_.height == map.height && placed_X_WO_.R == X_WO.R && placed_X_WO_.p == X_WO.p;
  if (unchanged) return;
  placed_map_.origin = map.origin;
  placed_map_.resolution = map.resolution;
  placed_map_.width = map.width;
  placed_map_.height = map.height;
  placed_X_WO_ = X_WO;
  place_in_map_.resize(area_cells_W_.size());
  height_in_map_.resize(area_cells_W_.size());
  const Pose X_OW = X_WO.inverse();
  for (std::size_t i = 0; i < area_cells_W_.size(); ++i) {
    const Vec3 p_O = X_OW * area_cells_W_[i].cast<double>();
    const Eigen::Vector2i cell = map.cell_of(p_O.head<2>());
    place_in_map_[i] = map.contains(cell) ? static_cast<std::int32_t>(map.index(cell)) : -1;
    height_in_map_[i] = static_cast<float>(p_O.z());
  }
}

void CoverageScorer::count_area(const OccupancyMap2D& map, const Pose& X_WO) {
  place_area(map, X_WO);
  const bool storeys = !map.ground.rises.empty();  // it chooses between them
  known_count_ = 0;
  for (std::size_t i = 0; i < known_.size(); ++i) {
    const std::int32_t place = place_in_map_[i];
    bool known =
        place >= 0 && map.cells[static_cast<std::size_t>(place)] != OccupancyMap2D::kUnknown;
    if (known && storeys) {
      const auto index = static_cast<int>(place);
      const Vec2 p = map.centre_of({index % map.width, index / map.width});
      known = !(std::abs(height_in_map_[i] - map.ground.at(p)) > kStorey_m);
    }
    known_[i] = known;
    known_count_ += known;
  }
}

void CoverageScorer::mark_near(const Vec3f& p_W) {
  const Vec3 p = p_W.cast<double>();
  const Vec3 reach = Vec3::Constant(config_.reach_m);
  const Eigen::Vector3i low = bucket_grid_.cell_of(p - reach).cwiseMax(0);
  const Eigen::Vector3i high =
      bucket_grid_.cell_of(p + reach).cwiseMin(bucket_grid_.size - Eigen::Vector3i::Ones());
  const auto limit = static_cast<float>(config_.reach_m * config_.reach_m);
  for (int z = low.z(); z <= high.z(); ++z) {
    for (int y = low.y(); y <= high.y(); ++y) {
      for (int x = low.x(); x <= high.x(); ++x) {
        const std::size_t bucket = bucket_grid_.index({x, y, z});
        std::uint32_t& end = bucket_end_[bucket];
        for (std::uint32_t slot = bucket_begin_[bucket]; slot < end;) {
          const std::uint32_t id = sample_ids_[slot];
          if ((samples_[id].p_W - p_W).squaredNorm() > limit) {
            ++slot;
            continue;
          }
          mapped_[id] = 1;
          ++mapped_count_;
          std::swap(sample_ids_[slot], sample_ids_[--end]);
        }
      }
    }
  }
}

void CoverageScorer::update(Stamp stamp, double distance_m, const OccupancyMap2D& map,
                            double free_volume_m3, std::span<const Vec3f> new_points_O,
                            const Pose& X_WO) {
  count_area(map, X_WO);
  for (const Vec3f& p_O : new_points_O) mark_near((X_WO * p_O.cast<double>()).cast<float>());
  const auto share = [](std::size_t part, std::size_t whole) {
    return whole == 0 ? CoverageRow::kUnknown
                      : static_cast<double>(part) / static_cast<double>(whole);
  };
  latest_ = {stamp, distance_m, share(known_count_, known_.size()),
             share(mapped_count_, samples_.size()), free_volume_m3};
  rows_.push_back(latest_);
}

CoverageResult CoverageScorer::result() const {
  CoverageResult result;
  result.area_fraction = latest_.area_fraction;
  result.surface_fraction = latest_.surface_fraction;
  result.volume_m3 = latest_.volume_m3;
  const auto first_time = [&](double share) {
    const auto row =
        std::ranges::find_if(rows_, [&](const CoverageRow& r) { return r.area_fraction >= share; });
    return row == rows_.end() ? std::numeric_limits<double>::quiet_NaN() : to_seconds(row->stamp);
  };
  result.t50_s = first_time(0.50);
  result.t90_s = first_time(0.90);
  result.t95_s = first_time(0.95);
  result.revisit_ratio = path_.revisit_ratio();
  result.heading_change_radpm = path_.heading_change_radpm();
  const double cell = column_grid_.resolution_m;
  result.area_m2 = cell * cell * static_cast<double>(area_cells_W_.size());
  result.surface_samples = samples_.size();
  result.reachable_volume_m3 = reachable_volume_m3_;
  for (std::size_t i = 0; i < samples_.size(); ++i) {
    ClassCoverage& of_class = result.classes[static_cast<std::size_t>(samples_[i].surface_class)];
    ++of_class.visible;
    of_class.mapped += mapped_[i];
  }
  result.rows = rows_;
  return result;
}

void add_figures(const CoverageResult& coverage, Figures& figures) {
  figures.set("coverage.area_fraction", coverage.area_fraction);
  figures.set("coverage.surface_fraction", coverage.surface_fraction);
  figures.set("coverage.volume_m3", coverage.volume_m3);
  figures.set("coverage.t50_s", coverage.t50_s);
  figures.set("coverage.t90_s", coverage.t90_s);
  figures.set("coverage.t95_s", coverage.t95_s);
  figures.set("coverage.revisit_ratio", coverage.revisit_ratio);
  figures.set("coverage.heading_change_radpm", coverage.heading_change_radpm);
  figures.set("coverage.reachable_area_m2", coverage.area_m2);
  figures.set("coverage.surface_samples", coverage.surface_samples);
  const CoverageRow last = coverage.rows.empty() ? CoverageRow() : coverage.rows.back();
  const double area = coverage.area_fraction * coverage.area_m2;
  figures.set("coverage.area_m2_per_m", area / last.distance_m);
  figures.set("coverage.area_m2_per_s", area / to_seconds(last.stamp));
  figures.set("coverage.volume_m3_per_m", coverage.volume_m3 / last.distance_m);
  figures.set("coverage.volume_m3_per_s", coverage.volume_m3 / to_seconds(last.stamp));
  for (std::size_t i = 0; i < coverage.classes.size(); ++i) {
    const ClassCoverage& c = coverage.classes[i];
    const std::string name(worlds::kSurfaceClassNames[i]);
    figures.set("coverage.surface_fraction_by_class." + name,
                static_cast<double>(c.mapped) / static_cast<double>(c.visible));  // 0 / 0: none
  }
}

std::string write_coverage_csv(std::span<const CoverageRow> rows) {
  std::string text = csv_header("coverage.csv");
  for (const CoverageRow& row : rows) {
    text += csv_number(to_seconds(row.stamp), 3) + "," + csv_number(row.distance_m, 3) + "," +
            csv_number(row.area_fraction, 5) + "," + csv_number(row.surface_fraction, 5) + "," +
            csv_number(row.volume_m3, 3) + "\n";
  }
  return text;
}

}  // namespace arex::sim
