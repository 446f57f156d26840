#include <algorithm>
#include <array>
#include <cmath>

#include "math/so3.h"
#include "worlds/garage_parts.h"

namespace arex::worlds::garage {
namespace {

constexpr double kLineHalf = 0.05;    // half width of a painted line, m
constexpr double kLeaf = 0.05;        // thickness of a door leaf, m
constexpr double kKerbHeight = 0.12;  // m

/// A flat rectangle of paint on the floor.
void add_paint(const Site& site, std::uint32_t object, const Vec2& low, const Vec2& high) {
  const double z = site.recipe.floor_z_m + kMark;
  site.mesh.add_quad(object, {low.x(), low.y(), z}, {high.x(), low.y(), z}, {high.x(), high.y(), z},
                     {low.x(), high.y(), z});
}

/// A wall along x on the centre line y, with a doorway about door_x if `door`.
void add_wall_along_x(const Site& site, std::uint32_t object, const GarageRoom& room, double y,
                      bool door) {
  const double z0 = site.recipe.floor_z_m, z1 = site.recipe.ceiling_z_m;
  const auto add = [&](double a, double b, double low) {
    add_tiled_box(site.mesh, object,
                  {{a, y - 0.5 * kGarageWall, low}, {b, y + 0.5 * kGarageWall, z1}});
  };
  const double x0 = room.x.low - 0.5 * kGarageWall, x1 = room.x.high + 0.5 * kGarageWall;
  if (!door) return add(x0, x1, z0);
  const double left = room.door.x() - 0.5 * site.recipe.door_width_m;
  const double right = room.door.x() + 0.5 * site.recipe.door_width_m;
  add(x0, left, z0);
  add(right, x1, z0);
  add(left, right, z0 + site.recipe.door_height_m);
}

/// The leaf, shut in the doorway or swung into the room, and the frame on the hall's side.
void add_door(const Site& site, const GarageRoom& room) {
  const GarageRecipe& recipe = site.recipe;
  const double z0 = recipe.floor_z_m, z1 = z0 + recipe.door_height_m;
  const double left = room.door.x() - 0.5 * recipe.door_width_m;
  const double right = room.door.x() + 0.5 * recipe.door_width_m;
  const double y = room.door.y(), out = room.outward.y();
  const auto door = site.add(SurfaceClass::kDoor, recipe.reflectivity.door);
  if (room.open) {
    const double hinge = y - out * 0.5 * kGarageWall, tip = hinge - out * recipe.door_width_m;
    add_small_box(site.mesh, door,
                  {{left - kLeaf, std::min(hinge, tip), z0}, {left, std::max(hinge, tip), z1}});
  } else {
    add_small_box(site.mesh, door, {{left, y - 0.5 * kLeaf, z0}, {right, y + 0.5 * kLeaf, z1}});
  }
  constexpr double kFrame = 0.08, kProud = 0.02;  // m
  const auto frame = site.add(SurfaceClass::kDoor, recipe.reflectivity.metal);
  const double face = y + out * 0.5 * kGarageWall, front = face + out * kProud;
  const auto trim = [&](double a, double b, double low, double high) {
    const Box box{{a, std::min(face, front), low}, {b, std::max(face, front), high}};
    site.mesh.add_box(frame, box.pose(), box.half());
  };
  trim(left - kFrame, left, z0, z1);
  trim(right, right + kFrame, z0, z1);
  trim(left - kFrame, right + kFrame, z1, z1 + kFrame);
}

/// Switch cabinets along the wall opposite the door, and a tank in a corner.
void add_equipment(const Site& site, const GarageRoom& room) {
  constexpr double kDeep = 0.6, kWide = 0.8, kTall = 2.0, kJoint = 0.02, kOff = 0.15;  // m
  constexpr double kTank = 0.5, kTankHalf = 0.9;                                       // m
  const double z0 = site.recipe.floor_z_m;
  const double inward = -room.outward.y();
  const double back = (inward > 0 ? room.y.high : room.y.low) - inward * (0.5 * kGarageWall + kOff);
  const double front = back - inward * kDeep;
  const double start = room.x.low + 0.5 * site.recipe.pillar_width_m + kOff;
  const double tank_low = room.x.high - 0.5 * site.recipe.pillar_width_m - kOff - 2 * kTank;
  for (int i = 0; i < 4; ++i) {
    const double x = start + i * (kWide + kJoint);
    if (x + kWide > tank_low) break;
    add_small_box(site.mesh, site.add(SurfaceClass::kPipe, site.recipe.reflectivity.metal),
                  {{x, std::min(back, front), z0}, {x + kWide, std::max(back, front), z0 + kTall}});
  }
  const Pose X_WP{Mat3::Identity(), Vec3(tank_low + kTank, back - inward * kTank, z0 + kTankHalf)};
  site.mesh.add_solid_cylinder(site.add(SurfaceClass::kPipe, site.recipe.reflectivity.metal), X_WP,
                               kTank, kTankHalf, 16);
}

void add_room(const Site& site, const GarageRoom& room) {
  const auto walls = site.add(SurfaceClass::kWall, site.recipe.reflectivity.plaster);
  for (const double y : {room.y.low, room.y.high}) {
    const bool front = y == room.door.y();
    if (front || !room.at_wall) add_wall_along_x(site, walls, room, y, front);
  }
  const double z0 = site.recipe.floor_z_m, z1 = site.recipe.ceiling_z_m;
  for (const double x : {room.x.low, room.x.high}) {
    // A wall shared by two rooms belongs to the one on its left.
    const bool shared =
        x == room.x.low &&
        std::any_of(site.plan.rooms.begin(), site.plan.rooms.end(), [&](const GarageRoom& other) {
          return other.x.high == x && other.y.low == room.y.low;
        });
    if (shared) continue;
    add_tiled_box(
        site.mesh, walls,
        {{x - 0.5 * kGarageWall, room.y.low, z0}, {x + 0.5 * kGarageWall, room.y.high, z1}});
  }
  add_door(site, room);
  add_equipment(site, room);
}

void add_bay(const Site& site, const GarageBay& bay) {
  constexpr double kStopFromBack = 0.75, kStopLong = 0.85, kStopHalf = 0.07, kStopHigh = 0.1;  // m
  const double depth = site.recipe.bay_depth_m;
  const auto lines = site.add(SurfaceClass::kFloor, site.recipe.reflectivity.marking);
  const auto has_neighbour = [&](double side) {
    const Vec2 other = bay.centre + Vec2(side * bay.width, 0);
    return std::any_of(
        site.plan.bays.begin(), site.plan.bays.end(),
        [&](const GarageBay& candidate) { return (candidate.centre - other).norm() < 0.01; });
  };
  for (const double side : {-1.0, 1.0}) {
    if (side < 0 && has_neighbour(side)) continue;  // the neighbour's right line is this one's left
    const double x = bay.centre.x() + 0.5 * side * bay.width;
    add_paint(site, lines, {x - kLineHalf, bay.centre.y() - 0.48 * depth},
              {x + kLineHalf, bay.centre.y() + 0.48 * depth});
  }
  const Vec2 stop = bay.centre + (0.5 * depth - kStopFromBack) * bay.inward;
  const double z0 = site.recipe.floor_z_m;
  add_small_box(site.mesh, site.add(SurfaceClass::kKerb, site.recipe.reflectivity.safety_paint),
                {{stop.x() - kStopLong, stop.y() - kStopHalf, z0},
                 {stop.x() + kStopLong, stop.y() + kStopHalf, z0 + kStopHigh}});
}

/// Raised islands at the ends of the middle rows, about the pillars that stand there.
void add_islands(const Site& site) {
  constexpr double kOut = 0.9, kIn = 0.25, kInset = 0.3;  // from the column and the rows' edges, m
  const double z0 = site.recipe.floor_z_m;
  for (const Interval& block : site.plan.blocks) {
    for (const Interval& band : site.plan.bands) {
      for (const double side : {-1.0, 1.0}) {
        const double a = side * (band.low + kInset), b = side * (band.high - kInset);
        const auto add = [&](double x0, double x1) {
          const auto kerb = site.add(SurfaceClass::kKerb, site.recipe.reflectivity.concrete);
          add_tiled_box(site.mesh, kerb,
                        {{x0, std::min(a, b), z0}, {x1, std::max(a, b), z0 + kKerbHeight}});
        };
        add(block.low - kOut, block.low + kIn);
        add(block.high - kIn, block.high + kOut);
      }
    }
  }
}

/// Arrows along the aisles and a zebra crossing at the ramp's foot.
void add_road_markings(const Site& site) {
  constexpr double kSpacing = 12.0, kShaft = 1.6, kHead = 1.0, kHeadHalf = 0.4;  // m
  const GaragePlan& plan = site.plan;
  const auto paint = site.add(SurfaceClass::kFloor, site.recipe.reflectivity.marking);
  const double z = site.recipe.floor_z_m + kMark;
  for (const double y : plan.aisle_y) {
    // Right-hand traffic has one lane each way in the centre, and one way round the outside.
    const double along = y < 0 ? -1 : 1;
    const double start = y == 0 ? plan.foot_x + 6.0 : plan.hall_x.low + 6.0;
    for (double x = start; x < plan.hall_x.high - 4; x += kSpacing) {
      const double tail = x - along * kShaft;
      add_paint(site, paint, {std::min(x, tail), y - kLineHalf},
                {std::max(x, tail), y + kLineHalf});
      site.mesh.add_triangle(paint, {x, y - kHeadHalf, z}, {x, y + kHeadHalf, z},
                             {x + along * kHead, y, z});
    }
  }
  constexpr double kZebraFrom = 1.2, kZebraLong = 2.5, kBar = 0.5;  // m
  for (double y = -0.5 * site.recipe.ramp_width_m; y + kBar <= 0.5 * site.recipe.ramp_width_m;
       y += 2 * kBar) {
    add_paint(site, paint, {plan.foot_x + kZebraFrom, y},
              {plan.foot_x + kZebraFrom + kZebraLong, y + kBar});
  }
}

}  // namespace

void add_rooms(const Site& site) {
  for (const GarageRoom& room : site.plan.rooms) add_room(site, room);
}

void add_bays(const Site& site) {
  for (const GarageBay& bay : site.plan.bays) add_bay(site, bay);
  add_islands(site);
  add_road_markings(site);
  for (const ParkedCar& car : site.plan.cars) {
    const Pose X_WC{so3::from_yaw(car.yaw_rad),
                    Vec3(car.centre.x(), car.centre.y(), site.recipe.floor_z_m)};
    add_car(site.mesh, car.kind, X_WC,
            {car.reflectivity, site.recipe.reflectivity.glass, site.recipe.reflectivity.rubber,
             site.recipe.reflectivity.number_plate});
  }
}

}  // namespace arex::worlds::garage
