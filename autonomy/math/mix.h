#pragma once

#include <cstddef>
#include <cstdint>

namespace arex {

/// Spreads every bit of a word over all of it, one to one (the finaliser of SplitMix64, see
/// random.h).
constexpr std::uint64_t mix_bits(std::uint64_t z) {
  z = (z ^ (z >> 30)) * 0xBF58476D1CE4E5B9ULL;
  z = (z ^ (z >> 27)) * 0x94D049BB133111EBULL;
  return z ^ (z >> 31);
}

/// The three indices of a cell in one word: no two cells within 2^20 of the origin share one.
constexpr std::uint64_t cell_key(std::int64_t x, std::int64_t y, std::int64_t z) {
  constexpr int kBits = 21;
  constexpr std::int64_t kOffset = std::int64_t{1} << (kBits - 1);
  constexpr std::uint64_t kMask = (std::uint64_t{1} << kBits) - 1;
  return (static_cast<std::uint64_t>(x + kOffset) & kMask) << (2 * kBits) |
         (static_cast<std::uint64_t>(y + kOffset) & kMask) << kBits |
         (static_cast<std::uint64_t>(z + kOffset) & kMask);
}

/// For tables of such keys.
struct CellKeyHash {
  std::size_t operator()(std::uint64_t key) const { return mix_bits(key); }
};

}  // namespace arex
