#include "semantics/stem_detector.h"

#include <algorithm>
#include <bit>
#include <cmath>

namespace arex {
namespace {

constexpr double kRasterCell = 0.1;  // m, of the raster
constexpr double kStemLayer = 0.1;   // m
constexpr double kLowest = 0.2;      // m above the ground, first layer
constexpr int kLayers = 64;
constexpr double kMostCells = 4e7;
constexpr double kLeastSeen = 0.15;  // of the girth

/// The raster of layers.
class LayerRaster {
 public:
  LayerRaster(const WorkingCloud& cloud, const std::vector<float>& heights) : low_(cloud.low) {
    const double area = static_cast<double>(cloud.high.x() - cloud.low.x()) *
                        static_cast<double>(cloud.high.y() - cloud.low.y());
    cell_ = static_cast<float>(std::max(kRasterCell, std::sqrt(area / kMostCells)));
    columns_ = 1 + static_cast<int>((cloud.high.x() - low_.x()) / cell_);
    rows_ = 1 + static_cast<int>((cloud.high.y() - low_.y()) / cell_);
    masks_.resize(static_cast<std::size_t>(columns_) * static_cast<std::size_t>(rows_), 0);
    for (std::size_t i = 0; i < cloud.points.size(); ++i) {
      const double layer = (static_cast<double>(heights[i]) - kLowest) / kStemLayer;
      if (!(layer >= 0 && layer < kLayers)) continue;
      const int c =
          std::min(columns_ - 1, static_cast<int>((cloud.points[i].x() - low_.x()) / cell_));
      const int r = std::min(rows_ - 1, static_cast<int>((cloud.points[i].y() - low_.y()) / cell_));
      masks_[at(c, r)] |= std::uint64_t{1} << static_cast<int>(layer);
    }
  }
  [[nodiscard]] int columns() const { return columns_; }
  [[nodiscard]] int rows() const { return rows_; }
  [[nodiscard]] bool empty(int c, int r) const { return masks_[at(c, r)] == 0; }
  [[nodiscard]] std::uint64_t around(int c, int r) const {
    std::uint64_t mask = 0;
    for (int j = std::max(0, r - 1); j <= std::min(rows_ - 1, r + 1); ++j) {
      for (int i = std::max(0, c - 1); i <= std::min(columns_ - 1, c + 1); ++i) {
        mask |= masks_[at(i, j)];
      }
    }
    return mask;
  }
  [[nodiscard]] Vec2 centre(int c, int r) const {
    return {static_cast<double>(low_.x()) + static_cast<double>(cell_) * (c + 0.5),
            static_cast<double>(low_.y()) + static_cast<double>(cell_) * (r + 0.5)};
  }
  [[nodiscard]] std::size_t cells() const { return masks_.size(); }
  /// Calls visit(cell) for the cells whose middles are within `radius` of a place.
  template <class Visit>
  void visit(const Vec2& place, double radius, Visit visit) const {
    const int reach = static_cast<int>(std::ceil(radius / static_cast<double>(cell_)));
    const int c0 =
        static_cast<int>((place.x() - static_cast<double>(low_.x())) / static_cast<double>(cell_));
    const int r0 =
        static_cast<int>((place.y() - static_cast<double>(low_.y())) / static_cast<double>(cell_));
    for (int r = std::max(0, r0 - reach); r <= std::min(rows_ - 1, r0 + reach); ++r) {
      for (int c = std::max(0, c0 - reach); c <= std::min(columns_ - 1, c0 + reach); ++c) {
        if ((centre(c, r) - place).norm() < radius) visit(at(c, r));
      }
    }
  }
  [[nodiscard]] std::size_t at(int c, int r) const {
    return static_cast<std::size_t>(r) * static_cast<std::size_t>(columns_) +
           static_cast<std::size_t>(c);
  }

 private:
  Vec3f low_;
  float cell_ = 0;
  int columns_ = 0, rows_ = 0;
  std::vector<std::uint64_t> masks_;
};

/// Filled layers of the longest run that begins low enough; 0 if it is too short.
int filled_run(std::uint64_t mask, const StemConfig& config) {
  const int gap = static_cast<int>(std::lround(config.max_gap_m / kStemLayer));
  const int top = static_cast<int>(std::ceil((config.band_high_m + 1 - kLowest) / kStemLayer));
  int best = 0;
  for (int begin = 0; begin < top;) {
    if ((mask >> begin & 1) == 0) {
      ++begin;
      continue;
    }
    int last = begin, filled = 1;
    for (int i = begin + 1; i < top && i - last <= gap + 1; ++i) {
      if ((mask >> i & 1) == 0) continue;
      last = i;
      ++filled;
    }
    const double start = kLowest + begin * kStemLayer;
    const double length = (last - begin + 1) * kStemLayer;
    if (start <= config.max_start_m && length >= config.min_run_m - 1e-9 &&
        filled * kStemLayer >= 0.6 * config.min_run_m) {
      best = std::max(best, filled);
    }
    begin = last + 1;
  }
  return best;
}

struct Candidate {
  int filled = 0;
  std::size_t cell = 0;
  Vec2 at = Vec2::Zero();
};

std::vector<Candidate> candidates_of(const LayerRaster& raster, const StemConfig& config) {
  std::vector<Candidate> candidates;
  for (int r = 0; r < raster.rows(); ++r) {
    for (int c = 0; c < raster.columns(); ++c) {
      if (raster.empty(c, r)) continue;
      const int filled = filled_run(raster.around(c, r), config);
      if (filled > 0) candidates.push_back({filled, raster.at(c, r), raster.centre(c, r)});
    }
  }
  std::sort(candidates.begin(), candidates.end(), [](const Candidate& a, const Candidate& b) {
    return a.filled != b.filled ? a.filled > b.filled : a.cell < b.cell;
  });
  return candidates;
}

/// Whether the evidence is that of a stem, and not of leaves or a shrub.
bool is_stem(const StemEvidence& e, const StemConfig& config) {
  const bool thick_enough = 2 * e.stem.radius >= config.min_diameter_m;
  const bool upright = e.stem.lean.norm() < 0.5;
  const bool tall = e.layers * StemEvidence::kLayer >= config.min_run_m - 1e-9;
  const bool seen = e.seen_fraction >= kLeastSeen && e.confidence() >= config.min_confidence;
  const bool sharp = e.median_residual <= config.residual_m;
  return thick_enough && upright && tall && seen && sharp;
}

}  // namespace

std::vector<StemEvidence> find_stems(const WorkingCloud& cloud, const ColumnIndex& index,
                                     const std::vector<float>& heights, const StemConfig& config) {
  constexpr double kOff = 0.1;     // m, from a stem to where the next candidate may be
  constexpr double kTried = 0.12;  // m, around a candidate that is none
  const LayerRaster raster(cloud, heights);
  std::vector<StemEvidence> stems;
  std::vector<std::uint8_t> closed(raster.cells(), 0);  // to further candidates
  std::vector<std::uint8_t> taken(cloud.points.size(), 0);
  const double reach = std::min(0.7, config.max_diameter_m / 2 + 0.3);
  for (const Candidate& candidate : candidates_of(raster, config)) {
    if (closed[candidate.cell] != 0) continue;
    // The column's own points tell where the surface is.
    std::vector<Vec3> points;
    Vec2 sum = Vec2::Zero();
    int near = 0;
    index.within(static_cast<float>(candidate.at.x()), static_cast<float>(candidate.at.y()),
                 static_cast<float>(reach), [&](std::uint32_t i) {
                   const auto h = static_cast<double>(heights[i]);
                   if (taken[i] != 0 || h < config.band_low_m || h > config.band_high_m) return;
                   const Vec3f& p = cloud.points[i];
                   points.emplace_back(static_cast<double>(p.x()), static_cast<double>(p.y()), h);
                   if ((points.back().head<2>() - candidate.at).norm() > 0.2) return;
                   sum += points.back().head<2>();
                   ++near;
                 });
    const Vec2 about = near > 0 ? Vec2(sum / near) : candidate.at;
    const auto evidence = fit_stem(points, about, config);
    if (!evidence || !is_stem(*evidence, config)) {
      raster.visit(candidate.at, kTried, [&](std::size_t cell) { closed[cell] = 1; });
      continue;
    }
    stems.push_back(*evidence);
    const Stem& stem = evidence->stem;
    raster.visit(stem.centre, stem.radius + kOff, [&](std::size_t cell) { closed[cell] = 1; });
    index.within(static_cast<float>(stem.centre.x()), static_cast<float>(stem.centre.y()),
                 static_cast<float>(stem.radius + 0.5), [&](std::uint32_t i) {
                   const Vec3 p(static_cast<double>(cloud.points[i].x()),
                                static_cast<double>(cloud.points[i].y()),
                                static_cast<double>(heights[i]));
                   if (stem.distance(p) < kOff) taken[i] = 1;
                 });
  }
  return stems;
}

}  // namespace arex
