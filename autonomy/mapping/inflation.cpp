#include "mapping/inflation.h"

#include <algorithm>
#include <cmath>

namespace arex {
namespace {

/// Guards ceil and the sphere's edge against 0.3 / 0.1 > 3.
constexpr double kRounding = 1e-6;

/// row |= row shifted by s bits, 0 < s < 64, towards higher (or lower) positions.
void dilate_up(std::uint64_t* row, int words, int s) {
  for (int i = words - 1; i > 0; --i) row[i] |= row[i] << s | row[i - 1] >> (64 - s);
  row[0] |= row[0] << s;
}
void dilate_down(std::uint64_t* row, int words, int s) {
  for (int i = 0; i + 1 < words; ++i) row[i] |= row[i] >> s | row[i + 1] << (64 - s);
  row[words - 1] |= row[words - 1] >> s;
}

/// Calls dilate(s) with steps that double up to all shifts of 0..n.
template <class Dilate>
void for_doubling_shifts(int n, const Dilate& dilate) {
  for (int done = 1; done <= n;) {
    const int s = std::min(done, n + 1 - done);
    dilate(s);
    done += s;
  }
}

/// Expands one row by -down..up.
void dilate_row(std::uint64_t* row, int words, int up, int down) {
  for_doubling_shifts(up, [&](int s) { dilate_up(row, words, s); });
  for_doubling_shifts(down, [&](int s) { dilate_down(row, words, s); });
}

/// Expands a line of `count` blocks of `block` words, `stride` words apart, by -down..up blocks.
void dilate_blocks(std::uint64_t* data, int count, int block, int stride, int up, int down) {
  const auto merge = [&](int to, int from) {
    std::uint64_t* const a = data + static_cast<std::ptrdiff_t>(to) * stride;
    const std::uint64_t* const b = data + static_cast<std::ptrdiff_t>(from) * stride;
    for (int i = 0; i < block; ++i) a[i] |= b[i];
  };
  for_doubling_shifts(up, [&](int s) {
    for (int k = count - 1; k >= s; --k) merge(k, k - s);
  });
  for_doubling_shifts(down, [&](int s) {
    for (int k = 0; k + s < count; ++k) merge(k, k + s);
  });
}

bool is_empty(const std::uint64_t* row, int words) {
  return std::all_of(row, row + words, [](std::uint64_t w) { return w == 0; });
}

}  // namespace

Inflation::Inflation(double lambda_m, double resolution_m, InflationShape shape)
    : shape_(shape),
      reach_(std::clamp(static_cast<int>(std::ceil(lambda_m / resolution_m - kRounding)), 0, 63)) {
  if (shape_ != InflationShape::kSpherical) return;
  const double radius2 = std::pow(lambda_m / resolution_m, 2) + kRounding;
  for (int d2 = 0; d2 <= radius2; ++d2) {
    half_width_.push_back(static_cast<int>(std::sqrt(radius2 - d2)));
  }
}

void Inflation::apply(const BitGrid& occupied, BitGrid& inflated) {
  if (shape_ == InflationShape::kSpherical) {
    apply_spherical(occupied, inflated);
  } else {
    inflated.bits = occupied.bits;
    expand_box(inflated, shape_ == InflationShape::kPrinted ? 0 : reach_, reach_);
  }
}

void Inflation::expand_box(BitGrid& grid, int up, int down) {
  if (up == 0 && down == 0) return;
  for (int h = 0; h < grid.rows_h; ++h) {
    for (int w = 0; w < grid.rows_w; ++w) {
      if (!is_empty(grid.row(h, w), grid.words)) dilate_row(grid.row(h, w), grid.words, up, down);
    }
    dilate_blocks(grid.row(h, 0), grid.rows_w, grid.words, grid.words, up, down);
  }
  const int layer = grid.rows_w * grid.words;
  dilate_blocks(grid.bits.data(), grid.rows_h, layer, layer, up, down);
}

void Inflation::apply_spherical(const BitGrid& occupied, BitGrid& inflated) {
  std::fill(inflated.bits.begin(), inflated.bits.end(), 0);
  const int words = occupied.words;
  const int reach = half_width_[0];
  std::vector<std::uint64_t> wide(static_cast<std::size_t>((reach + 1) * words));
  for (int h = 0; h < occupied.rows_h; ++h) {
    for (int w = 0; w < occupied.rows_w; ++w) {
      const std::uint64_t* const row = occupied.row(h, w);
      if (is_empty(row, words)) continue;
      for (int n = 0; n <= reach; ++n) {  // the row expanded by every half width that occurs
        std::uint64_t* const out = &wide[static_cast<std::size_t>(n * words)];
        std::copy_n(n == 0 ? row : out - words, words, out);
        if (n > 0) dilate_row(out, words, 1, 1);
      }
      for (int dh = std::max(-reach, -h); dh <= std::min(reach, occupied.rows_h - 1 - h); ++dh) {
        for (int dw = std::max(-reach, -w); dw <= std::min(reach, occupied.rows_w - 1 - w); ++dw) {
          const auto d2 = static_cast<std::size_t>(dh * dh + dw * dw);
          if (d2 >= half_width_.size()) continue;
          const std::uint64_t* const from =
              &wide[static_cast<std::size_t>(half_width_[d2] * words)];
          std::uint64_t* const to = inflated.row(h + dh, w + dw);
          for (int i = 0; i < words; ++i) to[i] |= from[i];
        }
      }
    }
  }
}

}  // namespace arex
