#pragma once

#include <zlib.h>

#include <cstdint>
#include <string_view>

/// The container MCAP, version 0: records of an opcode, a length of eight bytes and content; texts
/// behind four bytes of length; all little-endian. Source: mcap.dev/spec.
namespace arex::sim::mcap {

inline constexpr std::string_view kMagic{"\x89MCAP0\r\n", 8};
inline constexpr std::uint64_t kMessageHead = 22;  ///< bytes of a message record before its data
/// Of the end of a whole file: footer record and magic.
inline constexpr std::uint64_t kFooterSize = 9 + 20 + 8;

enum class Op : std::uint8_t {
  kHeader = 1,
  kFooter = 2,
  kSchema = 3,
  kChannel = 4,
  kMessage = 5,
  kChunk = 6,
  kMessageIndex = 7,
  kChunkIndex = 8,
  kStatistics = 0x0b,
  kSummaryOffset = 0x0e,
  kDataEnd = 0x0f,
};

/// The CRC-32 of zlib, which MCAP uses.
inline std::uint32_t crc32_of(std::string_view bytes, std::uint32_t before = 0) {
  return static_cast<std::uint32_t>(
      crc32_z(before, reinterpret_cast<const Bytef*>(bytes.data()), bytes.size()));
}

}  // namespace arex::sim::mcap
