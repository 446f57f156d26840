#include "worlds/garage.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "worlds/garage_parts.h"

namespace arex::worlds {
namespace garage {

void add_tiled_face(MeshBuilder& mesh, std::uint32_t object, const Vec3& corner, const Vec3& u,
                    const Vec3& v) {
  const int nu = std::max(1, static_cast<int>(std::ceil(u.norm() / kTile - 1e-9)));
  const int nv = std::max(1, static_cast<int>(std::ceil(v.norm() / kTile - 1e-9)));
  const auto at = [&](int i, int j) -> Vec3 { return corner + u * i / nu + v * j / nv; };
  for (int i = 0; i < nu; ++i) {
    for (int j = 0; j < nv; ++j) {
      mesh.add_quad(object, at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1));
    }
  }
}

void add_tiled_box(MeshBuilder& mesh, std::uint32_t object, const Pose& X_WP, const Vec3& half) {
  for (int axis = 0; axis < 3; ++axis) {
    const Vec3 u = 2 * half[(axis + 1) % 3] * X_WP.R.col((axis + 1) % 3);
    const Vec3 v = 2 * half[(axis + 2) % 3] * X_WP.R.col((axis + 2) % 3);
    for (const double side : {-1.0, 1.0}) {
      const Vec3 middle = X_WP.p + side * half[axis] * X_WP.R.col(axis);
      add_tiled_face(mesh, object, middle - 0.5 * (u + v), u, v);
    }
  }
  mesh.add_collision_box(object, X_WP, half);
}

void add_tiled_box(MeshBuilder& mesh, std::uint32_t object, const Box& box) {
  add_tiled_box(mesh, object, box.pose(), box.half());
}

void add_small_box(MeshBuilder& mesh, std::uint32_t object, const Box& box) {
  mesh.add_solid_box(object, box.pose(), box.half());
}

namespace {

/// A slab over the hall without the ramp's shaft: three rectangles. Only the face towards the hall
/// is drawn.
void add_slab(const Site& site, std::uint32_t object, double face_z, double thickness) {
  const GaragePlan& plan = site.plan;
  const auto add = [&](double x0, double x1, double y0, double y1) {
    add_tiled_face(site.mesh, object, {x0, y0, face_z}, {x1 - x0, 0, 0}, {0, y1 - y0, 0});
    const Box box{{x0, y0, std::min(face_z, face_z + thickness)},
                  {x1, y1, std::max(face_z, face_z + thickness)}};
    site.mesh.add_collision_box(object, box.pose(), box.half());
  };
  add(plan.hall_x.low, plan.foot_x, plan.hall_y.low, plan.shaft_y.low);
  add(plan.hall_x.low, plan.foot_x, plan.shaft_y.high, plan.hall_y.high);
  add(plan.foot_x, plan.hall_x.high, plan.hall_y.low, plan.hall_y.high);
}

void add_outer_walls(const Site& site) {
  const GaragePlan& plan = site.plan;
  const double z0 = site.recipe.floor_z_m, z1 = site.recipe.ceiling_z_m;
  const Interval &x = plan.hall_x, &y = plan.hall_y;
  const double t = kGarageWall;
  const std::array<Box, 4> walls{{{{x.low - t, y.low - t, z0}, {x.low, y.high + t, z1}},
                                  {{x.high, y.low - t, z0}, {x.high + t, y.high + t, z1}},
                                  {{x.low, y.low - t, z0}, {x.high, y.low, z1}},
                                  {{x.low, y.high, z0}, {x.high, y.high + t, z1}}}};
  for (const Box& wall : walls) {
    add_tiled_box(site.mesh, site.add(SurfaceClass::kWall, site.recipe.reflectivity.concrete),
                  wall);
  }
}

/// Half pillars on the outer walls, in line with the grid.
void add_pilasters(const Site& site) {
  const GaragePlan& plan = site.plan;
  const double half = 0.5 * site.recipe.pillar_width_m;
  const double proud = 0.5 * half;
  const double z0 = site.recipe.floor_z_m, z1 = site.recipe.ceiling_z_m;
  const auto add = [&](const Vec2& low, const Vec2& high) {
    const auto object = site.add(SurfaceClass::kPillar, site.recipe.reflectivity.concrete);
    add_tiled_box(site.mesh, object, {{low.x(), low.y(), z0}, {high.x(), high.y(), z1}});
  };
  for (const double x : plan.column_x) {
    add({x - half, plan.hall_y.low}, {x + half, plan.hall_y.low + proud});
    add({x - half, plan.hall_y.high - proud}, {x + half, plan.hall_y.high});
  }
  for (const double y : plan.row_y) {
    add({plan.hall_x.low, y - half}, {plan.hall_x.low + proud, y + half});
    add({plan.hall_x.high - proud, y - half}, {plan.hall_x.high, y + half});
  }
}

/// A warning strip round a pillar at a driver's eyes.
void add_warning_strip(const Site& site, const Vec2& at) {
  constexpr double kLow = 1.2, kHigh = 1.3, kProud = 0.002;  // m
  const double half = 0.5 * site.recipe.pillar_width_m + kProud;
  const auto strip = site.add(SurfaceClass::kPillar, site.recipe.reflectivity.warning_strip);
  const Vec3 up(0, 0, kHigh - kLow);
  const Vec3 centre(at.x(), at.y(), site.recipe.floor_z_m + kLow);
  const std::array<Vec3, 4> corners{centre + Vec3(half, half, 0), centre + Vec3(-half, half, 0),
                                    centre + Vec3(-half, -half, 0), centre + Vec3(half, -half, 0)};
  for (std::size_t i = 0; i < 4; ++i) {
    const Vec3 &a = corners[i], &b = corners[(i + 1) % 4];
    site.mesh.add_quad(strip, a, b, b + up, a + up);
  }
}

/// A square pillar with a painted base and steel angles on its corners.
void add_pillar(const Site& site, const Vec2& at) {
  constexpr double kGuardHeight = 1.1, kGuardLeg = 0.07, kGuardProud = 0.008;  // m
  const double half = 0.5 * site.recipe.pillar_width_m;
  const double z0 = site.recipe.floor_z_m, z1 = site.recipe.ceiling_z_m;
  const auto body = site.add(SurfaceClass::kPillar, site.recipe.reflectivity.concrete);
  add_tiled_box(site.mesh, body,
                {{at.x() - half, at.y() - half, z0}, {at.x() + half, at.y() + half, z1}});
  const auto guard = site.add(SurfaceClass::kPillar, site.recipe.reflectivity.safety_paint);
  const double reach = half + kGuardProud;
  for (const double sx : {-1.0, 1.0}) {
    for (const double sy : {-1.0, 1.0}) {
      // The two outer faces of an angle.
      const Vec3 corner(at.x() + sx * reach, at.y() + sy * reach, z0);
      const Vec3 up(0, 0, kGuardHeight);
      const Vec3 along_x = corner - Vec3(sx * kGuardLeg, 0, 0);
      const Vec3 along_y = corner - Vec3(0, sy * kGuardLeg, 0);
      site.mesh.add_quad(guard, corner, along_x, along_x + up, corner + up);
      site.mesh.add_quad(guard, corner, along_y, along_y + up, corner + up);
    }
  }
  add_warning_strip(site, at);
}

/// Main beams across the hall over every pillar column, lighter ones along it over every row.
void add_beams(const Site& site) {
  constexpr double kMainHalf = 0.2, kMinorHalf = 0.15;  // half widths, m
  constexpr double kMinorDepth = 0.7;                   // of the main beams' depth
  const GaragePlan& plan = site.plan;
  const double z1 = site.recipe.ceiling_z_m;
  const auto add = [&](const Vec2& low, const Vec2& high, double depth) {
    const auto object = site.add(SurfaceClass::kBeam, site.recipe.reflectivity.concrete);
    add_tiled_box(site.mesh, object, {{low.x(), low.y(), z1 - depth}, {high.x(), high.y(), z1}});
  };
  const double depth = site.recipe.beam_depth_m;
  for (const double x : plan.column_x) {
    if (x - kMainHalf < plan.foot_x) {
      add({x - kMainHalf, plan.hall_y.low}, {x + kMainHalf, plan.shaft_y.low}, depth);
      add({x - kMainHalf, plan.shaft_y.high}, {x + kMainHalf, plan.hall_y.high}, depth);
    } else {
      add({x - kMainHalf, plan.hall_y.low}, {x + kMainHalf, plan.hall_y.high}, depth);
    }
  }
  for (const double y : plan.row_y) {
    add({plan.hall_x.low, y - kMinorHalf}, {plan.hall_x.high, y + kMinorHalf}, kMinorDepth * depth);
  }
}

/// Shut fire exits in the end walls.
void add_exits(const Site& site) {
  constexpr double kHalfWidth = 0.55, kProud = 0.04;  // m
  const GaragePlan& plan = site.plan;
  const double z0 = site.recipe.floor_z_m;
  const auto add = [&](double x0, double x1, double y) {
    const auto door = site.add(SurfaceClass::kDoor, site.recipe.reflectivity.door);
    add_small_box(site.mesh, door,
                  {{x0, y - kHalfWidth, z0}, {x1, y + kHalfWidth, z0 + site.recipe.door_height_m}});
  };
  for (const double y : plan.aisle_y) {
    add(plan.hall_x.high - kProud, plan.hall_x.high, y);
    if (y != 0) add(plan.hall_x.low, plan.hall_x.low + kProud, y);
  }
}

}  // namespace

void add_hall(const Site& site) {
  const GarageRecipe& recipe = site.recipe;
  add_slab(site, site.add(SurfaceClass::kFloor, recipe.reflectivity.floor_coating),
           recipe.floor_z_m, -kSlab);
  add_slab(site, site.add(SurfaceClass::kCeiling, recipe.reflectivity.concrete), recipe.ceiling_z_m,
           kSlab);
  add_outer_walls(site);
  add_pilasters(site);
  for (const double x : site.plan.column_x) {
    for (const double y : site.plan.row_y) add_pillar(site, {x, y});
  }
  add_beams(site);
  add_exits(site);
}

}  // namespace garage

World build(const GarageRecipe& recipe, std::uint64_t seed) {
  const GaragePlan plan = plan_garage(recipe, seed);
  MeshBuilder mesh;
  const garage::Site site{recipe, plan, mesh};
  garage::add_hall(site);
  garage::add_entrance(site);
  garage::add_rooms(site);
  garage::add_bays(site);
  garage::add_services(site);
  constexpr double kSky = 6.0;  // open air above the start, m
  World world = mesh.finish();
  world.bounds.high.z() = std::max(world.bounds.high.z(), kSky);
  return world;  // X_WS: the start is the origin, on the ground, facing the ramp
}

}  // namespace arex::worlds
