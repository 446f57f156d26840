#include "mapping/point_cloud_map.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "math/mix.h"

namespace arex {
namespace {

constexpr std::size_t kFirstSlots = 1U << 16;
constexpr std::size_t kPointBatch = 32;  ///< points
// A voxel's mean settles; more points would only wear out its count.
constexpr std::uint32_t kMaxCount = 1000;

std::uint64_t key_of(const Vec3f& p, double voxel_m) {
  const auto at = [&](int axis) {
    return static_cast<std::int64_t>(std::floor(static_cast<double>(p[axis]) / voxel_m));
  };
  return cell_key(at(0), at(1), at(2));
}

}  // namespace

PointCloudMap::PointCloudMap(const PointCloudMapConfig& config)
    : config_(config), slots_(kFirstSlots, 0) {}

std::size_t PointCloudMap::slot_of(std::uint64_t key) const {
  const std::size_t mask = slots_.size() - 1;
  std::size_t i = mix_bits(key) & mask;
  while (slots_[i] != 0 && voxels_[slots_[i] - 1].key != key) i = (i + 1) & mask;
  return i;
}

void PointCloudMap::grow() {
  slots_.assign(2 * slots_.size(), 0);
  for (std::size_t i = 0; i < voxels_.size(); ++i) {
    slots_[slot_of(voxels_[i].key)] = static_cast<std::uint32_t>(i + 1);
  }
}

void PointCloudMap::insert(std::span<const Vec3f> points_O) {
  // In batches, each memory access asked for a step before it is needed: the map is larger than the
  // cache.
  struct Keyed {
    std::uint64_t key;
    Vec3f p;
  };
  std::array<Keyed, kPointBatch> batch;
  std::size_t count = 0;
  const auto insert_batch = [&] {
    const std::size_t mask = slots_.size() - 1;
    for (std::size_t i = 0; i < count; ++i) {
      const std::uint32_t at = slots_[mix_bits(batch[i].key) & mask];
      if (at != 0) __builtin_prefetch(&voxels_[at - 1], 1);
    }
    for (std::size_t i = 0; i < count; ++i) insert(batch[i].key, batch[i].p);
    count = 0;
  };
  for (const Vec3f& p : points_O) {
    if (!p.allFinite()) continue;
    const std::uint64_t key = key_of(p, config_.voxel_m);
    __builtin_prefetch(&slots_[mix_bits(key) & (slots_.size() - 1)]);
    batch[count++] = {key, p};
    if (count == kPointBatch) insert_batch();
  }
  insert_batch();
}

void PointCloudMap::insert(std::uint64_t key, const Vec3f& p) {
  std::size_t slot = slot_of(key);
  if (slots_[slot] == 0) {
    if (voxels_.size() >= static_cast<std::size_t>(config_.max_points)) {
      ++refused_;
      return;
    }
    if (2 * (voxels_.size() + 1) > slots_.size()) {
      grow();
      slot = slot_of(key);
    }
    voxels_.push_back({key, p, 1});
    slots_[slot] = static_cast<std::uint32_t>(voxels_.size());
    return;
  }
  Voxel& voxel = voxels_[slots_[slot] - 1];
  if (voxel.count >= kMaxCount) return;
  ++voxel.count;
  voxel.mean += (p - voxel.mean) / static_cast<float>(voxel.count);
}

std::vector<Vec3f> PointCloudMap::points(std::size_t first) const {
  std::vector<Vec3f> out;
  out.reserve(voxels_.size() - std::min(first, voxels_.size()));
  for (std::size_t i = first; i < voxels_.size(); ++i) out.push_back(voxels_[i].mean);
  return out;
}

}  // namespace arex
