#pragma once

#include <filesystem>
#include <functional>
#include <string_view>
#include <vector>

#include "math/random.h"

namespace arex::test {

/// One way in for what users give.
struct Target {
  std::string_view name;
  /// Writes a damaged input into the empty folder and reads it. @throws ConfigError where a command
  /// would refuse it; anything else that is thrown is a mistake.
  std::function<void(const std::filesystem::path& folder, RandomStream& random)> run;
};

std::vector<Target> all_targets();
}  // namespace arex::test
