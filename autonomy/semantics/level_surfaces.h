#pragma once

#include <span>
#include <vector>

#include "semantics/raster.h"
#include "semantics/semantic_config.h"
#include "semantics/working_cloud.h"

namespace arex {

/// A floor or ceiling: one height in each cell seen from above. Storeys above each other are
/// surfaces of their own; a ramp is part of the floor that it leads to.
struct LevelSurface {
  enum class Kind : std::uint8_t { kFloor, kCeiling };
  Kind kind = Kind::kFloor;
  Raster height;                   ///< NaN where it is not
  std::vector<std::uint8_t> seen;  ///< per cell: 1 where it has points, 0 where it was filled in
  double area_m2 = 0;              ///< of the cells with points
};

/// The level surfaces of a building.
///
/// In each column of 0.25 m, points that lie close above each other form a group; a thin group may
/// be a piece of a level surface. Pieces grow together with neighbours that the greatest slope
/// allows. A surface is a floor if more stands on it than hangs below it, up to head height: cars
/// and pillars on the one side, beams and pipes on the other. What is hidden below things is filled
/// in: half a metre all around, holes that have the surface on three sides within 6 m, and of a
/// floor up to 3 m more below what stands beside it. Nothing that is nowhere 1.25 m wide is a level
/// surface: ducts, trays and beams are not.
/// @param path where the vehicle was; a surface below it is floor, one above it ceiling
std::vector<LevelSurface> find_level_surfaces(const WorkingCloud& cloud,
                                              std::span<const Vec3f> path,
                                              const GarageConfig& config);

/// Heights of the points above the highest floor below them (NaN: none), and below the lowest
/// ceiling above that floor (infinite: none).
struct Clearances {
  std::vector<float> above_floor;
  std::vector<float> room;             ///< floor to ceiling at the point's place, m
  std::vector<std::int16_t> floor_of;  ///< index of the floor in the surfaces, -1: none
};
Clearances measure_clearances(const WorkingCloud& cloud, const std::vector<LevelSurface>& surfaces);

/// Slope of a surface over a metre around each of its cells, rad; NaN where too little was seen.
Raster slopes_of(const LevelSurface& surface);

}  // namespace arex
