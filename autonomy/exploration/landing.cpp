#include "exploration/landing.h"

#include <algorithm>
#include <cmath>

#include "mapping/distance_transform.h"

namespace arex {
namespace {

/// Whether something hangs over the floor of a column, or stands on it, below this z in O.
bool is_covered(const FloorMap& floor, std::size_t cell, double z_O, double resolution_m) {
  return floor.overhead[cell] != FloorMap::kNothing && floor.overhead[cell] * resolution_m < z_O;
}

bool has_floor(const FloorMap& floor, std::size_t cell) {
  return floor.top[cell] != FloorMap::kUnknown && floor.top[cell] != FloorMap::kUnseen;
}

}  // namespace

/// A reachable place.
struct LandingFinder::Place {
  Vec2 p = Vec2::Zero();
  double travel_m = 0;
  double room_m = 0;        ///< to the nearest thing
  double known_room_m = 0;  ///< to the nearest thing, or air that is not known to be free
};

LandingFinder::LandingFinder(const LandingConfig& config, const ExplorerConfig& explorer,
                             double vehicle_radius_m)
    : config_(config),
      explorer_(explorer),
      body_m_(vehicle_radius_m),
      footing_m_(vehicle_radius_m + config.margin_m) {}

LandingGround LandingFinder::assess(const OccupancyMap2D& map, const Vec3& p_O) const {
  const Vec2 p = p_O.head<2>();
  const Eigen::Vector2i centre = map.cell_of(p);
  if (!map.contains(centre) || map.floor.top.empty()) return LandingGround::kUnknown;
  const int reach = static_cast<int>(std::ceil(footing_m_ / map.resolution));
  int cells = 0, seen = 0, unknown = 0, lowest = FloorMap::kNothing, highest = FloorMap::kUnknown;
  for (int dy = -reach; dy <= reach; ++dy) {
    for (int dx = -reach; dx <= reach; ++dx) {
      const Eigen::Vector2i cell = centre + Eigen::Vector2i(dx, dy);
      if ((map.centre_of(cell) - p).norm() > footing_m_) continue;
      ++cells;
      if (!map.contains(cell)) {
        ++unknown;
        continue;
      }
      const std::size_t i = map.index(cell);
      if (is_covered(map.floor, i, p_O.z() + body_m_, map.resolution)) {
        return LandingGround::kObstructed;
      }
      unknown += map.floor.top[i] == FloorMap::kUnknown;
      if (!has_floor(map.floor, i)) continue;
      ++seen;
      lowest = std::min<int>(lowest, map.floor.top[i]);
      highest = std::max<int>(highest, map.floor.top[i]);
    }
  }
  constexpr double kRounding = 1e-9;
  if (seen > 0 && (highest - lowest) * map.resolution > config_.max_relief_m + kRounding) {
    return LandingGround::kObstructed;
  }
  const bool known = unknown == 0 && seen >= config_.min_floor_seen * cells;
  return known ? LandingGround::kClear : LandingGround::kUnknown;
}

std::vector<LandingFinder::Place> LandingFinder::reachable_places(
    const ExplorationSpace& space) const {
  const OccupancyMap2D& map = space.map();
  const auto width = static_cast<std::size_t>(map.width);
  const auto covered = [&](std::size_t i) {
    const Vec2 p = map.centre_of({static_cast<int>(i % width), static_cast<int>(i / width)});
    return is_covered(map.floor, i, at_flight_height(explorer_, p, map).z() + body_m_,
                      map.resolution);
  };
  const auto from_covered = squared_distances(map.width, map.height, covered);
  const auto from_unclear = squared_distances(map.width, map.height, [&](std::size_t i) {
    return covered(i) || map.floor.top[i] == FloorMap::kUnknown;
  });
  const auto metres = [&](std::int32_t squared) {
    return squared == kNoObstacle ? std::numeric_limits<double>::infinity()
                                  : map.resolution * std::sqrt(static_cast<double>(squared));
  };
  std::vector<Place> places;
  for (int y = 0; y < map.height; ++y) {
    for (int x = 0; x < map.width; ++x) {
      const Eigen::Vector2i cell(x, y);
      if (!space.is_reachable(cell) || !space.is_free(cell)) continue;
      const std::size_t i = map.index(cell);
      places.push_back({map.centre_of(cell), space.travel_distance(cell),
                        std::min(space.clearance(cell), metres(from_covered[i])),
                        metres(from_unclear[i])});
    }
  }
  return places;
}

std::optional<LandingPlace> LandingFinder::find(const OccupancyMap2D& map, const Vec3& p_OB,
                                                const LandingQuery& query,
                                                std::span<const std::uint32_t> flown_since) const {
  const ExplorationSpace space(map, explorer_.bounds, explorer_.space, p_OB.head<2>(), flown_since);
  std::vector<Place> places = reachable_places(space);
  std::erase_if(places, [&](const Place& place) {
    return std::any_of(query.tried.begin(), query.tried.end(), [&](const Vec2& other) {
      return (other - place.p).norm() < config_.apart_m;
    });
  });
  if (places.empty()) return std::nullopt;
  std::stable_sort(places.begin(), places.end(),
                   [](const Place& a, const Place& b) { return a.travel_m < b.travel_m; });
  const auto above = [&](LandingPlace::Kind kind, const auto& place) {
    return LandingPlace{kind, at_flight_height(explorer_, place->p, map)};
  };
  const double preferred_m = std::max(explorer_.stop.landing_clearance_m, footing_m_);
  struct Demand {
    LandingPlace::Kind kind;
    double room_m;
  };
  for (const Demand demand : {Demand{LandingPlace::Kind::kClear, preferred_m},
                              Demand{LandingPlace::Kind::kClear, footing_m_},
                              Demand{LandingPlace::Kind::kToBeSeen, footing_m_}}) {
    if (query.last_resort) break;
    const bool must_be_clear = demand.kind == LandingPlace::Kind::kClear;
    const auto place = std::find_if(places.begin(), places.end(), [&](const Place& p) {
      if (p.room_m < demand.room_m) return false;
      if (must_be_clear && p.known_room_m < footing_m_) return false;
      const LandingGround ground = assess(map, at_flight_height(explorer_, p.p, map));
      return must_be_clear ? ground == LandingGround::kClear : ground != LandingGround::kObstructed;
    });
    if (place != places.end()) return above(demand.kind, place);
  }
  const auto widest =
      std::max_element(places.begin(), places.end(),
                       [](const Place& a, const Place& b) { return a.room_m < b.room_m; });
  return above(LandingPlace::Kind::kWidest, widest);
}

}  // namespace arex
