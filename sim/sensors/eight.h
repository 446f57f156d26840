#pragma once

#include <cmath>
#include <cstdint>

/// Eight numbers at a time: GCC's vectors, each added and multiplied for itself, so that the same
/// bits come out as from eight numbers one after the other.
namespace arex::sim {

using Float8 = float __attribute__((vector_size(32)));
using Int8 = std::int32_t __attribute__((vector_size(32)));
using Uint8 = std::uint32_t __attribute__((vector_size(32)));

/// from[index], each.
inline Float8 gather(const float* from, const Int8& index) {
  return Float8{from[index[0]], from[index[1]], from[index[2]], from[index[3]],
                from[index[4]], from[index[5]], from[index[6]], from[index[7]]};
}

inline Float8 root(const Float8& v) {
  Float8 out;
  for (int i = 0; i < 8; ++i) out[i] = std::sqrt(v[i]);
  return out;
}

/// Whether a comparison holds for any of them.
inline bool any(const Int8& held) {
  std::int32_t all = 0;
  for (int i = 0; i < 8; ++i) all |= held[i];
  return all != 0;
}

}  // namespace arex::sim
