#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "worlds/garage_parts.h"

/// Everything that hangs under the ceiling. Rods, collars and sprinkler heads are drawn but not
/// solid: they stand where the vehicle's width cannot follow.
namespace arex::worlds::garage {
namespace {

constexpr double kGap = 0.05;  // between the main beams and what hangs below them, m

double soffit(const Site& site) { return site.recipe.ceiling_z_m - site.recipe.beam_depth_m; }

void add_rod(const Site& site, std::uint32_t object, double x, double y, double z) {
  constexpr double kRod = 0.008;  // radius, m
  const std::array<Vec3, 2> points{Vec3(x, y, z), Vec3(x, y, site.recipe.ceiling_z_m)};
  const std::array<double, 2> radii{kRod, kRod};
  site.mesh.add_tube(object, points, radii, 4);
}

/// Calls `place(x)` about every 4 m of a run, clear of the beams.
template <class Place>
void along(const Site& site, const Interval& x, const Place& place) {
  const double pitch = 0.5 * site.recipe.pillar_spacing_m;
  for (double at = site.plan.column_x.front() - 0.5 * pitch; at < x.high; at += pitch) {
    if (at > x.low) place(at);
  }
}

/// A pipe under the beams; its ends in the open turn up into the ceiling.
void add_pipe(const Site& site, const ServiceRun& run) {
  constexpr int kSides = 12;
  constexpr double kCollar = 0.02, kCollarHalf = 0.05;  // m
  const double z = soffit(site) - kGap - run.radius;
  const auto object = site.add(SurfaceClass::kPipe, site.recipe.reflectivity.metal);
  std::vector<Vec3> points;
  const double near_end = 1.0;  // closer than this to an end wall, the pipe goes through it
  const bool left_open = run.x.low > site.plan.hall_x.low + near_end;
  const bool right_open = run.x.high < site.plan.hall_x.high - near_end;
  if (left_open) points.emplace_back(run.x.low, run.y, site.recipe.ceiling_z_m);
  points.emplace_back(left_open ? run.x.low : site.plan.hall_x.low, run.y, z);
  points.emplace_back(right_open ? run.x.high : site.plan.hall_x.high, run.y, z);
  if (right_open) points.emplace_back(run.x.high, run.y, site.recipe.ceiling_z_m);
  const std::vector<double> radii(points.size(), run.radius);
  site.mesh.add_tube(object, points, radii, kSides);
  for (std::size_t i = 0; i + 1 < points.size(); ++i) {
    site.mesh.add_collision_cylinder(object, pose_along(points[i], points[i + 1]), run.radius,
                                     0.5 * (points[i + 1] - points[i]).norm());
  }
  along(site, run.x, [&](double x) {
    add_rod(site, object, x, run.y, z);
    const Vec3 half(kCollarHalf, 0, 0), centre(x + 0.5, run.y, z);
    site.mesh.add_cylinder(object, pose_along(centre - half, centre + half), run.radius + kCollar,
                           kCollarHalf, kSides);
  });
}

/// A duct or a cable tray: a long box on rods, a duct with flanges.
void add_box_run(const Site& site, const ServiceRun& run) {
  constexpr double kFlange = 0.02, kFlangeHalf = 0.03;  // m
  const bool duct = run.kind == ServiceRun::Kind::kDuct;
  const double half_width = duct ? 0.40 : 0.15, height = duct ? 0.32 : 0.07;
  const double top = soffit(site) - kGap;
  const auto object = site.add(SurfaceClass::kPipe, site.recipe.reflectivity.metal);
  add_tiled_box(
      site.mesh, object,
      {{run.x.low, run.y - half_width, top - height}, {run.x.high, run.y + half_width, top}});
  along(site, run.x, [&](double x) {
    for (const double side : {-0.9, 0.9}) add_rod(site, object, x, run.y + side * half_width, top);
    if (!duct || x + 1.0 > run.x.high) return;
    site.mesh.add_box(object, {Mat3::Identity(), Vec3(x + 0.5, run.y, top - 0.5 * height)},
                      {kFlangeHalf, half_width + kFlange, 0.5 * height + kFlange});
  });
}

/// Sprinkler branches across the hall, one in each cell, with upright heads.
void add_sprinklers(const Site& site) {
  constexpr double kRadius = 0.03, kDrop = 0.30, kHeadSpacing = 3.0, kFromWall = 0.5;  // m
  constexpr double kHeadRadius = 0.03, kHeadHalf = 0.06;                               // m
  const GaragePlan& plan = site.plan;
  const double z = site.recipe.ceiling_z_m - kDrop;
  const auto branch = [&](double x, double y0, double y1) {
    const auto object = site.add(SurfaceClass::kPipe, site.recipe.reflectivity.metal);
    const std::array<Vec3, 2> ends{Vec3(x, y0, z), Vec3(x, y1, z)};
    const std::array<double, 2> radii{kRadius, kRadius};
    site.mesh.add_tube(object, ends, radii, 8);
    site.mesh.add_collision_capsule(object, ends[0], ends[1], kRadius);
    for (double y = y0 + 0.5 * kHeadSpacing; y < y1; y += kHeadSpacing) {
      const Vec3 centre(x, y, z + kRadius + kHeadHalf);
      site.mesh.add_cone(object, {Mat3::Identity(), centre}, 0.4 * kHeadRadius, kHeadRadius,
                         kHeadHalf, 6);
    }
  };
  for (std::size_t i = 0; i + 1 < plan.column_x.size(); ++i) {
    const double x = 0.5 * (plan.column_x[i] + plan.column_x[i + 1]);
    const double low = plan.hall_y.low + kFromWall, high = plan.hall_y.high - kFromWall;
    if (x < plan.foot_x + 1) {
      branch(x, low, plan.shaft_y.low - kFromWall);
      branch(x, plan.shaft_y.high + kFromWall, high);
    } else {
      branch(x, low, high);
    }
  }
}

/// Strip lamps over the aisles, two in each cell.
void add_lamps(const Site& site) {
  constexpr double kLong = 0.75, kHalfWidth = 0.10, kTall = 0.08, kRodAt = 0.5;  // m
  const GaragePlan& plan = site.plan;
  const double top = soffit(site) - kGap;
  for (const double y : plan.aisle_y) {
    along(site, plan.hall_x, [&](double x) {
      if (y > plan.shaft_y.low && y < plan.shaft_y.high && x - kLong < plan.foot_x) return;
      const auto lamp = site.add(SurfaceClass::kPipe, site.recipe.reflectivity.plaster);
      add_small_box(site.mesh, lamp,
                    {{x - kLong, y - kHalfWidth, top - kTall}, {x + kLong, y + kHalfWidth, top}});
      for (const double side : {-kRodAt, kRodAt}) add_rod(site, lamp, x + side, y, top);
    });
  }
}

/// Direction signs across the aisles, before each block of bays.
void add_signs(const Site& site) {
  constexpr double kHalfWidth = 0.7, kThick = 0.05, kTall = 0.3, kBefore = 1.0;  // m
  const double top = soffit(site) - kGap;
  for (const Interval& block : site.plan.blocks) {
    for (const double y : site.plan.aisle_y) {
      const auto sign = site.add(SurfaceClass::kPipe, site.recipe.reflectivity.sign);
      const auto rods = site.add(SurfaceClass::kPipe, site.recipe.reflectivity.metal);
      const double x = block.low - kBefore;
      add_small_box(site.mesh, sign,
                    {{x, y - kHalfWidth, top - kTall}, {x + kThick, y + kHalfWidth, top}});
      for (const double side : {-0.8, 0.8}) {
        add_rod(site, rods, x + 0.5 * kThick, y + side * kHalfWidth, top);
      }
    }
  }
}

}  // namespace

void add_services(const Site& site) {
  for (const ServiceRun& run : site.plan.services) {
    if (run.kind == ServiceRun::Kind::kPipe) {
      add_pipe(site, run);
    } else {
      add_box_run(site, run);
    }
  }
  add_sprinklers(site);
  add_lamps(site);
  add_signs(site);
}

}  // namespace arex::worlds::garage
