#include "semantics/stem_detector.h"

#include <algorithm>
#include <cmath>

#include "semantics/layer_raster.h"

namespace arex {
namespace {

constexpr double kStemLayer = LayerRaster::kLayer;
constexpr double kLowest = LayerRaster::kLowest;
constexpr double kLeastSeen = 0.15;  // of the girth

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
