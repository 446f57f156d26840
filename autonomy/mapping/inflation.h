#pragma once

#include <cstdint>
#include <vector>

#include "mapping/mapping_config.h"

namespace arex {

/// A dense grid of bits in rows of 64-bit words: row (h, w), bits along l (GridView's axes).
struct BitGrid {
  int rows_w = 0;
  int rows_h = 0;
  int length = 0;  ///< bits of a row
  int words = 0;   ///< of a row
  std::vector<std::uint64_t> bits;

  BitGrid(int w, int h, int l)
      : rows_w(w),
        rows_h(h),
        length(l),
        words((l + 63) / 64),
        bits(static_cast<std::size_t>(w) * static_cast<std::size_t>(h) *
             static_cast<std::size_t>(words)) {}
  [[nodiscard]] std::uint64_t* row(int h, int w) {
    return &bits[static_cast<std::size_t>((h * rows_w + w) * words)];
  }
  [[nodiscard]] const std::uint64_t* row(int h, int w) const {
    return &bits[static_cast<std::size_t>((h * rows_w + w) * words)];
  }
};

/// Expands obstacles by lambda_inflat (paper, eq. (13)).
///
/// kCubic: the offsets -n..n along each axis, n = ceil(lambda / size). For a lambda on the grid
/// that is the paper's point set with a, b, c in 0..2n. kPrinted: the offsets -n..0, its point set
/// to the letter (n_step = n), which covers one octant only. kSpherical: the offsets whose length
/// is at most lambda.
///
/// The whole grid is expanded anew, 64 cells at a time: cheaper than keeping counts for the cells
/// that change, and there is no state that could go astray.
class Inflation {
 public:
  Inflation(double lambda_m, double resolution_m, InflationShape shape);

  [[nodiscard]] int reach() const { return reach_; }
  void apply(const BitGrid& occupied, BitGrid& inflated);

 private:
  /// @param up, down cells towards higher and lower indices
  static void expand_box(BitGrid& grid, int up, int down);
  void apply_spherical(const BitGrid& occupied, BitGrid& inflated);

  InflationShape shape_;
  int reach_;                    ///< cells
  std::vector<int> half_width_;  ///< spherical: along l, for the squared distance in the other axes
};

}  // namespace arex
