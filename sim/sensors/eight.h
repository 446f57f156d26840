#pragma once

#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstring>

/// Eight numbers at a time: GCC's vectors, each added and multiplied for itself, so that the same
/// bits come out as from eight numbers one after the other.
namespace arex::sim {

using Float8 = float __attribute__((vector_size(32)));
using Int8 = std::int32_t __attribute__((vector_size(32)));
using Uint8 = std::uint32_t __attribute__((vector_size(32)));

inline Float8 load_eight(const float* from) {
  Float8 v;
  std::memcpy(&v, from, sizeof v);
  return v;
}

/// Every other one of sixteen, from the first of `low` or, `odd`, from its second on.
template <bool odd, class Vector>
Vector every_other(const Vector& low, const Vector& high) {
  if constexpr (odd) {
    return __builtin_shufflevector(low, high, 1, 3, 5, 7, 9, 11, 13, 15);
  } else {
    return __builtin_shufflevector(low, high, 0, 2, 4, 6, 8, 10, 12, 14);
  }
}

/// from[index], each.
inline Float8 gather(const float* from, const Int8& index) {
  return Float8{from[index[0]], from[index[1]], from[index[2]], from[index[3]],
                from[index[4]], from[index[5]], from[index[6]], from[index[7]]};
}

/// from[index] and from[index + 1], each: fetched in pairs.
struct Neighbours {
  Float8 left, right;
};
inline Neighbours gather_neighbours(const float* from, const Int8& index) {
  using Pairs = double __attribute__((vector_size(32)));
  const auto pair = [&](int i) {
    double both;
    std::memcpy(&both, from + index[i], sizeof both);
    return both;
  };
  const auto outer = (Float8)Pairs{pair(0), pair(1), pair(4), pair(5)};
  const auto inner = (Float8)Pairs{pair(2), pair(3), pair(6), pair(7)};
  return {__builtin_shufflevector(outer, inner, 0, 2, 8, 10, 4, 6, 12, 14),
          __builtin_shufflevector(outer, inner, 1, 3, 9, 11, 5, 7, 13, 15)};
}

inline Float8 root(const Float8& v) {
  Float8 out;
  for (int i = 0; i < 8; ++i) out[i] = std::sqrt(v[i]);
  return out;
}

/// Columns of eight rows.
inline std::array<Float8, 8> transposed(const std::array<Float8, 8>& rows) {
  std::array<Float8, 8> pairs, fours, out;
  for (std::size_t i = 0; i < 8; i += 2) {
    pairs[i] = __builtin_shufflevector(rows[i], rows[i + 1], 0, 8, 1, 9, 4, 12, 5, 13);
    pairs[i + 1] = __builtin_shufflevector(rows[i], rows[i + 1], 2, 10, 3, 11, 6, 14, 7, 15);
  }
  for (std::size_t i = 0; i < 8; i += 4) {
    for (std::size_t k = 0; k < 2; ++k) {
      const Float8 &upper = pairs[i + k], &lower = pairs[i + k + 2];
      fours[i + 2 * k] = __builtin_shufflevector(upper, lower, 0, 1, 8, 9, 4, 5, 12, 13);
      fours[i + 2 * k + 1] = __builtin_shufflevector(upper, lower, 2, 3, 10, 11, 6, 7, 14, 15);
    }
  }
  for (std::size_t i = 0; i < 4; ++i) {
    out[i] = __builtin_shufflevector(fours[i], fours[i + 4], 0, 1, 2, 3, 8, 9, 10, 11);
    out[i + 4] = __builtin_shufflevector(fours[i], fours[i + 4], 4, 5, 6, 7, 12, 13, 14, 15);
  }
  return out;
}

/// Bit i: whether a comparison holds for number i.
inline unsigned lanes_of(const Int8& held) {
#ifdef __AVX__
  return static_cast<unsigned>(__builtin_ia32_movmskps256((Float8)held));
#else
  unsigned bits = 0;
  for (unsigned i = 0; i < 8; ++i) bits |= held[i] != 0 ? 1U << i : 0U;
  return bits;
#endif
}

/// Whether a comparison holds for any of them.
inline bool any(const Int8& held) { return lanes_of(held) != 0; }

}  // namespace arex::sim
