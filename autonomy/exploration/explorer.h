#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string_view>
#include <vector>

#include "exploration/blacklist.h"
#include "exploration/candidate_filter.h"
#include "exploration/frontier_detector.h"
#include "exploration/revenue.h"
#include "exploration/stop_criteria.h"
#include "exploration/viewpoint.h"

namespace arex {

struct ExplorerConfig {
  RevenueConfig revenue;  ///< its keys stand directly under `exploration`
  ExplorationBounds bounds;
  SpaceConfig space;
  FrontierDetectorConfig detector;
  CandidateFilterConfig filter;
  BlacklistConfig blacklist;
  ViewpointConfig viewpoint;
  StopConfig stop;
  ConsumptionConfig consumption;
  double flight_height_m = 1.5;
  bool follow_ground = false;
  bool reevaluate = true;
  bool legs_as_flown = false;

  void fields(auto& f) {
    revenue.fields(f);
    f("bounds", bounds, "the area to explore");
    f("space", space, "where the vehicle can go in the known");
    f("detector", detector, "frontier detector");
    f("filter", filter, "cases A, B and C of the paper's figure");
    f("blacklist", blacklist, "targets that failed");
    f("viewpoint", viewpoint, "from where a frontier is to be seen");
    f("stop", stop, "stop criteria");
    f("consumption", consumption, "battery and power as believed");
    f("flight_height_m", flight_height_m, "height of the goals");
    f("follow_ground", follow_ground,
      "flight_height_m counts from the mapped ground under a goal; false: from O's origin");
    f("reevaluate", reevaluate, "drop a target whose unknown area was seen from afar");
    f("legs_as_flown", legs_as_flown,
      "a target dropped on the way counts in T_{t-1} as where the vehicle was; false: as printed");
  }
};

/// Where the vehicle flies over a place.
[[nodiscard]] Vec3 at_flight_height(const ExplorerConfig& config, const Vec2& place,
                                    const OccupancyMap2D& map);

/// How the vehicle fares with the target of the last decision.
enum class TargetProgress : std::uint8_t { kUnderWay, kReached, kUnreachable };

struct ExplorerInput {
  Stamp now = 0;
  Vec3 p_OB = Vec3::Zero();
  Vec3 home_O = Vec3::Zero();
  TargetProgress progress = TargetProgress::kUnderWay;
  ConsumptionModel energy;
  /// Cells flown through since the map was made: what OccupancyMap2D::flown will say next.
  std::vector<std::uint32_t> flown_since;
};

enum class DecisionKind : std::uint8_t {
  kNewTarget,
  kKeepTarget,
  kStop,
  kWait,    ///< the vehicle knows no free space around itself yet
  kGoBack,  ///< its place is cut off from what it has explored: to where it flew last
};
inline constexpr std::array<std::string_view, 5> kDecisionKindNames{"new_target", "keep_target",
                                                                    "stop", "wait", "go_back"};

/// How the target before this decision ended.
enum class TargetEnd : std::uint8_t {
  kNone,  ///< there was none, or it stands
  kReached,
  kStillUnknown,  ///< reached, but its cell did not become known: a strike
  kUnreachable,   ///< a strike
  kSeen,          ///< its unknown area became known on the way
  kCutOff,        ///< no reachable point sees it any more
};
inline constexpr std::array<std::string_view, 6> kTargetEndNames{
    "none", "reached", "still_unknown", "unreachable", "seen", "cut_off"};

/// Where the candidates of a decision come from; each is asked only if those before it have none.
enum class CandidateSource : std::uint8_t {
  kTrees,       ///< the RRTs
  kExhaustive,  ///< the exhaustive frontier search
  kForgiving,   ///< the same, with all strikes forgiven but the last ones
};
inline constexpr std::array<std::string_view, 3> kCandidateSourceNames{"trees", "exhaustive",
                                                                       "forgiving"};

/// One decision with all that led to it.
struct Decision {
  Stamp stamp = 0;
  int sequence = 0;
  DecisionKind kind = DecisionKind::kWait;
  TargetEnd previous_end = TargetEnd::kNone;
  StopReason stop_reason = StopReason::kNone;
  /// New or kept target, or the way back: where to fly and where to look from there, and the
  /// frontier point itself.
  Vec3 goal_O = Vec3::Zero();
  double goal_yaw_rad = 0;
  Vec2 target = Vec2::Zero();
  CandidateSource source = CandidateSource::kTrees;
  std::vector<Candidate> candidates;  ///< empty where a target is kept or the battery decided
  std::optional<std::size_t> winner;  ///< index into candidates
  /// Of a stop for want of candidates: the largest f_I of all frontiers that the exhaustive search
  /// still reaches, whatever the filters and the blacklist made of them.
  std::optional<double> open_frontier_m2;
  double home_distance_m = 0;  ///< along the known path
  EnergyBalance energy;
};

/// Direction-aware RRT exploration (paper, Algorithm 1): from the 2D map and the vehicle's place to
/// the next goal. A pure function of the configuration, the seed and the inputs so far; called from
/// one job at a time.
class Explorer {
 public:
  /// @param resolution_m of every map that decide() will be given.
  Explorer(const ExplorerConfig& config, double resolution_m, std::uint64_t seed);

  /// To be called at a steady rate while exploring: both the re-evaluation of the present target
  /// and the battery are looked at each time.
  [[nodiscard]] Decision decide(const OccupancyMap2D& map, const ExplorerInput& input);

  [[nodiscard]] const TargetHistory& history() const { return history_; }
  [[nodiscard]] const FrontierDetector& detector() const { return detector_; }

 private:
  struct Target {
    Vec2 point = Vec2::Zero();
    Vec2 viewpoint = Vec2::Zero();
  };

  void balance(Decision& decision, const ExplorationSpace& space, const ExplorerInput& input) const;
  TargetEnd settle_target(const ExplorationSpace& space, const ExplorerInput& input);
  void choose(Decision& decision, const ExplorationSpace& space, const ExplorerInput& input);
  /// Asks one source. @return whether it has a candidate worth the flight
  bool ask(CandidateSource source, Decision& decision, const ExplorationSpace& space,
           const ExplorerInput& input) const;
  /// Back to the nearest place that it flew through, but does not reach any more. @return whether
  /// there is one to try
  bool go_back(Decision& decision, const ExplorationSpace& space, const ExplorerInput& input);
  void stop(Decision& decision, const ExplorationSpace& space) const;
  void select(Decision& decision, const OccupancyMap2D& map);
  /// Whether there still is something to see at a target: enough unknown area, and a border to it.
  [[nodiscard]] bool is_worthwhile(const ExplorationSpace& space, const Vec2& point) const;
  [[nodiscard]] std::vector<Candidate> assess(CandidateSource source, const ExplorationSpace& space,
                                              const ExplorerInput& input) const;
  void set_goal(Decision& decision, const OccupancyMap2D& map) const;

  ExplorerConfig config_;
  FrontierDetector detector_;
  ViewpointFinder viewpoints_;
  Blacklist blacklist_;
  TargetHistory history_;
  std::optional<Target> target_;
  std::optional<Vec3> way_back_O_;  ///< where it is under way to instead
  int lost_ways_back_ = 0;          ///< that failed since the last target
  int sequence_ = 0;
};

}  // namespace arex
