#include "semantics/leaning_stems.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <numbers>
#include <optional>
#include <tuple>

#include "semantics/layer_raster.h"

namespace arex {
namespace {

constexpr double kLeaningLeast = 0.2;       // per metre, 11 degrees
constexpr double kLeaningMost = 1.2;        // per metre, 50 degrees
constexpr double kLeaningReach = 0.1;       // m from the surface, a leaning stem's points
constexpr double kLeaningLength = 1.4;      // m along the axis
constexpr double kLeaningFoot = 0.4;        // m above the ground: below this it shows points
constexpr double kLeaningThinnest = 0.07;   // m, diameter: thinner ones are the rods of a thicket
constexpr int kLeaningAtFoot = 3;           // of these points
constexpr double kLeaningBark = 0.05;       // m
constexpr float kLeaningOffGround = 0.15F;  // m, height of what is no ground
constexpr double kLeaningConfidence = 0.5;

double ground_at(const Raster& ground, const Vec2& p) { return ground.interpolate(p.x(), p.y()); }

/// A straight line in the cloud's frame.
struct Axis {
  Vec3 at = Vec3::Zero();
  Vec3 along = Vec3::UnitZ();  ///< unit, upwards
  [[nodiscard]] Vec2 lean() const { return along.head<2>() / along.z(); }
};

/// Where an axis comes out of the ground.
Vec3 foot_of_axis(const Axis& axis, const Raster& ground) {
  constexpr int kSecants = 8;
  constexpr double kLeast = 0.1;  // m, per metre of the axis: a steeper slope beside it has no foot
  const auto at = [&](double z) {
    return Vec3(axis.at + (z - axis.at.z()) / axis.along.z() * axis.along);
  };
  const auto above = [&](double z) { return z - ground_at(ground, at(z).head<2>()); };
  double z = axis.at.z(), height = above(z), slope = 1;
  for (int round = 0; round < kSecants && std::abs(height) > 1e-4; ++round) {  // secants
    const double next = z - height / slope, next_height = above(next);
    slope = std::max(kLeast, (next_height - height) / (next - z));
    z = next;
    height = next_height;
  }
  return at(z);
}

/// The frame whose vertical is an axis, with the ground at the axis' foot as its zero.
class LeaningFrame {
 public:
  LeaningFrame(const Axis& axis, const Raster& ground)
      : R_(Quat::FromTwoVectors(axis.along, Vec3::UnitZ()).toRotationMatrix()),
        foot_(foot_of_axis(axis, ground)) {}
  [[nodiscard]] const Vec3& foot() const { return foot_; }
  [[nodiscard]] Vec3 into(const Vec3& p) const { return R_ * (p - foot_); }
  /// A stem's axis as it was fitted here.
  [[nodiscard]] Axis out_of(const Stem& stem) const {
    const Vec2 base = stem.centre_at(0);
    return {foot_ + R_.transpose() * Vec3(base.x(), base.y(), 0),
            R_.transpose() * Vec3(stem.lean.x(), stem.lean.y(), 1).normalized()};
  }

 private:
  Mat3 R_;
  Vec3 foot_;
};

/// What the search goes through.
struct Scene {
  const WorkingCloud& cloud;
  const ColumnIndex& index;
  const std::vector<float>& heights;
  const Raster& ground;
  const StemConfig& config;
  std::vector<std::uint8_t> taken;  ///< points of a stem that has been found
};

/// Calls visit(point) for the points about an axis, from its foot on.
template <class Visit>
void along_axis(const Scene& scene, const Axis& axis, const Vec3& foot, double reach, double length,
                const Visit& visit) {
  constexpr double kPiece = 0.4;  // m along the axis
  for (double s = 0; s < length; s += kPiece) {
    const Vec3 middle = foot + (s + kPiece / 2) * axis.along;
    const double disc = reach + kPiece / 2;
    // So far above and below its middle a disc across the axis is in the piece, and a little more.
    const double high = (kPiece / 2 + disc * axis.along.head<2>().norm()) / axis.along.z() + 1e-3;
    scene.index.within(static_cast<float>(middle.x()), static_cast<float>(middle.y()),
                       static_cast<float>(disc), static_cast<float>(middle.z() - high),
                       static_cast<float>(middle.z() + high), [&](std::uint32_t i) {
                         const Vec3 p = scene.cloud.points[i].cast<double>();
                         const double at = (p - foot).dot(axis.along) - s;
                         if (at >= 0 && at < kPiece) visit(i, p);
                       });
  }
}

struct Fitted {
  StemEvidence evidence;  ///< in the leaning frame
  Axis axis;
  Vec3 foot;
  int at_foot = 0;  ///< points on its surface just above the ground
};

/// The stem about an axis, by a fit in a frame that leans with it.
std::optional<Fitted> fit_about(const Scene& scene, const Axis& axis) {
  const LeaningFrame frame(axis, scene.ground);
  const double reach = std::min(0.7, scene.config.max_diameter_m / 2 + 0.3);
  std::vector<Vec3> points, foot_points;  // the latter with their heights
  Vec2 sum = Vec2::Zero();
  int near = 0;
  along_axis(scene, axis, frame.foot(), reach, scene.config.band_high_m,
             [&](std::uint32_t i, const Vec3& p) {
               if (scene.taken[i] != 0 || scene.heights[i] < kLeaningOffGround) return;
               const Vec3 local = frame.into(p);
               if (scene.heights[i] < static_cast<float>(kLeaningFoot))
                 foot_points.push_back(local);
               if (local.z() < scene.config.band_low_m) return;
               points.push_back(local);
               if (local.head<2>().norm() > 0.2) return;
               sum += local.head<2>();
               ++near;
             });
  const Vec2 about = near > 0 ? Vec2(sum / near) : Vec2::Zero();
  const auto evidence = fit_stem(points, about, scene.config);
  if (!evidence || evidence->stem.lean.norm() > 1) return std::nullopt;
  Fitted fitted{*evidence, frame.out_of(evidence->stem), {}, 0};
  if (fitted.axis.along.z() < 0.5) return std::nullopt;
  fitted.foot = foot_of_axis(fitted.axis, scene.ground);
  fitted.at_foot =
      static_cast<int>(std::count_if(foot_points.begin(), foot_points.end(), [&](const Vec3& p) {
        return std::abs(evidence->stem.distance(p)) < kLeaningBark;
      }));
  return fitted;
}

bool is_leaning_stem(const Fitted& fitted, const StemConfig& config) {
  const StemEvidence& e = fitted.evidence;
  const double lean = fitted.axis.lean().norm();
  return lean >= kLeaningLeast && lean <= kLeaningMost &&
         2 * e.stem.radius >= std::max(kLeaningThinnest, config.min_diameter_m) &&
         e.layers * StemEvidence::kLayer >= kLeaningLength - 1e-9 &&
         fitted.at_foot >= kLeaningAtFoot && e.seen_fraction >= 0.15 &&
         e.median_residual <= config.residual_m &&
         e.confidence() >= std::max(kLeaningConfidence, config.min_confidence);
}

/// As others know stems: by breast height above its foot.
StemEvidence as_evidence(const Fitted& fitted) {
  const double stretch = 1 / fitted.axis.along.z();  // m of axis, per metre of height
  StemEvidence out = fitted.evidence;
  out.stem.lean = fitted.axis.lean();
  out.stem.centre = fitted.foot.head<2>() + kBreastHeight * out.stem.lean;
  out.stem.radius = fitted.evidence.stem.radius_at(kBreastHeight * stretch);
  out.stem.taper = fitted.evidence.stem.taper * stretch;
  return out;
}

/// Fits again in the frame that leans as the first fit does.
std::optional<Fitted> fit_twice(const Scene& scene, const Axis& axis) {
  constexpr double kHopeful = 0.3;  // confidence
  const auto first = fit_about(scene, axis);
  if (!first || first->evidence.confidence() < kHopeful) return std::nullopt;
  return fit_about(scene, first->axis);
}

void take_points(Scene& scene, const Fitted& fitted) {
  constexpr double kLength = 4;  // m
  const double radius = fitted.evidence.stem.radius;
  along_axis(scene, fitted.axis, fitted.foot, radius + kLeaningReach, kLength,
             [&](std::uint32_t i, const Vec3& p) {
               const Vec3 off = p - fitted.foot;
               const double out = (off - off.dot(fitted.axis.along) * fitted.axis.along).norm();
               if (out < radius + kLeaningReach) scene.taken[i] = 1;
             });
}

/// An axis that begins at a stem above the ground is a branch's.
bool is_branch_of(const Fitted& fitted, const StemEvidence& stem, const Raster& ground) {
  constexpr double kFrom = 0.4, kTo = 4, kStep = 0.1;  // m above the foot
  const double higher = fitted.foot.z() - foot_of_stem(stem.stem, ground).z();
  for (double h = kFrom; h <= kTo; h += kStep) {
    const Vec2 p = fitted.foot.head<2>() + h * fitted.axis.lean();
    if ((p - stem.stem.centre_at(h + higher)).norm() < stem.stem.radius_at(h + higher)) return true;
  }
  return false;
}

/// The leans that are looked for: each is less than 0.3 from one of them.
std::vector<Vec2> leans_to_try() {
  std::vector<Vec2> leans;
  const auto ring = [&](double lean, int count, double turn) {
    for (int i = 0; i < count; ++i) {
      const double angle = 2 * std::numbers::pi * (i + turn) / count;
      leans.push_back(lean * Vec2(std::cos(angle), std::sin(angle)));
    }
  };
  ring(0.55, 10, 0);
  ring(0.95, 14, 0.5);
  return leans;
}

struct LeaningCandidate {
  int filled = 0;
  std::size_t lean = 0;
  std::size_t cell = 0;
  Vec2 foot = Vec2::Zero();
};

/// Filled layers of a column that stands on the ground and is high enough, with more room around it
/// than leaves leave; 0 if it is none.
int filled_from_ground(const LayerRaster& raster, std::size_t cell) {
  constexpr int kColumnLayers = 18, kLeastFilled = 13;  // up to 2 m
  constexpr int kFootOfColumn = 5, kLeastOfFoot = 3;    // layers
  constexpr int kBeside = 4;                            // cells
  const auto filled_of = [](std::uint64_t mask, int layers) {
    return std::popcount(mask & ((std::uint64_t{1} << layers) - 1));
  };
  const int column = raster.column(cell), row = raster.row(cell);
  const std::uint64_t mask = raster.around(column, row);
  const int filled = filled_of(mask, kColumnLayers);
  if (filled < kLeastFilled || filled_of(mask, kFootOfColumn) < kLeastOfFoot) return 0;
  int bare = 0;
  for (const auto& [c, r] : {std::pair(-kBeside, 0), {kBeside, 0}, {0, -kBeside}, {0, kBeside}}) {
    bare += 2 * filled_of(raster.around(column + c, row + r), kColumnLayers) <= filled;
  }
  return bare >= 2 ? filled : 0;
}

/// One point of each cube of 0.1 m that may be a stem's.
std::vector<std::uint32_t> thinned_band(const Scene& scene) {
  constexpr float kHigh = 3;  // m above the ground
  LayerRaster seen(scene.cloud.low, scene.cloud.high);
  std::vector<std::uint32_t> band;
  for (std::size_t i = 0; i < scene.cloud.points.size(); ++i) {
    const float h = scene.heights[i];
    if (scene.taken[i] != 0 || h < kLeaningOffGround || h > kHigh) continue;
    const std::size_t cell = seen.cell_of(flat(scene.cloud.points[i]));
    if (seen.add(cell, static_cast<double>(h) + LayerRaster::kLowest)) {
      band.push_back(static_cast<std::uint32_t>(i));
    }
  }
  return band;
}

std::vector<LeaningCandidate> leaning_candidates(const Scene& scene,
                                                 const std::vector<Vec2>& leans) {
  const std::vector<std::uint32_t> band = thinned_band(scene);
  LayerRaster raster(scene.cloud.low, scene.cloud.high);
  std::vector<LeaningCandidate> candidates;
  std::vector<std::size_t> touched;
  for (std::size_t k = 0; k < leans.size(); ++k) {
    touched.clear();
    for (const std::uint32_t i : band) {
      const Vec2 p = flat(scene.cloud.points[i]);
      const auto z = static_cast<double>(scene.cloud.points[i].z());
      // Where a line of this lean through the point comes out of the ground, and how far below.
      double up = static_cast<double>(scene.heights[i]);
      for (int round = 0; round < 2; ++round) up = z - ground_at(scene.ground, p - up * leans[k]);
      const Vec2 foot = p - up * leans[k];
      if (!raster.covers(foot)) continue;
      const std::size_t cell = raster.cell_of(foot);
      if (raster.empty(cell)) touched.push_back(cell);
      raster.add(cell, up);
    }
    for (const std::size_t cell : touched) {
      if (raster.empty(cell)) continue;  // touched, but too high or too low
      const int filled = filled_from_ground(raster, cell);
      if (filled == 0) continue;
      candidates.push_back({filled, k, cell, raster.centre(raster.column(cell), raster.row(cell))});
    }
    for (const std::size_t cell : touched) raster.clear(cell);
  }
  std::sort(candidates.begin(), candidates.end(),
            [](const LeaningCandidate& a, const LeaningCandidate& b) {
              return std::tuple(-a.filled, a.lean, a.cell) < std::tuple(-b.filled, b.lean, b.cell);
            });
  return candidates;
}

}  // namespace

Vec3 foot_of_stem(const Stem& stem, const Raster& ground) {
  const Vec2 foot = stem.centre_at(0);
  return {foot.x(), foot.y(), ground_at(ground, foot)};
}

std::vector<StemEvidence> take_leaning_stems(std::vector<StemEvidence>& stems,
                                             const WorkingCloud& cloud, const ColumnIndex& index,
                                             const std::vector<float>& heights,
                                             const Raster& ground, const StemConfig& config) {
  constexpr double kTried = 0.15;  // m, around a candidate that is none
  constexpr double kAlike = 0.45;  // between leans that are tried as one
  constexpr double kAsGood = 0.8;  // confidence, of that of the upright fit
  Scene scene{cloud, index, heights, ground, config, {}};
  scene.taken.assign(cloud.points.size(), 0);
  std::vector<StemEvidence> leaning;
  // Those that were found as upright ones.
  std::erase_if(stems, [&](const StemEvidence& e) {
    if (e.stem.lean.norm() < kLeaningLeast) return false;
    const auto at = [&](double h) {
      const Vec2 p = e.stem.centre_at(h);
      return Vec3(p.x(), p.y(), h + ground_at(ground, p));
    };
    const auto fitted = fit_twice(scene, {at(kBreastHeight), (at(2.2) - at(0.6)).normalized()});
    if (!fitted || !is_leaning_stem(*fitted, config) ||
        fitted->evidence.confidence() < kAsGood * e.confidence()) {
      return false;
    }
    leaning.push_back(as_evidence(*fitted));
    take_points(scene, *fitted);
    return true;
  });
  for (const StemEvidence& e : stems) {
    const Vec3 foot = foot_of_stem(e.stem, ground);
    const Axis axis{foot, Vec3(e.stem.lean.x(), e.stem.lean.y(), 1).normalized()};
    take_points(scene, {e, axis, foot, 0});
  }

  const std::vector<Vec2> leans = leans_to_try();
  const LayerRaster cells(cloud.low, cloud.high);
  std::vector<std::uint32_t> closed(cells.cells(), 0);  // a bit for each lean
  const auto close = [&](const LeaningCandidate& candidate) {
    std::uint32_t alike = 0;
    for (std::size_t k = 0; k < leans.size(); ++k) {
      alike |= std::uint32_t{(leans[k] - leans[candidate.lean]).norm() < kAlike} << k;
    }
    cells.visit(candidate.foot, kTried, [&](std::size_t cell) { closed[cell] |= alike; });
  };
  for (const LeaningCandidate& candidate : leaning_candidates(scene, leans)) {
    if ((closed[candidate.cell] >> candidate.lean & 1) != 0) continue;
    close(candidate);
    const Vec2& lean = leans[candidate.lean];
    const Vec3 foot(candidate.foot.x(), candidate.foot.y(), ground_at(ground, candidate.foot));
    const auto fitted = fit_twice(scene, {foot, Vec3(lean.x(), lean.y(), 1).normalized()});
    if (!fitted || !is_leaning_stem(*fitted, config)) continue;
    if (std::any_of(stems.begin(), stems.end(),
                    [&](const StemEvidence& e) { return is_branch_of(*fitted, e, ground); })) {
      continue;
    }
    leaning.push_back(as_evidence(*fitted));
    take_points(scene, *fitted);
  }
  return leaning;
}

}  // namespace arex
