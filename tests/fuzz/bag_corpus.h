#pragma once

#include <filesystem>

#include "math/random.h"

namespace arex::test {

/// Damages a recording, in any container, layout, encoding and compression, and reads it as `arex
/// replay` does before and while it replays, but for the odometry.
void read_recording(const std::filesystem::path& folder, RandomStream& random);

}  // namespace arex::test
