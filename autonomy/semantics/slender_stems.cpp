#include "semantics/slender_stems.h"

#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <iterator>
#include <limits>
#include <numbers>
#include <optional>

#include "semantics/cone_sums.h"
#include "semantics/layer_raster.h"

namespace arex {
namespace {

constexpr double kCore = 0.09;        // m from the line, where a stem's points are
constexpr double kRingLow = 0.13;     // m from the line, where nothing is beside a bare stem
constexpr double kRingHigh = 0.30;    // likewise
constexpr double kRangeNoise = 0.02;  // m, of a point
constexpr double kMiddle = 1.0;       // m above the ground, where lines are anchored
constexpr double kLineTop = 2.0;      // m, of the part that is fitted
constexpr double kSameStem = 0.25;    // m, between lines
constexpr double kSamePost = 0.15;    // m, between a post and a stem that is none

/// The layers of a slender stem that count, from LayerRaster::kLowest on.
constexpr int kLineLayers = 16;   // up to 1.8 m
constexpr int kFootLayers = 5;    // of those, where a candidate must show
constexpr int kFewestAtFoot = 3;  // of them

double geman_mcclure(double distance, double scale) {
  const double ratio = distance / scale;
  return 1 / ((1 + ratio * ratio) * (1 + ratio * ratio));
}

/// A leaning line, anchored kMiddle above the ground.
struct Line {
  Vec2 at = Vec2::Zero();
  Vec2 lean = Vec2::Zero();
  [[nodiscard]] Vec2 centre_at(double h) const { return at + (h - kMiddle) * lean; }
  [[nodiscard]] double distance(const Vec3& p) const {
    return (p.head<2>() - centre_at(p.z())).norm();
  }
};

std::vector<Vec3> points_near(const WorkingCloud& cloud, const ColumnIndex& index,
                              const std::vector<float>& heights, const Vec2& about, double radius,
                              double low, double high) {
  std::vector<Vec3> points;
  index.within(static_cast<float>(about.x()), static_cast<float>(about.y()),
               static_cast<float>(radius), [&](std::uint32_t i) {
                 const auto h = static_cast<double>(heights[i]);
                 if (h < low || h > high) return;
                 const Vec2 p = flat(cloud.points[i]);
                 points.emplace_back(p.x(), p.y(), h);
               });
  return points;
}

/// The place near `about` with most points of the foot around it.
std::optional<Vec2> foot_of(const std::vector<Vec3>& points, Vec2 about) {
  constexpr double kReach = 0.15, kTop = 0.8;  // m
  constexpr int kShifts = 4;
  for (int shift = 0; shift < kShifts; ++shift) {
    Vec2 sum = Vec2::Zero();
    int count = 0;
    for (const Vec3& p : points) {
      if (p.z() > kTop || (p.head<2>() - about).norm() > kReach) continue;
      sum += p.head<2>();
      ++count;
    }
    if (count < kFewestAtFoot) return std::nullopt;
    about = sum / count;
  }
  return about;
}

/// The line with most company. Every layer counts as much, however many leaves it has.
Line fit_line(const std::vector<Vec3>& points, const Vec2& foot) {
  constexpr std::array kScales{0.12, 0.10, 0.08, 0.06, 0.05, 0.05, 0.05};  // m
  constexpr double kLean = 0.06;   // deviation of the prior, per metre
  constexpr double kSigma = 0.04;  // m, of a layer's points
  constexpr double kFaint = 0.2;   // weight of a layer that counts in full
  Line line{foot, Vec2::Zero()};
  std::vector<double> weights(points.size());
  for (const double scale : kScales) {
    std::array<double, 32> of_layer{};
    const auto layer_of = [](const Vec3& p) {
      return std::min<std::size_t>(31, static_cast<std::size_t>(p.z() / LayerRaster::kLayer));
    };
    for (std::size_t i = 0; i < points.size(); ++i) {
      if (points[i].z() > kLineTop) continue;
      weights[i] = geman_mcclure(line.distance(points[i]), scale);
      of_layer[layer_of(points[i])] += weights[i];
    }
    Eigen::Matrix2d A = Eigen::Matrix2d::Zero();
    Eigen::Matrix2d b = Eigen::Matrix2d::Zero();  // one column for x, one for y
    for (std::size_t i = 0; i < points.size(); ++i) {
      const Vec3& p = points[i];
      if (p.z() > kLineTop) continue;
      const double weight = weights[i] / std::max(kFaint, of_layer[layer_of(p)]);
      const Vec2 row(1, p.z() - kMiddle);
      A += weight * row * row.transpose();
      b += weight * row * p.head<2>().transpose();
    }
    A(0, 0) += 1e-6;
    b.row(0) += 1e-6 * line.at.transpose();
    A(1, 1) += (kSigma / kLean) * (kSigma / kLean);
    const Eigen::Matrix2d solution = A.ldlt().solve(b);
    if (!solution.allFinite()) break;
    line.at = solution.row(0).transpose();
    line.lean = solution.row(1).transpose();
  }
  return line;
}

/// What stands along a line.
struct Company {
  int filled = 0;     ///< layers with points in the core
  double chance = 0;  ///< layers that leaves as dense as those in the ring would have filled
  int bare = 0;       ///< filled layers with fewer points in the ring
  int top = 0;        ///< layers up to the highest of a run without gaps of more than two
};

Company company_of(const std::vector<Vec3>& points, const Line& line) {
  constexpr double kAreas = kCore * kCore / (kRingHigh * kRingHigh - kRingLow * kRingLow);
  std::array<int, kLineLayers> core{}, ring{};
  for (const Vec3& p : points) {
    const int layer =
        static_cast<int>(std::floor((p.z() - LayerRaster::kLowest) / LayerRaster::kLayer));
    if (layer < 0 || layer >= kLineLayers) continue;
    const double d = line.distance(p);
    core[static_cast<std::size_t>(layer)] += d <= kCore;
    ring[static_cast<std::size_t>(layer)] += d > kRingLow && d <= kRingHigh;
  }
  Company company;
  for (int i = 0, gap = 0; i < kLineLayers && gap <= 2; ++i) {
    const auto at = static_cast<std::size_t>(i);
    gap = core[at] > 0 ? 0 : gap + 1;
    if (core[at] == 0) continue;
    ++company.filled;
    company.chance += 1 - std::exp(-kAreas * ring[at]);
    company.bare += ring[at] < core[at];
    company.top = i + 1;
  }
  return company;
}

/// Whether a line's company is a stem's. Asked before a cone is fitted: few lines in leaves pass.
bool is_stem_line(const Line& line, const Company& company) {
  constexpr int kLeastTop = 13;         // layers: above breast height
  constexpr double kLeastFilled = 0.6;  // of the layers up to there
  constexpr double kLeastBeyond = 7;    // layers, beyond what chance fills
  constexpr int kLeastBare = 4;         // layers
  constexpr double kMostLean = 0.2;     // per metre
  return company.top >= kLeastTop && company.filled >= kLeastFilled * company.top &&
         company.filled - company.chance >= kLeastBeyond && company.bare >= kLeastBare &&
         line.lean.norm() < kMostLean;
}

bool is_slender(const StemEvidence& e, const StemConfig& config) {
  constexpr double kThickest = 0.08;  // m, radius
  constexpr double kError = 0.01;     // m, of a thin stem's diameter
  return e.stem.radius < kThickest && 2 * e.stem.radius >= config.min_diameter_m - kError;
}

/// Radius of the circle whose points are this far from its middle in the mean, when each is off by
/// the ranges' noise.
double without_noise(double radius) {
  constexpr double kNoise = 0.015;    // m, of a voxel's mean
  constexpr double kThinnest = 0.01;  // m
  return std::sqrt(std::max(radius * radius - kNoise * kNoise, kThinnest * kThinnest));
}

/// What is believed of a thin shaft before its points are looked at: a few of them on one side
/// would fit a circle of any size.
struct ShaftPrior {
  double radius = 0.035, radius_sigma = 0.015;  // m
  double taper = 0.01, taper_sigma = 0.01;      // per metre
  double lean_sigma = 0.06;                     // per metre
};

/// The cone through points, by iteratively reweighted least squares.
std::optional<Stem> fit_shaft(const std::vector<Vec3>& points, Stem shaft,
                              const ShaftPrior& prior) {
  constexpr std::array kScales{0.04, 0.04, 0.04, 0.035, 0.03, 0.03, 0.025, 0.025, 0.025, 0.025};
  constexpr double kLargest = 0.3;  // m, radius
  constexpr double kPlace = 0.05;   // m, deviation of the start
  constexpr double kAll = std::numeric_limits<float>::max();
  const ConePoints columns(points, shaft.centre);
  const Vec2 start = shaft.centre, lean = shaft.lean;
  Vec6 weights;
  weights << kPlace, kPlace, prior.lean_sigma, prior.lean_sigma, prior.radius_sigma,
      prior.taper_sigma;
  weights = weights.cwiseAbs2().cwiseInverse().eval();
  shaft.radius = prior.radius;
  shaft.taper = prior.taper;
  for (const double scale : kScales) {
    Vec6 off;
    off << start - shaft.centre, lean - shaft.lean, prior.radius - shaft.radius,
        prior.taper - shaft.taper;
    Mat6 A = weights.asDiagonal();
    Vec6 b = weights.cwiseProduct(off);
    const ConeSums sums = columns.sums(shaft, scale, kRangeNoise, kAll);
    A += sums.A;
    b += sums.b;
    const Vec6 step = A.ldlt().solve(b);
    if (!step.allFinite()) return std::nullopt;
    shaft.centre += step.head<2>();
    shaft.lean += step.segment<2>(2);
    shaft.radius = std::clamp(shaft.radius + step[4], 0.01, kLargest);
    shaft.taper += step[5];
  }
  return shaft;
}

// m above the ground: where posts are looked at, what they end below, and how far above that a tree
// would show.
constexpr double kShaftLow = 0.3, kShaftHigh = 2.9, kPostTop = 3.1, kAbove = 0.7;
constexpr ShaftPrior kPostPrior{
    .radius = 0.05, .radius_sigma = 0.015, .taper = 0, .taper_sigma = 0.02};

/// Where a plumb line near `about` has most company in all layers.
Vec2 plumb_line(const std::vector<Vec3>& points, Vec2 about) {
  constexpr std::array kScales{0.12, 0.10, 0.08, 0.06, 0.06, 0.06};  // m
  constexpr double kFaint = 0.2;  // weight of a layer that counts in full
  constexpr std::size_t kLayers = 32;
  for (const double scale : kScales) {
    std::array<double, kLayers> weight{};
    std::array<Vec2, kLayers> sum;
    sum.fill(Vec2::Zero());
    for (const Vec3& p : points) {
      const auto layer =
          std::min(kLayers - 1, static_cast<std::size_t>(p.z() / LayerRaster::kLayer));
      const double w = geman_mcclure((p.head<2>() - about).norm(), scale);
      weight[layer] += w;
      sum[layer] += w * p.head<2>();
    }
    Vec2 all = 1e-6 * about;
    double of_all = 1e-6;
    for (std::size_t i = 0; i < kLayers; ++i) {
      const double counts = 1 / std::max(kFaint, weight[i]);
      all += counts * sum[i];
      of_all += counts * weight[i];
    }
    about = all / of_all;
  }
  return about;
}

/// How a shaft looks where a tree has grown thin and hides in its leaves, and where it goes on.
struct UpperPart {
  double filled = 0;  ///< share of the layers with points on the surface
  double own = 0;     ///< share of the points near the axis that are not outside
  double above = 0;   ///< points above, for each on the surface
};
UpperPart upper_part(const std::vector<Vec3>& points, const Stem& shaft) {
  constexpr double kUpper = 1.8;        // m above the ground
  constexpr double kOnSurface = 0.035;  // m
  constexpr double kNear = 0.1;         // m from the surface
  std::uint64_t layers = 0;
  int on = 0, outside = 0, above = 0;
  for (const Vec3& p : points) {
    const double d = shaft.distance(p);
    if (p.z() < kUpper || d > kNear) continue;
    if (p.z() > kShaftHigh) {
      above += p.z() > kPostTop;
      continue;
    }
    outside += d > kOnSurface;
    if (std::abs(d) > kOnSurface) continue;
    ++on;
    layers |= std::uint64_t{1} << static_cast<int>((p.z() - kUpper) / LayerRaster::kLayer);
  }
  if (on == 0) return {};
  return {std::popcount(layers) * LayerRaster::kLayer / (kShaftHigh - kUpper),
          static_cast<double>(on) / (on + outside), static_cast<double>(above) / on};
}

}  // namespace

std::vector<StemEvidence> find_slender_stems(const WorkingCloud& cloud, const ColumnIndex& index,
                                             const std::vector<float>& heights,
                                             const StemConfig& config) {
  constexpr double kReach = 0.45;    // m, of what a line is fitted to
  constexpr double kTried = 0.08;    // m, around where a line has been begun
  constexpr double kOfCone = 0.12;   // m from the line, of what the cone is fitted to
  constexpr double kConeLow = 0.25;  // m above the ground, likewise
  constexpr std::uint64_t kFoot = (std::uint64_t{1} << kFootLayers) - 1;
  struct Found {
    StemEvidence evidence;
    double score;
  };
  const LayerRaster raster(cloud, heights);
  std::vector<std::uint8_t> closed(raster.cells(), 0);
  std::vector<Found> found;
  for (int r = 0; r < raster.rows(); ++r) {
    for (int c = 0; c < raster.columns(); ++c) {
      if (raster.empty(c, r) || closed[raster.at(c, r)] != 0) continue;
      const std::uint64_t mask = raster.around(c, r);
      if (std::popcount(mask & kFoot) < kFewestAtFoot) continue;
      if (std::popcount(mask & ((std::uint64_t{1} << kLineLayers) - 1)) < kLineLayers / 2) continue;
      const std::vector<Vec3> points = points_near(cloud, index, heights, raster.centre(c, r),
                                                   kReach, LayerRaster::kLowest, kLineTop);
      const auto foot = foot_of(points, raster.centre(c, r));
      if (!foot) continue;
      raster.visit(*foot, kTried, [&](std::size_t cell) { closed[cell] = 1; });
      const Line line = fit_line(points, *foot);
      const Company company = company_of(points, line);
      if (!is_stem_line(line, company)) continue;
      std::vector<Vec3> core;
      for (const Vec3& p : points) {
        if (p.z() >= kConeLow && line.distance(p) <= kOfCone) core.push_back(p);
      }
      if (core.empty()) continue;
      auto stem = fit_shaft(core, {line.centre_at(kBreastHeight), line.lean, 0, 0}, {});
      if (!stem) continue;
      stem->radius = without_noise(stem->radius);
      const StemEvidence evidence = weigh_stem(core, *stem);
      if (!is_slender(evidence, config)) continue;
      found.push_back({evidence, company.filled - company.chance});
    }
  }
  std::stable_sort(found.begin(), found.end(),
                   [](const Found& a, const Found& b) { return a.score > b.score; });
  std::vector<StemEvidence> stems;
  for (const Found& each : found) {
    const bool known = std::any_of(stems.begin(), stems.end(), [&](const StemEvidence& other) {
      return (other.stem.centre - each.evidence.stem.centre).norm() < kSameStem;
    });
    if (!known) stems.push_back(each.evidence);
  }
  return stems;
}

void add_slender_stems(const std::vector<StemEvidence>& slender, std::vector<StemEvidence>& stems) {
  constexpr double kMuchThicker = 1.4;
  constexpr double kOnBark = 0.06;  // m from the cone's surface
  constexpr double kWide = 0.2;     // m of girth: more than a slender stem shows
  for (const StemEvidence& line : slender) {
    bool known = false;
    std::erase_if(stems, [&](const StemEvidence& cone) {
      const double apart = (cone.stem.centre - line.stem.centre).norm();
      if (apart > std::max(kSameStem, cone.stem.radius + kCore)) return false;
      const double seen_girth = cone.seen_fraction * 2 * std::numbers::pi * cone.stem.radius;
      const bool strip_of_bark = std::abs(apart - cone.stem.radius) < kOnBark && seen_girth > kWide;
      const bool through_leaves =
          cone.stem.radius > kMuchThicker * line.stem.radius && !strip_of_bark;
      known |= !through_leaves;
      return through_leaves;
    });
    if (!known) stems.push_back(line);
  }
}

/// Of a cloud that somebody has cut off above the stems, none shows where a tree goes on.
bool ends_below_trees(const std::vector<float>& heights) {
  constexpr double kHardly = 0.001;  // of what stands up
  std::size_t upright = 0, above = 0;
  for (const float height : heights) {
    upright += static_cast<double>(height) > kShaftLow;
    above += static_cast<double>(height) > kPostTop + 0.5 * kAbove;
  }
  return static_cast<double>(above) < kHardly * static_cast<double>(upright);
}

std::optional<StemEvidence> post_at(const Stem& about, const WorkingCloud& cloud,
                                    const ColumnIndex& index, const std::vector<float>& heights) {
  constexpr double kThickest = 0.15;               // m, radius
  constexpr double kPlumb = 0.025, kEven = 0.015;  // per metre
  constexpr double kLeastFilled = 0.6, kLeastOwn = 0.62, kMostAbove = 0.2;
  // Trees that a plumb shaft happens to fit reach 0.55: it has their leaves around and inside.
  constexpr double kLeastConfidence = 0.56;
  constexpr double kSure = 0.75, kLeastOwnIfSure = 0.5;
  if (about.radius > kThickest) return std::nullopt;
  const std::vector<Vec3> points = points_near(cloud, index, heights, about.centre,
                                               about.radius + 0.25, kShaftLow, kPostTop + kAbove);
  std::vector<Vec3> lower;
  std::copy_if(points.begin(), points.end(), std::back_inserter(lower),
               [](const Vec3& p) { return p.z() <= kShaftHigh; });
  // As the stem was fitted, and as a plumb line would stand there: leaves draw a free fit aside.
  for (const Stem& start : {about, Stem{plumb_line(lower, about.centre), Vec2::Zero(), 0, 0}}) {
    const auto shaft = fit_shaft(lower, start, kPostPrior);
    if (!shaft) continue;
    const UpperPart upper = upper_part(points, *shaft);
    if (shaft->lean.norm() < kPlumb && std::abs(shaft->taper) < kEven &&
        upper.filled >= kLeastFilled && upper.above <= kMostAbove) {
      const StemEvidence post = weigh_stem(lower, *shaft);
      const bool sure = post.confidence() >= kSure;
      if (upper.own >= (sure ? kLeastOwnIfSure : kLeastOwn) &&
          post.confidence() >= kLeastConfidence) {
        return post;
      }
    }
  }
  return std::nullopt;
}

std::vector<StemEvidence> take_posts(std::vector<StemEvidence>& slender,
                                     std::vector<StemEvidence>& stems, const WorkingCloud& cloud,
                                     const ColumnIndex& index, const std::vector<float>& heights) {
  std::vector<StemEvidence> posts;
  if (ends_below_trees(heights)) return posts;
  for (const std::vector<StemEvidence>* candidates : {&slender, &stems}) {
    for (const StemEvidence& candidate : *candidates) {
      const auto post = post_at(candidate.stem, cloud, index, heights);
      if (!post) continue;
      const bool known = std::any_of(posts.begin(), posts.end(), [&](const StemEvidence& other) {
        return (other.stem.centre - post->stem.centre).norm() < kSameStem;
      });
      if (!known) posts.push_back(*post);
    }
  }
  const auto is_near_post = [&](const StemEvidence& stem, double reach) {
    return std::any_of(posts.begin(), posts.end(), [&](const StemEvidence& post) {
      return (stem.stem.centre - post.stem.centre).norm() < reach;
    });
  };
  std::erase_if(slender, [&](const StemEvidence& line) { return is_near_post(line, kSamePost); });
  // A cone whose surface the post stands in was fitted through it and leaves beside it.
  std::erase_if(stems, [&](const StemEvidence& stem) {
    return is_near_post(stem, std::max(kSamePost, stem.stem.radius + kCore));
  });
  return posts;
}

}  // namespace arex
