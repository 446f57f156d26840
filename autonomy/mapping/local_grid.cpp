#include "mapping/local_grid.h"

#include <algorithm>
#include <bit>
#include <cmath>

#include "mapping/bits.h"

namespace arex {
namespace {

constexpr double kGridUnitsPerLogOdds = 27;  ///< 0.7 -> 23, 0.4 -> -11, 0.12 -> -54, 0.97 -> 94
constexpr std::int8_t kUnseen = -128;
constexpr std::uint8_t kConfirmed = 0x80;
constexpr std::uint8_t kFrameCount = 0x0f;
constexpr int kDecaySlices = 10;  ///< of the grid, one after the other within kDecayPeriod
constexpr Stamp kDecayPeriod = kNanosecondsPerSecond;

int to_grid_units(double probability) {
  return static_cast<int>(
      std::lround(std::log(probability / (1 - probability)) * kGridUnitsPerLogOdds));
}

Cell grid_size(const Vec3& size_m, double resolution_m) {
  return (size_m / resolution_m).array().round().cast<int>();
}

int modulo(int a, int n) {
  const int m = a % n;
  return m < 0 ? m + n : m;
}

constexpr std::size_t kBlock = 32;  ///< cells handled at a time

/// What `n` cells in a row are, a bit each. Reads whole blocks, up to kBlock - 1 cells more.
void classify(const std::int8_t* evidence, const std::uint8_t* frames, int n,
              std::uint64_t* occupied, std::uint64_t* known) {
#if AREX_VECTOR
  const __m256i zero = _mm256_setzero_si256();
  const __m256i unseen = _mm256_set1_epi8(kUnseen);
  const __m256i count = _mm256_set1_epi8(static_cast<char>(kFrameCount));
  for (int i = 0; i < n; i += 2 * static_cast<int>(kBlock)) {
    std::uint64_t full = 0, seen = 0;
    for (int half = 0; half < 64 && i + half < n; half += static_cast<int>(kBlock)) {
      const auto load = [at = i + half](const auto* row) {
        return _mm256_loadu_si256(reinterpret_cast<const __m256i*>(row + at));
      };
      const auto bits = [](__m256i sign) {
        return static_cast<std::uint64_t>(static_cast<std::uint32_t>(_mm256_movemask_epi8(sign)));
      };
      const __m256i e = load(evidence), f = load(frames);
      const std::uint64_t held = bits(_mm256_cmpgt_epi8(_mm256_and_si256(f, count), zero));
      // kConfirmed is the sign bit of its byte, as the evidence's sign is of its.
      const std::uint64_t remembered = bits(_mm256_andnot_si256(e, f));
      const std::uint64_t free = bits(_mm256_andnot_si256(_mm256_cmpeq_epi8(e, unseen), e));
      full |= (held | remembered) << half;
      seen |= (held | remembered | free) << half;
    }
    if (n - i < 64) {
      const std::uint64_t inside = (std::uint64_t{1} << (n - i)) - 1;
      full &= inside;
      seen &= inside;
    }
    occupied[i / 64] = full;
    known[i / 64] = seen;
  }
#else
  std::fill_n(occupied, (n + 63) / 64, 0);
  std::fill_n(known, (n + 63) / 64, 0);
  for (int i = 0; i < n; ++i) {
    const bool confirmed = (frames[i] & kConfirmed) != 0;
    const bool full = (frames[i] & kFrameCount) != 0 || (confirmed && evidence[i] >= 0);
    const bool free = evidence[i] < 0 && evidence[i] != kUnseen;
    occupied[i / 64] |= std::uint64_t{full} << (i % 64);
    known[i / 64] |= std::uint64_t{full || free} << (i % 64);
  }
#endif
}

/// In a cube of 4^3 voxels the rows along y: mask[x + 4 z].
struct CubeRows {
  std::array<std::uint64_t, 16> mask{};
  constexpr CubeRows() {
    for (std::uint64_t k = 0; k < 16; ++k) {
      for (std::uint64_t y = 0; y < 4; ++y) {
        mask[k] |= std::uint64_t{1} << morton(k % 4, y, k / 4);
      }
    }
  }
};
constexpr CubeRows kRows;

/// Copies a row of `n` bits so that bit `first` comes to lie at 0.
void rotate_row(const std::vector<std::uint64_t>& in, int n, int first, std::uint64_t* out) {
  const int words = static_cast<int>(in.size());
  const auto at = [&](int k) {
    return k >= 0 && k < words ? in[static_cast<std::size_t>(k)] : std::uint64_t{0};
  };
  const auto word_at = [&](int bit) {  // 64 bits from `bit` on, zeros around the row
    const int w = bit >> 6, s = bit & 63;
    return s == 0 ? at(w) : at(w) >> s | at(w + 1) << (64 - s);
  };
  for (int k = 0; k < words; ++k) out[k] = word_at(64 * k + first) | word_at(64 * k + first - n);
  if (n % 64 != 0) out[words - 1] &= (std::uint64_t{1} << (n % 64)) - 1;
}

/// The flags of `n` cells from their bits.
void write_flags(const std::uint64_t* occupied, const std::uint64_t* inflated,
                 const std::uint64_t* known, int n, std::uint8_t* flags) {
#if AREX_VECTOR
  const __m256i byte_of = _mm256_setr_epi8(0, 0, 0, 0, 0, 0, 0, 0, 1, 1, 1, 1, 1, 1, 1, 1, 2, 2, 2,
                                           2, 2, 2, 2, 2, 3, 3, 3, 3, 3, 3, 3, 3);
  const __m256i bit_of = _mm256_set1_epi64x(static_cast<long long>(0x8040201008040201ULL));
  for (int i = 0; i < n; i += static_cast<int>(kBlock)) {
    const auto spread = [&](const std::uint64_t* row, std::uint8_t flag) {
      const auto bits = static_cast<int>(static_cast<std::uint32_t>(row[i / 64] >> (i % 64)));
      const __m256i bytes = _mm256_shuffle_epi8(_mm256_set1_epi32(bits), byte_of);
      const __m256i set = _mm256_cmpeq_epi8(_mm256_and_si256(bytes, bit_of), bit_of);
      return _mm256_and_si256(set, _mm256_set1_epi8(static_cast<char>(flag)));
    };
    const __m256i all = _mm256_or_si256(
        spread(occupied, GridView::kOccupied),
        _mm256_or_si256(spread(inflated, GridView::kInflated), spread(known, GridView::kKnown)));
    if (n - i >= static_cast<int>(kBlock)) {
      _mm256_storeu_si256(reinterpret_cast<__m256i*>(flags + i), all);
    } else {
      alignas(kBlock) std::array<std::uint8_t, kBlock> rest;
      _mm256_store_si256(reinterpret_cast<__m256i*>(rest.data()), all);
      std::copy_n(rest.begin(), n - i, flags + i);
    }
  }
#else
  for (int i = 0; i < n; ++i) {
    const auto flag = [&](const std::uint64_t* row, unsigned value) {
      return (row[i / 64] >> (i % 64) & 1U) != 0 ? value : 0U;
    };
    flags[i] = static_cast<std::uint8_t>(flag(occupied, GridView::kOccupied) |
                                         flag(inflated, GridView::kInflated) |
                                         flag(known, GridView::kKnown));
  }
#endif
}

}  // namespace

LocalGrid::LocalGrid(const LocalGridConfig& config, double inflation_m, double resolution_m)
    : config_(config),
      resolution_m_(resolution_m),
      size_(grid_size(config.size_m, resolution_m)),
      hit_units_(to_grid_units(config.sensor.hit_probability)),
      miss_units_(to_grid_units(config.sensor.miss_probability)),
      min_units_(to_grid_units(config.sensor.min_probability)),
      max_units_(to_grid_units(config.sensor.max_probability)),
      decay_units_(static_cast<int>(
          std::lround(config.decay_per_s * to_seconds(kDecayPeriod) * kGridUnitsPerLogOdds))),
      low_(-size_ / 2),
      evidence_(static_cast<std::size_t>(size_.prod()) + kBlock, kUnseen),
      frames_(evidence_.size(), 0),
      inflation_(inflation_m, resolution_m, config.inflation_shape),
      occupied_(size_.x(), size_.z(), size_.y()),
      known_(occupied_),
      inflated_(occupied_) {}

std::size_t LocalGrid::address(int x, int y, int z) const {
  return static_cast<std::size_t>(
      (modulo(z, size_.z()) * size_.x() + modulo(x, size_.x())) * size_.y() + modulo(y, size_.y()));
}

void LocalGrid::forget(const CellBox& cells) {
  const int length = cells.size().y();
  if (length <= 0) return;
  const int first = modulo(cells.low.y(), size_.y());
  const int before_seam = std::min(length, size_.y() - first);
  const auto clear = [&](std::size_t begin, int count) {
    std::fill_n(&evidence_[begin], count, kUnseen);
    std::fill_n(&frames_[begin], count, std::uint8_t{0});
  };
  for (int z = cells.low.z(); z < cells.high.z(); ++z) {
    for (int x = cells.low.x(); x < cells.high.x(); ++x) {
      const std::size_t row = address(x, 0, z);
      clear(row + static_cast<std::size_t>(first), before_seam);
      clear(row, length - before_seam);
    }
  }
}

void LocalGrid::recentre(const Vec3& p_OB) {
  centre_ = p_OB;
  const Cell middle = (p_OB / resolution_m_).array().floor().cast<int>();
  const CellBox old = box();
  low_ = middle - size_ / 2;
  if (low_ == old.low) return;
  const CellBox now = box();
  // What enters, axis by axis: the part of the new box beyond the old one.
  CellBox rest = now;
  for (int axis = 0; axis < 3; ++axis) {
    CellBox below = rest, above = rest;
    below.high[axis] = std::min(rest.high[axis], old.low[axis]);
    above.low[axis] = std::max(rest.low[axis], old.high[axis]);
    forget(below);
    forget(above);
    rest.low[axis] = std::max(rest.low[axis], old.low[axis]);
    rest.high[axis] = std::min(rest.high[axis], old.high[axis]);
    if (rest.low[axis] >= rest.high[axis]) break;
  }
  const auto left = [&](const std::array<int, 3>& c) { return !now.contains({c[0], c[1], c[2]}); };
  for (Held& frame : lidar_) std::erase_if(frame.hits, left);
  std::erase_if(depth_.hits, left);
}

void LocalGrid::release(const Held& frame) {
  for (const auto& [x, y, z] : frame.hits) --frames_[address(x, y, z)];
}

void LocalGrid::add_frame(const RayCaster& rays, FrameKind kind, Stamp stamp) {
  decay_until(stamp);
  stamp_ = stamp;
  Held frame;
  if (kind == FrameKind::kDepth) {
    release(depth_);
    frame.hits.swap(depth_.hits);
  } else if (static_cast<int>(lidar_.size()) == config_.lidar_frames) {
    release(lidar_.front());
    frame.hits.swap(lidar_.front().hits);
    lidar_.pop_front();
  }
  frame.hits.clear();
  const CellBox cells = box();
  const Cell low = cells.low.array() - (kBrickCells - 1);
  for (const BrickRays& brick : rays.bricks()) {
    const Cell corner = brick.brick * kBrickCells;
    if ((corner.array() < low.array()).any() || (corner.array() >= cells.high.array()).any()) {
      continue;
    }
    const BrickMask inside = mask_inside(brick.brick, cells);
    address_brick(brick.brick);
    pass(brick, inside);
    hit(brick, inside, frame);
  }
  if (kind == FrameKind::kDepth) {
    depth_ = std::move(frame);
  } else {
    lidar_.push_back(std::move(frame));
  }
}

void LocalGrid::address_brick(const Cell& brick) {
  const Cell corner = brick * kBrickCells;
  for (int i = 0; i < kBrickCells; ++i) {
    const auto at = static_cast<std::size_t>(i);
    brick_address_[0][at] = static_cast<std::size_t>(modulo(corner.x() + i, size_.x()) * size_.y());
    brick_address_[1][at] = static_cast<std::size_t>(modulo(corner.y() + i, size_.y()));
    brick_address_[2][at] =
        static_cast<std::size_t>(modulo(corner.z() + i, size_.z()) * size_.x() * size_.y());
  }
}

std::size_t LocalGrid::voxel_in_brick(std::size_t voxel) const {
  const auto& c = kBrickCoordinates.of[voxel];
  return brick_address_[0][c[0]] + brick_address_[1][c[1]] + brick_address_[2][c[2]];
}

void LocalGrid::pass(const BrickRays& rays, const BrickMask& inside) {
  // Row by row along y, as the cells lie in memory; only at the seam of the array one by one.
  const bool in_a_row = brick_address_[1][7] == brick_address_[1][0] + 7;
  for (std::size_t w : {0U, 1U, 4U, 5U}) {
    const std::uint64_t near = rays.passed[w] & inside[w];
    const std::uint64_t far = rays.passed[w + 2] & inside[w + 2];
    if ((near | far) == 0) continue;
    for (std::size_t k = 0; k < 16; ++k) {
      const std::size_t x = k % 4, z = k / 4;
      const std::uint64_t row = kRows.mask[k];
      const auto bits = static_cast<unsigned>(gather_bits(near, row) | gather_bits(far, row) << 4);
      if (bits == 0) continue;
      const std::size_t begin = brick_address_[0][x + 4 * (w & 1)] + brick_address_[2][z + (w & 4)];
      if (in_a_row) {
        pass_eight(begin + brick_address_[1][0], bits);
        continue;
      }
      for (unsigned rest = bits; rest != 0; rest &= rest - 1) {
        pass_one(begin + brick_address_[1][static_cast<std::size_t>(std::countr_zero(rest))]);
      }
    }
  }
}

void LocalGrid::pass_one(std::size_t i) {
  const int before = evidence_[i] == kUnseen ? 0 : evidence_[i];
  const int after = std::max(before + miss_units_, min_units_);
  evidence_[i] = static_cast<std::int8_t>(after);
  frames_[i] = static_cast<std::uint8_t>(frames_[i] & (after < 0 ? kFrameCount : 0xff));
}

/// pass_one() of those of eight cells in a row whose bit is set.
void LocalGrid::pass_eight(std::size_t first, unsigned bits) {
#if AREX_VECTOR
  auto* const evidence = reinterpret_cast<__m128i*>(&evidence_[first]);
  auto* const frames = reinterpret_cast<__m128i*>(&frames_[first]);
  const __m128i chosen =
      _mm_cvtsi64_si128(static_cast<long long>(_pdep_u64(bits, 0x0101010101010101) * 0xff));
  const __m128i before = _mm_loadl_epi64(evidence);
  const __m128i known = _mm_andnot_si128(_mm_cmpeq_epi8(before, _mm_set1_epi8(kUnseen)), before);
  const __m128i after =
      _mm_max_epi8(_mm_adds_epi8(known, _mm_set1_epi8(static_cast<char>(miss_units_))),
                   _mm_set1_epi8(static_cast<char>(min_units_)));
  _mm_storel_epi64(evidence, _mm_blendv_epi8(before, after, chosen));
  const __m128i refuted =
      _mm_and_si128(_mm_and_si128(after, chosen), _mm_set1_epi8(static_cast<char>(kConfirmed)));
  const __m128i held = _mm_loadl_epi64(frames);
  if (_mm_testz_si128(refuted, held) == 0) {
    _mm_storel_epi64(frames, _mm_andnot_si128(refuted, held));
  }
#else
  for (; bits != 0; bits &= bits - 1) {
    pass_one(first + static_cast<std::size_t>(std::countr_zero(bits)));
  }
#endif
}

void LocalGrid::hit(const BrickRays& rays, const BrickMask& inside, Held& frame) {
  for (std::size_t w = 0; w < inside.size(); ++w) {
    for (std::uint64_t bits = rays.hit[w] & inside[w]; bits != 0; bits &= bits - 1) {
      const std::size_t voxel = 64 * w + static_cast<std::size_t>(std::countr_zero(bits));
      const std::size_t i = voxel_in_brick(voxel);
      const int before = evidence_[i] == kUnseen ? 0 : evidence_[i];
      evidence_[i] = static_cast<std::int8_t>(std::min(before + hit_units_, max_units_));
      ++frames_[i];
      if (config_.remember && (frames_[i] & kFrameCount) >= config_.confirm_frames) {
        frames_[i] |= kConfirmed;
      }
      const auto& c = kBrickCoordinates.of[voxel];
      frame.hits.push_back({rays.brick.x() * kBrickCells + c[0],
                            rays.brick.y() * kBrickCells + c[1],
                            rays.brick.z() * kBrickCells + c[2]});
    }
  }
}

void LocalGrid::decay_until(Stamp stamp) {
  if (decay_units_ == 0) return;
  const auto cells = static_cast<std::size_t>(size_.prod());
  const std::int64_t due = stamp / (kDecayPeriod / kDecaySlices);
  const std::int64_t slices = std::clamp<std::int64_t>(due - decayed_slices_, 0, kDecaySlices);
  for (std::int64_t s = due - slices; s < due; ++s) {
    const auto slice = static_cast<std::size_t>(s % kDecaySlices);
    const std::size_t begin = cells * slice / kDecaySlices;
    const std::size_t end = cells * (slice + 1) / kDecaySlices;
    for (std::size_t i = begin; i < end; ++i) {
      const int e = evidence_[i];
      const int size = e < 0 ? -e : e;
      const int left = size - decay_units_;
      const int decayed = e < 0 ? -left : left;
      const bool gone = left <= 0 || e == kUnseen;
      evidence_[i] = static_cast<std::int8_t>(gone ? kUnseen : decayed);
      frames_[i] = static_cast<std::uint8_t>(frames_[i] & (gone ? kFrameCount : 0xff));
    }
  }
  decayed_slices_ = std::max(decayed_slices_, due);
}

void LocalGrid::clear() {
  forget(box());
  lidar_.clear();
  depth_.hits.clear();
}

std::shared_ptr<GridSnapshot> LocalGrid::free_snapshot() {
  return snapshots_.take([this] {
    auto made = std::make_unique<GridSnapshot>();
    made->cells.resize(static_cast<std::size_t>(size_.prod()));
    return made;
  });
}

void LocalGrid::bar_heights(std::vector<std::uint8_t>& cells) const {
  const auto layer = static_cast<std::ptrdiff_t>(size_.x()) * size_.y();
  for (int h = 0; h < size_.z(); ++h) {
    const double z = (low_.z() + h + 0.5) * resolution_m_;
    if (z >= floor_m_ && z <= ceiling_m_) continue;
    std::for_each_n(cells.begin() + h * layer, layer, [](std::uint8_t& flags) {
      flags = static_cast<std::uint8_t>(flags | GridView::kInflated | GridView::kBarred);
    });
  }
}

std::shared_ptr<const GridSnapshot> LocalGrid::snapshot() {
  const std::shared_ptr<GridSnapshot> out = free_snapshot();
  out->stamp = stamp_;
  out->centre = centre_;
  const int length = size_.y();
  const int first = modulo(low_.y(), length);
  std::vector<std::uint64_t> occupied(static_cast<std::size_t>(occupied_.words)), known(occupied);
  for (int h = 0; h < size_.z(); ++h) {
    for (int w = 0; w < size_.x(); ++w) {
      const std::size_t row = address(low_.x() + w, 0, low_.z() + h);
      classify(&evidence_[row], &frames_[row], length, occupied.data(), known.data());
      rotate_row(occupied, length, first, occupied_.row(h, w));
      rotate_row(known, length, first, known_.row(h, w));
    }
  }
  inflation_.apply(occupied_, inflated_);
  std::uint8_t* flags = out->cells.data();
  for (int h = 0; h < size_.z(); ++h) {
    for (int w = 0; w < size_.x(); ++w, flags += length) {
      write_flags(occupied_.row(h, w), inflated_.row(h, w), known_.row(h, w), length, flags);
    }
  }
  bar_heights(out->cells);
  out->view.cells = out->cells.data();
  out->view.low = low_.cast<double>() * resolution_m_;
  out->view.resolution_m = resolution_m_;
  out->view.size = size_;
  return out;
}

}  // namespace arex
