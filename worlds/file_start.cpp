#include "worlds/file_start.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <tuple>

#include "config/config.h"
#include "math/so3.h"
#include "worlds/file_ground.h"
#include "worlds/triangle.h"

namespace arex::worlds {
namespace {

constexpr double kStartResolution = 0.2;  // m; conservative cells make every gap narrower by this
constexpr double kMostStartCells = 4e7;   // beyond, the cells grow
constexpr double kHover = Ground::kHeadroom;  // where room is looked for, above the ground, m
constexpr double kWanted = 0.7;               // room there that is as good as more, m
constexpr double kOffRim = 2.0;               // from the world's rim to an origin that is meant, m
constexpr double kLattice = 0.4;              // between the places that are tried, m
constexpr double kFoot = 0.1;                 // from the middle to a leg, along x and y, m
constexpr double kUneven = 0.05;     // between the ground's heights under middle and legs, m
constexpr double kOnGround = 0.3;    // a given height this far from the ground means it, m
constexpr double kFairShare = 0.1;   // of the free space that a start is to give access to
constexpr double kLeastReach = 1.0;  // m^2 that can be reached, seen from above

/// Distance from a point to the nearest triangle that is not the ground it is above, at most 2 m.
double room_at(const World& world, const Vec3& p, double ground) {
  double room = 2;
  for (std::size_t t = 0; t < world.mesh.triangles.size(); ++t) {
    if (world.class_of_triangle(t) == SurfaceClass::kLeaf) continue;
    const std::array<Vec3, 3> v = corners_of(world, t);
    const Vec3 low = v[0].cwiseMin(v[1]).cwiseMin(v[2]), high = v[0].cwiseMax(v[1]).cwiseMax(v[2]);
    if (((low - p).array() > room).any() || ((p - high).array() > room).any()) continue;
    const Vec3 nearest = nearest_on_triangle(p, v[0], v[1], v[2]);
    const Vec3 normal = (v[1] - v[0]).cross(v[2] - v[0]).normalized();
    const bool is_ground =
        std::abs(normal.z()) >= Ground::kStandable && nearest.z() < ground + kOnGround;
    if (!is_ground) room = std::min(room, (nearest - p).norm());
  }
  return room;
}

/// Free space at a resolution that memory allows, nothing flooded yet; `room` in m.
struct Space {
  FreeSpace free;
  std::vector<float> room2;  ///< squared, in cells
  std::size_t passable = 0;
};

Space space_of(const World& world, double radius_m) {
  const double volume = (world.bounds.high - world.bounds.low).prod();
  const double resolution = std::max(kStartResolution, std::cbrt(volume / kMostStartCells));
  OccupancyGrid occupancy = voxelize(world, make_grid(world.bounds, resolution),
                                     ClassSet::all().without(SurfaceClass::kLeaf));
  Space space;
  space.room2 = squared_distances(occupancy);
  space.free.grid = occupancy.grid;
  space.free.passable = std::move(occupancy.occupied);
  const auto limit = static_cast<float>(std::pow(radius_m / resolution, 2));
  for (std::size_t i = 0; i < space.room2.size(); ++i) {
    space.free.passable[i] = space.room2[i] > limit;
    space.passable += space.free.passable[i];
  }
  space.free.reachable.assign(space.free.passable.size(), 0);
  return space;
}

bool is_level_at(const Ground& ground, const Vec2& p, double z) {
  for (const Vec2& leg :
       {Vec2(kFoot, kFoot), Vec2(-kFoot, kFoot), Vec2(kFoot, -kFoot), Vec2(-kFoot, -kFoot)}) {
    const std::vector<double> heights = ground.heights(p + leg);
    if (std::none_of(heights.begin(), heights.end(),
                     [&](double h) { return std::abs(h - z) < kUneven; })) {
      return false;
    }
  }
  return true;
}

/// Of uneven ground under a given place, the highest point that a leg may come to stand on: none
/// begins inside it.
double highest_under(const Ground& ground, const Vec2& p, double z) {
  double highest = z;
  for (double x = -1.5 * kFoot; x < 2 * kFoot; x += 0.5 * kFoot) {
    for (double y = -1.5 * kFoot; y < 2 * kFoot; y += 0.5 * kFoot) {
      for (const double h : ground.floors(p + Vec2(x, y))) {
        if (h < z + kOnGround) highest = std::max(highest, h);
      }
    }
  }
  return highest;
}

struct Candidate {
  Vec3 p = Vec3::Zero();  ///< on the ground
  double room = 0;        ///< at most kWanted
  double distance = 0;    ///< from where a start is looked for
};

/// The first cell above a place where the vehicle fits; outside the grid if there is none.
Eigen::Vector3i cell_above(const FreeSpace& free, const Vec3& p) {
  constexpr double kHighest = 1.6;
  for (double rise = 0.3; rise <= kHighest; rise += 0.5 * free.grid.resolution_m) {
    const Eigen::Vector3i cell = free.grid.cell_of(p + rise * Vec3::UnitZ());
    if (free.grid.contains(cell) && free.passable[free.grid.index(cell)]) return cell;
  }
  return Eigen::Vector3i::Constant(-1);
}

std::vector<Candidate> candidates(const World& world, const Ground& ground, const Space& space) {
  const Bounds& bounds = world.bounds;
  // Those who make worlds to fly in put the vehicle at their origin.
  const Vec2 middle = 0.5 * (bounds.low + bounds.high).head<2>();
  const bool has_origin = (bounds.low.head<2>().array() < -kOffRim).all() &&
                          (bounds.high.head<2>().array() > kOffRim).all();
  const Vec2 wanted = has_origin ? Vec2(0, 0) : middle;
  std::vector<Candidate> found;
  const Vec2 first = ((bounds.low.head<2>() - wanted) / kLattice).array().ceil();
  const Vec2 last = ((bounds.high.head<2>() - wanted) / kLattice).array().floor();
  for (double j = first.y(); j <= last.y(); ++j) {
    for (double i = first.x(); i <= last.x(); ++i) {
      const Vec2 p = wanted + kLattice * Vec2(i, j);
      for (const double z : ground.floors(p)) {
        const Vec3 place(p.x(), p.y(), z);
        const Eigen::Vector3i hover = space.free.grid.cell_of(place + kHover * Vec3::UnitZ());
        if (!space.free.grid.contains(hover)) continue;
        if (!space.free.passable[space.free.grid.index(hover)]) continue;
        const double room =
            std::sqrt(static_cast<double>(space.room2[space.free.grid.index(hover)])) *
            space.free.grid.resolution_m;
        found.push_back({place, std::min(room, kWanted), (p - wanted).norm()});
      }
    }
  }
  std::stable_sort(found.begin(), found.end(), [](const Candidate& a, const Candidate& b) {
    return std::tuple(-a.room, a.distance, a.p.z()) < std::tuple(-b.room, b.distance, b.p.z());
  });
  return found;
}

FoundStart search(const World& world, const Ground& ground, Space& space, double yaw_rad) {
  FreeSpace& free = space.free;
  std::size_t best_volume = 0;
  std::optional<Vec3> best;
  constexpr std::size_t kMostLevelTests = 100'000;
  std::size_t tests = 0;
  for (const Candidate& candidate : candidates(world, ground, space)) {
    const Eigen::Vector3i cell = cell_above(free, candidate.p);
    if (!free.grid.contains(cell) || free.reachable[free.grid.index(cell)]) continue;
    if (++tests > kMostLevelTests) break;
    if (!is_level_at(ground, candidate.p.head<2>(), candidate.p.z())) continue;
    const std::size_t volume = flood(free, cell);
    if (volume <= best_volume) continue;
    best_volume = volume;
    best = candidate.p;
    if (static_cast<double>(volume) > kFairShare * static_cast<double>(space.passable)) break;
  }
  if (!best)
    throw ConfigError(fmt::format(
        "holds no place to start from: level, with room around and above it. It is {:.3g} x {:.3g} "
        "m large: see file.scale, file.up and, of a cloud, file.voxel_m",
        world.bounds.high.x() - world.bounds.low.x(),
        world.bounds.high.y() - world.bounds.low.y()));
  return {
      {so3::from_yaw(yaw_rad), *best}, room_at(world, *best + 0.5 * Vec3::UnitZ(), best->z()), {}};
}

[[noreturn]] void refuse(const std::string& start, const std::string& why) {
  throw ConfigError("file.start.position_m " + start + " " + why);
}

FoundStart given(const World& world, const Ground& ground, const FileStart& start,
                 double radius_m) {
  const Vec2 p(start.position_m[0], start.position_m[1]);
  const std::vector<double> heights = ground.floors(p);
  std::string name =
      "[" + config_detail::format_scalar(p.x()) + ", " + config_detail::format_scalar(p.y());
  const bool has_height = start.position_m.size() == 3;
  if (has_height) name += ", " + config_detail::format_scalar(start.position_m[2]);
  name += "]";
  if (heights.empty())
    throw ConfigError("file.start.position_m " + name + " has no ground below it");
  double best = std::nan(""), best_room = -1;
  if (has_height) {
    const double z = start.position_m[2];
    for (const double h : heights) {
      if (!(std::abs(h - z) >= std::abs(best - z))) best = h;
    }
    if (std::abs(best - z) > kOnGround) {
      refuse(name, best < z ? fmt::format("is in the air, {:.2f} m above the ground", z - best)
                            : fmt::format("is {:.2f} m below the ground", best - z));
    }
    best_room = room_at(world, {p.x(), p.y(), best + 0.5}, best);
  } else {
    // The lowest floor with room, or else the one with most.
    for (const double h : heights) {
      const double room = room_at(world, {p.x(), p.y(), h + 0.5}, h);
      if (room > best_room) {
        best = h;
        best_room = room;
      }
      if (best_room >= kWanted) break;
    }
  }
  if (best_room < radius_m) {
    refuse(name,
           fmt::format("leaves no room: the nearest surface is {:.2f} m from the standing vehicle",
                       best_room));
  }
  const double pad = highest_under(ground, p, best);
  return {{so3::from_yaw(start.yaw_rad), Vec3(p.x(), p.y(), pad)}, best_room, {}};
}

double area_of(const FreeSpace& free) {
  const std::size_t layer =
      static_cast<std::size_t>(free.grid.size.x()) * static_cast<std::size_t>(free.grid.size.y());
  std::vector<std::uint8_t> seen(layer, 0);
  for (std::size_t i = 0; i < free.reachable.size(); ++i) seen[i % layer] |= free.reachable[i];
  const double count = static_cast<double>(std::count(seen.begin(), seen.end(), 1));
  return count * free.grid.resolution_m * free.grid.resolution_m;
}

}  // namespace

FoundStart find_start(const World& world, const FileStart& start, double vehicle_radius_m) {
  const Ground ground(world);
  Space space = space_of(world, vehicle_radius_m);
  FoundStart found = start.position_m.empty() ? search(world, ground, space, start.yaw_rad)
                                              : given(world, ground, start, vehicle_radius_m);
  found.free = std::move(space.free);
  std::fill(found.free.reachable.begin(), found.free.reachable.end(), std::uint8_t{0});
  const Eigen::Vector3i cell = cell_above(found.free, found.X_WS.p);
  if (found.free.grid.contains(cell)) flood(found.free, cell);
  if (area_of(found.free) < kLeastReach) {
    throw ConfigError("lets the vehicle reach nothing from its start; see file.start, file.scale");
  }
  return found;
}

}  // namespace arex::worlds
