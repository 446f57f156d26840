#pragma once

#include <vector>

#include "semantics/level_surfaces.h"
#include "semantics/plan_shapes.h"

namespace arex {

/// One visible face of a wall.
struct WallFace {
  Vec2 a = Vec2::Zero(), b = Vec2::Zero();  ///< its ends seen from above, m
  double low = 0, high = 0;                 ///< heights that it reaches over, z
  double base_z = 0;                        ///< of the floor beside it
  int points = 0;                           ///< in the band

  [[nodiscard]] double length() const { return (b - a).norm(); }
  [[nodiscard]] Vec2 along() const { return (b - a) / length(); }
  [[nodiscard]] Vec2 normal() const { return {-along().y(), along().x()}; }
  /// Distance of a point from the segment, from above.
  [[nodiscard]] double distance(const Vec2& p) const {
    const double t = std::clamp((p - a).dot(along()), 0.0, length());
    return (p - a - t * along()).norm();
  }
};

struct Pillar {
  Rectangle box;
  double base_z = 0, top_z = 0;
  bool attached = false;  ///< it stands in or at a wall; the box's depth is a guess
  int points = 0;         ///< in the band
};

struct UprightStructure {
  std::vector<WallFace> walls;
  std::vector<Pillar> pillars;
};

/// Walls and pillars: what fills the band above cars and doors and below beams and pipes.
///
/// Wall faces grow along the local direction of the band's points, seen from above, over gaps up to
/// 1 m, and are lines through what they took (least squares), covered to 60 % and over 1 m without
/// a gap at least, that go on below the band: a pillar's side in line with a pipe is no wall. What
/// is left falls into clusters (PCL); a compact one that fills the band's height and reaches from
/// the ceiling, if there is one, down is a pillar. Where walls meet in a pillar, each piece of it
/// between them shows a corner: the square with that corner whose outline the band's points fill
/// best is the pillar. One that only sticks out of a wall is taken to be as deep as it is wide.
UprightStructure find_upright_structure(const WorkingCloud& cloud, const Clearances& clearances,
                                        const GarageConfig& config);

}  // namespace arex
