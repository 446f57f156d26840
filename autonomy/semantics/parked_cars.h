#pragma once

#include <vector>

#include "semantics/upright_structure.h"

namespace arex {

struct ParkedCar {
  Rectangle box;      ///< its length along the car
  double base_z = 0;  ///< of the floor
  double height = 0;  ///< above it
  bool whole = true;  ///< false: one dimension is a guess
  int points = 0;
};

/// Cars on the floors: clusters (PCL) of what stands 0.25 to 1 m above a floor away from walls and
/// pillars, each with the rectangle that its outline fits best (L-shape fitting), if a car has
/// such a size and it is no cabinet, as deep above a car's doors as below. Clusters of several cars
/// are cut where they are thin. Of a car of which one end or half is seen, the box is completed to
/// 4.5 m, away from the viewer. Of two that stand in each other the one that shows more is kept.
/// @param path where the vehicle was: on whose side of a car the seen end is; may be empty
std::vector<ParkedCar> find_cars(const WorkingCloud& cloud, const Clearances& clearances,
                                 const UprightStructure& structure, std::span<const Vec3f> path,
                                 const GarageConfig& config);

}  // namespace arex
