#pragma once

#include <bit>
#include <cstdint>
#include <stdexcept>
#include <string>
#include <string_view>
#include <type_traits>

#include "bag/wire_format.h"
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

/// ROS knows no time zero and none before it: what happens at zero is said to happen here.
inline constexpr Stamp kRosZero = 1;  // ns

/// Whether ROS can express the moment.
inline bool has_ros_time(Stamp stamp) {
  return stamp >= 0 && stamp / kNanosecondsPerSecond <= UINT32_MAX;
}

/// The same moment, a run's start one nanosecond late. @throws std::out_of_range if ROS cannot
/// express it.
inline RosTime ros_time(Stamp stamp) {
  if (!has_ros_time(stamp)) {
    throw std::out_of_range("no ROS time for the stamp " + std::to_string(stamp) + " ns");
  }
  const Stamp time = stamp == 0 ? kRosZero : stamp;
  return {static_cast<std::uint32_t>(time / kNanosecondsPerSecond),
          static_cast<std::uint32_t>(time % kNanosecondsPerSecond)};
}

/// A growing serialisation: of ROS 1, which also its containers and MCAP's records are in, numbers
/// packed, strings and arrays behind their length; or of ROS 2.
class RosBytes {
 public:
  explicit RosBytes(WireFormat format = WireFormat::kRos1) : format_(format) { clear(); }

  template <class T>
  requires std::is_arithmetic_v<T>
  void put(T value) {
    align(sizeof value);
    put_raw(&value, sizeof value);
  }
  void put(std::string_view text) {
    const bool ends_in_zero = format_ == WireFormat::kCdr;
    put_length(text.size() + ends_in_zero);
    put_raw(text.data(), text.size());
    if (ends_in_zero) bytes_ += '\0';
  }
  void put(RosTime time) {
    put(time.seconds);
    put(time.nanoseconds);
  }
  void put(const Vec3& v) {
    for (const double value : v) put(value);
  }
  void put(const Quat& q) {
    for (const double value : {q.x(), q.y(), q.z(), q.w()}) put(value);
  }
  /// The length before an array's elements, or a record's header or data.
  void put_length(std::size_t length) { put(static_cast<std::uint32_t>(length)); }
  void put_raw(const void* data, std::size_t size) {
    bytes_.append(static_cast<const char*>(data), size);
  }
  /// A number within an array of bytes, which is nobody's to align.
  template <class T>
  requires std::is_arithmetic_v<T>
  void put_packed(T value) { put_raw(&value, sizeof value); }
  /// Before raw numbers of a size.
  void align(std::size_t size) {
    if (format_ == WireFormat::kRos1) return;
    constexpr std::size_t kEncapsulation = 4;
    while ((bytes_.size() - kEncapsulation) % size != 0) bytes_ += '\0';
  }

  void clear() {
    bytes_.clear();
    if (format_ == WireFormat::kCdr) bytes_.append({'\0', '\1', '\0', '\0'});  // little-endian
  }
  void reserve(std::size_t size) { bytes_.reserve(size); }
  [[nodiscard]] std::size_t size() const { return bytes_.size(); }
  [[nodiscard]] std::string_view view() const { return bytes_; }

 private:
  WireFormat format_;
  std::string bytes_;
};

}  // namespace arex::sim
