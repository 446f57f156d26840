#pragma once

#include <cstdint>

#include "mapping/bits.h"

/// Sets of the 8 x 8 columns of a tile: bit i is the column of 2D Morton index i, x lowest.
namespace arex {

/// Masks of the columns whose x (bit 0: bits 0, 2, 4 of the index) or y (bit 1) has this rest.
constexpr std::uint64_t columns_where(int modulus, int rest, int bit) {
  std::uint64_t out = 0;
  for (int i = 0; i < 64; ++i) {
    const int c = (i >> bit & 1) | (i >> (bit + 2) & 1) << 1 | (i >> (bit + 4) & 1) << 2;
    if (c % modulus == rest) out |= std::uint64_t{1} << i;
  }
  return out;
}

/// The columns one further on along an axis (bit 0: x, bit 1: y); from 7 on they are lost. In
/// Morton order a step from an even column is 1 bit, from 1 or 5 it is 3, from 3 it is 11.
template <int kAxis>
std::uint64_t shift_up(std::uint64_t columns) {
  constexpr std::uint64_t even = columns_where(2, 0, kAxis), one = columns_where(4, 1, kAxis);
  constexpr std::uint64_t three = columns_where(8, 3, kAxis);
  return (columns & even) << (1 << kAxis) | (columns & one) << (3 << kAxis) |
         (columns & three) << (11 << kAxis);
}
template <int kAxis>
std::uint64_t shift_down(std::uint64_t columns) {
  constexpr std::uint64_t odd = columns_where(2, 1, kAxis), two = columns_where(4, 2, kAxis);
  constexpr std::uint64_t four = columns_where(8, 4, kAxis);
  return (columns & odd) >> (1 << kAxis) | (columns & two) >> (3 << kAxis) |
         (columns & four) >> (11 << kAxis);
}

/// The columns and their eight neighbours.
inline std::uint64_t with_neighbours(std::uint64_t columns) {
  columns |= shift_up<0>(columns) | shift_down<0>(columns);
  return columns | shift_up<1>(columns) | shift_down<1>(columns);
}

inline int x_of(int bit) {
  return static_cast<int>(gather_bits(static_cast<std::uint64_t>(bit), 0x15));
}
inline int y_of(int bit) {
  return static_cast<int>(gather_bits(static_cast<std::uint64_t>(bit), 0x2a));
}

}  // namespace arex
