#pragma once

#include <cmath>
#include <cstdint>

#include "worlds/reflectivity.h"
#include "worlds/world.h"

/// An underground parking garage: a walled forecourt with the start pad, a ramp down along +x, and
/// one storey of pillars, bays with parked cars, rooms, beams and services under the ceiling.
/// Source of the measures: AREX paper, scene 2 (30 degree ramp, 100 x 50 m, map from z -5 to
/// -10 m); what the paper leaves open follows common practice for garages and is named so.
namespace arex::worlds {

/// Reflectivities at the LiDAR's 905 nm. The diffuse ones are all estimates from the order of
/// published near-infrared spectra: bare concrete 0.3-0.4, asphalt 0.1-0.2, white traffic paint
/// 0.6-0.8, coated sheet metal 0.4-0.5, rubber below 0.05; glass sends most of a beam on or away.
/// Car paint spans black (carbon absorbs the near infrared as well) to white.
struct GarageReflectivity {
  double concrete = 0.35;
  double asphalt = 0.15;
  double floor_coating = 0.25;
  double marking = 0.70;
  double plaster = 0.55;
  double safety_paint = 0.60;
  double door = 0.42;
  double metal = 0.45;
  double glass = 0.06;
  double rubber = 0.04;
  double car_darkest = 0.05;
  double car_brightest = 0.75;
  double number_plate = kNumberPlateReflectivity;
  double sign = kSignReflectivity;
  double warning_strip = kWarningStripReflectivity;

  void fields(auto& f) {
    f("concrete", concrete, "slabs, pillars, beams, outer walls (estimate)");
    f("asphalt", asphalt, "forecourt (estimate)");
    f("floor_coating", floor_coating, "the storey's floor and the ramp (estimate)");
    f("marking", marking, "painted lines (estimate)");
    f("plaster", plaster, "walls of rooms (estimate)");
    f("safety_paint", safety_paint, "corner guards, bollards, wheel stops (estimate)");
    f("door", door, "doors (estimate)");
    f("metal", metal, "pipes, ducts, lamps, cabinets (estimate)");
    f("glass", glass, "car windows (estimate)");
    f("rubber", rubber, "tyres (estimate)");
    f("car_darkest", car_darkest, "darkest car paint (estimate)");
    f("car_brightest", car_brightest, "brightest car paint (estimate)");
    f("number_plate", number_plate, "of cars; above 1: times a perfect diffuse reflector");
    f("sign", sign, "direction signs; above 1: times a perfect diffuse reflector");
    f("warning_strip", warning_strip, "round pillars; above 1: times a perfect diffuse reflector");
    const auto retro = [](double value) { return value > 0 && value <= kGreatestReflectivity; };
    f.check(retro(number_plate), "0 < number_plate <= 1000");
    f.check(retro(sign), "0 < sign <= 1000");
    f.check(retro(warning_strip), "0 < warning_strip <= 1000");
    const auto valid = [](double value) { return value > 0 && value <= 1; };
    f.check(valid(concrete), "0 < concrete <= 1");
    f.check(valid(asphalt), "0 < asphalt <= 1");
    f.check(valid(floor_coating), "0 < floor_coating <= 1");
    f.check(valid(marking), "0 < marking <= 1");
    f.check(valid(plaster), "0 < plaster <= 1");
    f.check(valid(safety_paint), "0 < safety_paint <= 1");
    f.check(valid(door), "0 < door <= 1");
    f.check(valid(metal), "0 < metal <= 1");
    f.check(valid(glass), "0 < glass <= 1");
    f.check(valid(rubber), "0 < rubber <= 1");
    f.check(valid(car_darkest), "0 < car_darkest <= 1");
    f.check(car_brightest >= car_darkest && car_brightest <= 1,
            "car_darkest <= car_brightest <= 1");
  }
};

struct GarageRecipe {
  double length_m = 100.0;
  double width_m = 50.0;
  double floor_z_m = -8.5;
  double ceiling_z_m = -5.0;
  double ramp_angle_deg = 30.0;
  double ramp_width_m = 6.0;
  double pillar_spacing_m = 8.0;
  double pillar_width_m = 0.6;
  double beam_depth_m = 0.5;
  double bay_depth_m = 5.0;
  double bay_width_m = 2.45;
  double aisle_width_m = 6.0;
  double occupancy_fraction = 0.55;
  int rooms = 7;
  double open_door_fraction = 0.6;
  double door_width_m = 1.4;
  double door_height_m = 2.2;
  int service_runs = 9;
  GarageReflectivity reflectivity;

  /// The hall, along x and y from the start, m.
  [[nodiscard]] Eigen::AlignedBox2d extent() const {
    return {Vec2(0, -0.5 * width_m), Vec2(length_m, 0.5 * width_m)};
  }
  /// The storey, not the air over its roof.
  void limit_reach(Bounds& region) const { region.high.z() = ceiling_z_m; }

  void fields(auto& f) {
    f("length_m", length_m, "hall along x, from the start (paper, second scene)");
    f("width_m", width_m, "hall along y, centred on the start (paper, second scene)");
    f("floor_z_m", floor_z_m, "height of the floor below the start (within the paper's map band)");
    f("ceiling_z_m", ceiling_z_m, "height of the ceiling's underside (top of the paper's band)");
    f("ramp_angle_deg", ramp_angle_deg, "slope of the entrance ramp (paper, second scene)");
    f("ramp_width_m", ramp_width_m, "ramp between its walls: two lanes of 3 m");
    f("pillar_spacing_m", pillar_spacing_m, "pillar grid, x and y: three bays and a pillar");
    f("pillar_width_m", pillar_width_m, "side of a square pillar");
    f("beam_depth_m", beam_depth_m, "downstand of the main beams below the ceiling");
    f("bay_depth_m", bay_depth_m, "parking bay, along the car (common practice)");
    f("bay_width_m", bay_width_m, "parking bay, across the car (common practice)");
    f("aisle_width_m", aisle_width_m, "least width of a driving aisle (common practice)");
    f("occupancy_fraction", occupancy_fraction, "probability that a bay holds a car");
    f("rooms", rooms, "interior rooms at most; the first stands open, the second is shut");
    f("open_door_fraction", open_door_fraction, "probability that a further room stands open");
    f("door_width_m", door_width_m, "clear width of a room's doorway");
    f("door_height_m", door_height_m, "clear height of a room's doorway");
    f("service_runs", service_runs, "pipes, ducts and cable trays along the hall, at most");
    f("reflectivity", reflectivity, "reflectivities at 905 nm");
    check_sizes(f);
  }

  void check_sizes(auto& f) const {
    f.check(length_m >= 50 && length_m <= 300, "50 <= length_m <= 300");
    f.check(width_m >= 30 && width_m <= 150, "30 <= width_m <= 150");
    f.check(ceiling_z_m <= -3 && ceiling_z_m >= -10, "-10 <= ceiling_z_m <= -3");
    f.check(ceiling_z_m - floor_z_m >= 2.8 && ceiling_z_m - floor_z_m <= 6,
            "2.8 <= ceiling_z_m - floor_z_m <= 6");
    f.check(ramp_angle_deg >= 15 && ramp_angle_deg <= 40, "15 <= ramp_angle_deg <= 40");
    f.check(-floor_z_m <= 0.4 * length_m * std::tan(to_radians(ramp_angle_deg)),
            "the ramp ends within 0.4 of length_m: -floor_z_m <= 0.4 length_m tan(ramp_angle_deg)");
    f.check(ramp_width_m >= 3 && ramp_width_m <= 10, "3 <= ramp_width_m <= 10");
    f.check(pillar_width_m >= 0.2 && pillar_width_m <= 1.5, "0.2 <= pillar_width_m <= 1.5");
    f.check(pillar_spacing_m >= ramp_width_m + pillar_width_m + 1 && pillar_spacing_m <= 12,
            "ramp_width_m + pillar_width_m + 1 <= pillar_spacing_m <= 12");
    f.check(beam_depth_m >= 0.2 && beam_depth_m <= 0.25 * (ceiling_z_m - floor_z_m),
            "0.2 <= beam_depth_m <= a quarter of the storey");
    f.check(bay_depth_m >= 4.5 && bay_depth_m <= 6, "4.5 <= bay_depth_m <= 6");
    f.check(bay_width_m >= 2.3 && bay_width_m <= 4, "2.3 <= bay_width_m <= 4");
    f.check(aisle_width_m >= 4 && aisle_width_m <= 12, "4 <= aisle_width_m <= 12");
    f.check(occupancy_fraction >= 0 && occupancy_fraction <= 1, "0 <= occupancy_fraction <= 1");
    f.check(rooms >= 0 && rooms <= 100, "0 <= rooms <= 100");
    f.check(open_door_fraction >= 0 && open_door_fraction <= 1, "0 <= open_door_fraction <= 1");
    f.check(door_width_m >= 1.2 && door_width_m <= 2.5, "1.2 <= door_width_m <= 2.5");
    f.check(door_height_m >= 1.9 && door_height_m <= ceiling_z_m - floor_z_m - 0.3,
            "1.9 <= door_height_m, 0.3 below the ceiling");
    f.check(service_runs >= 0 && service_runs <= 40, "0 <= service_runs <= 40");
  }
};

/// The world of a recipe. Everything random (rooms, doors, cars, pipe runs) comes from the seed;
/// World::terrain is empty, the ground is made of shapes. @pre the recipe's checks hold.
World build(const GarageRecipe& recipe, std::uint64_t seed);

}  // namespace arex::worlds
