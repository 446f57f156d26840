#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "math/so3.h"
#include "worlds/garage_parts.h"

namespace arex::worlds::garage {
namespace {

constexpr double kYardBehind = 8.0;   // the walled forecourt, from the start back, m
constexpr double kYardBeyond = 15.0;  // and from the portal on, m
constexpr Interval kYardY{-10.0, 10.0};
constexpr double kYardWall = 2.4;  // height, m
constexpr double kParapet = 1.0;   // height above the ground, m
constexpr double kRib = 0.25;      // beams under the roof, square, m

/// The ramp's surface as a frame R: x down the slope, y left, z off the surface; origin at the
/// middle of the crest.
struct RampFrame {
  Pose X_WR;
  double slope;
  double length;

  explicit RampFrame(const Site& site) {
    const double angle = to_radians(site.recipe.ramp_angle_deg);
    X_WR = {so3::Exp(Vec3(0, angle, 0)), Vec3(site.plan.crest_x, 0, 0)};
    slope = std::tan(angle);
    length = (site.plan.foot_x - site.plan.crest_x) / std::cos(angle);
  }
  [[nodiscard]] double z(double x) const { return -(x - X_WR.p.x()) * slope; }
  /// A box by two corners given in R.
  [[nodiscard]] Pose pose(const Box& box) const { return X_WR * box.pose(); }
};

void add_ground(const Site& site) {
  const GaragePlan& plan = site.plan;
  const auto object = site.add(SurfaceClass::kGround, site.recipe.reflectivity.asphalt);
  const double x0 = -kYardBehind - kGarageWall, x1 = plan.hall_x.high + kGarageWall;
  const double y0 = plan.hall_y.low - kGarageWall, y1 = plan.hall_y.high + kGarageWall;
  const double opening = plan.shaft_y.high;
  const auto add = [&](double ax, double bx, double ay, double by) {
    add_tiled_face(site.mesh, object, {ax, ay, 0}, {bx - ax, 0, 0}, {0, by - ay, 0});
    const Box solid{{ax, ay, -kSlab}, {bx, by, 0}};
    site.mesh.add_collision_box(object, solid.pose(), solid.half());
  };
  add(x0, plan.crest_x, y0, y1);
  add(plan.crest_x, plan.portal_x, y0, -opening);
  add(plan.crest_x, plan.portal_x, opening, y1);
  add(plan.portal_x, x1, y0, y1);
}

void add_ramp(const Site& site, const RampFrame& ramp) {
  const GaragePlan& plan = site.plan;
  const GarageReflectivity& shade = site.recipe.reflectivity;
  MeshBuilder& mesh = site.mesh;
  const double half = 0.5 * site.recipe.ramp_width_m;
  const Box deck{{0, -half, -kSlab}, {ramp.length, half, 0}};
  add_tiled_box(mesh, site.add(SurfaceClass::kRamp, shade.floor_coating), ramp.pose(deck),
                deck.half());

  constexpr double kKerbWidth = 0.25, kKerbHeight = 0.12;               // m
  constexpr double kRailHeight = 0.95, kRailOff = 0.15, kRail = 0.025;  // m
  constexpr double kDash = 1.0, kDashHalf = 0.06;                       // m
  for (const double side : {-1.0, 1.0}) {
    const double y0 = side > 0 ? half - kKerbWidth : -half;
    const Box kerb{{0, y0, 0}, {ramp.length, y0 + kKerbWidth, kKerbHeight}};
    add_tiled_box(mesh, site.add(SurfaceClass::kKerb, shade.concrete), ramp.pose(kerb),
                  kerb.half());
    const std::array<Vec3, 2> rail{
        ramp.X_WR * Vec3(0.3, side * (half - kRailOff), kRailHeight),
        ramp.X_WR * Vec3(ramp.length - 0.3, side * (half - kRailOff), kRailHeight)};
    const std::array<double, 2> radii{kRail, kRail};
    const auto object = site.add(SurfaceClass::kPipe, shade.metal);
    mesh.add_tube(object, rail, radii, 8);
    mesh.add_collision_capsule(object, rail[0], rail[1], kRail);
  }
  const auto line = site.add(SurfaceClass::kRamp, shade.marking);
  for (double x = kDash; x + kDash < ramp.length; x += 2 * kDash) {
    mesh.add_quad(line, ramp.X_WR * Vec3(x, -kDashHalf, kMark),
                  ramp.X_WR * Vec3(x + kDash, -kDashHalf, kMark),
                  ramp.X_WR * Vec3(x + kDash, kDashHalf, kMark),
                  ramp.X_WR * Vec3(x, kDashHalf, kMark));
  }
  const auto wall = [&](double x0, double x1, double z0, double z1, double side) {
    const double inner = side * half, outer = side * (half + kGarageWall);
    add_tiled_box(mesh, site.add(SurfaceClass::kWall, shade.concrete),
                  {{x0, std::min(inner, outer), z0}, {x1, std::max(inner, outer), z1}});
  };
  const double buried = -0.5 * kSlab;  // where ground covers the wall, it ends inside the slab
  for (const double side : {-1.0, 1.0}) {
    wall(plan.hall_x.low, plan.crest_x, site.recipe.floor_z_m, buried, side);
    wall(plan.crest_x, plan.portal_x, site.recipe.floor_z_m, kParapet, side);
    wall(plan.portal_x, plan.foot_x, site.recipe.floor_z_m, buried, side);
  }
}

/// The roof one storey above the ramp, its ribs, the portal's head wall and the height bar.
void add_roof(const Site& site, const RampFrame& ramp) {
  const GaragePlan& plan = site.plan;
  const GarageReflectivity& shade = site.recipe.reflectivity;
  const double half = 0.5 * site.recipe.ramp_width_m;
  const double storey = site.recipe.ceiling_z_m - site.recipe.floor_z_m;
  // The underside's frame: the ramp's, raised by a storey.
  const Pose X_WU{ramp.X_WR.R, ramp.X_WR.p + Vec3(0, 0, storey)};
  const double start = ramp.length * (plan.portal_x - plan.crest_x) / (plan.foot_x - plan.crest_x);
  const Box slab{{start, -half, 0}, {ramp.length, half, kSlab}};
  add_tiled_box(site.mesh, site.add(SurfaceClass::kCeiling, shade.concrete), X_WU * slab.pose(),
                slab.half());
  constexpr double kRibSpacing = 2.5;  // m
  for (double x = start + kRibSpacing; x < ramp.length - kRib; x += kRibSpacing) {
    const Box rib{{x, -half, -kRib}, {x + kRib, half, 0}};
    add_tiled_box(site.mesh, site.add(SurfaceClass::kBeam, shade.concrete), X_WU * rib.pose(),
                  rib.half());
  }
  const double soffit = ramp.z(plan.portal_x) + storey;
  add_tiled_box(site.mesh, site.add(SurfaceClass::kWall, shade.concrete),
                {{plan.portal_x - kGarageWall, -half, soffit}, {plan.portal_x, half, kParapet}});
  constexpr double kBarBefore = 0.8, kBarRadius = 0.06;  // m
  constexpr double kBarHeight = 0.83;                    // of the storey, above the ramp
  const double bar_x = plan.portal_x - kBarBefore;
  const std::array<Vec3, 2> bar{Vec3(bar_x, -half, ramp.z(bar_x) + kBarHeight * storey),
                                Vec3(bar_x, half, ramp.z(bar_x) + kBarHeight * storey)};
  const std::array<double, 2> radii{kBarRadius, kBarRadius};
  const auto object = site.add(SurfaceClass::kPipe, shade.safety_paint);
  site.mesh.add_tube(object, bar, radii, 10);
  site.mesh.add_collision_capsule(object, bar[0], bar[1], kBarRadius);
}

/// Pilasters along the ramp's walls, and a lamp between each two of them where there is a roof:
/// what a scan of two parallel walls needs to tell how far along them it is.
void add_wall_details(const Site& site, const RampFrame& ramp) {
  constexpr double kSpacing = 2.4, kWidth = 0.3, kProud = 0.12;                            // m
  constexpr double kLampHeight = 2.3, kLampLong = 0.8, kLampTall = 0.14, kLampDeep = 0.1;  // m
  const GaragePlan& plan = site.plan;
  const GarageReflectivity& shade = site.recipe.reflectivity;
  const double half = 0.5 * site.recipe.ramp_width_m;
  const double storey = site.recipe.ceiling_z_m - site.recipe.floor_z_m;
  for (double x = plan.crest_x + 1.0; x + kWidth < plan.foot_x; x += kSpacing) {
    for (const double side : {-1.0, 1.0}) {
      const auto between = [&](double a, double b, double deep, double z0, double z1) {
        const double face = side * half, front = side * (half - deep);
        return Box{{a, std::min(face, front), z0}, {b, std::max(face, front), z1}};
      };
      const double top = x < plan.portal_x ? kParapet : ramp.z(x + kWidth) + storey;
      add_tiled_box(site.mesh, site.add(SurfaceClass::kPillar, shade.concrete),
                    between(x, x + kWidth, kProud, ramp.z(x + kWidth), top));
      const double lamp_x = x + 0.5 * (kSpacing + kWidth - kLampLong);
      if (x < plan.portal_x || lamp_x + kLampLong > plan.foot_x) continue;
      const double z = ramp.z(lamp_x) + kLampHeight;
      add_small_box(site.mesh, site.add(SurfaceClass::kPipe, shade.metal),
                    between(lamp_x, lamp_x + kLampLong, kLampDeep, z, z + kLampTall));
    }
  }
}

void add_yard_walls(const Site& site) {
  constexpr double kGateHalf = 2.6, kGateHeight = 2.1, kGateProud = 0.06;   // m
  constexpr double kPostSpacing = 4.0, kPostHalf = 0.2, kPostProud = 0.12;  // m
  const GarageReflectivity& shade = site.recipe.reflectivity;
  const auto wall = [&](double x0, double x1, double y0, double y1) {
    add_tiled_box(site.mesh, site.add(SurfaceClass::kWall, shade.plaster),
                  {{x0, y0, 0}, {x1, y1, kYardWall}});
  };
  const double t = kGarageWall;
  const Interval x{-kYardBehind, site.plan.portal_x + kYardBeyond}, y = kYardY;
  wall(x.low - t, x.low, y.low - t, y.high + t);
  wall(x.high, x.high + t, y.low - t, y.high + t);
  wall(x.low, x.high, y.low - t, y.low);
  wall(x.low, x.high, y.high, y.high + t);
  add_small_box(site.mesh, site.add(SurfaceClass::kDoor, shade.door),
                {{x.low, -kGateHalf, 0}, {x.low + kGateProud, kGateHalf, kGateHeight}});
  for (double post = x.low + kPostSpacing; post < x.high - 1; post += kPostSpacing) {
    for (const double side : {-1.0, 1.0}) {
      const double face = side * y.high, front = side * (y.high - kPostProud);
      add_small_box(site.mesh, site.add(SurfaceClass::kPillar, shade.concrete),
                    {{post - kPostHalf, std::min(face, front), 0},
                     {post + kPostHalf, std::max(face, front), kYardWall}});
    }
  }
}

/// The attendant's kiosk, the ticket machine, the raised barrier, bollards and lamp posts.
void add_yard_furniture(const Site& site) {
  const GaragePlan& plan = site.plan;
  const GarageReflectivity& shade = site.recipe.reflectivity;
  MeshBuilder& mesh = site.mesh;
  const double edge = plan.shaft_y.high;
  const auto box = [&](SurfaceClass kind, double reflectivity, const Vec3& low, const Vec3& high) {
    add_small_box(mesh, site.add(kind, reflectivity), {low, high});
  };
  box(SurfaceClass::kWall, shade.plaster, {-5.5, 5.5, 0}, {-2.8, 8.0, 2.5});
  box(SurfaceClass::kCeiling, shade.concrete, {-5.8, 5.2, 2.5}, {-2.5, 8.3, 2.7});
  box(SurfaceClass::kDoor, shade.door, {-5.2, 5.46, 0}, {-4.3, 5.5, 2.1});
  box(SurfaceClass::kWall, shade.glass, {-4.0, 5.47, 1.0}, {-3.1, 5.5, 2.0});
  box(SurfaceClass::kPipe, shade.safety_paint, {0.5, -2.7, 0}, {0.85, -2.3, 1.35});
  box(SurfaceClass::kPipe, shade.safety_paint, {1.3, 2.4, 0}, {1.65, 2.75, 1.05});

  const std::array<Vec3, 2> boom{Vec3(1.48, 2.58, 1.0), Vec3(1.48, 2.9, 3.9)};
  const std::array<double, 2> boom_radii{0.05, 0.04};
  const auto barrier = site.add(SurfaceClass::kPipe, shade.marking);
  mesh.add_tube(barrier, boom, boom_radii, 8);
  mesh.add_collision_capsule(barrier, boom[0], boom[1], 0.05);

  for (const double side : {-1.0, 1.0}) {
    const Pose X_WP{Mat3::Identity(), Vec3(plan.crest_x - 0.3, side * edge, 0.5)};
    mesh.add_solid_cylinder(site.add(SurfaceClass::kPipe, shade.safety_paint), X_WP, 0.09, 0.5, 12);
  }
  for (const Vec2& at : {Vec2(-4.0, -8.5), Vec2(15.0, -8.5), Vec2(15.0, 8.5)}) {
    const auto post = site.add(SurfaceClass::kPipe, shade.metal);
    mesh.add_solid_cylinder(post, {Mat3::Identity(), Vec3(at.x(), at.y(), 2.25)}, 0.07, 2.25, 12);
    const double inward = at.y() > 0 ? -0.5 : 0.5;
    const Vec3 head(at.x(), at.y() + inward, 4.5);
    mesh.add_solid_box(post, {Mat3::Identity(), head}, {0.15, 0.6, 0.06});
  }
  const CarMaterials paint{0.5 * (shade.car_darkest + shade.car_brightest), shade.glass,
                           shade.rubber, shade.number_plate};
  add_car(mesh, CarKind::kVan, {so3::from_yaw(0), Vec3(14.0, 6.8, 0)}, paint);
  add_car(mesh, CarKind::kSedan, {so3::from_yaw(std::numbers::pi), Vec3(-3.0, -6.0, 0)}, paint);
}

}  // namespace

void add_entrance(const Site& site) {
  const RampFrame ramp(site);
  add_ground(site);
  add_ramp(site, ramp);
  add_roof(site, ramp);
  add_wall_details(site, ramp);
  add_yard_walls(site);
  add_yard_furniture(site);
}

}  // namespace arex::worlds::garage
