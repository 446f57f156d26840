#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string_view>
#include <vector>

#include "exploration/candidate.h"
#include "exploration/consumption_model.h"
#include "exploration/stop_criteria.h"
#include "mapping/occupancy_map_2d.h"

namespace arex {

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

/// One decision with all that led to it.
struct Decision {
  Stamp stamp = 0;
  int sequence = 0;
  DecisionKind kind = DecisionKind::kWait;
  TargetEnd previous_end = TargetEnd::kNone;
  StopReason stop_reason = StopReason::kNone;
  /// New or kept target, or the way back: where to fly, and the frontier point to be seen there.
  Vec3 goal_O = Vec3::Zero();
  Vec2 target = Vec2::Zero();
  /// Where its candidates come from: "trees", "exhaustive" and "forgiving" of the revenue explorer;
  /// others have their own words.
  std::string_view source;
  std::vector<Candidate> candidates;  ///< empty where a target is kept or the battery decided
  std::optional<std::size_t> winner;  ///< index into candidates
  /// Where the revenue is direction-aware: which one R would have chosen instead of R_d and case C.
  std::optional<std::size_t> undirected_winner;
  /// Of a stop for want of candidates: the largest f_I of all frontiers that the exhaustive search
  /// still reaches, whatever the filters and the blacklist made of them.
  std::optional<double> open_frontier_m2;
  double home_distance_m = 0;  ///< along the known path
  EnergyBalance energy;
};

/// Decides where to go next: from the 2D map and the vehicle's place to the next goal. A pure
/// function of the configuration, the seed and the inputs so far; called from one job at a time.
class Explorer {
 public:
  virtual ~Explorer() = default;

  /// Called at a steady rate while exploring: both the present target and the battery are to be
  /// looked at each time. The map outlives the call only.
  [[nodiscard]] virtual Decision decide(const OccupancyMap2D& map, const ExplorerInput& input) = 0;
};

}  // namespace arex
