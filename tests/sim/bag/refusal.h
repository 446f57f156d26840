#pragma once

#include <filesystem>
#include <string>

#include "bag/replay_input.h"
#include "config/config.h"

namespace arex::sim::test {

/// What a recording or its options are refused with; empty if they are not.
inline std::string refusal_of(const std::filesystem::path& file, const ReplayOptions& options) {
  try {
    ReplayInput(file, options);
  } catch (const ConfigError& error) {
    return error.what();
  }
  return "";
}

}  // namespace arex::sim::test
