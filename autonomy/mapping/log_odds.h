#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cstdint>

#include "mapping/bits.h"

namespace arex {

/// Evidence of a hit and of a miss, and its bounds, in units of log-odds.
struct LogOddsSteps {
  std::int16_t hit = 0, miss = 0, min = 0, max = 0;
};

/// 64 voxels, a bit each.
struct VoxelWord {
  std::uint64_t known = 0;
  std::uint64_t occupied = 0;
  std::uint64_t at_low = 0;  ///< at a bound
  std::uint64_t at_high = 0;
};

/// Takes what a frame saw of 64 voxels into their log-odds, aligned to 32 bytes. Voxels already at
/// the bound of the evidence may be among them.
inline void add_evidence(std::int16_t* odds, std::uint64_t hit, std::uint64_t passed,
                         const LogOddsSteps& steps, VoxelWord& word) {
  word.known |= hit | passed;
#if AREX_VECTOR
  // Sixteen lanes of all ones where the bit is set.
  const auto lanes_of = [](std::uint64_t bits) {
    const __m256i bit_of =
        _mm256_setr_epi16(1, 1 << 1, 1 << 2, 1 << 3, 1 << 4, 1 << 5, 1 << 6, 1 << 7, 1 << 8, 1 << 9,
                          1 << 10, 1 << 11, 1 << 12, 1 << 13, 1 << 14, static_cast<short>(1 << 15));
    const __m256i all = _mm256_set1_epi16(static_cast<short>(bits & 0xffff));
    return _mm256_cmpeq_epi16(_mm256_and_si256(all, bit_of), bit_of);
  };
  // Bit i set where lane i is negative.
  const auto negative = [](__m256i lanes) {
    const __m128i bytes =
        _mm_packs_epi16(_mm256_castsi256_si128(lanes), _mm256_extracti128_si256(lanes, 1));
    return static_cast<std::uint64_t>(_mm_movemask_epi8(bytes)) & 0xffff;
  };
  const __m256i hit_step = _mm256_set1_epi16(steps.hit);
  const __m256i miss_step = _mm256_set1_epi16(steps.miss);
  const __m256i low = _mm256_set1_epi16(steps.min);
  const __m256i high = _mm256_set1_epi16(steps.max);
  for (unsigned part = 0; part < 64; part += 16) {
    if (((hit | passed) >> part & 0xffff) == 0) continue;
    auto* const at = reinterpret_cast<__m256i*>(odds + part);
    const __m256i step = _mm256_or_si256(_mm256_and_si256(lanes_of(hit >> part), hit_step),
                                         _mm256_and_si256(lanes_of(passed >> part), miss_step));
    const __m256i sum = _mm256_adds_epi16(_mm256_load_si256(at), step);
    const __m256i after = _mm256_min_epi16(_mm256_max_epi16(sum, low), high);
    _mm256_store_si256(at, after);
    const std::uint64_t lanes = std::uint64_t{0xffff} << part;
    const auto assign = [lanes, part](std::uint64_t& bits, std::uint64_t sixteen) {
      bits = (bits & ~lanes) | sixteen << part;
    };
    assign(word.occupied, word.known >> part & ~negative(after) & 0xffff);
    assign(word.at_low, negative(_mm256_cmpeq_epi16(after, low)));
    assign(word.at_high, negative(_mm256_cmpeq_epi16(after, high)));
  }
#else
  for (std::uint64_t rest = hit | passed; rest != 0; rest &= rest - 1) {
    const std::uint64_t bit = rest & -rest;
    std::int16_t& at = odds[std::countr_zero(rest)];
    const int sum = at + ((hit & bit) != 0 ? steps.hit : steps.miss);
    at = static_cast<std::int16_t>(std::clamp<int>(sum, steps.min, steps.max));
    const auto assign = [bit](std::uint64_t& bits, bool value) {
      bits = value ? bits | bit : bits & ~bit;
    };
    assign(word.occupied, at >= 0);
    assign(word.at_low, at == steps.min);
    assign(word.at_high, at == steps.max);
  }
#endif
}

}  // namespace arex
