#include "semantics/stem_fit.h"

#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <numbers>

#include "semantics/cone_sums.h"
#include "semantics/pcl_models.h"

namespace arex {
namespace {

constexpr double kInlier = 0.05;          // m from the surface
constexpr double kWellInside = 0.06;      // m below the surface
constexpr double kAround = 0.2;           // m above the surface
constexpr double kWhole = 0.6;            // share of a stem's layers that a seen sector has
constexpr std::size_t kFewestOfStem = 8;  // points of a stem

/// Circle through points by moments. Source: Kasa, A circle fitting procedure and its error
/// analysis, IEEE Trans. Instrumentation and Measurement 25, 1976.
std::optional<Stem> circle_by_moments(std::span<const Vec3> points, const Vec2& about,
                                      double within) {
  Mat3 A = Mat3::Zero();
  Vec3 b = Vec3::Zero();
  int count = 0;
  for (const Vec3& p : points) {
    const Vec2 d = p.head<2>() - about;
    if (d.norm() > within) continue;
    const Vec3 row(d.x(), d.y(), 1);
    A += row * row.transpose();
    b += d.squaredNorm() * row;
    ++count;
  }
  if (count < static_cast<int>(kFewestOfStem)) return std::nullopt;
  A.diagonal() += Vec3::Constant(1e-9);
  const Vec3 s = A.ldlt().solve(b);
  const Vec2 c = 0.5 * s.head<2>();
  const double r2 = s.z() + c.squaredNorm();
  if (!(r2 > 0) || !c.allFinite()) return std::nullopt;
  return Stem{about + c, Vec2::Zero(), std::sqrt(r2), 0};
}

bool possible(const Stem& stem, const StemConfig& config) {
  return stem.radius > 0.01 && stem.radius <= config.max_diameter_m / 2;
}

/// Circles by moments around the place, and two guesses.
std::vector<Stem> simple_starts(std::span<const Vec3> points, const Vec2& about,
                                const StemConfig& config) {
  std::vector<Stem> stems;
  for (const double within : {0.15, 0.3, 0.5}) {
    const auto stem = circle_by_moments(points, about, within);
    if (stem && possible(*stem, config)) stems.push_back(*stem);
  }
  for (const double radius : {0.05, 0.12}) stems.push_back({about, Vec2::Zero(), radius, 0});
  return stems;
}

/// A circle by RANSAC through points within 0.6 m of breast height, where a lean moves it least.
std::optional<Stem> ransac_start(std::span<const Vec3> points, const StemConfig& config) {
  constexpr double kReach = 0.6;        // m
  constexpr std::size_t kEnough = 150;  // more points say the same, and take their time
  constexpr double kTolerance = 0.025;  // m
  std::vector<Vec2> middle;
  for (const Vec3& p : points) {
    if (std::abs(p.z() - kBreastHeight) < kReach) middle.emplace_back(p.head<2>());
  }
  if (middle.size() < kFewestOfStem) {
    for (const Vec3& p : points) middle.emplace_back(p.head<2>());
  }
  if (const std::size_t stride = 1 + middle.size() / kEnough; stride > 1) {
    for (std::size_t i = 0; i * stride < middle.size(); ++i) middle[i] = middle[i * stride];
    middle.resize((middle.size() + stride - 1) / stride);
  }
  const auto circle =
      ransac_circle(middle, kTolerance, {0.5 * config.min_diameter_m, 0.5 * config.max_diameter_m});
  if (!circle) return std::nullopt;
  return Stem{circle->head<2>(), Vec2::Zero(), circle->z(), 0};
}

/// Sectors of the girth, each about as wide as a map's voxel.
int sectors_of(double radius) {
  constexpr double kArc = 0.08;  // m
  return std::clamp(static_cast<int>(std::lround(2 * std::numbers::pi * radius / kArc)), 6, 36);
}

}  // namespace

StemEvidence weigh_stem(std::span<const Vec3> points, const Stem& stem) {
  StemEvidence evidence;
  evidence.stem = stem;
  const int sectors = sectors_of(stem.radius);
  std::array<std::uint64_t, 36> layers_of_sector{};
  std::uint64_t layers = 0;
  std::vector<double> residuals;
  for (const Vec3& p : points) {
    const double d = stem.distance(p);
    if (std::abs(d) <= kInlier) {
      ++evidence.inliers;
      residuals.push_back(std::abs(d));
      const auto layer = std::uint64_t{1}
                         << static_cast<int>(std::clamp(p.z() / StemEvidence::kLayer, 0., 63.));
      const Vec2 out = p.head<2>() - stem.centre_at(p.z());
      const double turn = std::atan2(out.y(), out.x()) / (2 * std::numbers::pi) + 0.5;
      const int sector = std::min(static_cast<int>(turn * sectors), sectors - 1);
      layers_of_sector[static_cast<std::size_t>(sector)] |= layer;
      layers |= layer;
    } else if (d < -kWellInside) {
      ++evidence.inside;
    } else if (d > 0 && d < kAround) {
      ++evidence.around;
    }
  }
  evidence.layers = std::popcount(layers);
  // A sector is seen where it is bark all the way up, and not a leaf here and a twig there.
  int seen = 0;
  for (int i = 0; i < sectors; ++i) {
    seen +=
        std::popcount(layers_of_sector[static_cast<std::size_t>(i)]) >= kWhole * evidence.layers;
  }
  evidence.seen_fraction = evidence.layers > 0 ? static_cast<double>(seen) / sectors : 0;
  if (!residuals.empty()) {
    const auto middle = residuals.begin() + static_cast<std::ptrdiff_t>(residuals.size() / 2);
    std::nth_element(residuals.begin(), middle, residuals.end());
    evidence.median_residual = *middle;
  }
  const double purity = static_cast<double>(evidence.inliers) /
                        (evidence.inliers + 2.0 * evidence.inside + 0.5 * evidence.around + 1.0);
  const double sharpness = 1 - evidence.median_residual / kInlier;
  evidence.score = evidence.layers * (0.05 + evidence.seen_fraction) * purity * sharpness;
  return evidence;
}

double StemEvidence::confidence() const {
  const double height = std::min(1.0, layers * kLayer / 1.6);
  const double girth = std::min(1.0, seen_fraction / 0.4);
  const double purity = inliers / (inliers + 2.0 * inside + 0.5 * around + 1.0);
  const double sharpness = 1 - std::min(1.0, median_residual / kInlier);
  return height * girth * purity * sharpness;
}

namespace {

// Scales of the weights, m: from where a start may be off to the noise of bark.
constexpr std::array kCoarse{0.10, 0.08, 0.07, 0.06, 0.05};
constexpr std::array kFine{0.045, 0.04, 0.04, 0.035, 0.035, 0.03, 0.03};

/// A step of reweighted least squares for each scale.
Stem improve(const ConePoints& points, Stem stem, const StemConfig& config,
             std::span<const double> scales) {
  constexpr double kSigma = 0.02;                // m, of a point
  constexpr double kLean = 0.15, kTaper = 0.01;  // deviations of the priors, per metre
  constexpr double kUsualTaper = 0.01;           // per metre
  const double most = config.max_diameter_m / 2;
  for (const double scale : scales) {
    auto [A, b] = points.sums(stem, scale, kSigma, 5 * scale);
    Vec6 prior = Vec6::Zero(), sigma;
    sigma << 1, 1, kLean, kLean, 1, kTaper;
    prior << 0, 0, -stem.lean.x(), -stem.lean.y(), 0, kUsualTaper - stem.taper;
    for (int i = 0; i < 6; ++i) {
      A(i, i) += 1 / (sigma[i] * sigma[i]);
      b[i] += prior[i] / (sigma[i] * sigma[i]);
    }
    const Vec6 step = A.ldlt().solve(b);
    if (!step.allFinite()) break;
    stem.centre += step.head<2>();
    stem.lean += step.segment<2>(2);
    stem.radius = std::clamp(stem.radius + step[4], 0.01, most);
    stem.taper += step[5];
  }
  return stem;
}

using Vec5 = Eigen::Matrix<double, 5, 1>;
using Mat5 = Eigen::Matrix<double, 5, 5>;

/// A section that is no circle: r(angle) = radius + c cos(2 angle) + s sin(2 angle).
struct OvalSection {
  Vec2 centre = Vec2::Zero();  ///< off the axis
  double radius = 0;
  Vec2 oval = Vec2::Zero();  ///< c, s
  /// Residual of a point off the axis, and its derivatives by the parameters, negated.
  double residual(const Vec2& point, Vec5& row) const {
    const Vec2 out = point - centre;
    const double norm = std::max(1e-6, out.norm());
    const Vec2 u = out / norm;
    const Vec2 twice(u.x() * u.x() - u.y() * u.y(), 2 * u.x() * u.y());
    row << u.x(), u.y(), 1, twice.x(), twice.y();
    return norm - radius - oval.dot(twice);
  }
};

/// Least squares with Geman-McClure weights on all that lies near a section.
OvalSection fit_oval(std::span<const Vec2> points, double radius) {
  constexpr std::array kScales{0.10, 0.08, 0.07, 0.06, 0.05, 0.04, 0.04, 0.03, 0.03, 0.03};  // m
  constexpr double kRangeSigma = 0.02;  // m, of a point
  constexpr double kOvalSigma = 0.1;    // of the radius, deviation of the prior
  OvalSection section;
  section.radius = radius;
  for (const double scale : kScales) {
    const double prior = 1 / (kOvalSigma * radius * kOvalSigma * radius);
    Mat5 A = Mat5::Identity();
    Vec5 b = Vec5::Zero();
    A(3, 3) = A(4, 4) = prior;
    b.tail<2>() = -prior * section.oval;
    Vec5 row;
    for (const Vec2& p : points) {
      const double d = section.residual(p, row);
      const double root = kRangeSigma * (1 + d * d / (scale * scale)), w = 1 / (root * root);
      A += w * row * row.transpose();
      b += w * d * row;
    }
    const Vec5 step = A.ldlt().solve(b);
    if (!step.allFinite()) break;
    section.centre += step.head<2>();
    section.radius += step[2];
    section.oval += step.tail<2>();
  }
  return section;
}

/// The girth of a stem that is no cylinder, where more than half of it is seen: a circle follows
/// one side of an oval, and the mean of its two calipers is what a forester would note.
Stem round_out(std::span<const Vec3> points, const Stem& stem) {
  constexpr double kLeastRadius = 0.08;  // m: of thinner ones noise makes ovals
  constexpr double kLeastOval = 0.05;    // of the radius
  constexpr double kMostOval = 0.25;     // likewise: an axis ratio of 5 to 3
  constexpr double kLeastGirth = 0.5;    // of the sectors
  constexpr double kFits = 0.03;         // m
  constexpr double kMoreOften = 1.15;    // points on the oval, for each on the circle
  constexpr int kSectors = 24;
  if (stem.radius < kLeastRadius) return stem;
  std::vector<Vec2> near;  // off the axis, as at breast height
  for (const Vec3& p : points) {
    const double taper = stem.radius_at(p.z()) - stem.radius;
    const Vec2 out = p.head<2>() - stem.centre_at(p.z());
    if (std::abs(out.norm() - stem.radius - taper) > 0.05 + 0.3 * stem.radius) continue;
    near.push_back(out - taper * out.normalized());
  }
  const OvalSection oval = fit_oval(near, stem.radius);
  const double amplitude = oval.oval.norm();
  if (!(oval.radius > kLeastRadius) || amplitude < kLeastOval * oval.radius ||
      amplitude > kMostOval * oval.radius || oval.centre.norm() > 0.5 * stem.radius) {
    return stem;
  }
  std::array<int, kSectors> seen{};
  int on_oval = 0, on_circle = 0;
  Vec5 row;
  for (const Vec2& p : near) {
    on_circle += std::abs(p.norm() - stem.radius) < kFits;
    if (std::abs(oval.residual(p, row)) >= kFits) continue;
    ++on_oval;
    const double turn = std::atan2(row[1], row[0]) / (2 * std::numbers::pi) + 0.5;
    ++seen[static_cast<std::size_t>(std::min(kSectors - 1, static_cast<int>(turn * kSectors)))];
  }
  // A sector is seen if it has a third of what it has on average.
  const auto girth = std::count_if(seen.begin(), seen.end(),
                                   [&](int count) { return 3 * kSectors * count > on_oval; });
  if (static_cast<double>(girth) < kLeastGirth * kSectors || on_oval < kMoreOften * on_circle) {
    return stem;
  }
  Stem out = stem;
  out.centre += oval.centre;
  out.radius = oval.radius + amplitude * amplitude / oval.radius;  // of a circle with that girth
  return out;
}

/// Every n-th point, at most `most` of them.
std::vector<Vec3> thinned(std::span<const Vec3> points, std::size_t most) {
  const std::size_t stride = (points.size() + most - 1) / most;
  std::vector<Vec3> part;
  for (std::size_t i = 0; i < points.size(); i += stride) part.push_back(points[i]);
  return part;
}

}  // namespace

std::optional<StemEvidence> fit_stem(std::span<const Vec3> all, const Vec2& about,
                                     const StemConfig& config) {
  constexpr std::size_t kFollowed = 2;                     // of the starts, after the coarse steps
  constexpr double kHopeless = 0.1;                        // confidence; bushes have less
  constexpr double kNoStem = 0.05;                         // confidence
  constexpr std::size_t kEnough = 200, kEnoughFine = 500;  // points, for coarse and fine steps
  if (all.size() < kFewestOfStem) return std::nullopt;
  // Most places of an orchard are leaves, many of them: a part of them tells so as well.
  const std::vector<Vec3> few = thinned(all, kEnough), more = thinned(all, kEnoughFine);
  const std::span<const Vec3> points = few;
  const ConePoints coarse(few, about);
  std::vector<StemEvidence> begun;
  const auto begin = [&](const Stem& start) {
    begun.push_back(weigh_stem(points, improve(coarse, start, config, kCoarse)));
  };
  const auto by_score = [](const StemEvidence& a, const StemEvidence& b) {
    return a.score > b.score;
  };
  for (const Stem& start : simple_starts(points, about, config)) begin(start);
  std::stable_sort(begun.begin(), begun.end(), by_score);
  // RANSAC costs more than all of these: only where they leave a doubt.
  const double sure = begun.front().confidence();
  if (sure > kHopeless && sure < config.min_confidence) {
    if (const auto start = ransac_start(points, config)) begin(*start);
    std::stable_sort(begun.begin(), begun.end(), by_score);
  }
  if (begun.size() > kFollowed) begun.resize(kFollowed);
  // What is this far from a stem after the coarse steps does not become one by the fine ones.
  if (begun.front().confidence() < kNoStem) return std::nullopt;
  const ConePoints fine(more, about);
  std::optional<StemEvidence> best;
  for (const StemEvidence& each : begun) {
    const StemEvidence evidence = weigh_stem(all, improve(fine, each.stem, config, kFine));
    if (evidence.inliers < static_cast<int>(kFewestOfStem)) continue;
    if (!best || evidence.score > best->score) best = evidence;
  }
  // Of leaves a section says nothing.
  if (best && best->confidence() >= config.min_confidence) best->stem = round_out(all, best->stem);
  return best;
}

}  // namespace arex
