#include "worlds/garage_plan.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <numbers>
#include <utility>

#include "math/random.h"

namespace arex::worlds {
namespace {

constexpr double kApron = 2.0;        // level ground between the start and the ramp, m
constexpr double kSoffit = 0.6;       // of the portal, below the ground: a slab and its finish, m
constexpr double kLeastRoom = 3.5;    // a shallower cell stays a row of bays, m
constexpr double kTurningRoom = 5.0;  // clear length at the ramp's foot, m

/// A cell of the pillar grid that a room may fill.
struct Slot {
  Interval x, y;
  bool at_wall = false;
  double outward = 0;  // the only side a door may be on, along y; 0 if both will do
};

void plan_hall(const GarageRecipe& recipe, GaragePlan& plan) {
  const double slope = std::tan(to_radians(recipe.ramp_angle_deg));
  const double storey = recipe.ceiling_z_m - recipe.floor_z_m;
  plan.crest_x = kApron;
  plan.foot_x = kApron - recipe.floor_z_m / slope;
  // The roof runs one storey above the ramp, straight up, and ends where it would reach the ground.
  plan.portal_x = kApron + (storey + kSoffit) / slope;
  plan.hall_x = {0, recipe.length_m};
  plan.hall_y = {-0.5 * recipe.width_m, 0.5 * recipe.width_m};
  plan.shaft_y = {-0.5 * recipe.ramp_width_m - kGarageWall,
                  0.5 * recipe.ramp_width_m + kGarageWall};

  const double pitch = recipe.pillar_spacing_m;
  // An aisle is left along each end wall.
  const double gridded = recipe.length_m - 2 * recipe.aisle_width_m;
  const int columns = static_cast<int>(std::floor(gridded / pitch + 1e-9)) + 1;
  const double first = 0.5 * (recipe.length_m - (columns - 1) * pitch);
  for (int i = 0; i < columns; ++i) plan.column_x.push_back(first + i * pitch);
  for (double y = 0.5 * pitch; y < plan.hall_y.high - 1.0; y += pitch) plan.row_y.push_back(y);
  for (std::size_t i = 0, n = plan.row_y.size(); i < n; ++i) plan.row_y.push_back(-plan.row_y[i]);
  std::sort(plan.row_y.begin(), plan.row_y.end());
}

/// Bands of two bays back to back while another aisle and the wall's own row still fit beside them.
void plan_bands(const GarageRecipe& recipe, GaragePlan& plan) {
  const double wall_row = plan.hall_y.high - recipe.bay_depth_m;
  double edge = 0.5 * std::max(recipe.ramp_width_m, recipe.aisle_width_m);
  plan.aisle_y.push_back(0);
  while (edge + 2 * recipe.bay_depth_m + recipe.aisle_width_m <= wall_row) {
    plan.bands.push_back({edge, edge + 2 * recipe.bay_depth_m});
    edge = plan.bands.back().high + recipe.aisle_width_m;
  }
  for (std::size_t i = 0; i < plan.bands.size(); ++i) {
    const bool last = i + 1 == plan.bands.size();
    const double beyond = last ? wall_row : plan.bands[i + 1].low;
    const double centre = 0.5 * (plan.bands[i].high + beyond);
    plan.aisle_y.insert(plan.aisle_y.end(), {centre, -centre});
  }
}

/// Cells of the middle rows past the ramp, a cross aisle after the ramp's foot and one halfway.
void plan_blocks(GaragePlan& plan) {
  std::vector<Interval> cells;
  for (std::size_t i = 0; i + 1 < plan.column_x.size(); ++i) {
    if (plan.column_x[i] >= plan.foot_x + kTurningRoom) {
      cells.push_back({plan.column_x[i], plan.column_x[i + 1]});
    }
  }
  const std::size_t half = cells.size() / 2;
  if (half > 0) plan.blocks.push_back({cells.front().low, cells[half].low});
  if (half + 1 < cells.size()) plan.blocks.push_back({cells[half].high, cells.back().high});
}

bool in_block(const GaragePlan& plan, const Interval& x) {
  return std::any_of(plan.blocks.begin(), plan.blocks.end(), [&](const Interval& block) {
    return x.low >= block.low - 1e-9 && x.high <= block.high + 1e-9;
  });
}

/// Every cell of the pillar grid that a room may fill without standing in an aisle.
std::vector<Slot> room_slots(const GarageRecipe& recipe, const GaragePlan& plan) {
  std::vector<Slot> slots;
  const double inner_row = 0.5 * recipe.pillar_spacing_m;
  for (std::size_t i = 0; i + 1 < plan.column_x.size(); ++i) {
    const Interval x{plan.column_x[i], plan.column_x[i + 1]};
    const bool beside_ramp = x.high <= plan.foot_x;
    for (std::size_t j = 0; j + 1 < plan.row_y.size(); ++j) {
      const Interval y{plan.row_y[j], plan.row_y[j + 1]};
      const double inner = std::min(std::abs(y.low), std::abs(y.high));
      const double outer = std::max(std::abs(y.low), std::abs(y.high));
      for (const Interval& band : plan.bands) {
        const bool fits = y.low * y.high > 0 && inner >= band.low && outer <= band.high;
        if (fits && in_block(plan, x)) slots.push_back({x, y, false, 0});
        // Beside the ramp the room reaches its wall: no gap that is too narrow to fly.
        if (fits && beside_ramp && inner == inner_row) {
          slots.push_back(y.low > 0 ? Slot{x, {plan.shaft_y.high, y.high}, true, 1}
                                    : Slot{x, {y.low, plan.shaft_y.low}, true, -1});
        }
      }
    }
    const double depth = plan.hall_y.high - plan.row_y.back();
    if (depth >= kLeastRoom && depth <= recipe.bay_depth_m + 1e-9) {
      slots.push_back({x, {plan.hall_y.low, plan.row_y.front()}, true, 1});
      slots.push_back({x, {plan.row_y.back(), plan.hall_y.high}, true, -1});
    }
  }
  return slots;
}

void plan_rooms(const GarageRecipe& recipe, RandomStream random, GaragePlan& plan) {
  std::vector<Slot> slots = room_slots(recipe, plan);
  const int count = std::min(recipe.rooms, static_cast<int>(slots.size()));
  for (int i = 0; i < count; ++i) {
    const int pick = random.uniform_int(i, static_cast<int>(slots.size()) - 1);
    std::swap(slots[static_cast<std::size_t>(i)], slots[static_cast<std::size_t>(pick)]);
    const Slot& slot = slots[static_cast<std::size_t>(i)];
    GarageRoom room{slot.x, slot.y, slot.at_wall, true, Vec2::Zero(), Vec2::UnitY()};
    const bool to_left = random.uniform() < 0.5;
    const bool other_open = random.uniform() < recipe.open_door_fraction;
    const double margin = 0.5 * recipe.pillar_width_m + 0.5 * recipe.door_width_m + 0.4;
    const double x = random.uniform(slot.x.low + margin, slot.x.high - margin);
    const double either = to_left ? 1 : -1;
    room.outward = Vec2(0, slot.outward != 0 ? slot.outward : either);
    room.door = Vec2(x, room.outward.y() > 0 ? slot.y.high : slot.y.low);
    room.open = i == 0 || (i != 1 && other_open);
    plan.rooms.push_back(room);
  }
}

bool taken_by_room(const GaragePlan& plan, const Vec2& centre, double half_depth) {
  return std::any_of(plan.rooms.begin(), plan.rooms.end(), [&](const GarageRoom& room) {
    return centre.x() > room.x.low && centre.x() < room.x.high &&
           centre.y() > room.y.low - half_depth && centre.y() < room.y.high + half_depth;
  });
}

void plan_bays(const GarageRecipe& recipe, GaragePlan& plan) {
  const double depth = recipe.bay_depth_m;
  const double clear = recipe.pillar_spacing_m - recipe.pillar_width_m;
  const int per_cell = std::max(1, static_cast<int>(std::floor(clear / recipe.bay_width_m)));
  const auto add_row = [&](const Interval& x, double y, double inward) {
    for (int k = 0; k < per_cell; ++k) {
      const double from_middle = (k - 0.5 * (per_cell - 1)) * clear / per_cell;
      const GarageBay bay{{x.middle() + from_middle, y}, {0, inward}, clear / per_cell};
      if (!taken_by_room(plan, bay.centre, 0.5 * depth)) plan.bays.push_back(bay);
    }
  };
  for (std::size_t i = 0; i + 1 < plan.column_x.size(); ++i) {
    const Interval x{plan.column_x[i], plan.column_x[i + 1]};
    for (const double side : {-1.0, 1.0}) {
      add_row(x, side * (plan.hall_y.high - 0.5 * depth), side);
      for (const Interval& band : plan.bands) {
        const bool middle = in_block(plan, x);
        const bool beside_ramp = x.high <= plan.foot_x;
        if (middle) add_row(x, side * (band.low + 0.5 * depth), side);
        if (middle || beside_ramp) add_row(x, side * (band.high - 0.5 * depth), -side);
      }
    }
  }
}

void park_cars(const GarageRecipe& recipe, RandomStream random, GaragePlan& plan) {
  constexpr double kSideways = 0.10, kLengthways = 0.12, kBehind = 0.25;  // m
  constexpr double kAskew = 0.03;                                         // rad
  // Cumulative shares of the kinds, in CarKind's order.
  constexpr std::array<double, kCarKinds> kShare{0.32, 0.57, 0.82, 0.91, 1.0};
  for (const GarageBay& bay : plan.bays) {
    const bool filled = random.uniform() < recipe.occupancy_fraction;
    const double draw = random.uniform();
    const auto kind = std::upper_bound(kShare.begin(), kShare.end() - 1, draw) - kShare.begin();
    const bool nose_in = random.uniform() < 0.5;
    const Vec2 across(-bay.inward.y(), bay.inward.x());
    const double sideways = random.uniform(-kSideways, kSideways);
    // However long the car, its back end keeps off the wall or the car behind.
    const double length = car_size(static_cast<CarKind>(kind)).x();
    const double slack = 0.5 * (recipe.bay_depth_m - length) - kBehind;
    const double lengthways = std::min(random.uniform(-kLengthways, kLengthways), slack);
    const double heading = std::atan2(bay.inward.y(), bay.inward.x());
    const double askew = random.uniform(-kAskew, kAskew);
    const GarageReflectivity& paint = recipe.reflectivity;
    const double shade = random.uniform(paint.car_darkest, paint.car_brightest);
    if (!filled) continue;
    plan.cars.push_back({static_cast<CarKind>(kind),
                         bay.centre + sideways * across + lengthways * bay.inward,
                         heading + askew + (nose_in ? 0 : std::numbers::pi), shade});
  }
}

void plan_services(const GarageRecipe& recipe, RandomStream random, GaragePlan& plan) {
  constexpr double kLane = 1.2;     // between runs, so that ducts do not meet, m
  constexpr double kAside = 0.85;   // from pillars and lamps to a run's middle, m
  constexpr double kFromEnd = 0.3;  // m
  std::vector<double> lanes;
  for (double y = plan.hall_y.low + 0.8; y <= plan.hall_y.high - 0.8; y += kLane) {
    const auto near = [&](double other) { return std::abs(y - other) < kAside; };
    if (std::none_of(plan.row_y.begin(), plan.row_y.end(), near) &&
        std::none_of(plan.aisle_y.begin(), plan.aisle_y.end(), near)) {
      lanes.push_back(y);
    }
  }
  const int count = std::min(recipe.service_runs, static_cast<int>(lanes.size()));
  for (int i = 0; i < count; ++i) {
    const int pick = random.uniform_int(i, static_cast<int>(lanes.size()) - 1);
    std::swap(lanes[static_cast<std::size_t>(i)], lanes[static_cast<std::size_t>(pick)]);
    ServiceRun run;
    run.y = lanes[static_cast<std::size_t>(i)];
    const bool meets_ramp = run.y > plan.shaft_y.low - kAside && run.y < plan.shaft_y.high + kAside;
    const double start = meets_ramp ? plan.foot_x + 1.0 : plan.hall_x.low + kFromEnd;
    const double third = plan.hall_x.length() / 3;
    const bool whole = random.uniform() < 0.5;
    const double cut = random.uniform(0, third);
    run.x = {whole ? start : start + cut, plan.hall_x.high - (whole ? kFromEnd : third - cut)};
    const double kind = random.uniform();
    run.kind = kind < 0.6   ? ServiceRun::Kind::kPipe
               : kind < 0.8 ? ServiceRun::Kind::kDuct
                            : ServiceRun::Kind::kTray;
    run.radius = random.uniform(0.04, 0.11);
    plan.services.push_back(run);
  }
}

}  // namespace

GaragePlan plan_garage(const GarageRecipe& recipe, std::uint64_t seed) {
  GaragePlan plan;
  plan_hall(recipe, plan);
  plan_bands(recipe, plan);
  plan_blocks(plan);
  plan_rooms(recipe, RandomStream(seed, "garage/rooms"), plan);
  plan_bays(recipe, plan);
  park_cars(recipe, RandomStream(seed, "garage/cars"), plan);
  plan_services(recipe, RandomStream(seed, "garage/services"), plan);
  return plan;
}

}  // namespace arex::worlds
