#include "mapping/global_map.h"

#include <immintrin.h>

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

constexpr std::size_t kBatch = 32;  ///< bricks

/// 16 lanes of all ones where the bit is set.
__m256i spread_to_lanes(std::uint64_t bits) {
  const __m256i bit_of =
      _mm256_setr_epi16(1, 1 << 1, 1 << 2, 1 << 3, 1 << 4, 1 << 5, 1 << 6, 1 << 7, 1 << 8, 1 << 9,
                        1 << 10, 1 << 11, 1 << 12, 1 << 13, 1 << 14, static_cast<short>(1 << 15));
  const __m256i all = _mm256_set1_epi16(static_cast<short>(bits & 0xffff));
  return _mm256_cmpeq_epi16(_mm256_and_si256(all, bit_of), bit_of);
}

/// Bit i set where lane i is negative.
std::uint64_t negative_lanes(__m256i lanes) {
  const __m128i bytes =
      _mm_packs_epi16(_mm256_castsi256_si128(lanes), _mm256_extracti128_si256(lanes, 1));
  return static_cast<std::uint64_t>(_mm_movemask_epi8(bytes)) & 0xffff;
}

}  // namespace

GlobalMap::GlobalMap(const GlobalMapConfig& config, double resolution_m)
    : resolution_m_(resolution_m),
      box_{round_to_cell(config.low_m, resolution_m), round_to_cell(config.high_m, resolution_m)},
      brick_low_(box_.low.unaryExpr([](int c) { return c >> 3; })),
      brick_count_((box_.high.array() - 1).unaryExpr([](int c) { return c >> 3; }).matrix() -
                   brick_low_ + Cell::Ones()),
      hit_units_(to_units(config.sensor.hit_probability)),
      miss_units_(to_units(config.sensor.miss_probability)),
      min_units_(to_units(config.sensor.min_probability)),
      max_units_(to_units(config.sensor.max_probability)),
      bricks_(static_cast<std::size_t>(brick_count_.prod())),
      tree_(resolution_m, config.sensor.min_probability, config.sensor.max_probability),
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
  std::array<Look, kBatch> looks;
  std::size_t count = 0;
  const auto insert_batch = [&] {
    for (std::size_t i = 0; i < count; ++i) weigh(looks[i]);
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
    if (count == kBatch) insert_batch();
  }
  insert_batch();
  tree_.apply(changes_);
  for (const BrickChange& change : changes_) band_.note(change);
}

void GlobalMap::weigh(Look& look) const {
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
  const __m256i hit_step = _mm256_set1_epi16(hit_units_);
  const __m256i miss_step = _mm256_set1_epi16(miss_units_);
  const __m256i low = _mm256_set1_epi16(min_units_);
  const __m256i high = _mm256_set1_epi16(max_units_);
  std::uint64_t any = 0;
  for (std::size_t w = 0; w < 8; ++w) {
    const std::uint64_t hit = look.hit[w], passed = look.passed[w], moved = look.moved[w];
    if (moved == 0) continue;
    std::uint64_t known = brick.known[w], occupied = brick.occupied[w];
    for (unsigned part = 0; part < 64; part += 16) {
      if ((moved >> part & 0xffff) == 0) continue;
      auto* const at = reinterpret_cast<__m256i*>(&brick.odds[64 * w + part]);
      __m256i odds = _mm256_load_si256(at);
      const __m256i steps =
          _mm256_or_si256(_mm256_and_si256(spread_to_lanes(hit >> part), hit_step),
                          _mm256_and_si256(spread_to_lanes(passed >> part), miss_step));
      odds = _mm256_adds_epi16(odds, steps);
      odds = _mm256_min_epi16(_mm256_max_epi16(odds, low), high);
      _mm256_store_si256(at, odds);
      const std::uint64_t lanes = std::uint64_t{0xffff} << part;
      const auto assign = [lanes, part](std::uint64_t& word, std::uint64_t sixteen) {
        word = (word & ~lanes) | sixteen << part;
      };
      known |= (hit | passed) & lanes;
      assign(occupied, known >> part & ~negative_lanes(odds) & 0xffff);
      assign(brick.at_low[w], negative_lanes(_mm256_cmpeq_epi16(odds, low)));
      assign(brick.at_high[w], negative_lanes(_mm256_cmpeq_epi16(odds, high)));
    }
    change.changed[w] = (known ^ brick.known[w]) | (occupied ^ brick.occupied[w]);
    any |= change.changed[w];
    known_voxels_ += static_cast<std::size_t>(std::popcount(known ^ brick.known[w]));
    brick.known[w] = known;
    brick.occupied[w] = occupied;
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

void GlobalMap::write_octomap(const std::filesystem::path& file) const { tree_.write(file); }

}  // namespace arex
