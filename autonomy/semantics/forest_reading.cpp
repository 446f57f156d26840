#include "semantics/forest_reading.h"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <functional>
#include <numbers>
#include <optional>

#include "semantics/ground_model.h"
#include "semantics/leaning_stems.h"
#include "semantics/slender_stems.h"
#include "semantics/stem_detector.h"

namespace arex {
namespace {

constexpr double kGroundThickness = 0.12;  // m, roughness and noise of the ground's points
constexpr double kBark = 0.06;             // m, a stem's points lie this near to its surface
constexpr double kStemStep = 0.25;         // m, of following a stem
constexpr double kBridge = 1.0;            // m, without points along a stem
constexpr double kCrownReach = 4.0;        // m, from a stem to the points of its crown
constexpr double kCrownBase = 1.5;         // m above the ground, of what counts as canopy
constexpr double kCanopyCell = 0.25;       // m
constexpr std::size_t kTop = 5;            // the highest points may be false echoes

/// The part of a stem at one height above its foot.
struct Ring {
  Vec2 centre;
  double height, radius;
  Vec2 lean;
  /// As part of a stem, whose breast it is.
  [[nodiscard]] Stem as_stem() const { return {centre, lean, radius, 0}; }
};

/// Follows a stem from its fit in one direction.
class StemFollower {
 public:
  StemFollower(const WorkingCloud& cloud, const ColumnIndex& index)
      : cloud_(cloud), index_(index) {}

  /// Rings from the given height on, `step` apart, ending where the stem's points do.
  /// @param foot_z of the stem
  [[nodiscard]] std::vector<Ring> follow(const Stem& stem, double foot_z, double from, double step,
                                         double until) const {
    std::vector<Ring> rings;
    Vec2 centre = stem.centre_at(from), lean = stem.lean;
    std::size_t sure = 0;
    double missing = 0;
    for (double h = from; step > 0 ? h <= until : h >= until; h += step) {
      const double radius = stem.radius_at(h);
      if (const auto found = fit_centre({centre, h, radius, lean}, foot_z)) {
        const Vec2 drift = (*found - centre) / step;
        lean += 0.2 * drift;
        centre = *found;
        missing = 0;
        rings.push_back({centre, h, radius, lean});
        sure = rings.size();
      } else {
        missing += std::abs(step);
        rings.push_back({centre, h, radius, lean});
      }
      if (missing > kBridge) break;
      centre += step * lean;
    }
    rings.resize(sure);
    return rings;
  }

 private:
  /// The centre of a circle of known radius near a guess; nothing if too few points lie on it.
  [[nodiscard]] std::optional<Vec2> fit_centre(const Ring& ring, double foot_z) const {
    constexpr std::size_t kFewest = 4;
    const Vec2& guess = ring.centre;
    const double radius = ring.radius, slant = ring.lean.norm();
    const Vec2 towards = slant > 0 ? Vec2(ring.lean / slant) : Vec2::UnitX();
    const double squeeze = 1 - 1 / std::sqrt(1 + slant * slant);
    const double reach = radius + 0.15 + slant * kStemStep;
    std::vector<Vec2> points;  // along the axis into its level, where a leaning stem is round
    index_.within(static_cast<float>(guess.x()), static_cast<float>(guess.y()),
                  static_cast<float>(reach), [&](std::uint32_t i) {
                    const double up =
                        static_cast<double>(cloud_.points[i].z()) - foot_z - ring.height;
                    if (std::abs(up) > kStemStep) return;
                    const Vec2 out = flat(cloud_.points[i]) - up * ring.lean - guess;
                    points.push_back(guess + out - squeeze * out.dot(towards) * towards);
                  });
    if (points.size() < kFewest) return std::nullopt;
    Vec2 centre = guess;
    for (int round = 0; round < 6; ++round) {
      Eigen::Matrix2d A = Eigen::Matrix2d::Identity();  // keeps a one-sided arc in place
      Vec2 b = guess - centre;
      for (const Vec2& p : points) {
        const Vec2 out = p - centre;
        const double norm = std::max(1e-6, out.norm());
        const double d = norm - radius;
        const double weight = 1 / std::pow(1 + d * d / (0.05 * 0.05), 2);
        const Vec2 u = out / norm;
        A += weight * u * u.transpose();
        b += weight * d * u;
      }
      centre += A.inverse() * b;
    }
    const auto on_bark =
        static_cast<std::size_t>(std::count_if(points.begin(), points.end(), [&](const Vec2& p) {
          return std::abs((p - centre).norm() - radius) < kBark;
        }));
    const bool kept = 2 * on_bark >= points.size() && on_bark >= kFewest;
    return kept && (centre - guess).norm() < 0.15 ? std::optional(centre) : std::nullopt;
  }

  const WorkingCloud& cloud_;
  const ColumnIndex& index_;
};

/// Where a stem or its crown is.
struct StemPlace {
  Vec2 at;
  std::size_t stem;
};

/// The nearest of some places, by buckets.
class NearestStem {
 public:
  NearestStem(const std::vector<StemPlace>& places, std::size_t none, const WorkingCloud& cloud)
      : places_(places),
        none_(none),
        buckets_(cloud.low.head<2>().cast<double>(), cloud.high.head<2>().cast<double>(),
                 kCrownReach, 0),
        lists_(buckets_.values.size()) {
    for (std::size_t i = 0; i < places.size(); ++i) {
      lists_[buckets_.cell_of(places[i].at.x(), places[i].at.y())].push_back(i);
    }
  }
  /// Index of the stem within kCrownReach, or `none`.
  [[nodiscard]] std::size_t at(const Vec2& p) const {
    std::size_t best = none_;
    double least = kCrownReach;
    const int column = buckets_.column_of(p.x()), row = buckets_.row_of(p.y());
    for (int r = row - 1; r <= row + 1; ++r) {
      for (int c = column - 1; c <= column + 1; ++c) {
        if (!buckets_.contains(c, r)) continue;
        for (const std::size_t i : lists_[buckets_.index(c, r)]) {
          const double distance = (places_[i].at - p).norm();
          if (distance < least) {
            least = distance;
            best = places_[i].stem;
          }
        }
      }
    }
    return best;
  }

 private:
  const std::vector<StemPlace>& places_;
  std::size_t none_;
  Raster buckets_;
  std::vector<std::vector<std::size_t>> lists_;
};

void label_stem(const std::vector<Ring>& rings, double foot_z, SemanticClass kind,
                const WorkingCloud& cloud, const ColumnIndex& index,
                const std::vector<float>& heights, std::vector<SemanticClass>& labels) {
  for (const Ring& ring : rings) {
    const Stem stem = ring.as_stem();
    const double slant = ring.lean.norm();
    const double reach = (ring.radius + kBark) * std::sqrt(1 + slant * slant) + slant * kStemStep;
    index.within(static_cast<float>(ring.centre.x()), static_cast<float>(ring.centre.y()),
                 static_cast<float>(reach), [&](std::uint32_t i) {
                   const double up =
                       static_cast<double>(cloud.points[i].z()) - foot_z - ring.height;
                   if (std::abs(up) > 0.5 * kStemStep + 1e-6 ||
                       static_cast<double>(heights[i]) < kGroundThickness) {
                     return;
                   }
                   const Vec2 p = flat(cloud.points[i]);
                   if (stem.from_axis({p.x(), p.y(), kBreastHeight + up}) > ring.radius + kBark)
                     return;
                   labels[i] = kind;
                 });
  }
}

/// What a stem's neighbourhood says of its tree.
struct Crown {
  std::vector<float> highest;  ///< z of the kTop highest points, falling
  std::vector<std::uint64_t> cells;
  void add(float z, std::uint64_t cell, bool canopy) {
    if (highest.size() < kTop || z > highest.back()) {
      highest.insert(std::upper_bound(highest.begin(), highest.end(), z, std::greater<>()), z);
      if (highest.size() > kTop) highest.pop_back();
    }
    if (canopy && (cells.empty() || cells.back() != cell)) cells.push_back(cell);
  }
  [[nodiscard]] double diameter() {
    std::sort(cells.begin(), cells.end());
    cells.erase(std::unique(cells.begin(), cells.end()), cells.end());
    const double area = static_cast<double>(cells.size()) * kCanopyCell * kCanopyCell;
    return 2 * std::sqrt(area / std::numbers::pi);
  }
};

/// A corner or a window's frame looks like a stem, and lies in a plane that goes on.
bool is_part_of_wall(const Stem& stem, const WorkingCloud& cloud, const ColumnIndex& index,
                     const std::vector<float>& heights, const std::vector<bool>& on_wall) {
  constexpr double kFrom = 0.5, kTo = 2.5;  // m above the ground
  const double reach = stem.radius + kBark + stem.lean.norm() * (kTo - kBreastHeight);
  int points = 0, of_wall = 0;
  index.within(static_cast<float>(stem.centre.x()), static_cast<float>(stem.centre.y()),
               static_cast<float>(reach), [&](std::uint32_t i) {
                 const auto h = static_cast<double>(heights[i]);
                 if (h < kFrom || h > kTo) return;
                 const Vec2 p = flat(cloud.points[i]);
                 if (std::abs(stem.distance({p.x(), p.y(), h})) > kBark) return;
                 ++points;
                 of_wall += on_wall[i];
               });
  return 2 * of_wall > points;
}

/// Whether an upright stem or a slender line is a part of a stem that leans, with leaves beside it.
bool is_part_of_any(const StemEvidence& upright, const std::vector<StemEvidence>& leaning) {
  constexpr double kLine = 0.15;  // m: of a thin one the line is known no better
  const double reach = std::max(kLine, upright.stem.radius);
  return std::any_of(leaning.begin(), leaning.end(), [&](const StemEvidence& e) {
    for (const double h : {0.4, 0.8, 1.2, 1.6, 2.0}) {
      const Vec2 p = upright.stem.centre_at(h);
      if (e.stem.from_axis({p.x(), p.y(), h}) < e.stem.radius + reach) return true;
    }
    return false;
  });
}

SemanticObject post_of(const StemEvidence& e, const Raster& ground, double top) {
  const double base = ground.interpolate(e.stem.centre.x(), e.stem.centre.y());
  SemanticObject object;
  object.kind = SemanticClass::kPillar;
  object.position = {e.stem.centre.x(), e.stem.centre.y(), base + 0.5 * top};
  object.size = {2 * e.stem.radius, 2 * e.stem.radius, top};
  object.base_z = base;
  object.seen_fraction = e.seen_fraction;
  object.confidence = e.confidence();
  return object;
}

}  // namespace

SceneReading read_forest(const WorkingCloud& cloud, const std::vector<bool>& on_wall,
                         const SemanticConfig& config) {
  SceneReading reading;
  reading.ground = fit_ground(cloud, config.ground_cell_m);
  reading.heights = heights_above(cloud.points, reading.ground);
  reading.labels.assign(cloud.points.size(), SemanticClass::kUnlabelled);
  const std::vector<float>& heights = reading.heights;
  const ColumnIndex index(cloud.points, cloud.low, cloud.high, WorkingCloud::kCell);
  std::vector<StemEvidence> stems = find_stems(cloud, index, heights, config.stem);
  const std::vector<StemEvidence> leaning =
      take_leaning_stems(stems, cloud, index, heights, reading.ground, config.stem);
  std::vector<StemEvidence> slender = find_slender_stems(cloud, index, heights, config.stem);
  constexpr double kSure = 0.5;  // confidence of one that stands for itself
  std::erase_if(stems, [&](const StemEvidence& e) {
    return (e.confidence() < kSure || leans_away(e.stem)) && is_part_of_any(e, leaning);
  });
  std::erase_if(slender, [&](const StemEvidence& e) { return is_part_of_any(e, leaning); });
  std::vector<StemEvidence> posts = take_posts(slender, stems, cloud, index, heights);
  add_slender_stems(slender, stems);
  stems.insert(stems.end(), leaning.begin(), leaning.end());
  if (!on_wall.empty()) {
    const auto of_wall = [&](const StemEvidence& e) {
      return is_part_of_wall(e.stem, cloud, index, heights, on_wall);
    };
    std::erase_if(stems, of_wall);
    std::erase_if(posts, of_wall);
  }

  const StemFollower follower(cloud, index);
  const auto label = [&](const StemEvidence& e, SemanticClass kind) {
    constexpr double kHighest = 60;
    const double foot_z = foot_of_stem(e.stem, reading.ground).z();
    std::vector<Ring> rings = follower.follow(e.stem, foot_z, kBreastHeight, kStemStep, kHighest);
    const std::vector<Ring> down =
        follower.follow(e.stem, foot_z, kBreastHeight - kStemStep, -kStemStep, 0);
    rings.insert(rings.end(), down.begin(), down.end());
    label_stem(rings, foot_z, kind, cloud, index, heights, reading.labels);
    return rings;
  };
  std::vector<StemPlace> places;
  for (std::size_t i = 0; i < stems.size(); ++i) {
    const std::vector<Ring> rings = label(stems[i], SemanticClass::kTrunk);
    places.push_back({stems[i].stem.centre, i});
    if (!leans_away(stems[i].stem)) continue;
    for (const Ring& ring : rings) {
      if (ring.height > kBreastHeight) places.push_back({ring.centre, i});
    }
  }
  for (const StemEvidence& e : posts) {
    double top = kBreastHeight;
    for (const Ring& ring : label(e, SemanticClass::kPillar)) top = std::max(top, ring.height);
    reading.objects.push_back(post_of(e, reading.ground, top));
  }

  const NearestStem nearest(places, stems.size(), cloud);
  std::vector<Crown> crowns(stems.size() + 1);
  const Raster canopy(cloud.low.head<2>().cast<double>(), cloud.high.head<2>().cast<double>(),
                      std::max(kCanopyCell, WorkingCloud::kCell), 0);
  for (std::size_t i = 0; i < cloud.points.size(); ++i) {
    const auto h = static_cast<double>(heights[i]);
    SemanticClass& kind = reading.labels[i];
    const Vec2 p = cloud.points[i].head<2>().cast<double>();
    const std::size_t tree = nearest.at(p);
    if (kind == SemanticClass::kUnlabelled && !on_wall.empty() && on_wall[i]) {
      kind = SemanticClass::kWall;
    } else if (kind == SemanticClass::kUnlabelled) {
      kind = std::abs(h) <= kGroundThickness ? SemanticClass::kGround
             : h < -kGroundThickness         ? SemanticClass::kUnlabelled
             : h < kCrownBase                ? SemanticClass::kUndergrowth
                                             : SemanticClass::kCanopy;
    }
    if (h > kGroundThickness && kind != SemanticClass::kPillar && kind != SemanticClass::kWall) {
      crowns[tree].add(cloud.points[i].z(), canopy.cell_of(p.x(), p.y()), h > kCrownBase);
    }
  }
  for (std::size_t i = 0; i < stems.size(); ++i) {
    const StemEvidence& e = stems[i];
    const double ground = foot_of_stem(e.stem, reading.ground).z();
    SemanticObject object;
    object.kind = SemanticClass::kTrunk;
    object.position = {e.stem.centre.x(), e.stem.centre.y(), ground + kBreastHeight};
    const double height =
        crowns[i].highest.empty() ? 0 : static_cast<double>(crowns[i].highest.back()) - ground;
    object.size = {2 * e.stem.radius, 2 * e.stem.radius, height};
    object.base_z = ground;
    object.canopy_diameter = crowns[i].diameter();
    object.seen_fraction = e.seen_fraction;
    object.confidence = e.confidence();
    reading.objects.push_back(object);
  }
  return reading;
}

}  // namespace arex
