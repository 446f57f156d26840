#pragma once

#include <array>
#include <cstddef>
#include <limits>
#include <string_view>
#include <vector>

#include "math/pose.h"
#include "scoring/figures.h"
#include "semantics/semantic_map.h"
#include "worlds/world.h"

namespace arex::sim {

struct SemanticScoreConfig {
  double near_m = 0.1;
  double mapped_fraction = 0.3;
  double sized_fraction = 0.5;

  void fields(auto& f) {
    f("near_m", near_m, "a true surface sample is mapped where a map point is this near");
    f("mapped_fraction", mapped_fraction,
      "a true object counts where this share of its samples is mapped");
    f("sized_fraction", sized_fraction, "and its size where this share is");
    f.check(near_m > 0 && near_m <= 1, "0 < near_m <= 1");
    f.check(mapped_fraction > 0 && mapped_fraction <= 1, "0 < mapped_fraction <= 1");
    f.check(sized_fraction > 0 && sized_fraction <= 1, "0 < sized_fraction <= 1");
  }
};

/// The score of one class. Not a number: there was nothing to measure.
struct ClassScore {
  static constexpr double kUnknown = std::numeric_limits<double>::quiet_NaN();
  double precision = kUnknown;          ///< of what was found, the share that is there
  double recall = kUnknown;             ///< of what is there and was mapped, the share found
  double f1 = kUnknown;                 ///< their harmonic mean
  double position_median_m = kUnknown;  ///< of what was found rightly
  double size_median_m = kUnknown;      ///< error, of what was seen well enough
  std::size_t found = 0, right = 0, mapped = 0, sized = 0;
};

/// Classes of objects that are scored, in the summary's order.
inline constexpr std::array kScoredClasses{SemanticClass::kTrunk, SemanticClass::kPillar,
                                           SemanticClass::kCar,   SemanticClass::kWall,
                                           SemanticClass::kRamp,  SemanticClass::kDoor};

/// A true object as a semantic map should name it, in W.
struct TrueObject {
  SemanticClass kind = SemanticClass::kOther;
  Vec2 position = Vec2::Zero();
  double size = 0;             ///< what size_median_m compares, m
  double mapped_fraction = 0;  ///< of its surface
  bool counts = true;          ///< false: finding it is neither right nor wrong
};

struct SemanticScore {
  std::array<ClassScore, kScoredClasses.size()> classes;
  std::vector<TrueObject> truth;  ///< every true object of the scored classes but walls

  [[nodiscard]] const ClassScore& of(SemanticClass kind) const;
};

/// Sets the figures `semantic.CLASS.*`.
void add_figures(const SemanticScore& score, Figures& figures);

/// Compares a semantic map with the world, over what was mapped.
///
/// A true object's surface is sampled evenly, one sample per 4 cm square: of trunks what lies 0.4
/// to 3 m above the ground; of pillars, doors and cars what is not level and stands more than 0.3 m
/// above their feet; of the ramp its upper face. The share of the samples that have a map point
/// within near_m is how much of it was mapped: from mapped_fraction on, the object counts. Found
/// objects and true ones are paired one to one, the nearest first, up to 0.3 m (trunk), 0.5 m
/// (pillar), 1 m (door), 1.5 m (car) or 4 m (ramp) apart, horizontally. A true object that counts
/// and has no partner lowers the recall, a found one without a partner the precision; one that is
/// paired with what does not count is left out. Pilasters, pillars that stick out of a wall by less
/// than half of their width, never count: they may be called pillars or not.
///
/// Positions are compared at breast height (trunk) or at the box's middle. Sizes are the diameter
/// by the tape, girth over pi, 1.3 m above the ground (trunk), the longer side of the box seen from
/// above (pillar, car, ramp) and the width (door); they are compared where sized_fraction of the
/// surface was mapped.
///
/// Walls are no countable objects: their precision is the share of the found walls' length that
/// has a true wall, door or pillar within 0.15 m, their recall the share of the mapped true wall
/// samples within 0.2 m of a found wall, and the position error is the distance of the found
/// walls' faces from true surfaces.
///
/// @param cloud_O the cloud that the map was made from; @param X_WO O in W
SemanticScore score_semantics(const SemanticMap& map, const std::vector<Vec3f>& cloud_O,
                              const Pose& X_WO, const worlds::World& world,
                              const SemanticScoreConfig& config = {});

}  // namespace arex::sim
