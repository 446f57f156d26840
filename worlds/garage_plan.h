#pragma once

#include <cstdint>
#include <vector>

#include "worlds/garage.h"
#include "worlds/garage_car.h"

/// Where everything in a garage stands: all of its random decisions, before any triangle.
///
/// Across the hall, from the centre aisle (in line with the ramp) outwards: two rows of bays back
/// to back and an aisle, as often as they fit, and a row along each side wall. Along the hall, the
/// pillar columns cut the rows into cells; a cell holds bays or a room, or is a cross aisle.
namespace arex::worlds {

struct Interval {
  double low = 0;
  double high = 0;
  [[nodiscard]] double middle() const { return 0.5 * (low + high); }
  [[nodiscard]] double length() const { return high - low; }
};

struct GarageRoom {
  Interval x, y;         ///< centre lines of its walls, m; at_wall, the back is that wall's face
  bool at_wall = false;  ///< the hall's side wall or the ramp's closes its back
  bool open = true;
  Vec2 door = Vec2::Zero();      ///< middle of the doorway, on a wall's centre line
  Vec2 outward = Vec2::UnitY();  ///< from the door into the hall
};

struct GarageBay {
  Vec2 centre = Vec2::Zero();
  Vec2 inward = Vec2::UnitY();  ///< unit vector from the aisle to the bay's back
  double width = 0;             ///< m
};

struct ParkedCar {
  CarKind kind = CarKind::kSedan;
  Vec2 centre = Vec2::Zero();
  double yaw_rad = 0;
  double reflectivity = 0.4;
};

struct ServiceRun {
  enum class Kind : std::uint8_t { kPipe, kDuct, kTray };
  Kind kind = Kind::kPipe;
  double y = 0;
  Interval x;
  double radius = 0.05;  ///< of a pipe, m
};

struct GaragePlan {
  double crest_x = 0;   ///< the ramp's upper edge, at ground level
  double foot_x = 0;    ///< the ramp's lower edge, on the floor
  double portal_x = 0;  ///< the roof over the ramp begins here
  Interval hall_x, hall_y;
  Interval shaft_y;  ///< the ramp between its walls' outer faces; x from the hall's to foot_x
  std::vector<double> column_x, row_y;  ///< the pillar grid
  std::vector<double> aisle_y;          ///< centre lines of the driving aisles
  std::vector<Interval> blocks;         ///< along x: what the cross aisles leave of the middle rows
  std::vector<Interval> bands;          ///< along y: the middle rows, two bays deep
  std::vector<GarageRoom> rooms;
  std::vector<GarageBay> bays;
  std::vector<ParkedCar> cars;
  std::vector<ServiceRun> services;
};

inline constexpr double kGarageWall = 0.2;  ///< thickness of every wall, m

/// @pre the recipe's checks hold.
GaragePlan plan_garage(const GarageRecipe& recipe, std::uint64_t seed);

}  // namespace arex::worlds
