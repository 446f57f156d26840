#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string_view>

#include "math/types.h"

namespace arex {

/// What an operator asks of a flying vehicle, as the buttons of a ground station do.
struct OperatorCommand {
  enum class Kind : std::uint8_t {
    kLand,    ///< stop, then down: here if the ground is clear, else at the nearest clear place
    kHold,    ///< stop and stay
    kReturn,  ///< home, then down
    kResume,  ///< go on with what was interrupted
    kGoTo,    ///< to goal_O, and stay there
  };
  friend constexpr std::array<std::string_view, 5> enum_names(Kind) {
    return {"land", "hold", "return", "resume", "go_to"};
  }

  Kind kind = Kind::kHold;
  Vec3 goal_O = Vec3::Zero();
};

/// What comes over the operator's link: a heartbeat, with some a command.
struct OperatorMessage {
  std::optional<OperatorCommand> command;
};

}  // namespace arex
