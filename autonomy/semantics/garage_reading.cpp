#include "semantics/garage_reading.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "semantics/doors.h"
#include "semantics/parked_cars.h"

namespace arex {
namespace {

constexpr double kOnSurface = 0.12;  // m, roughness and noise of a floor's or ceiling's points
constexpr double kOnFace = 0.1;      // m, likewise of a wall's
constexpr double kBesideLeaf = 0.2;  // m, of a shut door from its wall's face

/// @param size along its own axes and upwards, from base_z on
SemanticObject object_of(SemanticClass kind, const Vec2& centre, double base_z, const Vec3& size,
                         double yaw_rad, double confidence) {
  SemanticObject object;
  object.kind = kind;
  object.position = {centre.x(), centre.y(), base_z + 0.5 * size.z()};
  object.size = size;
  object.yaw_rad = yaw_rad;
  object.base_z = base_z;
  object.confidence = confidence;
  return object;
}

/// The lowest floor of each cell, its neighbours' where there is none.
Raster ground_of(const WorkingCloud& cloud, const std::vector<LevelSurface>& surfaces) {
  Raster ground(cloud.low.head<2>().cast<double>(), cloud.high.head<2>().cast<double>(),
                WorkingCloud::kCell, std::numeric_limits<float>::quiet_NaN());
  for (int r = 0; r < ground.rows; ++r) {
    for (int c = 0; c < ground.columns; ++c) {
      const Vec2 at = ground.centre(c, r);
      float& z = ground.values[ground.index(c, r)];
      for (const LevelSurface& surface : surfaces) {
        if (surface.kind != LevelSurface::Kind::kFloor) continue;
        const float floor = surface.height.values[surface.height.cell_of(at.x(), at.y())];
        if (!(floor >= z)) z = std::isnan(floor) ? z : floor;
      }
    }
  }
  return ground;
}

/// Ramps: pieces of floors that are steep, as rectangles along the slope.
class RampFinder {
 public:
  RampFinder(const std::vector<LevelSurface>& surfaces, const GarageConfig& config) {
    const double least = to_radians(config.ramp_slope_deg);
    const double most = to_radians(config.max_slope_deg);
    for (const LevelSurface& surface : surfaces) {
      masks_.emplace_back();
      if (surface.kind != LevelSurface::Kind::kFloor) continue;
      masks_.back() = find(surface, least, most);
      frame_ = surface.height;
    }
    merge();
  }
  [[nodiscard]] bool steep(int surface, const Vec2& p) const {
    if (surface < 0) return false;
    const std::vector<std::uint8_t>& mask = masks_[static_cast<std::size_t>(surface)];
    return !mask.empty() && mask[frame_.cell_of(p.x(), p.y())] != 0;
  }
  /// Whether a place lies on a ramp or just beside it.
  [[nodiscard]] bool at(const Vec2& p, double z) const {
    constexpr double kBeside = 0.6, kSlack = 0.1;  // m
    return std::any_of(ramps_.begin(), ramps_.end(), [&](const SemanticObject& ramp) {
      const Rectangle box{ramp.position.head<2>(), ramp.size.x(), ramp.size.y(), ramp.yaw_rad};
      return box.distance(p) < kBeside && z > ramp.base_z + kSlack &&
             z < ramp.base_z + ramp.size.z() - kSlack;
    });
  }
  [[nodiscard]] const std::vector<SemanticObject>& ramps() const { return ramps_; }

 private:
  /// Joins pieces of one ramp, whose floors met on it.
  void merge() {
    constexpr double kApart = 1.0, kAskew = 0.2;  // m, rad
    for (std::size_t i = 0; i < ramps_.size(); ++i) {
      for (std::size_t j = i + 1; j < ramps_.size();) {
        SemanticObject &a = ramps_[i], &b = ramps_[j];
        const bool along = std::abs(std::sin(a.yaw_rad - b.yaw_rad)) < kAskew;
        const bool level =
            a.base_z < b.base_z + b.size.z() + kApart && b.base_z < a.base_z + a.size.z() + kApart;
        std::vector<Vec2> corners = corners_of(a);
        const Rectangle box{b.position.head<2>(), b.size.x(), b.size.y(), b.yaw_rad};
        const bool beside = std::any_of(corners.begin(), corners.end(), [&](const Vec2& corner) {
          return box.distance(corner) < kApart;
        });
        if (!along || !level || !beside) {
          ++j;
          continue;
        }
        for (const Vec2& corner : corners_of(b)) corners.push_back(corner);
        const Rectangle both = rectangle_around(corners, a.yaw_rad, 0);
        const double low = std::min(a.base_z, b.base_z);
        const double high = std::max(a.base_z + a.size.z(), b.base_z + b.size.z());
        a.position = {both.centre.x(), both.centre.y(), 0.5 * (low + high)};
        a.size = {both.length, both.width, high - low};
        a.yaw_rad = both.yaw_rad;
        a.base_z = low;
        a.confidence = std::min(a.confidence, b.confidence);
        ramps_.erase(ramps_.begin() + static_cast<std::ptrdiff_t>(j));
      }
    }
  }
  static std::vector<Vec2> corners_of(const SemanticObject& ramp) {
    const Vec2 u(std::cos(ramp.yaw_rad), std::sin(ramp.yaw_rad)), v(-u.y(), u.x());
    const Vec2 centre = ramp.position.head<2>();
    const Vec2 a = 0.5 * ramp.size.x() * u, b = 0.5 * ramp.size.y() * v;
    return {centre + a + b, centre + a - b, centre - a + b, centre - a - b};
  }

  std::vector<std::uint8_t> find(const LevelSurface& surface, double least, double most) {
    const Raster slopes = slopes_of(surface);
    constexpr double kLeastArea = 8.0, kLeastSide = 1.8;  // m^2, m
    constexpr std::array<std::pair<int, int>, 4> kSides{{{1, 0}, {-1, 0}, {0, 1}, {0, -1}}};
    std::vector<std::uint8_t> mask(slopes.values.size(), 0);
    std::vector<std::uint8_t> open(slopes.values.size(), 0);
    for (std::size_t i = 0; i < open.size(); ++i) {
      const auto slope = static_cast<double>(slopes.values[i]);
      open[i] = slope >= least && slope <= most;
    }
    for (std::size_t i = 0; i < open.size(); ++i) {
      if (open[i] == 0) continue;
      std::vector<std::size_t> cells{i};
      open[i] = 0;
      for (std::size_t k = 0; k < cells.size(); ++k) {
        const int c = static_cast<int>(cells[k] % static_cast<std::size_t>(slopes.columns));
        const int r = static_cast<int>(cells[k] / static_cast<std::size_t>(slopes.columns));
        for (const auto& [dc, dr] : kSides) {
          if (!slopes.contains(c + dc, r + dr)) continue;
          const std::size_t next = slopes.index(c + dc, r + dr);
          if (open[next] == 0) continue;
          open[next] = 0;
          cells.push_back(next);
        }
      }
      const double area = static_cast<double>(cells.size()) * slopes.cell_m * slopes.cell_m;
      if (area < kLeastArea) continue;
      std::vector<Vec2> plan;
      float low = std::numeric_limits<float>::infinity(), high = -low;
      for (const std::size_t cell : cells) {
        const int c = static_cast<int>(cell % static_cast<std::size_t>(slopes.columns));
        const int r = static_cast<int>(cell / static_cast<std::size_t>(slopes.columns));
        plan.push_back(slopes.centre(c, r));
        low = std::min(low, surface.height.values[cell]);
        high = std::max(high, surface.height.values[cell]);
      }
      const Rectangle box = fit_rectangle(plan, 0.02);
      if (box.width < kLeastSide || high - low < 0.5F) continue;
      for (const std::size_t cell : cells) mask[cell] = 1;
      const double base = static_cast<double>(low), height = static_cast<double>(high - low);
      const Vec3 size(box.length + slopes.cell_m, box.width + slopes.cell_m, height);
      ramps_.push_back(object_of(SemanticClass::kRamp, box.centre, base, size, box.yaw_rad,
                                 std::min(1.0, area / (0.8 * box.length * box.width))));
    }
    return mask;
  }

  std::vector<std::vector<std::uint8_t>> masks_;  ///< per surface and cell: 1 where it is a ramp
  Raster frame_;                                  ///< the cells' places
  std::vector<SemanticObject> ramps_;
};

double saturating(int points, double usual) { return 1 - std::exp(-points / usual); }

void add_objects(const UprightStructure& structure, const std::vector<ParkedCar>& cars,
                 const std::vector<Door>& doors, std::vector<SemanticObject>& objects) {
  for (const WallFace& wall : structure.walls) {
    const double yaw = std::atan2(wall.along().y(), wall.along().x());
    objects.push_back(object_of(SemanticClass::kWall, 0.5 * (wall.a + wall.b), wall.base_z,
                                {wall.length(), 0, wall.high - wall.base_z}, yaw,
                                saturating(wall.points, 40 * wall.length())));
  }
  for (const Pillar& pillar : structure.pillars) {
    const Rectangle& box = pillar.box;
    objects.push_back(object_of(SemanticClass::kPillar, box.centre, pillar.base_z,
                                {box.length, box.width, pillar.top_z - pillar.base_z}, box.yaw_rad,
                                saturating(pillar.points, 60) * (pillar.attached ? 0.7 : 1)));
  }
  for (const ParkedCar& car : cars) {
    objects.push_back(object_of(SemanticClass::kCar, car.box.centre, car.base_z,
                                {car.box.length, car.box.width, car.height}, car.box.yaw_rad,
                                saturating(car.points, 150) * (car.whole ? 1 : 0.7)));
  }
  for (const Door& door : doors) {
    objects.push_back(object_of(SemanticClass::kDoor, door.centre, door.base_z,
                                {door.width, 0, door.height}, door.yaw_rad, door.open ? 0.6 : 0.5));
  }
}

/// Labels of what is no floor and no ceiling, by the objects that it is part of.
SemanticClass part_of(const Vec3f& p, double above_floor, double room,
                      const UprightStructure& structure, const std::vector<ParkedCar>& cars,
                      const std::vector<Door>& doors) {
  const Vec2 q = flat(p);
  const auto z = static_cast<double>(p.z());
  const auto on_floor_of = [&](double base) { return std::abs(z - above_floor - base) < 0.6; };
  for (const Pillar& pillar : structure.pillars) {
    if (on_floor_of(pillar.base_z) && pillar.box.reaches(q, kOnFace)) {
      return SemanticClass::kPillar;
    }
  }
  for (const ParkedCar& car : cars) {
    if (on_floor_of(car.base_z) && above_floor < car.height + 0.15 && car.box.reaches(q, 0.12)) {
      return SemanticClass::kCar;
    }
  }
  for (const Door& door : doors) {
    const Rectangle leaf{door.centre, door.width, 2 * kBesideLeaf, door.yaw_rad};
    if (!door.open && on_floor_of(door.base_z) && above_floor < door.height && leaf.reaches(q, 0)) {
      return SemanticClass::kDoor;
    }
  }
  for (const WallFace& wall : structure.walls) {
    if (on_floor_of(wall.base_z) && above_floor <= room + kOnSurface &&
        wall.distance(q) < kOnFace) {
      return SemanticClass::kWall;
    }
  }
  return SemanticClass::kOther;
}

}  // namespace

SceneReading read_garage(const WorkingCloud& cloud, std::span<const Vec3f> path,
                         const SemanticConfig& config) {
  SceneReading reading;
  const std::vector<LevelSurface> surfaces = find_level_surfaces(cloud, path, config.garage);
  const Clearances clearances = measure_clearances(cloud, surfaces);
  const RampFinder ramps(surfaces, config.garage);
  UprightStructure structure = find_upright_structure(cloud, clearances, config.garage);
  std::vector<ParkedCar> cars = find_cars(cloud, clearances, structure, path, config.garage);
  std::vector<Door> doors = find_doors(cloud, clearances, structure);
  // Ramps bear none of them; what seems to stand there belongs to their walls.
  std::erase_if(structure.pillars,
                [&](const Pillar& pillar) { return ramps.at(pillar.box.centre, pillar.base_z); });
  std::erase_if(doors, [&](const Door& door) { return ramps.at(door.centre, door.base_z); });
  std::erase_if(cars, [&](const ParkedCar& car) {
    // Of what was seen from one side the middle is a guess, behind the ramp's wall.
    const Vec2 half = 0.5 * car.box.width * car.box.across();
    return ramps.at(car.box.centre, car.base_z) || ramps.at(car.box.centre + half, car.base_z) ||
           ramps.at(car.box.centre - half, car.base_z);
  });
  reading.ground = ground_of(cloud, surfaces);
  reading.heights = clearances.above_floor;
  reading.objects = ramps.ramps();
  add_objects(structure, cars, doors, reading.objects);
  reading.labels.assign(cloud.points.size(), SemanticClass::kOther);
  for (std::size_t i = 0; i < cloud.points.size(); ++i) {
    const auto h = static_cast<double>(clearances.above_floor[i]);
    const auto room = static_cast<double>(clearances.room[i]);
    if (std::isnan(h)) continue;
    if (std::abs(h) <= kOnSurface) {
      const bool steep = ramps.steep(clearances.floor_of[i], flat(cloud.points[i]));
      reading.labels[i] = steep ? SemanticClass::kRamp : SemanticClass::kFloor;
    } else if (std::abs(h - room) <= kOnSurface) {
      reading.labels[i] = SemanticClass::kCeiling;
    } else {
      reading.labels[i] = part_of(cloud.points[i], h, room, structure, cars, doors);
    }
  }
  return reading;
}

}  // namespace arex
