#pragma once

#include "config/config.h"

namespace arex::sim {

/// Refuses a scenario that still says something under a key that has moved, or that has become a
/// consequence of another, and names the key to set instead. @throws ConfigError at the key's line.
void refuse_moved_keys(const ConfigNode& scenario);

}  // namespace arex::sim
