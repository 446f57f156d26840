#include "scoring/omniscient_tour.h"

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <memory>
#include <queue>
#include <stdexcept>
#include <utility>

#include "math/random.h"
#include "scoring/flight_ways.h"
#include "scoring/sight_map.h"
#include "scoring/tour_order.h"

namespace arex::sim {
namespace {

using Bits = SightMap::Bits;
using Node = FlightWays::Node;

/// A place to see from.
struct Vantage {
  Node node = 0;
  Vec2 place = Vec2::Zero();
};

/// A place that the tour visits.
struct Stop {
  Node node = 0;
  std::shared_ptr<const FlightWays::Distances> distances;  ///< from there
};

/// The way between two stops: how long it is and what is seen from it, its ends included.
struct Leg {
  double length_m = 0;
  Bits seen;
};

double length_of(std::span<const Leg> legs) {
  double sum = 0;
  for (const Leg& leg : legs) sum += leg.length_m;
  return sum;
}

/// The tour while it is made. Stop 0 is where it begins.
class TourPlan {
 public:
  TourPlan(const OmniscientTourConfig& config, const FlightWays& ways, const SightMap& sight,
           const Vec3& start_W, Node start, bool closed)
      : config_(config),
        ways_(ways),
        sight_(sight),
        start_z_(start_W.z()),
        closed_(closed),
        slot_(ways.nodes(), -1) {
    stops_.push_back(stop_at(start));
  }

  void make(std::span<const Vec3f> area_cells_W);

  /// Corners of the whole way; and of it, where it stops.
  [[nodiscard]] std::vector<Vec3> way_W(std::vector<Vec3>& stops_W) const;
  [[nodiscard]] double area_fraction(std::span<const Vec3> way_W) const;

 private:
  [[nodiscard]] std::vector<Vantage> find_vantages(std::span<const Vec3f> area_cells_W) const;
  void choose_stops(const std::vector<Vantage>& vantages, const std::vector<double>& weights);
  void improve(const std::vector<Vantage>& vantages);
  void order_stops();
  bool drop_a_stop();
  bool move_a_stop(std::size_t stop, const std::vector<Vantage>& vantages);

  [[nodiscard]] std::size_t legs() const {
    if (stops_.size() == 1) return 0;
    return closed_ ? stops_.size() : stops_.size() - 1;
  }
  /// The stop after this one; nothing after the last of an open tour.
  [[nodiscard]] const Stop* after(std::size_t stop) const {
    if (stop + 1 < stops_.size()) return &stops_[stop + 1];
    return closed_ ? &stops_.front() : nullptr;
  }
  [[nodiscard]] Stop stop_at(Node node) const {
    return {node, std::make_shared<const FlightWays::Distances>(ways_.distances_from(node))};
  }
  [[nodiscard]] double lattice_m(const Stop& from, Node to) const {
    return ways_.unit_m() * (*from.distances)[to];
  }
  const Bits& seen_from(Node node);
  Bits seen_along(std::span<const Vec3> way_W);
  Leg lay_leg(const Stop& from, Node to);
  void lay_legs();
  /// Whether the tour sees what is wanted; and with other legs instead of those to and from a stop.
  [[nodiscard]] bool suffices() { return suffices_instead(kNoStop, {}); }
  [[nodiscard]] bool suffices_instead(std::size_t stop, std::span<const Leg> other);
  static constexpr std::size_t kNoStop = std::numeric_limits<std::size_t>::max();

  const OmniscientTourConfig& config_;
  const FlightWays& ways_;
  const SightMap& sight_;
  double start_z_;
  bool closed_;
  std::vector<Stop> stops_;
  std::vector<Leg> legs_;           ///< leg i leaves stop i
  std::size_t wanted_ = 0;          ///< patches to be seen
  std::vector<std::int32_t> slot_;  ///< of a node in sights_; -1: not asked for yet
  std::vector<Bits> sights_;
};

// Greedy randomised search (Feo and Resende, 1995): a local optimum from each of several covers,
// the first of them the greedy one. Looking around is what costs time, and how many looks an
// optimum takes depends on the world.
void TourPlan::make(std::span<const Vec3f> area_cells_W) {
  const std::vector<Vantage> vantages = find_vantages(area_cells_W);
  Bits all = seen_from(stops_[0].node);
  for (const Vantage& vantage : vantages) add_bits(all, seen_from(vantage.node));
  wanted_ = static_cast<std::size_t>(
      std::ceil(config_.area_share * static_cast<double>(count_bits(all))));
  constexpr int kMostCovers = 8;  // where there is nothing new to look at
  constexpr double kLeastWeight = 0.7;
  RandomStream random(0, "omniscient_tour");
  std::vector<double> weights(vantages.size(), 1.0);
  std::vector<Stop> best_stops;
  std::vector<Leg> best_legs;
  for (int cover = 0; cover < kMostCovers; ++cover) {
    if (cover > 0 && static_cast<int>(sights_.size()) >= config_.looks) break;
    stops_.resize(1);
    legs_.clear();
    choose_stops(vantages, weights);
    improve(vantages);
    if (cover == 0 || length_of(legs_) < length_of(best_legs)) {
      best_stops = stops_;
      best_legs = legs_;
    }
    for (double& weight : weights) weight = random.uniform(kLeastWeight, 1);
  }
  stops_ = std::move(best_stops);
  legs_ = std::move(best_legs);
}

void TourPlan::improve(const std::vector<Vantage>& vantages) {
  constexpr int kRounds = 10;  // more than it takes
  order_stops();
  for (int round = 0; round < kRounds; ++round) {
    bool changed = false;
    while (drop_a_stop()) changed = true;
    for (std::size_t stop = 1; stop < stops_.size(); ++stop) {
      changed = move_a_stop(stop, vantages) || changed;
    }
    if (!changed) return;
    order_stops();
  }
}

// In each square the cell of the area nearest to the middle that can be flown to.
std::vector<Vantage> TourPlan::find_vantages(std::span<const Vec3f> area_cells_W) const {
  const double side = config_.viewpoint_spacing_m;
  Eigen::AlignedBox2d box;
  for (const Vec3f& cell : area_cells_W) box.extend(cell.head<2>().cast<double>());
  const Eigen::Vector2i size = (box.sizes() / side).array().floor().cast<int>() + 1;
  std::vector<double> least(static_cast<std::size_t>(size.prod()), side * side);
  std::vector<std::optional<Vantage>> found(least.size());
  for (const Vec3f& cell : area_cells_W) {
    const Vec3 p = cell.cast<double>();
    const Vec2 offset = (p.head<2>() - box.min()) / side;
    const Vec2 square = offset.array().floor();
    const auto at = static_cast<std::size_t>(static_cast<int>(square.y()) * size.x() +
                                             static_cast<int>(square.x()));
    const double away = ((offset - square).array() - 0.5).matrix().squaredNorm();
    if (away >= least[at]) continue;
    const auto node = ways_.nearest(p, config_.resolution_m);
    if (!node || (*stops_[0].distances)[*node] == FlightWays::kFar) continue;
    least[at] = away;
    found[at] = {*node, ways_.place_W(*node)};
  }
  std::vector<Vantage> vantages;
  for (const auto& vantage : found) {
    if (vantage) vantages.push_back(*vantage);
  }
  return vantages;
}

// Greedy set cover, each gain weighted, with lazy evaluation: a gain only falls while the cover
// grows, so that what was worked out before bounds it (Minoux, 1978).
void TourPlan::choose_stops(const std::vector<Vantage>& vantages,
                            const std::vector<double>& weights) {
  struct Gain {
    double value;
    std::size_t vantage;
    bool operator<(const Gain& other) const {  // of equal ones the first vantage is the greatest
      return value < other.value || (value == other.value && vantage > other.vantage);
    }
  };
  Bits seen = seen_from(stops_[0].node);
  const auto gain_of = [&](std::size_t i) {
    return Gain{weights[i] * static_cast<double>(count_new(seen, seen_from(vantages[i].node))), i};
  };
  std::priority_queue<Gain> gains;
  for (std::size_t i = 0; i < vantages.size(); ++i) gains.push(gain_of(i));
  while (count_bits(seen) < wanted_) {
    const Gain gain = gain_of(gains.top().vantage);
    gains.pop();
    if (!gains.empty() && gain < gains.top()) {
      gains.push(gain);
      continue;
    }
    const Node node = vantages[gain.vantage].node;
    add_bits(seen, seen_from(node));
    stops_.push_back(stop_at(node));
  }
}

// Keeps the order it has where the new one is no shorter or does not see enough.
void TourPlan::order_stops() {
  const auto size = static_cast<Eigen::Index>(stops_.size());
  Eigen::MatrixXd distance(size, size);
  for (Eigen::Index i = 0; i < size; ++i) {
    for (Eigen::Index j = 0; j < size; ++j) {
      distance(i, j) =
          lattice_m(stops_[static_cast<std::size_t>(i)], stops_[static_cast<std::size_t>(j)].node);
    }
  }
  const auto order = order_tour(distance, closed_, config_.perturbations);
  const bool first = legs_.empty();
  if (!first && std::ranges::is_sorted(order)) return;
  std::vector<Stop> old_stops = stops_;
  std::vector<Leg> old_legs = std::move(legs_);
  for (std::size_t i = 0; i < order.size(); ++i) stops_[i] = old_stops[order[i]];
  lay_legs();
  if (first || (length_of(legs_) < length_of(old_legs) && suffices())) return;
  stops_ = std::move(old_stops);
  legs_ = std::move(old_legs);
}

const Bits& TourPlan::seen_from(Node node) {
  if (slot_[node] < 0) {
    slot_[node] = static_cast<std::int32_t>(sights_.size());
    sights_.push_back(sight_.seen_from(ways_.place_W(node)));
  }
  return sights_[static_cast<std::size_t>(slot_[node])];
}

// From places on a lattice half as wide as the step, so that ways near each other share them.
Bits TourPlan::seen_along(std::span<const Vec3> way_W) {
  const double side = 0.5 * config_.sight_step_m;
  Bits seen = seen_from(stops_[0].node);
  for (const Vec3& p : with_points_between(way_W, config_.sight_step_m)) {
    const Vec3 q(side * std::round(p.x() / side), side * std::round(p.y() / side), p.z());
    auto node = ways_.nearest(q, config_.resolution_m);
    if (!node) node = ways_.nearest(p, config_.resolution_m);
    if (node) add_bits(seen, seen_from(*node));
  }
  return seen;
}

Leg TourPlan::lay_leg(const Stop& from, Node to) {
  const std::vector<Vec3> way = ways_.way_W(*from.distances, to, start_z_);
  return {polyline_length(way), seen_along(way)};
}

void TourPlan::lay_legs() {
  legs_.clear();
  for (std::size_t i = 0; i < legs(); ++i) legs_.push_back(lay_leg(stops_[i], after(i)->node));
}

bool TourPlan::suffices_instead(std::size_t stop, std::span<const Leg> other) {
  Bits seen = seen_from(stops_[0].node);
  for (std::size_t i = 0; i < legs_.size(); ++i) {
    if (i + 1 != stop && i != stop) add_bits(seen, legs_[i].seen);
  }
  for (const Leg& leg : other) add_bits(seen, leg.seen);
  return count_bits(seen) >= wanted_;
}

// Of those that the rest of the tour makes needless, the one whose absence saves most.
bool TourPlan::drop_a_stop() {
  std::vector<std::pair<double, std::size_t>> savings;
  for (std::size_t stop = 1; stop < stops_.size(); ++stop) {
    const Stop* next = after(stop);
    double saving = lattice_m(stops_[stop - 1], stops_[stop].node);
    if (next) {
      saving += lattice_m(*next, stops_[stop].node) - lattice_m(stops_[stop - 1], next->node);
    }
    savings.emplace_back(-saving, stop);
  }
  std::ranges::sort(savings);
  for (const auto& [saving, stop] : savings) {
    const Stop* next = after(stop);
    std::vector<Leg> shortcut;
    if (next && next != &stops_[stop - 1]) {
      shortcut.push_back(lay_leg(stops_[stop - 1], next->node));
    }
    if (!suffices_instead(stop, shortcut)) continue;
    const auto at = static_cast<std::ptrdiff_t>(stop);
    if (next) legs_[stop] = shortcut.empty() ? Leg{} : std::move(shortcut[0]);
    legs_.erase(legs_.begin() + at - 1);
    stops_.erase(stops_.begin() + at);
    if (stops_.size() == 1) legs_.clear();
    return true;
  }
  return false;
}

// To a vantage nearby from where the way is shorter and enough is seen. What saves most shows
// least: after a failure the next try asks for half as much.
bool TourPlan::move_a_stop(std::size_t stop, const std::vector<Vantage>& vantages) {
  constexpr double kReach = 3;  // spacings of the lattice
  constexpr double kWorthwhile_m = 0.1;
  const Stop& previous = stops_[stop - 1];
  const Stop* next = after(stop);
  const auto by_way_of = [&](Node node) {
    return lattice_m(previous, node) + (next ? lattice_m(*next, node) : 0);
  };
  const Vec2 here = ways_.place_W(stops_[stop].node);
  std::vector<std::pair<double, Node>> options;
  for (const Vantage& vantage : vantages) {
    if ((vantage.place - here).norm() > kReach * config_.viewpoint_spacing_m) continue;
    options.emplace_back(by_way_of(stops_[stop].node) - by_way_of(vantage.node), vantage.node);
  }
  std::ranges::sort(options, [](const auto& a, const auto& b) {
    return a.first > b.first || (a.first == b.first && a.second < b.second);
  });
  double asked = std::numeric_limits<double>::infinity();
  for (const auto& [saving, node] : options) {
    if (saving < kWorthwhile_m) return false;
    if (saving > asked) continue;
    std::vector<Leg> other{lay_leg(previous, node)};
    if (next) other.push_back(lay_leg(*next, node));
    double saved = legs_[stop - 1].length_m - other[0].length_m;
    if (next) saved += legs_[stop].length_m - other[1].length_m;
    if (saved < kWorthwhile_m || !suffices_instead(stop, other)) {
      asked = 0.5 * saving;
      continue;
    }
    legs_[stop - 1] = std::move(other[0]);
    if (next) legs_[stop] = std::move(other[1]);
    stops_[stop] = stop_at(node);
    return true;
  }
  return false;
}

std::vector<Vec3> TourPlan::way_W(std::vector<Vec3>& stops_W) const {
  std::vector<Vec3> way;
  double z = start_z_;
  for (std::size_t i = 0; i < legs_.size(); ++i) {
    const std::vector<Vec3> leg = ways_.way_W(*stops_[i].distances, after(i)->node, z);
    z = leg.back().z();
    way.insert(way.end(), leg.begin() + (way.empty() ? 0 : 1), leg.end());
    if (after(i) != &stops_.front()) stops_W.push_back(leg.back());
  }
  return way;
}

double TourPlan::area_fraction(std::span<const Vec3> way_W) const {
  Bits seen = sight_.seen_from(ways_.place_W(stops_[0].node));
  for (const Vec3& p : with_points_between(way_W, config_.sight_step_m)) {
    add_bits(seen, sight_.seen_from(p.head<2>()));
  }
  return static_cast<double>(count_bits(seen)) / static_cast<double>(count_bits(sight_.area()));
}

/// The speed at a corner of so many radians that the arc allows which rounds it.
double corner_speed(double turn_rad, double acceleration_mps2, double cut_m) {
  const double half = std::cos(0.5 * turn_rad);
  return std::sqrt(acceleration_mps2 * cut_m * half / std::max(1e-9, 1 - half));
}

}  // namespace

double flight_time(std::span<const Vec3> path_W, double max_speed_mps, double max_acceleration_mps2,
                   double corner_cut_m) {
  std::vector<Vec3> corners;
  for (const Vec3& p : path_W) {
    if (corners.empty() || (p - corners.back()).norm() > 1e-6) corners.push_back(p);
  }
  if (corners.size() < 2) return 0;
  std::vector<double> speed(corners.size(), 0);  // at rest at both ends
  for (std::size_t i = 1; i + 1 < corners.size(); ++i) {
    const Vec3 in = (corners[i] - corners[i - 1]).normalized();
    const Vec3 out = (corners[i + 1] - corners[i]).normalized();
    const double turn = std::atan2(in.cross(out).norm(), in.dot(out));
    speed[i] = std::min(max_speed_mps, corner_speed(turn, max_acceleration_mps2, corner_cut_m));
  }
  const auto length = [&](std::size_t i) { return (corners[i + 1] - corners[i]).norm(); };
  const auto reachable = [&](double from, double along) {
    return std::sqrt(from * from + 2 * max_acceleration_mps2 * along);
  };
  for (std::size_t i = 0; i + 1 < corners.size(); ++i) {
    speed[i + 1] = std::min(speed[i + 1], reachable(speed[i], length(i)));
  }
  double time = 0;
  for (std::size_t i = corners.size() - 1; i-- > 0;) {
    speed[i] = std::min(speed[i], reachable(speed[i + 1], length(i)));
    const double squares = speed[i] * speed[i] + speed[i + 1] * speed[i + 1];
    const double peak =
        std::min(max_speed_mps, std::sqrt(max_acceleration_mps2 * length(i) + 0.5 * squares));
    const double changing = (peak * peak - 0.5 * squares) / max_acceleration_mps2;
    time += (2 * peak - speed[i] - speed[i + 1]) / max_acceleration_mps2 +
            std::max(0.0, length(i) - changing) / peak;
  }
  return time;
}

std::optional<OmniscientTour> plan_omniscient_tour(const OmniscientTourConfig& config,
                                                   const worlds::World& world, const Pose& X_WO,
                                                   const ScoredRegion& region,
                                                   double vehicle_radius_m,
                                                   std::span<const Vec3f> area_cells_W,
                                                   const TourMission& mission) {
  Eigen::AlignedBox2d box;
  for (const Vec3f& cell : area_cells_W) box.extend(cell.head<2>().cast<double>());
  if (box.isEmpty() || box.volume() > config.max_area_m2) return std::nullopt;
  ReachableSpaceConfig space;
  space.resolution_m = config.resolution_m;
  std::optional<FlightWays> ways;
  try {
    ways.emplace(find_reachable_space(world, X_WO, region, vehicle_radius_m, space));
  } catch (const std::invalid_argument&) {
    return std::nullopt;
  }
  // In: up, and along what the mission prescribes.
  std::vector<Vec3> way_in{X_WO * Vec3(0, 0, mission.takeoff_height_m)};
  for (const Vec3& p_O : mission.entry_O) way_in.push_back(X_WO * p_O);
  const auto start = ways->nearest(way_in.back(), space.start_search_m);
  if (!start) return std::nullopt;

  const SightMap sight(world, area_cells_W, config.range_m, config.slab_m);
  TourPlan plan(config, *ways, sight, way_in.back(), *start, mission.returns);
  plan.make(area_cells_W);

  OmniscientTour tour;
  const std::vector<Vec3> way = plan.way_W(tour.viewpoints_W);
  tour.area_fraction = plan.area_fraction(way);
  std::vector<Vec3> flown = way_in;
  flown.insert(flown.end(), way.begin(), way.end());
  if (mission.returns) flown.insert(flown.end(), way_in.rbegin(), way_in.rend());
  const Vec3 height = mission.takeoff_height_m * Vec3::UnitZ();
  const std::array<Vec3, 2> up{flown.front() - height, flown.front()};
  const std::array<Vec3, 2> down{flown.back(), flown.back() - height};
  const TourMotion& motion = mission.motion;
  const double acceleration = motion.max_acceleration_mps2;
  tour.time_s = flight_time(up, motion.climb_speed_mps, acceleration, config.corner_cut_m) +
                flight_time(flown, motion.max_speed_mps, acceleration, config.corner_cut_m) +
                flight_time(down, motion.landing_speed_mps, acceleration, config.corner_cut_m);
  tour.path_W = std::move(flown);
  tour.path_W.insert(tour.path_W.begin(), up[0]);
  tour.path_W.push_back(down[1]);
  tour.path_m = polyline_length(tour.path_W);
  return tour;
}

void add_figures(const OmniscientTour& tour, double flown_m, double flown_s, Figures& figures) {
  figures.set("tour.path_m", tour.path_m);
  figures.set("tour.time_s", tour.time_s);
  figures.set("tour.viewpoints", tour.viewpoints_W.size());
  figures.set("tour.area_fraction", tour.area_fraction);
  figures.set("tour.path_ratio", flown_m / tour.path_m);
  figures.set("tour.time_ratio", flown_s / tour.time_s);
  figures.set("exploration.omniscient_ratio", flown_m / tour.path_m);
}

}  // namespace arex::sim
