#pragma once

#include <bit>
#include <cstdint>
#include <cstring>
#include <stdexcept>
#include <string>
#include <string_view>
#include <type_traits>
#include <utility>

#include "bag/wire_format.h"
#include "math/pose.h"
#include "math/types.h"

namespace arex::sim {

/// Bytes that are not what they should be: one message or one chunk is lost.
class DecodeError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// std_msgs/Header without its sequence number, which ROS 2 has not.
struct WireHeader {
  Stamp stamp = 0;  ///< as recorded, ns
  std::string_view frame;
};

/// Reads a serialised message from its beginning, every length checked against what is left.
/// Views refer to the bytes given. All functions throw DecodeError.
class WireReader {
 public:
  WireReader(std::string_view bytes, WireFormat format) : bytes_(bytes), format_(format) {
    if (format == WireFormat::kRos1) return;
    const std::string_view kind = take(4);
    if (kind[0] != 0 || (kind[1] != 0 && kind[1] != 1)) {
      throw DecodeError("an encapsulation other than plain CDR");
    }
    swapped_ = kind[1] == 0;  // big-endian
  }

  template <class T>
  requires std::is_arithmetic_v<T> T number() {
    align(sizeof(T));
    char bytes[sizeof(T)];
    std::memcpy(bytes, take(sizeof(T)).data(), sizeof(T));
    if (swapped_) {
      for (std::size_t i = 0; i < sizeof(T) / 2; ++i) std::swap(bytes[i], bytes[sizeof(T) - 1 - i]);
    }
    T value;
    std::memcpy(&value, bytes, sizeof(T));
    return value;
  }
  std::string_view text() {
    const auto size = number<std::uint32_t>();
    std::string_view text = take(size);
    if (format_ == WireFormat::kCdr && !text.empty()) text.remove_suffix(1);  // its final zero
    return text;
  }
  /// The length of an array whose elements take at least so many bytes each.
  std::size_t length(std::size_t least_bytes) {
    const std::size_t count = number<std::uint32_t>();
    if (count > left() / least_bytes) throw DecodeError("an array longer than its message");
    return count;
  }
  std::string_view take(std::size_t size) {
    if (size > left()) throw DecodeError("a message that ends too early");
    at_ += size;
    return bytes_.substr(at_ - size, size);
  }
  /// Before something that is read by take(): CDR begins it at a multiple of its largest number.
  void align(std::size_t size) {
    if (format_ == WireFormat::kRos1) return;
    constexpr std::size_t kEncapsulation = 4;
    const std::size_t over = (at_ - kEncapsulation) % size;
    if (over != 0) take(size - over);
  }
  Stamp time() {
    // ROS 1 counts seconds unsigned, ROS 2 signed: the same for two thirds of a century.
    const Stamp seconds = number<std::uint32_t>();
    const Stamp nanoseconds = number<std::uint32_t>();
    if (nanoseconds >= kNanosecondsPerSecond) throw DecodeError("a time that is none");
    return seconds * kNanosecondsPerSecond + nanoseconds;
  }
  WireHeader header() {
    if (format_ == WireFormat::kRos1) number<std::uint32_t>();  // seq
    WireHeader header;
    header.stamp = time();
    header.frame = text();
    return header;
  }
  Vec3 vector() {
    Vec3 v;
    for (int i = 0; i < 3; ++i) v[i] = number<double>();
    return v;
  }
  /// Position, then quaternion x y z w.
  Pose pose() {
    Pose X;
    X.p = vector();
    const Vec3 xyz = vector();
    const auto w = number<double>();
    const Quat q(w, xyz.x(), xyz.y(), xyz.z());
    const double norm = q.norm();
    if (!X.p.allFinite() || !(norm > 0.5 && norm < 2)) throw DecodeError("a pose that is none");
    X.R = q.normalized().toRotationMatrix();
    return X;
  }
  void skip_numbers(std::size_t count, std::size_t size) {
    align(size);
    take(count * size);
  }

  [[nodiscard]] std::size_t left() const { return bytes_.size() - at_; }
  [[nodiscard]] bool swapped() const { return swapped_; }

 private:
  std::string_view bytes_;
  WireFormat format_;
  bool swapped_ = false;
  std::size_t at_ = 0;
};

}  // namespace arex::sim
