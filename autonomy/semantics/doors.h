#pragma once

#include <vector>

#include "semantics/upright_structure.h"

namespace arex {

struct Door {
  Vec2 centre = Vec2::Zero();
  double width = 0;
  double height = 0;
  double yaw_rad = 0;  ///< along the wall
  double base_z = 0;
  bool open = false;
};

/// Doors in wall faces, which are known from above the doors' heads: over 0.7 to 3 m of a wall's
/// length, from the floor to 1.8 to 2.5 m, either a leaf stands before or behind the face by 2.5 to
/// 18 cm (shut), or there is nothing at the face but something behind it (open). What sticks out at
/// a pillar is no door.
std::vector<Door> find_doors(const WorkingCloud& cloud, const Clearances& clearances,
                             const UprightStructure& structure);

}  // namespace arex
