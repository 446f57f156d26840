#pragma once

#include <optional>
#include <span>
#include <vector>

#include "exploration/frontier_explorer.h"

namespace arex {

/// What the mission asks of the map: where to land.
struct LandingQuery {
  std::vector<Vec2> tried;   ///< places in O that were in vain
  bool last_resort = false;  ///< no more tries: the widest place that can be reached
};

/// What a place to land must be like, beside exploration.stop.landing_clearance_m.
struct LandingConfig {
  double margin_m = 0.3;      ///< drift while coming down, odometry and wind
  double max_relief_m = 0.2;  ///< a level floor on the border of two layers has one of 0.1
  double min_floor_seen = 0.5;
  double apart_m = 1.0;
  int tries = 5;

  void fields(auto& f) {
    f("margin_m", margin_m, "around the vehicle: floor that must be free and flat, too");
    f("max_relief_m", max_relief_m, "between the lowest and the highest floor below it");
    f("min_floor_seen", min_floor_seen, "share of the floor below it that was seen");
    f("apart_m", apart_m, "of a place from those that were tried before");
    f("tries", tries, "places flown to before it lands on the widest that is known");
    f.check(margin_m >= 0, "margin_m >= 0");
    f.check(max_relief_m >= 0, "max_relief_m >= 0");
    f.check(min_floor_seen >= 0 && min_floor_seen <= 1, "min_floor_seen in [0, 1]");
    f.check(apart_m >= 0, "apart_m >= 0");
    f.check(tries >= 1, "tries >= 1");
  }
};

/// What the 3D map knows of the ground under the whole vehicle and its margin.
enum class LandingGround : std::uint8_t {
  kUnknown,
  kClear,       ///< flat, and nothing stands on it or hangs over it on the way down
  kObstructed,  ///< something does, or it is not flat
};

/// Where to land, best first.
struct LandingPlace {
  enum class Kind : std::uint8_t {
    kClear,     ///< known to be free and flat
    kToBeSeen,  ///< nothing known speaks against it: to be looked at from above
    kWidest,    ///< there is neither: as far from everything known as can be reached
  };
  Kind kind = Kind::kClear;
  Vec3 p_O = Vec3::Zero();  ///< above it, at flight height
};

/// Finds the ground for a landing in the 2D map and the floor under it. Positions in O, metres.
class LandingFinder {
 public:
  /// @param explorer how high, how far from obstacles, and where it can fly
  LandingFinder(const LandingConfig& config, const ExplorerConfig& explorer,
                double vehicle_radius_m);

  /// The ground straight below p, and the way down to it.
  [[nodiscard]] LandingGround assess(const OccupancyMap2D& map, const Vec3& p_O) const;

  /// The reachable place to which the way is the shortest: a clear one that is
  /// landing_clearance_m from obstacles, else a clear one, else one to be seen, else the widest.
  /// None of those within apart_m of places tried; nothing if nothing else can be reached.
  [[nodiscard]] std::optional<LandingPlace> find(const OccupancyMap2D& map, const Vec3& p_OB,
                                                 const LandingQuery& query,
                                                 std::span<const std::uint32_t> flown_since) const;

 private:
  struct Place;
  [[nodiscard]] std::vector<Place> reachable_places(const ExplorationSpace& space) const;

  LandingConfig config_;
  ExplorerConfig explorer_;
  double body_m_;     ///< the vehicle's radius
  double footing_m_;  ///< the vehicle's radius and the margin
};

}  // namespace arex
