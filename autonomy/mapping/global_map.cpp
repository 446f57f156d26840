#include "mapping/global_map.h"

#include <bit>
#include <cmath>

namespace arex {
namespace {

/// Fine enough that no chain of hits and misses of OctoMap's own (float) log-odds ends in another
/// state; a test walks them.
constexpr double kUnitsPerLogOdds = 4096;

std::int16_t to_units(double probability) {
  return static_cast<std::int16_t>(
      std::lround(std::log(probability / (1 - probability)) * kUnitsPerLogOdds));
}

Cell round_to_cell(const Vec3& p, double resolution_m) {
  return (p / resolution_m).array().round().cast<int>();
}

constexpr std::size_t kBrickBatch = 32;  ///< bricks

}  // namespace

GlobalMap::GlobalMap(const GlobalMapConfig& config, double resolution_m)
    : resolution_m_(resolution_m),
      box_{round_to_cell(config.low_m, resolution_m), round_to_cell(config.high_m, resolution_m)},
      brick_low_(box_.low.unaryExpr([](int c) { return c >> 3; })),
      brick_count_((box_.high.array() - 1).unaryExpr([](int c) { return c >> 3; }).matrix() -
                   brick_low_ + Cell::Ones()),
      sensor_(config.sensor),
      steps_{to_units(config.sensor.hit_probability), to_units(config.sensor.miss_probability),
             to_units(config.sensor.min_probability), to_units(config.sensor.max_probability)},
      bricks_(static_cast<std::size_t>(brick_count_.prod())),
      band_(config, resolution_m, box_, brick_low_, brick_count_) {}

std::size_t GlobalMap::slot_of(const Cell& brick) const {
  const Cell at = brick - brick_low_;
  return static_cast<std::size_t>((at.y() * brick_count_.x() + at.x()) * brick_count_.z() + at.z());
}

void GlobalMap::add_frame(const RayCaster& rays) {
  changes_.clear();
  const CellBox brick_box{brick_low_, brick_low_ + brick_count_};
  // In batches, each memory access asked for a step before it is needed: the map is larger than the
  // cache.
  std::array<Look, kBrickBatch> looks;
  std::size_t count = 0;
  const auto insert_batch = [&] {
    for (std::size_t i = 0; i < count; ++i) apply_evidence(looks[i]);
    for (std::size_t i = 0; i < count; ++i) update(looks[i]);
    count = 0;
  };
  for (const BrickRays& ray : rays.bricks()) {
    if (!brick_box.contains(ray.brick)) continue;
    std::unique_ptr<Brick>& brick = bricks_[slot_of(ray.brick)];
    if (!brick) brick = std::make_unique<Brick>();
    Look& look = looks[count++];
    look.at = ray.brick;
    look.brick = brick.get();
    const BrickMask inside = mask_inside(ray.brick, box_);
    for (std::size_t w = 0; w < inside.size(); ++w) {
      look.hit[w] = ray.hit[w] & inside[w];
      look.passed[w] = ray.passed[w] & inside[w];
    }
    for (const BrickMask* mask :
         {&brick->known, &brick->occupied, &brick->at_low, &brick->at_high}) {
      __builtin_prefetch(mask);
    }
    if (count == kBrickBatch) insert_batch();
  }
  insert_batch();
  for (const BrickChange& change : changes_) band_.note(change);
}

void GlobalMap::apply_evidence(Look& look) const {
  const Brick& brick = *look.brick;
  for (std::size_t w = 0; w < look.moved.size(); ++w) {
    look.moved[w] = (look.hit[w] & ~brick.at_high[w]) | (look.passed[w] & ~brick.at_low[w]);
    if (static_cast<std::uint32_t>(look.moved[w]) != 0) __builtin_prefetch(&brick.odds[64 * w], 1);
    if (look.moved[w] >> 32 != 0) __builtin_prefetch(&brick.odds[64 * w + 32], 1);
  }
}

const HeightBand& GlobalMap::refreshed_band() const {
  band_.refresh([this](const Cell& brick) -> HeightBand::States {
    const std::unique_ptr<Brick>& found = bricks_[slot_of(brick)];
    if (!found) return {};
    return {&found->known, &found->occupied};
  });
  return band_;
}

void GlobalMap::update(const Look& look) {
  Brick& brick = *look.brick;
  BrickChange change{look.at, &brick.known, &brick.occupied, {}};
  std::uint64_t any = 0;
  for (std::size_t w = 0; w < 8; ++w) {
    if (look.moved[w] == 0) continue;
    VoxelWord word{brick.known[w], brick.occupied[w], brick.at_low[w], brick.at_high[w]};
    add_evidence(&brick.odds[64 * w], look.hit[w], look.passed[w], steps_, word);
    change.changed[w] = (word.known ^ brick.known[w]) | (word.occupied ^ brick.occupied[w]);
    any |= change.changed[w];
    known_voxels_ += static_cast<std::size_t>(std::popcount(word.known ^ brick.known[w]));
    brick.known[w] = word.known;
    brick.occupied[w] = word.occupied;
    brick.at_low[w] = word.at_low;
    brick.at_high[w] = word.at_high;
  }
  if (any != 0) changes_.push_back(change);
}

int GlobalMap::state(const Cell& cell) const {
  if (!box_.contains(cell)) return -1;
  const Cell brick = cell.unaryExpr([](int c) { return c >> 3; });
  const std::unique_ptr<Brick>& found = bricks_[slot_of(brick)];
  if (!found) return -1;
  const Cell in = cell - brick * kBrickCells;
  const std::uint64_t i =
      morton(static_cast<std::uint64_t>(in.x()), static_cast<std::uint64_t>(in.y()),
             static_cast<std::uint64_t>(in.z()));
  if ((found->known[i / 64] >> (i % 64) & 1U) == 0) return -1;
  return static_cast<int>(found->occupied[i / 64] >> (i % 64) & 1U);
}

double GlobalMap::known_volume() const {
  return static_cast<double>(known_voxels_) * std::pow(resolution_m_, 3);
}

StateTree GlobalMap::octree() const {
  std::vector<BrickChange> all;
  std::size_t slot = 0;
  Cell at;
  for (at.y() = 0; at.y() < brick_count_.y(); ++at.y()) {
    for (at.x() = 0; at.x() < brick_count_.x(); ++at.x()) {
      for (at.z() = 0; at.z() < brick_count_.z(); ++at.z(), ++slot) {
        const std::unique_ptr<Brick>& brick = bricks_[slot];
        if (!brick || brick->known == BrickMask{}) continue;
        all.push_back({brick_low_ + at, &brick->known, &brick->occupied, brick->known});
      }
    }
  }
  StateTree tree(resolution_m_, sensor_.min_probability, sensor_.max_probability);
  tree.apply(all);
  return tree;
}

void GlobalMap::write_octomap(const std::filesystem::path& file) const { octree().write(file); }

}  // namespace arex
