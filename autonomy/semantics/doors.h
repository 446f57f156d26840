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

/// Doors in wall faces, which are known from above the doors' heads: over 0.75 to 3 m of a wall's
/// length, below a lintel and with wall on both sides, either a leaf stands before or behind the
/// wall around it by 2 to 18 cm (shut), or there is nothing at the face and the floor goes through
/// (open): where something hides a wall, it hides the floor at its foot, too. What sticks out at a
/// pillar is no door.
std::vector<Door> find_doors(const WorkingCloud& cloud, const Clearances& clearances,
                             const UprightStructure& structure);

}  // namespace arex
