#pragma once

#include <cstdint>

namespace arex::sim {

/// How a message lies in a recording.
enum class WireFormat : std::uint8_t {
  kRos1,  ///< packed, little-endian; a header has a sequence number
  kCdr,   ///< ROS 2: behind four bytes that name the byte order, numbers aligned to their size
};

}  // namespace arex::sim
