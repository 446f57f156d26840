#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <limits>
#include <type_traits>
#include <vector>

#include "messages/sensors.h"
#include "sensors/eight.h"

/// The pixels of the renderer's triangles. Included by renderer.cpp alone, whose options it needs.
namespace arex::sim {

// Pixels are decided four at a time: GCC's vectors, whose arithmetic is each number's own.
constexpr int kLanes = 4;
using Double4 = double __attribute__((vector_size(32)));
using Long4 = std::int64_t __attribute__((vector_size(32)));
using Uint4 = std::uint32_t __attribute__((vector_size(16)));
using Int4 = std::int32_t __attribute__((vector_size(16)));
using Float4 = float __attribute__((vector_size(16)));

template <class Vector, class Scalar>
Vector load_vector(const Scalar* from) {
  Vector v;
  std::memcpy(&v, from, sizeof v);
  return v;
}

inline Double4 all_lanes(double value) { return Double4{value, value, value, value}; }

/// Bit i: whether a comparison holds in lane i.
inline unsigned lanes_of(const Long4& held) {
#ifdef __AVX__
  return static_cast<unsigned>(__builtin_ia32_movmskpd256((Double4)held));
#else
  unsigned bits = 0;
  for (unsigned i = 0; i < 4; ++i) bits |= held[i] != 0 ? 1U << i : 0U;
  return bits;
#endif
}

/// Pixels from the first up to the last, both included.
struct PixelBox {
  int u_first = 0, u_last = -1, v_first = 0, v_last = -1;
  [[nodiscard]] bool empty() const { return u_first > u_last || v_first > v_last; }
};

/// A triangle as linear functions of a pixel's ray (x, y, 1): its three edges, of which none is
/// negative where the ray passes inside, and the last is 1/z of its plane, 1/m. Each is
/// of_x x + (of_y y + of_one), rounded: it goes one way along x and one way along y, so that it is
/// greatest and least at corners of any rectangle of pixels, to the last bit.
///
/// No zero of of_one has a sign: so none of a sum has, and what has one is less than zero.
struct Footprint {
  static constexpr std::size_t kFunctions = 4, kInverseDepth = 3;
  Double4 of_x, of_y, of_one;
};

/// A picture under way: the nearest depths so far, and the triangles that have them.
///
/// It is made of tiles of 4 x 4 pixels: a leaf's lie in one place of the memory or two, where a row
/// of depths and one of triangles would be two for each row that it covers. Tiles that a triangle
/// misses, or that are nearer all over, are told by their corners, a block of sixteen at a time.
template <bool with_triangles>
class TiledPicture {
 public:
  static constexpr int kSide = kLanes;  ///< of a tile, px

  /// Of a camera's picture the columns from u_first on.
  TiledPicture(const PinholeCamera& camera, int u_first, int width)
      : camera_(camera), u_first_(u_first), width_(width) {
    columns_ = static_cast<std::size_t>((width + kSide - 1) / kSide);
    rows_ = static_cast<std::size_t>((camera.height + kSide - 1) / kSide);
    for (int u = 0; u < static_cast<int>(columns_ + kLanes) * kSide; ++u) {
      ray_x_.push_back((u_first + u - camera.cx) / camera.fx);
    }
    for (int v = 0; v < static_cast<int>(rows_ + kLanes) * kSide; ++v) {
      ray_y_.push_back((v - camera.cy) / camera.fy);
    }
    for (std::size_t i = 0; i < columns_ + kLanes; ++i) {
      border_x_[0].push_back(ray_x_[i * kSide]);
      border_x_[1].push_back(ray_x_[i * kSide + kSide - 1]);
    }
    for (std::size_t i = 0; i < rows_ + kLanes; ++i) {
      border_y_[0].push_back(ray_y_[i * kSide]);
      border_y_[1].push_back(ray_y_[i * kSide + kSide - 1]);
    }
  }

  /// Nothing is drawn yet.
  void clear() {
    tiles_.resize(columns_ * rows_);
    least_.assign(tiles_.size() + kLanes * (columns_ + 1), kUntouched);
  }

  /// Draws a triangle where it covers a pixel's centre within the box and nothing drawn is as near.
  /// @param box in this picture's own columns
  /// @param most 1/z of the nearest that is drawn, 1/m
  void fill(const Footprint& footprint, const PixelBox& box, double most, std::uint32_t triangle) {
    const std::size_t left = static_cast<std::size_t>(box.u_first) / kSide * kSide;
    const std::size_t right = static_cast<std::size_t>(box.u_last) / kSide * kSide + kSide - 1;
    const double nearest =
        footprint.of_x[3] * ray_x_[footprint.of_x[3] > 0 ? right : left] +
        (footprint.of_y[3] *
             ray_y_[static_cast<std::size_t>(footprint.of_y[3] > 0 ? box.v_last : box.v_first)] +
         footprint.of_one[3]);
    const bool wide = box.u_last - box.u_first >= kWide;
    if (nearest <= most) {
      wide ? fill_blocks<true, false>(footprint, box, most, triangle)
           : fill_blocks<false, false>(footprint, box, most, triangle);
    } else {
      fill_blocks<true, true>(footprint, box, most, triangle);
    }
  }

  /// 1/z of a row's pixels, 1/m, and their triangles: of each tile's part.
  template <class Visit>
  void visit_row(int v, const Visit& visit) const {
    static constexpr Tile kNothing{};
    const std::size_t first = static_cast<std::size_t>(v / kSide) * columns_;
    const auto within = static_cast<std::size_t>(v % kSide * kSide);
    for (std::size_t i = 0; i < columns_; ++i) {
      const Tile& tile = least_[first + i] == kUntouched ? kNothing : tiles_[first + i];
      const int count = std::min(kSide, width_ - static_cast<int>(i) * kSide);
      if constexpr (with_triangles) {
        visit(&tile.inverse_depth[within], &tile.triangle[within], count);
      } else {
        visit(&tile.inverse_depth[within], count);
      }
    }
  }

 private:
  static constexpr int kPixels = kSide * kSide;
  // From this width on, the run of tiles between the edges is worth looking for, px.
  static constexpr int kWide = 16;
  static constexpr double kUntouched = -1;

  struct alignas(64) DepthTile {
    std::array<float, kPixels> inverse_depth{};  ///< 1/z so far, rows from the top
  };
  struct alignas(64) TriangleTile {
    std::array<float, kPixels> inverse_depth{};
    std::array<std::uint32_t, kPixels> triangle{};  ///< where anything is drawn
  };
  using Tile = std::conditional_t<with_triangles, TriangleTile, DepthTile>;

  /// Each function of a footprint at four places, in the registers and in the memory.
  using Values = std::array<Double4, Footprint::kFunctions>;
  using Rows = std::array<std::array<double, kLanes>, Footprint::kFunctions>;
  /// Where each function is taken in tiles: at their first or last columns or rows.
  using Places = std::array<const double*, Footprint::kFunctions>;

  static Values along_x(const Footprint& footprint, const Places& x, std::size_t column) {
    Values values;
    for (std::size_t i = 0; i < values.size(); ++i) {
      values[i] = footprint.of_x[static_cast<int>(i)] * load_vector<Double4>(x[i] + column);
    }
    return values;
  }
  static Rows along_y(const Footprint& footprint, const Places& y, std::size_t row) {
    Rows rows;
    for (std::size_t i = 0; i < rows.size(); ++i) {
      const auto lane = static_cast<int>(i);
      const Double4 values =
          footprint.of_y[lane] * load_vector<Double4>(y[i] + row) + footprint.of_one[lane];
      std::memcpy(rows[i].data(), &values, sizeof values);
    }
    return rows;
  }
  /// In which of four tiles of row k of a block an edge is negative.
  static Long4 outside(const Values& x, const Rows& y, std::size_t k) {
    return (Long4)(x[0] + y[0][k]) | (Long4)(x[1] + y[1][k]) | (Long4)(x[2] + y[2][k]);
  }

  /// Draws in blocks of 4 x 4 tiles.
  template <bool wide, bool cut_near>
  void fill_blocks(const Footprint& footprint, const PixelBox& box, double most,
                   std::uint32_t triangle) {
    const unsigned falls_right = lanes_of((Long4)footprint.of_x);
    const unsigned falls_down = lanes_of((Long4)footprint.of_y);
    // Where each function is greatest in tiles, and least.
    Places x_most, x_least, y_most, y_least;
    for (std::size_t i = 0; i < 4; ++i) {
      const unsigned left = falls_right >> i & 1U, top = falls_down >> i & 1U;
      x_most[i] = border_x_[1 - left].data();
      y_most[i] = border_y_[1 - top].data();
      x_least[i] = border_x_[left].data();
      y_least[i] = border_y_[top].data();
    }
    const auto last_row = static_cast<std::size_t>(box.v_last / kSide);
    const Double4 roots = wide ? -1.0 / footprint.of_x : Double4{};  // zero at root * (value at 0)
    for (auto row = static_cast<std::size_t>(box.v_first / kSide); row <= last_row; row += kLanes) {
      const Rows y = along_y(footprint, y_most, row);
      double u_first = box.u_first, u_last = box.u_last;
      if constexpr (wide) {
        // A pixel of slack on both sides: the tiles' corners decide.
        for (int i = 0; i < 3; ++i) {
          const std::array<double, kLanes>& values = y[static_cast<std::size_t>(i)];
          const double greatest = std::max(values[0], values[3]);
          const double u = camera_.cx - u_first_ + camera_.fx * (greatest * roots[i]);
          if (footprint.of_x[i] > 0) u_first = std::max(u_first, u - 1);
          if (footprint.of_x[i] < 0) u_last = std::min(u_last, u + 1);
          if (footprint.of_x[i] == 0 && greatest < 0) u_last = u_first - 1;
        }
        if (u_first > u_last) continue;
      }
      const auto first_column = static_cast<std::size_t>(static_cast<int>(u_first) / kSide);
      const auto last_column = static_cast<std::size_t>(static_cast<int>(u_last) / kSide);
      const unsigned live_rows = first_of_sixteen(kLanes * (last_row - row + 1));
      Rows y_worst;
      if constexpr (wide) y_worst = along_y(footprint, y_least, row);
      for (std::size_t column = first_column; column <= last_column; column += kLanes) {
        const Values x = along_x(footprint, x_most, column);
        unsigned dead = 0, inside = 0;
        const double* least = &least_[row * columns_ + column];
        for (std::size_t k = 0; k < kLanes; ++k, least += columns_) {
          const Long4 hidden = x[3] + y[3][k] < load_vector<Double4>(least);
          dead |= lanes_of(outside(x, y, k) | hidden) << (kLanes * k);
        }
        const unsigned live_columns = first_of_sixteen(last_column - column + 1) & 0b1111U;
        unsigned live = ~dead & live_rows & (0x1111U * live_columns);
        if (live == 0) continue;
        if constexpr (wide) {
          const Values x_worst = along_x(footprint, x_least, column);
          for (std::size_t k = 0; k < kLanes; ++k) {
            inside |= (lanes_of(outside(x_worst, y_worst, k)) ^ 0b1111U) << (kLanes * k);
          }
        }
        for (; live != 0; live &= live - 1) {
          const auto tile = static_cast<std::size_t>(__builtin_ctz(live));
          const std::size_t tile_row = row + tile / kLanes, tile_column = column + tile % kLanes;
          if (wide && (inside >> tile & 1U) != 0) {
            fill_tile<true, cut_near>(footprint, tile_row, tile_column, box, most, triangle);
          } else {
            fill_tile<false, cut_near>(footprint, tile_row, tile_column, box, most, triangle);
          }
        }
      }
    }
  }

  /// As many bits, all sixteen from there on.
  static unsigned first_of_sixteen(std::size_t count) {
    return count < 16 ? (1U << count) - 1U : 0xFFFFU;
  }

  template <bool inside, bool cut_near>
  void fill_tile(const Footprint& footprint, std::size_t row, std::size_t column,
                 const PixelBox& box, double most, std::uint32_t triangle) {
    const double* ray_y = &ray_y_[row * kSide];
    Rows y = along_y(footprint, {ray_y, ray_y, ray_y, ray_y}, 0);
    // Outside of the box 1/z is less than any.
    const auto row_y = load_vector<Double4>(ray_y);
    const Long4 in_box = (row_y >= ray_y_[static_cast<std::size_t>(box.v_first)]) &
                         (row_y <= ray_y_[static_cast<std::size_t>(box.v_last)]);
    const Double4 q_in_box = in_box ? load_vector<Double4>(y[3].data())
                                    : all_lanes(-std::numeric_limits<double>::infinity());
    std::memcpy(y[3].data(), &q_in_box, sizeof q_in_box);
    const double* ray_x = &ray_x_[column * kSide];
    const Values x = along_x(footprint, {ray_x, ray_x, ray_x, ray_x}, 0);
    const auto drawn = [&](std::size_t k) {
      Double4 q = x[3] + y[3][k];
      if constexpr (cut_near) q = q <= most ? q : Double4{};
      if constexpr (!inside) q = outside(x, y, k) < 0 ? Double4{} : q;
      return __builtin_convertvector(q, Float4);
    };
    const std::size_t at = row * columns_ + column;
    Tile& tile = tiles_[at];
    const Int8 touched = Int8{} - (least_[at] != kUntouched ? 1 : 0);
    Float8 least;
    for (std::size_t k = 0; k < kSide; k += 2) {
      const Float8 two = __builtin_shufflevector(drawn(k), drawn(k + 1), 0, 1, 2, 3, 4, 5, 6, 7);
      float* so_far = &tile.inverse_depth[k * kSide];
      const auto before = (Float8)((Int8)load_vector<Float8>(so_far) & touched);
      const Float8 after = two > before ? two : before;
      std::memcpy(so_far, &after, sizeof after);
      if constexpr (with_triangles) {
        std::uint32_t* seen = &tile.triangle[k * kSide];
        const auto seen_before = load_vector<Uint8>(seen);
        const Uint8 seen_after = two > before ? triangle - Uint8{} : seen_before;
        std::memcpy(seen, &seen_after, sizeof seen_after);
      }
      least = k == 0 || after < least ? after : least;
    }
    const Float4 low = __builtin_shufflevector(least, least, 0, 1, 2, 3);
    const Float4 high = __builtin_shufflevector(least, least, 4, 5, 6, 7);
    const Float4 four = low < high ? low : high;
    const Float4 across = __builtin_shufflevector(four, four, 2, 3, 0, 1);
    const Float4 two = four < across ? four : across;
    least_[at] = static_cast<double>(two[0] < two[1] ? two[0] : two[1]);
  }

  PinholeCamera camera_;
  int u_first_, width_;
  std::size_t columns_, rows_;         ///< of tiles
  std::vector<double> ray_x_, ray_y_;  ///< of each column and row of pixels
  // Of each column and row of tiles: the rays through its first and last pixels.
  std::array<std::vector<double>, 2> border_x_, border_y_;
  std::vector<Tile> tiles_;    ///< rows from the top
  std::vector<double> least_;  ///< of each tile's inverse depths, 1/m
};

}  // namespace arex::sim
