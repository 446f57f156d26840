#pragma once

#include <cstdint>

/// AREX_VECTOR: the loops over cells take several at once with AVX2 and BMI2. Each such loop stands
/// beside its plain form, which means the same bit for bit: built with AREX_SCALAR the plain forms
/// run, and the same tests try both.
#if defined(__AVX2__) && defined(__BMI2__) && !defined(AREX_SCALAR)
#define AREX_VECTOR 1
#include <immintrin.h>
#else
#define AREX_VECTOR 0
#endif

namespace arex {

/// The bits of `word` under `mask`, moved together at the low end (PEXT).
inline std::uint64_t gather_bits(std::uint64_t word, std::uint64_t mask) {
#if AREX_VECTOR
  return _pext_u64(word, mask);
#else
  std::uint64_t out = 0;
  for (std::uint64_t to = 1; mask != 0; mask &= mask - 1, to <<= 1) {
    if ((word & mask & -mask) != 0) out |= to;
  }
  return out;
#endif
}

/// The low bits of `word`, moved apart to where `mask` has bits (PDEP).
inline std::uint64_t scatter_bits(std::uint64_t word, std::uint64_t mask) {
#if AREX_VECTOR
  return _pdep_u64(word, mask);
#else
  std::uint64_t out = 0;
  for (; mask != 0; mask &= mask - 1, word >>= 1) {
    if ((word & 1U) != 0) out |= mask & -mask;
  }
  return out;
#endif
}

}  // namespace arex
