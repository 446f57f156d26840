#pragma once

#include <string>
#include <string_view>

namespace arex::sim {

/// An LZ4 frame as the readers of ROS 1 demand it: independent blocks, a checksum at the end of the
/// content. @throws std::runtime_error
std::string lz4_frame(std::string_view bytes);

}  // namespace arex::sim
