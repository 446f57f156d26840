#pragma once

#include <array>
#include <bit>
#include <cstdint>
#include <cstring>
#include <optional>
#include <string>
#include <string_view>

/// Numbers in the point files of others.
namespace arex::cloud_fields {

enum class NumberType : std::uint8_t { kI8, kU8, kI16, kU16, kI32, kU32, kI64, kU64, kF32, kF64 };

constexpr std::size_t size_of(NumberType type) {
  constexpr std::array<std::size_t, 10> kSizes{1, 1, 2, 2, 4, 4, 8, 8, 4, 8};
  return kSizes[static_cast<std::size_t>(type)];
}

template <class T>
double load(const char* bytes, bool swapped) {
  std::array<char, sizeof(T)> raw{};
  std::memcpy(raw.data(), bytes, sizeof(T));
  if (swapped) {
    for (std::size_t i = 0; i < sizeof(T) / 2; ++i) std::swap(raw[i], raw[sizeof(T) - 1 - i]);
  }
  return static_cast<double>(std::bit_cast<T>(raw));
}

/// One number as a double. @param swapped its bytes are in the other order than the host's
inline double number(const char* bytes, NumberType type, bool swapped) {
  switch (type) {
    case NumberType::kI8:
      return load<std::int8_t>(bytes, swapped);
    case NumberType::kU8:
      return load<std::uint8_t>(bytes, swapped);
    case NumberType::kI16:
      return load<std::int16_t>(bytes, swapped);
    case NumberType::kU16:
      return load<std::uint16_t>(bytes, swapped);
    case NumberType::kI32:
      return load<std::int32_t>(bytes, swapped);
    case NumberType::kU32:
      return load<std::uint32_t>(bytes, swapped);
    case NumberType::kI64:
      return load<std::int64_t>(bytes, swapped);
    case NumberType::kU64:
      return load<std::uint64_t>(bytes, swapped);
    case NumberType::kF32:
      return load<float>(bytes, swapped);
    case NumberType::kF64:
      return load<double>(bytes, swapped);
  }
  return 0;
}

/// @throws ConfigError always: "has ...", before which a file's reader puts the name.
[[noreturn]] void refuse(const std::string& what);

/// A number as text, `nan` and `inf` included; nothing if it is none.
std::optional<double> parse_number(std::string_view word);

/// A count of a header: digits alone. @param name what it counts, for the refusal
/// @throws ConfigError if it is anything else, or more than `most`
std::size_t parse_count(std::string_view word, const std::string& name, std::size_t most);

/// What follows the last point that a header announces must be padding (blanks, zeros): points that
/// it does not announce would be lost without a word.
/// @throws ConfigError
void expect_padding(std::string_view rest, std::size_t points);

/// Splits off the next word of a line; empty at its end.
std::string_view next_word(std::string_view& line);

/// Splits off the next line, without its end (LF or CR LF).
std::string_view next_line(std::string_view& text);

}  // namespace arex::cloud_fields
