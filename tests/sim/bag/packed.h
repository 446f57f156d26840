#pragma once

#include <bit>
#include <cstdint>
#include <string>
#include <string_view>

/// Bytes put together by hand, number by number: the oracle of what reads them.
namespace arex::sim::test {

class Packed {
 public:
  /// @param bytes an integer's size
  Packed& integer(std::uint64_t value, int bytes) {
    for (int i = 0; i < bytes; ++i) text_ += static_cast<char>(value >> (8 * i) & 0xff);
    return *this;
  }
  Packed& u8(std::uint8_t v) { return integer(v, 1); }
  Packed& u16(std::uint16_t v) { return integer(v, 2); }
  Packed& u32(std::uint32_t v) { return integer(v, 4); }
  Packed& f32(float v) { return integer(std::bit_cast<std::uint32_t>(v), 4); }
  Packed& f64(double v) { return integer(std::bit_cast<std::uint64_t>(v), 8); }
  Packed& raw(std::string_view bytes) {
    text_ += bytes;
    return *this;
  }
  /// Behind its length.
  Packed& text(std::string_view bytes) {
    return u32(static_cast<std::uint32_t>(bytes.size())).raw(bytes);
  }
  Packed& zeros(std::size_t count) {
    text_.append(count, '\0');
    return *this;
  }
  /// std_msgs/Header of ROS 1.
  Packed& header(std::uint32_t seconds, std::uint32_t nanoseconds, std::string_view frame) {
    return u32(7).u32(seconds).u32(nanoseconds).text(frame);
  }
  [[nodiscard]] const std::string& bytes() const { return text_; }

 private:
  std::string text_;
};

}  // namespace arex::sim::test
