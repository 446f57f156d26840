#pragma once

#include <cstddef>
#include <functional>
#include <string>

namespace arex::worlds {

/// What a job may use before it counts as having failed.
struct ContainedLimits {
  double cpu_s = 60;
  std::size_t memory_bytes = std::size_t{8} << 30;  ///< address space; not under a sanitizer
};

/// Runs a job in a process of its own and returns its answer. For parsers that others have written:
/// what crashes, hangs, prints or eats memory on a damaged file ends there, and becomes one line.
/// @throws ConfigError with the message of what the job threw, or saying how the process ended.
std::string run_contained(const std::function<std::string()>& job,
                          const ContainedLimits& limits = {});

}  // namespace arex::worlds
