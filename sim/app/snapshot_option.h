#pragma once

#include <string>
#include <vector>

#include "math/types.h"

/// The option --snapshot.
namespace arex::app {

/// Its times. @throws ConfigError for one that is not above 0 and below `end_s`, where nothing is
/// seen any more, or between two ticks of the clock.
/// @param end what ends then, in words
std::vector<Stamp> snapshot_times(const std::vector<std::string>& texts, double end_s,
                                  const std::string& end);

/// One line on stderr for each that was never due. @param what ended too early: "flight"
void tell_missed(const std::vector<Stamp>& times, const char* what, Stamp end);

}  // namespace arex::app
