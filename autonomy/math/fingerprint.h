#pragma once

#include <bit>
#include <cstdint>
#include <cstring>
#include <span>
#include <string>
#include <type_traits>

namespace arex {

/// A 64-bit fingerprint of a sequence of numbers, bit for bit (FNV-1a on 64-bit words, mixed at the
/// end as in SplitMix64).
class Fingerprint {
 public:
  void add(std::span<const double> values) {
    for (const double value : values) add(std::bit_cast<std::uint64_t>(value));
  }
  /// The bytes of plain values without padding.
  template <class T>
  requires std::has_unique_object_representations_v<T> || std::is_same_v<T, float>
  void add_bytes(std::span<const T> values) {
    const auto* bytes = reinterpret_cast<const unsigned char*>(values.data());
    std::size_t left = values.size_bytes();
    for (; left >= sizeof(std::uint64_t); left -= sizeof(std::uint64_t)) {
      std::uint64_t word = 0;
      std::memcpy(&word, bytes, sizeof word);
      add(word);
      bytes += sizeof word;
    }
    std::uint64_t rest = left;
    std::memcpy(&rest, bytes, left);
    add(rest);
  }
  void add(std::uint64_t word) { state_ = (std::rotl(state_, 23) ^ word) * 0x100000001B3ULL; }

  [[nodiscard]] std::uint64_t value() const { return state_; }

  /// 16 hexadecimal digits, mixed at the end.
  [[nodiscard]] std::string text() const;

 private:
  std::uint64_t state_ = 0xCBF29CE484222325ULL;
};

}  // namespace arex
