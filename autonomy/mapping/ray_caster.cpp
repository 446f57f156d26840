#include "mapping/ray_caster.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>
#include <limits>

#include "mapping/bits.h"

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
int unspread(std::uint32_t spread) {
  return static_cast<int>(gather_bits(spread, spread_bits(kWindow / 8 - 1)));
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

/// Where the voxels passed are noted.
struct Marks {
  std::uint64_t* passed;
  std::uint8_t* touched;

  void add(std::uint32_t voxel) const {
    passed[voxel >> 6] |= std::uint64_t{1} << (voxel & 63U);
    touched[voxel >> 9] = 1;
  }
  /// Several voxels of one word.
  void add(std::uint32_t word, std::uint64_t voxels) const {
    passed[word >> 6] |= voxels;
    touched[word >> 9] = static_cast<std::uint8_t>(touched[word >> 9] | (voxels != 0 ? 1 : 0));
  }
};

#if AREX_VECTOR

using Four = std::array<std::uint64_t, 4>;

__m256i load(const Four& four) {
  return _mm256_loadu_si256(reinterpret_cast<const __m256i*>(four.data()));
}
__m256i all_four(std::uint64_t v) { return _mm256_set1_epi64x(static_cast<long long>(v)); }
__m256i times(__m256i a, __m256i b) { return _mm256_mul_epu32(a, b); }  // of 32 bits each

/// Tables for four steps, by the position of the first among the four cells of a word.
struct FourSteps {
  /// Along the longest axis, towards higher or lower cells: the cell's share of the bit index.
  std::array<std::array<Four, 2>, 3> place{};
  /// 1 for the steps that count: first <= i < first + count.
  std::array<std::array<Four, 5>, 4> counts{};
  constexpr FourSteps() {
    for (std::size_t i = 0; i < 4; ++i) {
      for (std::size_t axis = 0; axis < 3; ++axis) {
        place[axis][0][3 - i] = place[axis][1][i] = spread_bits(i) << axis;
      }
      for (std::size_t first = 0; first < 4; ++first) {
        for (std::size_t count = 0; count < 5; ++count) {
          counts[first][count][i] = i >= first && i < first + count ? 1 : 0;
        }
      }
    }
  }
};
constexpr FourSteps kFourSteps;

/// A shorter axis over four steps. The cell's lowest two bits say where in a word it lies.
class FourLanes {
 public:
  FourLanes(Lane& lane, int axis)
      : lane_(lane),
        steps_(load({0, lane.step, 2 * lane.step, 3 * lane.step})),
        step_(all_four(lane.step)),
        flip_(all_four(lane.flip)),
        speed_(all_four(lane.speed)),
        low_shift_(_mm_cvtsi32_si128(kFractionBits - axis)),
        high_shift_(_mm_cvtsi32_si128(kFractionBits - 2 - axis)),
        low_(all_four(std::uint64_t{1} << axis)),
        high_(all_four(std::uint64_t{8} << axis)) {}

  /// Takes the next `count` steps, the first of which is the `first` of four.
  void take(int first, int count) {
    in_ = _mm256_add_epi64(all_four(lane_.at - static_cast<std::uint64_t>(first) * lane_.step),
                           steps_);
    out_ = _mm256_add_epi64(in_, step_);
    near_ = lane_.at >> kWordShift;
    lane_.at += static_cast<std::uint64_t>(count) * lane_.step;
    far_ = lane_.at >> kWordShift;
  }
  /// Shares of the bit index of the cells where the steps begin and end.
  [[nodiscard]] __m256i place_in() const { return place(in_); }
  [[nodiscard]] __m256i place_out() const { return place(out_); }
  /// Distance to the boundary ahead, and speed, 31 bits.
  [[nodiscard]] __m256i ahead() const {
    const __m256i left = _mm256_and_si256(_mm256_xor_si256(in_, flip_), all_four(kFractionMask));
    return _mm256_srli_epi64(left, kFractionBits - 31);
  }
  [[nodiscard]] __m256i speed() const { return speed_; }
  // The steps reach from one word at most into the next.
  [[nodiscard]] bool stays_in_its_word() const { return near_ == far_; }
  [[nodiscard]] std::uint32_t near_word() const { return lane_.spread[near_ << 2]; }
  [[nodiscard]] std::uint32_t far_word() const { return lane_.spread[far_ << 2]; }
  [[nodiscard]] __m256i begins_near() const { return is_near(in_); }
  [[nodiscard]] __m256i ends_near() const { return is_near(out_); }

 private:
  static constexpr int kWordShift = kFractionBits + 2;

  [[nodiscard]] __m256i place(__m256i at) const {
    return _mm256_or_si256(_mm256_and_si256(_mm256_srl_epi64(at, low_shift_), low_),
                           _mm256_and_si256(_mm256_srl_epi64(at, high_shift_), high_));
  }
  [[nodiscard]] __m256i is_near(__m256i at) const {
    return _mm256_cmpeq_epi64(_mm256_srli_epi64(at, kWordShift), all_four(near_));
  }

  Lane& lane_;
  __m256i steps_, step_, flip_, speed_;
  __m128i low_shift_, high_shift_;
  __m256i low_, high_;
  __m256i in_{}, out_{};
  std::uint64_t near_ = 0, far_ = 0;
};

/// Marks, sorted by the word that they lie in.
struct Quarters {
  __m256i near_near, near_far, far_near, far_far;  ///< along u, along v

  /// Adds one mark of each of four steps.
  void add(__m256i marks, __m256i u_near, __m256i v_near) {
    const __m256i u = _mm256_and_si256(marks, u_near), other = _mm256_andnot_si256(u_near, marks);
    near_near = _mm256_or_si256(near_near, _mm256_and_si256(u, v_near));
    near_far = _mm256_or_si256(near_far, _mm256_andnot_si256(v_near, u));
    far_near = _mm256_or_si256(far_near, _mm256_and_si256(other, v_near));
    far_far = _mm256_or_si256(far_far, _mm256_andnot_si256(v_near, other));
  }
  [[nodiscard]] Four sum() const {
    const auto pairs = [](__m256i a, __m256i b) {
      return _mm256_or_si256(_mm256_unpacklo_epi64(a, b), _mm256_unpackhi_epi64(a, b));
    };
    const __m256i near = pairs(near_near, near_far), far = pairs(far_near, far_far);
    Four out;
    _mm256_storeu_si256(reinterpret_cast<__m256i*>(out.data()),
                        _mm256_or_si256(_mm256_permute2x128_si256(near, far, 0x20),
                                        _mm256_permute2x128_si256(near, far, 0x31)));
    return out;
  }
};

std::uint64_t any_of_four(__m256i v) {
  const __m128i two = _mm_or_si128(_mm256_castsi256_si128(v), _mm256_extracti128_si256(v, 1));
  return static_cast<std::uint64_t>(
      _mm_cvtsi128_si64(_mm_or_si128(two, _mm_unpackhi_epi64(two, two))));
}

/// Marks the steps that u and v have taken, in the words at `along` of the longest axis.
/// @param one 1 for the steps that count; `place` along the longest axis
void mark_four(const FourLanes& u, const FourLanes& v, std::uint32_t along, __m256i place,
               __m256i one, const Marks& marks) {
  const __m256i u_first =
      _mm256_cmpgt_epi64(times(v.ahead(), u.speed()), times(u.ahead(), v.speed()));
  const __m256i u_in = _mm256_or_si256(u.place_in(), place), v_in = v.place_in();
  const __m256i u_out = _mm256_or_si256(u.place_out(), place), v_out = v.place_out();
  const __m256i begin = _mm256_sllv_epi64(one, _mm256_or_si256(u_in, v_in));
  const __m256i end = _mm256_sllv_epi64(one, _mm256_or_si256(u_out, v_out));
  const __m256i middle = _mm256_sllv_epi64(
      one, _mm256_blendv_epi8(_mm256_or_si256(u_in, v_out), _mm256_or_si256(u_out, v_in), u_first));
  const std::uint32_t u_near = along | u.near_word(), v_near = v.near_word();
  if (u.stays_in_its_word() && v.stays_in_its_word()) {
    marks.add(u_near | v_near, any_of_four(_mm256_or_si256(_mm256_or_si256(begin, end), middle)));
    return;
  }
  const __m256i u_begin = u.begins_near(), u_end = u.ends_near();
  const __m256i v_begin = v.begins_near(), v_end = v.ends_near();
  Quarters quarters{};
  quarters.add(begin, u_begin, v_begin);
  quarters.add(end, u_end, v_end);
  quarters.add(middle, _mm256_blendv_epi8(u_begin, u_end, u_first),
               _mm256_blendv_epi8(v_end, v_begin, u_first));
  const Four sum = quarters.sum();
  const std::uint32_t u_far = along | u.far_word(), v_far = v.far_word();
  marks.add(u_near | v_near, sum[0]);
  marks.add(u_near | v_far, sum[1]);
  marks.add(u_far | v_near, sum[2]);
  marks.add(u_far | v_far, sum[3]);
}

#endif  // AREX_VECTOR

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
  const Marks marks{passed_.data(), touched_.data()};
  int steps = std::abs(end[a] - at_a);
  const auto step = [&] {
    const std::uint32_t ia = spread_a[at_a & (kWindow - 1)];
    const std::uint32_t u_in = u.index_in(), u_out = u.index_out();
    const std::uint32_t v_in = v.index_in(), v_out = v.index_out();
    const bool u_first = u.ahead() * v.speed < v.ahead() * u.speed;
    marks.add(ia | u_in | v_in);
    marks.add(ia | (u_first ? u_out | v_in : u_in | v_out));
    marks.add(ia | u_out | v_out);
    u.advance();
    v.advance();
    at_a += step_a;
    --steps;
  };
  if (steps > 0) step();  // begins inside a cell
#if AREX_VECTOR
  // Then up to four at a time, those in the four cells along a that words are long.
  FourLanes u4(u, b), v4(v, c);
  const auto size = [](int i) { return static_cast<std::size_t>(i); };
  const __m256i place = load(kFourSteps.place[size(a)][step_a > 0 ? 1 : 0]);
  while (steps > 0) {
    const int lane = (step_a > 0 ? at_a : ~at_a) & 3;
    const int count = std::min(4 - lane, steps);
    u4.take(lane, count);
    v4.take(lane, count);
    mark_four(u4, v4, spread_a[at_a & (kWindow - 4)], place,
              load(kFourSteps.counts[size(lane)][size(count)]), marks);
    at_a += count * step_a;
    steps -= count;
  }
#else
  while (steps > 0) step();
#endif
  // The last step ends inside a cell, which does not count.
  const std::uint32_t ia = spread_a[at_a & (kWindow - 1)];
  const std::uint32_t u_in = u.index_in(), v_in = v.index_in();
  const std::uint32_t u_end = u.spread[end[b] & (kWindow - 1)];
  const std::uint32_t v_end = v.spread[end[c] & (kWindow - 1)];
  const std::uint32_t last = ia | u_end | v_end;
  const bool u_first = u.ahead() * v.speed < v.ahead() * u.speed;
  if (const std::uint32_t i = ia | u_in | v_in; i != last) marks.add(i);
  const std::uint32_t middle = ia | (u_first ? u_end : u_in) | (u_first ? v_in : v_end);
  if (middle != last) marks.add(middle);
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
        const int in_window = unspread(static_cast<std::uint32_t>(i) >> axis);
        brick[axis] = centre + ((in_window - centre + 32) & 63) - 32;
      }
      bricks_.push_back({brick, &hit_[8 * i], &passed_[8 * i]});
    }
  }
  return bricks_;
}

}  // namespace arex
