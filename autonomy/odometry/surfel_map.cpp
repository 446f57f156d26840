#include "odometry/surfel_map.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <utility>

#include "math/mix.h"

namespace arex {
namespace {

constexpr double kUnitVariance = 1e-4;  // weights are told in points of 1 cm noise
constexpr double kPriorPoints = 3;      // of the points' own noise, in the thickness of a surfel

std::uint64_t key_of(const Vec3& p, double inverse_edge) {
  const auto at = [&](int axis) {
    return static_cast<std::int64_t>(std::floor(p[axis] * inverse_edge));
  };
  return cell_key(at(0), at(1), at(2));
}

Vec3 centre_of(const Vec3& p, double edge, double inverse_edge) {
  return ((p * inverse_edge).array().floor() + 0.5).matrix() * edge;
}

Vec3 to_vec3(const std::array<float, 3>& a) { return {a[0], a[1], a[2]}; }

Mat3 to_symmetric(const std::array<float, 6>& a) {
  Mat3 m;
  m << a[0], a[1], a[2], a[1], a[3], a[4], a[2], a[4], a[5];
  return m;
}

}  // namespace

const Mat3 SurfelMap::kR_GO = [] {
  Mat3 R;
  R.col(0) = Vec3(1, -1, 0).normalized();
  R.col(1) = Vec3(1, 1, -2).normalized();
  R.col(2) = Vec3(1, 1, 1).normalized();
  return R;
}();

SurfelMap::SurfelMap(const SurfelMapConfig& config) : config_(config) {
  levels_.resize(static_cast<std::size_t>(config.levels));
  for (int i = 0; i < config.levels; ++i) {
    Level& level = levels_[static_cast<std::size_t>(i)];
    level.edge_m = edge_m(i);
    level.inverse_edge = 1 / level.edge_m;
  }
  clear();
}

void SurfelMap::clear() {
  for (Level& level : levels_) {
    level.slots.assign(1024, Slot{});
    level.cells.clear();
    level.surfels.clear();
    level.hand = 0;
  }
}

std::size_t SurfelMap::slot_of(const Level& level, std::uint64_t key) {
  const std::size_t mask = level.slots.size() - 1;
  std::size_t i = mix_bits(key) & mask;
  while (level.slots[i].cell != kNone && level.slots[i].key != key) i = (i + 1) & mask;
  return i;
}

void SurfelMap::make_slots(Level& level, std::size_t more_cells) const {
  const std::size_t cells =
      std::min(level.cells.size() + more_cells, static_cast<std::size_t>(config_.capacity));
  std::size_t slots = level.slots.size();
  while (slots < 2 * cells) slots *= 2;
  if (slots == level.slots.size()) return;
  const std::vector<Slot> before = std::exchange(level.slots, std::vector<Slot>(slots));
  for (const Slot& slot : before) {
    if (slot.cell != kNone) level.slots[slot_of(level, slot.key)] = slot;
  }
}

void SurfelMap::erase_slot(Level& level, std::size_t hole) {
  const std::size_t mask = level.slots.size() - 1;
  // Close the gap: move up whatever may stand at the hole instead of further down.
  for (std::size_t i = (hole + 1) & mask; level.slots[i].cell != kNone; i = (i + 1) & mask) {
    const std::size_t home = mix_bits(level.slots[i].key) & mask;
    if (((i - home) & mask) >= ((i - hole) & mask)) {
      level.slots[hole] = level.slots[i];
      hole = i;
    }
  }
  level.slots[hole] = Slot{};
}

std::uint32_t SurfelMap::make_room(Level& level) const {
  if (level.cells.size() < static_cast<std::size_t>(config_.capacity)) {
    if (level.cells.size() == level.cells.capacity()) {
      // Doubling would hold twice what is used.
      const std::size_t cells = level.cells.size() + level.cells.size() / 8 + 1024;
      level.cells.reserve(cells);
      level.surfels.reserve(cells);
    }
    level.cells.emplace_back();
    level.surfels.emplace_back();
    return static_cast<std::uint32_t>(level.cells.size() - 1);
  }
  for (;;) {
    const std::size_t index = level.hand;
    level.hand = (level.hand + 1) % level.cells.size();
    const std::size_t slot = slot_of(level, level.cells[index].key);
    if (level.slots[slot].seen == 0) {
      erase_slot(level, slot);
      return static_cast<std::uint32_t>(index);
    }
    level.slots[slot].seen = 0;
  }
}

SurfelMap::Slot& SurfelMap::obtain(Level& level, std::uint64_t key, int insertion) {
  std::size_t i = slot_of(level, key);
  if (level.slots[i].cell == kNone) {
    const std::uint32_t index = make_room(level);
    level.cells[index] = Cell{};
    level.cells[index].key = key;
    level.cells[index].refresh_at = config_.min_points;
    level.surfels[index] = Surfel{};
    level.surfels[index].born = insertion;
    i = slot_of(level, key);  // making room may have moved slots
    level.slots[i] = {key, index, 0, 0};
  }
  level.slots[i].seen = 1;
  return level.slots[i];
}

void SurfelMap::insert(std::span<const Vec3f> points_O, std::span<const float> variances_m2,
                       int insertion) {
  // Level by level, slots and cells asked for ahead: the time goes into waiting for memory.
  constexpr std::size_t kSlotsAhead = 16, kCellsAhead = 8;
  std::vector<Vec3> points_G;
  points_G.reserve(points_O.size());
  for (const Vec3f& p_O : points_O) points_G.emplace_back(kR_GO * p_O.cast<double>());
  const std::size_t n = points_G.size();
  for (Level& level : levels_) {
    make_slots(level, n);
    std::array<std::uint64_t, kSlotsAhead> keys{};
    const auto add_point = [&](std::size_t i) {
      const float weight = static_cast<float>(kUnitVariance) / variances_m2[i];
      const Vec3 centre = centre_of(points_G[i], level.edge_m, level.inverse_edge);
      Slot& slot = obtain(level, keys[i % kSlotsAhead], insertion);
      add(level, slot, points_G[i] - centre, weight);
    };
    for (std::size_t i = 0; i < n + kSlotsAhead; ++i) {
      if (i >= kSlotsAhead) add_point(i - kSlotsAhead);
      if (i < n) {
        const std::uint64_t key = key_of(points_G[i], level.inverse_edge);
        keys[i % kSlotsAhead] = key;
        __builtin_prefetch(&level.slots[mix_bits(key) & (level.slots.size() - 1)]);
      }
      if (i >= kCellsAhead && i - kCellsAhead < n) {
        const Slot& slot = level.slots[slot_of(level, keys[(i - kCellsAhead) % kSlotsAhead])];
        if (slot.cell != kNone && slot.saturated == 0) {
          __builtin_prefetch(&level.cells[slot.cell], 1);
        }
      }
    }
  }
}

void SurfelMap::add(Level& level, Slot& slot, const Vec3& offset_G, float weight) {
  if (slot.saturated != 0) return;
  Cell& cell = level.cells[slot.cell];
  const Vec3f d = offset_G.cast<float>();
  ++cell.count;
  cell.weight += weight;
  for (int i = 0; i < 3; ++i) cell.first[static_cast<std::size_t>(i)] += weight * d[i];
  cell.second[0] += weight * d.x() * d.x();
  cell.second[1] += weight * d.x() * d.y();
  cell.second[2] += weight * d.x() * d.z();
  cell.second[3] += weight * d.y() * d.y();
  cell.second[4] += weight * d.y() * d.z();
  cell.second[5] += weight * d.z() * d.z();
  if (cell.weight >= static_cast<float>(config_.saturation_weight)) slot.saturated = 1;
  if (cell.count >= cell.refresh_at) {
    refresh(level, cell, level.surfels[slot.cell]);
    cell.refresh_at =
        std::max(cell.count + 1, static_cast<int>(std::ceil(cell.count * config_.refresh_growth)));
  }
}

SurfelMap::Fit SurfelMap::fit(int count, double weight, const Vec3& mean, const Mat3& covariance) {
  Eigen::SelfAdjointEigenSolver<Mat3> solver;
  solver.computeDirect(covariance);
  const Vec3 spread = solver.eigenvalues().cwiseMax(0);
  Fit fit;
  fit.mean = mean;
  fit.normal = solver.eigenvectors().col(0);
  const double n = count;
  const double noise = n / weight;  // harmonic mean of the points' variances
  fit.thickness_m2 = (n * spread[0] + kPriorPoints * noise) / (n - 3 + kPriorPoints);
  // Variance of a regression plane at mean + d: s^2 (1/n + d1^2 / (n l1) + d2^2 / (n l2)).
  constexpr double kLeastSpread = 1e-6;
  fit.regression = Mat3::Zero();
  for (int i = 1; i < 3; ++i) {
    const Vec3 axis = solver.eigenvectors().col(i);
    fit.regression +=
        fit.thickness_m2 / (n * std::max(spread[i], kLeastSpread)) * axis * axis.transpose();
  }
  return fit;
}

void SurfelMap::refresh(const Level& level, const Cell& cell, Surfel& surfel) const {
  const double W = cell.weight;
  const Vec3 mean = to_vec3(cell.first) / W;
  const Mat3 covariance = to_symmetric(cell.second) / W - mean * mean.transpose();
  const Fit f = fit(cell.count, W / kUnitVariance, mean, covariance);
  const double limit = config_.max_thickness_ratio * level.edge_m;
  surfel.thickness_m2 = -1;
  if (f.thickness_m2 > limit * limit) return;
  for (std::size_t i = 0; i < 3; ++i) {
    const auto e = static_cast<Eigen::Index>(i);
    surfel.mean[i] = static_cast<float>(f.mean[e]);
    surfel.normal[i] = static_cast<float>(f.normal[e]);
  }
  const Mat3& r = f.regression;
  const std::array<double, 6> upper{r(0, 0), r(0, 1), r(0, 2), r(1, 1), r(1, 2), r(2, 2)};
  for (std::size_t i = 0; i < 6; ++i) surfel.regression[i] = static_cast<float>(upper[i]);
  surfel.thickness_m2 =
      static_cast<float>(f.thickness_m2 * (1 + 1 / static_cast<double>(cell.count)));
}

SurfelMap::Query SurfelMap::begin(const Vec3& p_O) const {
  Query query;
  query.p_G = kR_GO * p_O;
  for (std::size_t l = 0; l < levels_.size(); ++l) {
    const Level& level = levels_[l];
    query.keys[l] = key_of(query.p_G, level.inverse_edge);
    __builtin_prefetch(&level.slots[mix_bits(query.keys[l]) & (level.slots.size() - 1)]);
  }
  return query;
}

void SurfelMap::look_up(Query& query) const {
  for (std::size_t l = 0; l < levels_.size(); ++l) {
    const Level& level = levels_[l];
    query.cells[l] = level.slots[slot_of(level, query.keys[l])].cell;
    if (query.cells[l] != kNone) __builtin_prefetch(&level.surfels[query.cells[l]]);
  }
}

std::optional<SurfelMatch> SurfelMap::answer(const Query& query) const {
  const Surfel* best = nullptr;
  std::size_t best_level = 0;
  Vec3 best_mean;
  double least = 0;
  for (std::size_t l = 0; l < levels_.size(); ++l) {
    if (query.cells[l] == kNone) continue;
    const Level& level = levels_[l];
    const Surfel& surfel = level.surfels[query.cells[l]];
    if (surfel.thickness_m2 < 0) continue;
    const Vec3 mean = centre_of(query.p_G, level.edge_m, level.inverse_edge) + to_vec3(surfel.mean);
    const Vec3 d = query.p_G - mean;
    const double variance = surfel.thickness_m2 + d.dot(to_symmetric(surfel.regression) * d);
    if (best == nullptr || variance < least) {
      best = &surfel;
      best_level = l;
      best_mean = mean;
      least = variance;
    }
  }
  if (best == nullptr) return std::nullopt;
  return SurfelMatch{kR_GO.transpose() * to_vec3(best->normal),
                     kR_GO.transpose() * best_mean,
                     least,
                     kR_GO.transpose() * to_symmetric(best->regression) * kR_GO,
                     static_cast<int>(best_level),
                     best->born,
                     query.cells[best_level]};
}

std::optional<SurfelMatch> SurfelMap::find(const Vec3& p_O) const {
  Query query = begin(p_O);
  look_up(query);
  return answer(query);
}

bool SurfelMap::occupied(const Vec3& p_O) const {
  const Level& level = levels_.back();
  const std::uint64_t key = key_of(kR_GO * p_O, level.inverse_edge);
  const std::uint32_t index = level.slots[slot_of(level, key)].cell;
  return index != kNone && level.surfels[index].thickness_m2 >= 0;
}

std::size_t SurfelMap::memory_bytes() const {
  std::size_t bytes = 0;
  for (const Level& level : levels_) {
    bytes += level.slots.capacity() * sizeof(Slot) + level.cells.capacity() * sizeof(Cell) +
             level.surfels.capacity() * sizeof(Surfel);
  }
  return bytes;
}

}  // namespace arex
