#include "sweep/sweep_file.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "config/text.h"

namespace arex::sim {
namespace {

using config_detail::expect_kind;
using config_detail::fail;
using config_detail::parse_scalar;
using Kind = ConfigNode::Kind;

constexpr int kMostRetries = 100;
constexpr double kMostExactInteger = 9007199254740992;  // 2^53: beyond, a double skips integers

// A value of a scenario's key: what stands at it must be one key's, not a section's.
Assignment read_assignment(const ConfigNode::Entry& entry) {
  if (entry.key == "seed") {
    fail(entry.where, "'seed' stands here, expected the seeds in 'seeds: [..]'");
  }
  if (entry.value.kind == Kind::kMap) {
    fail(entry.where, "'" + entry.key + "' is a map, expected dotted keys such as '" + entry.key +
                          "." + (entry.value.entries.empty() ? "x" : entry.value.entries[0].key) +
                          ": value'");
  }
  return {entry.key, entry.where, entry.value};
}

std::vector<Assignment> read_assignments(const ConfigNode& node, std::string_view name) {
  expect_kind(node, name, Kind::kMap, "a map of key: value");
  std::vector<Assignment> assignments;
  for (const auto& entry : node.entries) assignments.push_back(read_assignment(entry));
  return assignments;
}

BaseScenario read_base(const ConfigNode& node, const std::filesystem::path& folder) {
  std::string path;
  parse_scalar(node, "base", path);
  BaseScenario base{(folder / path).lexically_normal(), node.where};
  std::error_code ignored;
  if (!std::filesystem::is_regular_file(base.file, ignored)) {
    fail(node.where, "'base' is '" + path + "', expected a scenario file relative to this file");
  }
  return base;
}

std::vector<BaseScenario> read_bases(const ConfigNode& node, const std::filesystem::path& folder) {
  if (node.kind != Kind::kSequence) return {read_base(node, folder)};
  std::vector<BaseScenario> bases;
  for (const ConfigNode& item : node.items) bases.push_back(read_base(item, folder));
  if (bases.empty()) fail(node.where, "'base' is empty, expected a scenario file");
  return bases;
}

std::vector<GridAxis> read_grid(const ConfigNode& node) {
  expect_kind(node, "grid", Kind::kMap, "a map of key: [values]");
  std::vector<GridAxis> grid;
  for (const auto& entry : node.entries) {
    const Assignment axis = read_assignment(entry);
    expect_kind(axis.value, axis.key, Kind::kSequence, "a list of values [..]");
    if (axis.value.items.empty())
      fail(axis.where, "'" + axis.key + "' has no values, expected [..]");
    grid.push_back({axis.key, axis.where, axis.value.items});
  }
  return grid;
}

std::vector<Variant> read_list(const ConfigNode& node, const std::filesystem::path& folder) {
  expect_kind(node, "list", Kind::kSequence, "a list of maps of key: value");
  std::vector<Variant> list;
  for (const ConfigNode& item : node.items) {
    expect_kind(item, "list", Kind::kMap, "a map of key: value, with or without a name");
    Variant variant;
    for (const auto& entry : item.entries) {
      if (entry.key == "name") {
        parse_scalar(entry.value, "name", variant.name);
        const auto same = [&](const Variant& v) { return v.name == variant.name; };
        if (std::any_of(list.begin(), list.end(), same)) {
          fail(entry.where, "two items are named '" + variant.name + "', expected one each");
        }
      } else if (entry.key == "base") {
        variant.base = read_base(entry.value, folder);
      } else {
        variant.values.push_back(read_assignment(entry));
      }
    }
    list.push_back(std::move(variant));
  }
  if (list.empty()) fail(node.where, "'list' is empty, expected items");
  return list;
}

HypercubeAxis read_axis(const ConfigNode::Entry& entry) {
  static constexpr std::array<std::string_view, 3> kScales{"linear", "log", "integer"};
  HypercubeAxis axis{entry.key, entry.where};
  const ConfigNode& node = entry.value;
  if (entry.key == "seed") {
    fail(entry.where, "'seed' stands here, expected the seeds in 'seeds: [..]'");
  }
  const bool pair =
      node.kind == Kind::kSequence && (node.items.size() == 2 || node.items.size() == 3);
  if (!pair) fail(node.where, "'" + axis.key + "' expects [low, high] or [low, high, log|integer]");
  parse_scalar(node.items[0], axis.key, axis.low);
  parse_scalar(node.items[1], axis.key, axis.high);
  if (node.items.size() == 3) {
    axis.scale = static_cast<HypercubeAxis::Scale>(
        config_detail::parse_choice(node.items[2], axis.key, {kScales.begin(), kScales.end()}));
  }
  if (!(axis.low < axis.high)) fail(node.where, "'" + axis.key + "' expects low < high");
  if (axis.scale == HypercubeAxis::Scale::kLog && axis.low <= 0) {
    fail(node.where, "'" + axis.key + "' expects 0 < low on a log scale");
  }
  if (axis.scale == HypercubeAxis::Scale::kInteger &&
      std::max(std::abs(axis.low), std::abs(axis.high)) > kMostExactInteger) {
    fail(node.where, "'" + axis.key + "' expects integers of at most 2^53");
  }
  return axis;
}

int read_count(const ConfigNode& node, std::string_view key, int least, int most) {
  int count = 0;
  parse_scalar(node, key, count);
  if (count < least || count > most) {
    fail(node.where, "'" + std::string(key) + "' is " + std::to_string(count) + ", expected " +
                         std::to_string(least) + " to " + std::to_string(most));
  }
  return count;
}

LatinHypercube read_hypercube(const ConfigNode& node) {
  expect_kind(node, "latin_hypercube", Kind::kMap, "samples, seed and keys");
  config_detail::reject_unknown(node, {"samples", "seed", "keys"});
  LatinHypercube cube;
  const ConfigNode* samples = node.find("samples");
  const ConfigNode* keys = node.find("keys");
  if (!samples || !keys) fail(node.where, "'latin_hypercube' expects samples: N and keys: {..}");
  cube.samples = read_count(*samples, "samples", 1, kMostRuns);
  if (const ConfigNode* seed = node.find("seed")) parse_scalar(*seed, "seed", cube.seed);
  expect_kind(*keys, "keys", Kind::kMap, "a map of key: [low, high]");
  for (const auto& entry : keys->entries) cube.axes.push_back(read_axis(entry));
  if (cube.axes.empty()) fail(keys->where, "'keys' is empty, expected key: [low, high]");
  return cube;
}

// `7` or `1..10`, both ends included.
void read_seed(const ConfigNode& node, std::vector<std::uint64_t>& seeds) {
  const auto dots = node.scalar.find("..");
  if (node.kind != Kind::kScalar || dots == std::string::npos) {
    parse_scalar(node, "seeds", seeds.emplace_back());
    return;
  }
  std::uint64_t first = 0;
  std::uint64_t last = 0;
  ConfigNode end = node;
  end.scalar = node.scalar.substr(0, dots);
  parse_scalar(end, "seeds", first);
  end.scalar = node.scalar.substr(dots + 2);
  parse_scalar(end, "seeds", last);
  const std::string given = "'seeds' has '" + shortened(node.scalar) + "', ";
  if (last < first) fail(node.where, given + "expected FIRST..LAST");
  const std::uint64_t more = last - first;  // by one less than their count, which may be 2^64
  if (more >= kMostRuns - std::min<std::size_t>(seeds.size(), kMostRuns)) {
    fail(node.where, given + "more than " + std::to_string(more) + " seeds, expected at most " +
                         std::to_string(kMostRuns) + " in all");
  }
  for (std::uint64_t i = 0; i <= more; ++i) seeds.push_back(first + i);
}

std::vector<std::uint64_t> read_seeds(const ConfigNode& node) {
  std::vector<std::uint64_t> seeds;
  if (node.kind == Kind::kSequence) {
    for (const ConfigNode& item : node.items) read_seed(item, seeds);
  } else {
    read_seed(node, seeds);
  }
  if (seeds.empty()) fail(node.where, "'seeds' is empty, expected seeds");
  std::vector<std::uint64_t> sorted = seeds;
  std::sort(sorted.begin(), sorted.end());
  const auto twice = std::adjacent_find(sorted.begin(), sorted.end());
  if (twice != sorted.end()) {
    fail(node.where, "'seeds' has " + std::to_string(*twice) + " twice, expected each once");
  }
  return seeds;
}

}  // namespace

SweepFile load_sweep_file(const std::filesystem::path& file) {
  const ConfigNode node = load_yaml(file);
  config_detail::reject_unknown(node, {"base", "set", "grid", "list", "latin_hypercube", "seeds",
                                       "repeats", "timeout_s", "retries"});
  const std::filesystem::path folder = file.parent_path();
  SweepFile sweep;
  sweep.name = file.stem().string();
  sweep.where = file.string() + ":1";
  if (const auto* n = node.find("base")) sweep.bases = read_bases(*n, folder);
  if (const auto* n = node.find("set")) sweep.set = read_assignments(*n, "set");
  if (const auto* n = node.find("grid")) sweep.grid = read_grid(*n);
  if (const auto* n = node.find("list")) sweep.list = read_list(*n, folder);
  if (const auto* n = node.find("latin_hypercube")) sweep.hypercube = read_hypercube(*n);
  if (const auto* n = node.find("seeds")) {
    sweep.seeds = read_seeds(*n);
    sweep.seeds_where = n->where;
  }
  if (const auto* n = node.find("repeats")) sweep.repeats = read_count(*n, "repeats", 1, kMostRuns);
  if (const auto* n = node.find("retries"))
    sweep.retries = read_count(*n, "retries", 0, kMostRetries);
  if (const auto* n = node.find("timeout_s")) {
    parse_scalar(*n, "timeout_s", sweep.timeout_s);
    if (sweep.timeout_s <= 0) fail(n->where, "'timeout_s' is not positive, expected seconds");
  }
  const auto has_base = [](const Variant& variant) { return variant.base.has_value(); };
  if (sweep.bases.empty() &&
      (sweep.list.empty() || !std::all_of(sweep.list.begin(), sweep.list.end(), has_base))) {
    fail(sweep.where, "no 'base', expected 'base: SCENARIO.yaml'");
  }
  return sweep;
}

}  // namespace arex::sim
