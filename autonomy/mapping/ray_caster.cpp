#include "mapping/ray_caster.h"

#include <immintrin.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>
#include <limits>

namespace arex {
namespace {

constexpr int kWindowBits = 9;
constexpr int kWindow = 1 << kWindowBits;
constexpr int kFractionBits = 64 - kWindowBits;
constexpr double kFixedOne = static_cast<double>(std::uint64_t{1} << kFractionBits);
constexpr std::uint64_t kFractionMask = (std::uint64_t{1} << kFractionBits) - 1;
constexpr std::size_t kWindowBricks = std::size_t{1} << (3 * (kWindowBits - 3));

/// Window coordinate -> its share of the Morton index, per axis.
struct SpreadTable {
  std::array<std::array<std::uint32_t, kWindow>, 3> axis{};
  constexpr SpreadTable() {
    for (std::size_t i = 0; i < kWindow; ++i) {
      for (std::size_t a = 0; a < 3; ++a) {
        axis[a][i] = static_cast<std::uint32_t>(spread_bits(i) << a);
      }
    }
  }
};
constexpr SpreadTable kSpread;

/// A coordinate in cells as fixed point: the cell modulo the window above, the fraction below.
std::uint64_t to_fixed(double coordinate) {
  const double cell = std::floor(coordinate);
  return (static_cast<std::uint64_t>(static_cast<std::int64_t>(cell)) << kFractionBits) +
         static_cast<std::uint64_t>((coordinate - cell) * kFixedOne);
}
std::uint64_t to_fixed_step(double step) {
  return static_cast<std::uint64_t>(static_cast<std::int64_t>(step * kFixedOne));
}

std::uint32_t window_index(const Cell& cell) {
  const auto at = [&](int axis) {
    return kSpread
        .axis[static_cast<std::size_t>(axis)][static_cast<std::size_t>(cell[axis] & (kWindow - 1))];
  };
  return at(0) | at(1) | at(2);
}

/// Undoes the spread of a brick's coordinate.
int gather_bits(std::uint32_t spread) {
  return static_cast<int>(
      _pext_u32(spread, static_cast<std::uint32_t>(spread_bits(kWindow / 8 - 1))));
}

/// One of the two shorter axes during a walk.
struct Lane {
  const std::uint32_t* spread;
  std::uint64_t at;     ///< where the ray enters the current step
  std::uint64_t next;   ///< where it leaves it
  std::uint64_t step;   ///< signed, per step
  std::uint64_t flip;   ///< turns the fraction into the distance to the boundary ahead
  std::uint64_t speed;  ///< |step|, 31 bits

  Lane(int axis, const Vec3& p, double slope, double first)
      : spread(kSpread.axis[static_cast<std::size_t>(axis)].data()),
        at(to_fixed(p[axis])),
        next(at + to_fixed_step(slope * first)),
        step(to_fixed_step(slope)),
        flip(slope > 0 ? kFractionMask : 0),
        speed(to_fixed_step(std::abs(slope)) >> (kFractionBits - 31)) {}

  [[nodiscard]] std::uint32_t index_in() const { return spread[at >> kFractionBits]; }
  [[nodiscard]] std::uint32_t index_out() const { return spread[next >> kFractionBits]; }
  /// Distance to the boundary ahead, 31 bits.
  [[nodiscard]] std::uint64_t ahead() const {
    return ((at ^ flip) & kFractionMask) >> (kFractionBits - 31);
  }
  void advance() {
    at = next;
    next += step;
  }
};

}  // namespace

RayCaster::RayCaster(double resolution_m)
    : resolution_m_(resolution_m),
      inverse_resolution_(1 / resolution_m),
      passed_(kWindowBricks * 8),
      hit_(kWindowBricks * 8),
      touched_(kWindowBricks) {}

void RayCaster::begin(const Vec3& centre, const CellBox& clip) {
  for (std::size_t b = 0; b < kWindowBricks; b += 8) {
    std::uint64_t eight = 0;
    std::memcpy(&eight, &touched_[b], sizeof eight);
    if (eight == 0) continue;
    for (std::size_t i = b; i < b + 8; ++i) {
      if (touched_[i] == 0) continue;
      std::fill_n(&passed_[8 * i], 8, 0);
      std::fill_n(&hit_[8 * i], 8, 0);
      touched_[i] = 0;
    }
  }
  bricks_.clear();
  centre_ = cell_of(centre);
  clip_.low = clip.low.cwiseMax(centre_ - Cell::Constant(kReach));
  clip_.high = clip.high.cwiseMin(centre_ + Cell::Constant(kReach));
}

void RayCaster::add(const Vec3& from, const Vec3& to, bool hit) {
  const Vec3 p = from * inverse_resolution_;
  Vec3 q = to * inverse_resolution_;
  const Vec3 d = q - p;
  // Also refuses what is not finite.
  if (!((p - centre_.cast<double>()).cwiseAbs().maxCoeff() < kReach)) return;
  double exit = std::numeric_limits<double>::infinity();
  for (int axis = 0; axis < 3; ++axis) {
    if (d[axis] == 0) continue;
    exit = std::min(exit, ((d[axis] > 0 ? clip_.high[axis] : clip_.low[axis]) - p[axis]) / d[axis]);
  }
  const double length = d.cwiseAbs().maxCoeff();
  if (!(exit > 0) || !(length < 1e9)) return;
  if (exit < 1) {
    // A little past the box, whose last voxels then are not the ray's end.
    const double share = exit + 2 / length;
    if (share < 1) q = p + share * d;
  }
  const Cell end = q.array().floor().cast<int>();
  if (hit && exit >= 1) mark_hit(end);
  if (length > 0) walk(p, d, length, end);
}

void RayCaster::add_point(const Vec3& point) {
  const Vec3 p = point * inverse_resolution_;
  if (!((p - centre_.cast<double>()).cwiseAbs().maxCoeff() < kReach)) return;
  mark_hit(p.array().floor().cast<int>());
}

void RayCaster::mark_hit(const Cell& cell) {
  if (!clip_.contains(cell)) return;
  const std::uint32_t i = window_index(cell);
  hit_[i >> 6] |= std::uint64_t{1} << (i & 63U);
  touched_[i >> 9] = 1;
}

void RayCaster::walk(const Vec3& p, const Vec3& d, double length, const Cell& end) {
  int a = 0;
  d.cwiseAbs().maxCoeff(&a);
  const int b = a == 2 ? 0 : a + 1;
  const int c = b == 2 ? 0 : b + 1;
  const double start_cell = std::floor(p[a]);
  const double first = d[a] > 0 ? start_cell + 1 - p[a] : p[a] - start_cell;
  Lane u(b, p, d[b] / length, first);
  Lane v(c, p, d[c] / length, first);
  const std::uint32_t* const spread_a = kSpread.axis[static_cast<std::size_t>(a)].data();
  int at_a = static_cast<int>(start_cell);
  const int step_a = d[a] > 0 ? 1 : -1;
  std::uint64_t* const passed = passed_.data();
  std::uint8_t* const touched = touched_.data();
  const auto mark = [passed, touched](std::uint32_t i) {
    passed[i >> 6] |= std::uint64_t{1} << (i & 63U);
    touched[i >> 9] = 1;
  };

  for (int steps = std::abs(end[a] - at_a); steps > 0; --steps) {
    const std::uint32_t ia = spread_a[at_a & (kWindow - 1)];
    const std::uint32_t u_in = u.index_in(), u_out = u.index_out();
    const std::uint32_t v_in = v.index_in(), v_out = v.index_out();
    const bool u_first = u.ahead() * v.speed < v.ahead() * u.speed;
    const std::uint32_t in = ia | u_in | v_in, out = ia | u_out | v_out;
    const std::uint32_t middle = ia | (u_first ? u_out : u_in) | (u_first ? v_in : v_out);
    if ((in ^ out) >> 6 == 0) {  // the usual case: one word holds all three
      const std::uint64_t one = 1;
      passed[in >> 6] |= one << (in & 63U) | one << (middle & 63U) | one << (out & 63U);
      touched[in >> 9] = 1;
    } else {
      mark(in);
      mark(middle);
      mark(out);
    }
    u.advance();
    v.advance();
    at_a += step_a;
  }
  // The last step ends inside a cell, which does not count.
  const std::uint32_t ia = spread_a[at_a & (kWindow - 1)];
  const std::uint32_t u_in = u.index_in(), v_in = v.index_in();
  const std::uint32_t u_end = u.spread[end[b] & (kWindow - 1)];
  const std::uint32_t v_end = v.spread[end[c] & (kWindow - 1)];
  const std::uint32_t last = ia | u_end | v_end;
  const bool u_first = u.ahead() * v.speed < v.ahead() * u.speed;
  if (const std::uint32_t i = ia | u_in | v_in; i != last) mark(i);
  const std::uint32_t middle = ia | (u_first ? u_end : u_in) | (u_first ? v_in : v_end);
  if (middle != last) mark(middle);
}

const std::vector<BrickRays>& RayCaster::finish() {
  for (std::size_t b = 0; b < kWindowBricks; b += 8) {
    std::uint64_t eight = 0;
    std::memcpy(&eight, &touched_[b], sizeof eight);
    if (eight == 0) continue;
    for (std::size_t i = b; i < b + 8; ++i) {
      if (touched_[i] == 0) continue;
      for (std::size_t w = 8 * i; w < 8 * i + 8; ++w) passed_[w] &= ~hit_[w];
      // The brick of this window coordinate that lies nearest to the centre.
      Cell brick;
      for (int axis = 0; axis < 3; ++axis) {
        const int centre = centre_[axis] >> 3;
        const int in_window = gather_bits(static_cast<std::uint32_t>(i) >> axis);
        brick[axis] = centre + ((in_window - centre + 32) & 63) - 32;
      }
      bricks_.push_back({brick, &hit_[8 * i], &passed_[8 * i]});
    }
  }
  return bricks_;
}

}  // namespace arex
