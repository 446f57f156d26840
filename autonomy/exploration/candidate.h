#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string_view>

#include "math/types.h"

namespace arex {

/// What became of a candidate before its revenue was compared.
enum class Verdict : std::uint8_t {
  kKept,
  kNearObstacle,  ///< case A of the paper's figure
  kLittleGain,    ///< case B: close to known area
  kOffDirection,  ///< case C: far away from the exploration direction
  kBlacklisted,   ///< proved unreachable, or stayed unknown though it was visited
  kNoViewpoint,   ///< nowhere to see it from that the vehicle can reach
};
inline constexpr std::array<std::string_view, 6> kVerdictNames{
    "kept", "near_obstacle", "little_gain", "off_direction", "blacklisted", "no_viewpoint"};

/// One candidate of a decision with the terms of its revenue, as decisions.csv records it.
struct Candidate {
  Vec2 point = Vec2::Zero();      ///< CG, in O
  Vec2 seen_from = Vec2::Zero();  ///< a known-free point with a free line to it, in O
  Vec2 viewpoint = Vec2::Zero();  ///< where the vehicle would go to see it, in O; if kept
  Verdict verdict = Verdict::kKept;
  double information_m2 = 0;        ///< f_I
  double distance_m = 0;            ///< f_N
  std::optional<double> angle_rad;  ///< A in [0, pi]; none for the first two targets
  double direction = 1;             ///< f_D
  double revenue = 0;               ///< R, or R_d where direction-aware; if kept
};

}  // namespace arex
