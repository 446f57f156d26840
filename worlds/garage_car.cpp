#include "worlds/garage_car.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <numbers>
#include <span>

#include "math/so3.h"

namespace arex::worlds {
namespace {

/// A cross-section of the body. Between `belt` and `top` it leans in: the windows of the cabin, the
/// crown of the bonnet.
struct Station {
  double x;         ///< m
  double low;       ///< underside, m
  double belt;      ///< shoulder line, m
  double top;       ///< roof or bonnet, m
  double shoulder;  ///< half width at the belt, fraction of the car's half width
  double crown;     ///< half width at the top, fraction of the car's half width
  bool side_glass;  ///< of the segment up to the next station, belt to top
  bool top_glass;   ///< of the segment up to the next station: windscreen, rear window
};

/// Stations from the nose to the tail; four of them bound the cabin.
struct Profile {
  double width, wheel_radius, front_axle, rear_axle;
  std::array<Station, 10> stations;
  std::size_t cowl, roof_front, roof_rear, tail;
};

// Side views of common cars, measured off in 5 cm steps: estimates, right to about 10 cm.
constexpr std::array<Profile, kCarKinds> kProfiles{{
    {1.82,
     0.32,
     1.42,
     -1.36,
     {{{2.35, .28, .56, .62, .78, .62, false, false},
       {2.12, .20, .68, .74, .95, .72, false, false},
       {1.05, .20, .88, .95, 1.0, .80, true, true},
       {0.35, .20, .92, 1.39, 1.0, .64, true, false},
       {-0.30, .20, .93, 1.45, 1.0, .64, false, false},
       {-0.40, .20, .93, 1.45, 1.0, .64, true, false},
       {-0.98, .20, .94, 1.40, 1.0, .62, true, true},
       {-1.68, .20, .97, 1.05, 1.0, .76, false, false},
       {-2.18, .22, .97, 1.02, .96, .74, false, false},
       {-2.35, .32, .80, .86, .86, .68, false, false}}},
     2,
     3,
     6,
     7},
    {1.76,
     0.31,
     1.25,
     -1.25,
     {{{2.02, .28, .58, .64, .78, .62, false, false},
       {1.82, .20, .72, .78, .95, .72, false, false},
       {1.05, .20, .92, 1.00, 1.0, .80, true, true},
       {0.30, .20, .96, 1.46, 1.0, .66, true, false},
       {-0.25, .20, .97, 1.52, 1.0, .66, false, false},
       {-0.35, .20, .97, 1.52, 1.0, .66, true, false},
       {-1.05, .20, .99, 1.50, 1.0, .65, false, false},
       {-1.40, .20, 1.00, 1.44, 1.0, .64, false, true},
       {-1.90, .22, .98, 1.02, .96, .74, false, false},
       {-2.02, .34, .80, .84, .90, .70, false, false}}},
     2,
     3,
     7,
     8},
    {1.90,
     0.37,
     1.40,
     -1.35,
     {{{2.33, .36, .74, .82, .82, .68, false, false},
       {2.15, .26, .92, .98, .96, .76, false, false},
       {1.10, .26, 1.05, 1.13, 1.0, .84, true, true},
       {0.50, .26, 1.09, 1.62, 1.0, .72, true, false},
       {-0.25, .26, 1.10, 1.70, 1.0, .72, false, false},
       {-0.36, .26, 1.10, 1.70, 1.0, .72, true, false},
       {-1.80, .26, 1.12, 1.66, 1.0, .70, false, false},
       {-1.98, .26, 1.12, 1.60, 1.0, .70, false, true},
       {-2.26, .28, 1.10, 1.14, .96, .78, false, false},
       {-2.33, .40, .90, .94, .92, .76, false, false}}},
     2,
     3,
     7,
     8},
    {1.94,
     0.34,
     1.55,
     -1.45,
     {{{2.45, .30, .72, .80, .82, .72, false, false},
       {2.32, .22, .95, 1.02, .95, .80, false, false},
       {1.85, .22, 1.12, 1.22, 1.0, .86, true, true},
       {1.05, .22, 1.15, 1.90, 1.0, .82, true, false},
       {0.15, .22, 1.16, 1.97, 1.0, .84, false, false},
       {-0.50, .22, 1.16, 1.98, 1.0, .84, false, false},
       {-1.60, .22, 1.16, 1.98, 1.0, .84, false, false},
       {-2.30, .22, 1.16, 1.96, 1.0, .83, false, true},
       {-2.42, .24, 1.14, 1.20, .98, .92, false, false},
       {-2.45, .36, .90, .96, .96, .92, false, false}}},
     2,
     3,
     7,
     8},
    {1.88,
     0.38,
     1.55,
     -1.45,
     {{{2.50, .38, .80, .88, .84, .70, false, false},
       {2.32, .30, .98, 1.04, .96, .78, false, false},
       {1.25, .30, 1.08, 1.15, 1.0, .84, true, true},
       {0.65, .30, 1.11, 1.70, 1.0, .72, true, false},
       {0.05, .30, 1.12, 1.77, 1.0, .72, false, false},
       {-0.06, .30, 1.12, 1.77, 1.0, .72, true, false},
       {-0.60, .30, 1.12, 1.73, 1.0, .70, true, true},
       {-0.85, .30, 1.10, 1.12, 1.0, .90, false, false},
       {-2.44, .34, 1.10, 1.12, 1.0, .90, false, false},
       {-2.50, .46, 1.00, 1.04, .98, .88, false, false}}},
     2,
     3,
     6,
     7},
}};

const Profile& profile_of(CarKind kind) { return kProfiles[static_cast<std::size_t>(kind)]; }

/// The right half of a section, from the underside up, then mirrored from the top down: 8 points.
std::array<Vec3, 8> section(const Station& s, double half_width, const Pose& X_WC) {
  const std::array<Vec2, 4> half{{{0.90 * s.shoulder * half_width, s.low},
                                  {s.shoulder * half_width, s.low + 0.45 * (s.belt - s.low)},
                                  {0.97 * s.shoulder * half_width, s.belt},
                                  {s.crown * half_width, s.top}}};
  std::array<Vec3, 8> ring;
  for (std::size_t i = 0; i < 4; ++i) {
    ring[i] = X_WC * Vec3(s.x, -half[i].x(), half[i].y());
    ring[7 - i] = X_WC * Vec3(s.x, half[i].x(), half[i].y());
  }
  return ring;
}

void add_shell(MeshBuilder& mesh, const Profile& car, const Pose& X_WC, std::uint32_t body,
               std::uint32_t glass) {
  const auto ring_of = [&](const Station& s) { return section(s, 0.5 * car.width, X_WC); };
  const auto add_end = [&](const std::array<Vec3, 8>& r) {
    for (std::size_t i = 0; i < 3; ++i) mesh.add_quad(body, r[i], r[i + 1], r[6 - i], r[7 - i]);
  };
  std::array<Vec3, 8> previous = ring_of(car.stations[0]);
  add_end(previous);
  for (std::size_t k = 0; k + 1 < car.stations.size(); ++k) {
    const Station& s = car.stations[k];
    const std::array<Vec3, 8> next = ring_of(car.stations[k + 1]);
    for (std::size_t i = 0; i < 8; ++i) {
      const std::size_t j = (i + 1) % 8;
      const bool window = (s.side_glass && (i == 2 || i == 4)) || (s.top_glass && i == 3);
      mesh.add_quad(window ? glass : body, previous[i], previous[j], next[j], next[i]);
    }
    previous = next;
  }
  add_end(previous);
}

void add_wheels(MeshBuilder& mesh, const Profile& car, const Pose& X_WC, std::uint32_t body,
                std::uint32_t tyres) {
  constexpr double kHalfTyre = 0.11;
  constexpr double kProud = 0.015;  // the tyre stands out of the body, and the rim out of the tyre
  constexpr int kSides = 12;
  const Mat3 across = so3::Exp(Vec3(-0.5 * std::numbers::pi, 0, 0));  // z to the left
  for (const double x : {car.front_axle, car.rear_axle}) {
    for (const double side : {-1.0, 1.0}) {
      const double outer = 0.5 * car.width + kProud;
      const Vec3 hub(x, side * (outer - kHalfTyre), car.wheel_radius);
      mesh.add_cylinder(tyres, X_WC * Pose{across, hub}, car.wheel_radius, kHalfTyre, kSides);
      const Vec3 rim(x, side * (outer + kProud), car.wheel_radius);
      mesh.add_disc(body, X_WC * Pose{across, rim}, 0.62 * car.wheel_radius, kSides);
    }
  }
}

void add_mirrors(MeshBuilder& mesh, const Profile& car, const Pose& X_WC, std::uint32_t body) {
  const Station& s = car.stations[car.cowl];
  for (const double side : {-1.0, 1.0}) {
    const Vec3 centre(s.x - 0.25, side * (0.5 * car.width + 0.04), s.belt + 0.10);
    mesh.add_box(body, X_WC * Pose{Mat3::Identity(), centre}, {0.06, 0.09, 0.07});
  }
}

/// Front and rear, on the ends of the shell.
void add_plates(MeshBuilder& mesh, const Profile& car, const Pose& X_WC, std::uint32_t plates) {
  constexpr double kHalfWidth = 0.26, kTall = 0.11, kProud = 0.008;  // m, the European format
  for (const std::size_t end : {std::size_t{0}, car.stations.size() - 1}) {
    const Station& s = car.stations[end];
    const double x = s.x + std::copysign(kProud, s.x);
    const double low = 0.5 * (s.low + s.belt) - 0.5 * kTall;
    mesh.add_quad(plates, X_WC * Vec3(x, -kHalfWidth, low), X_WC * Vec3(x, kHalfWidth, low),
                  X_WC * Vec3(x, kHalfWidth, low + kTall),
                  X_WC * Vec3(x, -kHalfWidth, low + kTall));
  }
}

/// Bonnet, middle, cabin and tail as one box each.
void add_solids(MeshBuilder& mesh, const Profile& car, const Pose& X_WC, std::uint32_t body) {
  const auto& s = car.stations;
  const double half = 0.5 * car.width;
  const auto add = [&](double x0, double x1, double half_width, double z0, double z1) {
    const Vec3 centre(0.5 * (x0 + x1), 0, 0.5 * (z0 + z1));
    mesh.add_collision_box(body, X_WC * Pose{Mat3::Identity(), centre},
                           {0.5 * (x1 - x0), half_width, 0.5 * (z1 - z0)});
  };
  const double low = s[car.cowl].low;
  const double bonnet = 0.5 * (s[1].top + s[car.cowl].top);
  const double cowl = s[car.cowl].x, tail = s[car.tail].x;
  add(cowl, s.front().x, 0.94 * half, low, bonnet);
  add(tail, cowl, half, low, s[car.roof_rear].belt);
  add(0.5 * (tail + s[car.roof_rear].x), 0.5 * (cowl + s[car.roof_front].x),
      0.5 * (1 + s[car.roof_front].crown) * half, s[car.roof_rear].belt, s[4].top);
  add(s.back().x, tail, 0.96 * half, low, 0.5 * (s[car.tail].top + s[8].top));
}

}  // namespace

Vec3 car_size(CarKind kind) {
  const Profile& car = profile_of(kind);
  double height = 0;
  for (const Station& s : car.stations) height = std::max(height, s.top);
  return {car.stations.front().x - car.stations.back().x, car.width, height};
}

void add_car(MeshBuilder& mesh, CarKind kind, const Pose& X_WC, const CarMaterials& materials) {
  const Profile& car = profile_of(kind);
  const std::uint32_t body = mesh.add_object(SurfaceClass::kCar, materials.paint);
  const std::uint32_t glass = mesh.add_object(SurfaceClass::kCar, materials.glass);
  const std::uint32_t tyres = mesh.add_object(SurfaceClass::kCar, materials.rubber);
  add_shell(mesh, car, X_WC, body, glass);
  add_wheels(mesh, car, X_WC, body, tyres);
  add_mirrors(mesh, car, X_WC, body);
  add_plates(mesh, car, X_WC, mesh.add_object(SurfaceClass::kCar, materials.plate));
  add_solids(mesh, car, X_WC, body);
}

}  // namespace arex::worlds
