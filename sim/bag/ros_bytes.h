#pragma once

#include <bit>
#include <cstdint>
#include <stdexcept>
#include <string>
#include <string_view>
#include <type_traits>

#include "math/types.h"

namespace arex::sim {

// ROS 1 is little-endian, and numbers are written as they lie in memory.
static_assert(std::endian::native == std::endian::little);

/// A moment as ROS 1 writes it. Zero means "not a time".
struct RosTime {
  std::uint32_t seconds = 0;
  std::uint32_t nanoseconds = 0;

  auto operator<=>(const RosTime&) const = default;
};

/// Time zero is no valid ROS time: a run starts one second after it.
inline constexpr Stamp kRosEpoch = kNanosecondsPerSecond;

/// @throws std::out_of_range if ROS cannot express the moment.
inline RosTime ros_time(Stamp stamp) {
  const Stamp time = stamp + kRosEpoch;
  if (time <= 0 || time / kNanosecondsPerSecond > UINT32_MAX) {
    throw std::out_of_range("no ROS time for the stamp " + std::to_string(stamp) + " ns");
  }
  return {static_cast<std::uint32_t>(time / kNanosecondsPerSecond),
          static_cast<std::uint32_t>(time % kNanosecondsPerSecond)};
}

/// A growing ROS 1 serialisation: numbers packed, strings and arrays after their length.
class RosBytes {
 public:
  template <class T>
  requires std::is_arithmetic_v<T>
  void put(T value) { put_raw(&value, sizeof value); }
  void put(std::string_view text) {
    put_length(text.size());
    put_raw(text.data(), text.size());
  }
  void put(RosTime time) {
    put(time.seconds);
    put(time.nanoseconds);
  }
  void put(const Vec3& v) { put_raw(v.data(), 3 * sizeof(double)); }
  void put(const Quat& q) {
    for (const double value : {q.x(), q.y(), q.z(), q.w()}) put(value);
  }
  /// The length before an array's elements, or a record's header or data.
  void put_length(std::size_t length) { put(static_cast<std::uint32_t>(length)); }
  void put_raw(const void* data, std::size_t size) {
    bytes_.append(static_cast<const char*>(data), size);
  }

  void clear() { bytes_.clear(); }
  void reserve(std::size_t size) { bytes_.reserve(size); }
  [[nodiscard]] std::size_t size() const { return bytes_.size(); }
  [[nodiscard]] std::string_view view() const { return bytes_; }

 private:
  std::string bytes_;
};

}  // namespace arex::sim
