#include "mapping/local_grid.h"

#include <immintrin.h>

#include <algorithm>
#include <atomic>
#include <bit>
#include <cmath>

namespace arex {
namespace {

constexpr double kUnitsPerLogOdds = 27;  ///< 0.7 -> 23, 0.4 -> -11, 0.12 -> -54, 0.97 -> 94
constexpr std::int8_t kUnseen = -128;
constexpr std::uint8_t kConfirmed = 0x80;
constexpr std::uint8_t kFrameCount = 0x0f;
constexpr int kDecaySlices = 10;  ///< of the grid, one after the other within kDecayPeriod
constexpr Stamp kDecayPeriod = kNanosecondsPerSecond;

int to_units(double probability) {
  return static_cast<int>(
      std::lround(std::log(probability / (1 - probability)) * kUnitsPerLogOdds));
}

Cell grid_size(const Vec3& size_m, double resolution_m) {
  return (size_m / resolution_m).array().round().cast<int>();
}

int modulo(int a, int n) {
  const int m = a % n;
  return m < 0 ? m + n : m;
}

/// Flags of `n` cells of a row.
void make_flags(const std::int8_t* evidence, const std::uint8_t* frames, int n,
                std::uint8_t* flags) {
  for (int i = 0; i < n; ++i) {
    const bool held = (frames[i] & kFrameCount) != 0;
    const bool remembered = (frames[i] & kConfirmed) != 0 && evidence[i] >= 0;
    const bool free = evidence[i] < 0 && evidence[i] != kUnseen;
    const bool occupied = held || remembered;
    flags[i] = static_cast<std::uint8_t>((occupied ? GridView::kOccupied : 0) |
                                         (occupied || free ? GridView::kKnown : 0));
  }
}

/// Bit i of the row = bit 0 of flags[i].
void pack_row(const std::uint8_t* flags, int n, std::uint64_t* row) {
  int i = 0;
  for (; i + 64 <= n; i += 64) {
    const auto load = [&](int at) {
      const __m256i v = _mm256_loadu_si256(reinterpret_cast<const __m256i*>(flags + at));
      return static_cast<std::uint32_t>(_mm256_movemask_epi8(_mm256_slli_epi16(v, 7)));
    };
    row[i / 64] = load(i) | static_cast<std::uint64_t>(load(i + 32)) << 32;
  }
  if (i < n) row[i / 64] = 0;
  for (; i < n; ++i) row[i / 64] |= static_cast<std::uint64_t>(flags[i] & 1U) << (i % 64);
}

/// flags[i] |= flag where bit i of the row is set.
void merge_row(const std::uint64_t* row, int n, std::uint8_t flag, std::uint8_t* flags) {
  const __m256i byte_of = _mm256_setr_epi8(0, 0, 0, 0, 0, 0, 0, 0, 1, 1, 1, 1, 1, 1, 1, 1, 2, 2, 2,
                                           2, 2, 2, 2, 2, 3, 3, 3, 3, 3, 3, 3, 3);
  const __m256i bit_of = _mm256_set1_epi64x(static_cast<long long>(0x8040201008040201ULL));
  const __m256i value = _mm256_set1_epi8(static_cast<char>(flag));
  int i = 0;
  for (; i + 32 <= n; i += 32) {
    const auto bits = static_cast<std::uint32_t>(row[i / 64] >> (i % 64));
    if (bits == 0) continue;
    const __m256i spread = _mm256_shuffle_epi8(_mm256_set1_epi32(static_cast<int>(bits)), byte_of);
    const __m256i set = _mm256_cmpeq_epi8(_mm256_and_si256(spread, bit_of), bit_of);
    auto* const at = reinterpret_cast<__m256i*>(flags + i);
    _mm256_storeu_si256(at, _mm256_or_si256(_mm256_loadu_si256(at), _mm256_and_si256(set, value)));
  }
  for (; i < n; ++i) {
    if ((row[i / 64] >> (i % 64) & 1U) != 0) flags[i] |= flag;
  }
}

}  // namespace

LocalGrid::LocalGrid(const LocalGridConfig& config, double inflation_m, double resolution_m)
    : config_(config),
      resolution_m_(resolution_m),
      size_(grid_size(config.size_m, resolution_m)),
      hit_units_(to_units(config.sensor.hit_probability)),
      miss_units_(to_units(config.sensor.miss_probability)),
      min_units_(to_units(config.sensor.min_probability)),
      max_units_(to_units(config.sensor.max_probability)),
      decay_units_(static_cast<int>(
          std::lround(config.decay_per_s * to_seconds(kDecayPeriod) * kUnitsPerLogOdds))),
      low_(-size_ / 2),
      evidence_(static_cast<std::size_t>(size_.prod()), kUnseen),
      frames_(evidence_.size(), 0),
      inflation_(inflation_m, resolution_m, config.inflation_shape),
      occupied_(size_.x(), size_.z(), size_.y()),
      inflated_(occupied_) {}

std::size_t LocalGrid::address(int x, int y, int z) const {
  return static_cast<std::size_t>(
      (modulo(z, size_.z()) * size_.x() + modulo(x, size_.x())) * size_.y() + modulo(y, size_.y()));
}

void LocalGrid::forget(const CellBox& cells) {
  for (int z = cells.low.z(); z < cells.high.z(); ++z) {
    for (int x = cells.low.x(); x < cells.high.x(); ++x) {
      for (int y = cells.low.y(); y < cells.high.y(); ++y) {
        const std::size_t i = address(x, y, z);
        evidence_[i] = kUnseen;
        frames_[i] = 0;
      }
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
  for (std::size_t w = 0; w < inside.size(); ++w) {
    for (std::uint64_t bits = rays.passed[w] & inside[w]; bits != 0; bits &= bits - 1) {
      const std::size_t i =
          voxel_in_brick(64 * w + static_cast<std::size_t>(std::countr_zero(bits)));
      const int before = evidence_[i] == kUnseen ? 0 : evidence_[i];
      const int after = std::max(before + miss_units_, min_units_);
      evidence_[i] = static_cast<std::int8_t>(after);
      frames_[i] = static_cast<std::uint8_t>(frames_[i] & (after < 0 ? kFrameCount : 0xff));
    }
  }
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
  const std::int64_t due = stamp / (kDecayPeriod / kDecaySlices);
  const std::int64_t slices = std::clamp<std::int64_t>(due - decayed_slices_, 0, kDecaySlices);
  for (std::int64_t s = due - slices; s < due; ++s) {
    const auto slice = static_cast<std::size_t>(s % kDecaySlices);
    const std::size_t begin = evidence_.size() * slice / kDecaySlices;
    const std::size_t end = evidence_.size() * (slice + 1) / kDecaySlices;
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
  for (const std::shared_ptr<GridSnapshot>& snapshot : snapshots_) {
    if (snapshot.use_count() != 1) continue;
    // The last reader let go of it on its own thread.
    std::atomic_thread_fence(std::memory_order_acquire);
    return snapshot;
  }
  snapshots_.push_back(std::make_shared<GridSnapshot>());
  snapshots_.back()->cells.resize(evidence_.size());
  return snapshots_.back();
}

std::shared_ptr<const GridSnapshot> LocalGrid::snapshot() {
  const std::shared_ptr<GridSnapshot> out = free_snapshot();
  out->stamp = stamp_;
  out->centre = centre_;
  const int length = size_.y();
  const int wrap = length - modulo(low_.y(), length);  // cells of a row before the array's end
  const auto row_begin = [&](int h, int w) {
    return static_cast<std::ptrdiff_t>(h * size_.x() + w) * length;
  };
  for (int h = 0; h < size_.z(); ++h) {
    for (int w = 0; w < size_.x(); ++w) {
      std::uint8_t* const flags = out->cells.data() + row_begin(h, w);
      const std::size_t first = address(low_.x() + w, low_.y(), low_.z() + h);
      const std::size_t second = first + static_cast<std::size_t>(wrap - length);
      make_flags(&evidence_[first], &frames_[first], wrap, flags);
      if (wrap < length) {
        make_flags(&evidence_[second], &frames_[second], length - wrap, flags + wrap);
      }
      pack_row(flags, length, occupied_.row(h, w));
    }
  }
  inflation_.apply(occupied_, inflated_);
  for (int h = 0; h < size_.z(); ++h) {
    for (int w = 0; w < size_.x(); ++w) {
      merge_row(inflated_.row(h, w), length, GridView::kInflated,
                out->cells.data() + row_begin(h, w));
    }
  }
  out->view.cells = out->cells.data();
  out->view.low = low_.cast<double>() * resolution_m_;
  out->view.resolution_m = resolution_m_;
  out->view.size = size_;
  return out;
}

}  // namespace arex
