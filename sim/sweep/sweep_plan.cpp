#include "sweep/sweep_plan.h"

#include <fmt/format.h>
#include <xxhash.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <fstream>
#include <map>
#include <numeric>
#include <set>
#include <stdexcept>

#include "math/random.h"
#include "run/scenario.h"

namespace arex::sim {
namespace {

using config_detail::fail;

// A node as flow YAML, for the table.
std::string flow_text(const ConfigNode& node) {
  switch (node.kind) {
    case ConfigNode::Kind::kScalar:
      return node.scalar;
    case ConfigNode::Kind::kSequence: {
      std::string text;
      for (const auto& item : node.items) text += (text.empty() ? "" : ", ") + flow_text(item);
      return "[" + text + "]";
    }
    case ConfigNode::Kind::kMap: {
      std::string text;
      for (const auto& entry : node.entries) {
        text += (text.empty() ? "" : ", ") + entry.key + ": " + flow_text(entry.value);
      }
      return "{" + text + "}";
    }
    default:
      return "";
  }
}

// Six digits name a sample as well as sixteen.
std::string sample_text(double value, HypercubeAxis::Scale scale) {
  if (scale == HypercubeAxis::Scale::kInteger) {
    return std::to_string(static_cast<long long>(value));
  }
  return fmt::format("{:.6g}", value);
}

double scaled(const HypercubeAxis& axis, double u) {
  if (axis.scale == HypercubeAxis::Scale::kLog) return axis.low * std::pow(axis.high / axis.low, u);
  if (axis.scale == HypercubeAxis::Scale::kInteger) {
    return std::min(axis.high, std::floor(axis.low + u * (axis.high - axis.low + 1)));
  }
  return axis.low + u * (axis.high - axis.low);
}

using Point = std::vector<Assignment>;

// Each key's range is cut into as many strata as there are samples; each stratum is hit once.
std::vector<Point> hypercube_points(const LatinHypercube& cube) {
  if (cube.axes.empty()) return {Point{}};
  const auto count = static_cast<std::size_t>(cube.samples);
  std::vector<Point> points(count);
  for (const HypercubeAxis& axis : cube.axes) {
    RandomStream random(cube.seed, "latin_hypercube/" + axis.key);
    std::vector<int> strata(count);
    std::iota(strata.begin(), strata.end(), 0);
    for (std::size_t i = count - 1; i > 0; --i) {
      std::swap(strata[i],
                strata[static_cast<std::size_t>(random.uniform_int(0, static_cast<int>(i)))]);
    }
    for (std::size_t i = 0; i < count; ++i) {
      const double u = (strata[i] + random.uniform()) / static_cast<double>(count);
      ConfigNode value;
      value.kind = ConfigNode::Kind::kScalar;
      value.where = axis.where;
      value.scalar = sample_text(scaled(axis, u), axis.scale);
      points[i].push_back({axis.key, axis.where, value});
    }
  }
  return points;
}

// The product of the axes, the last one running fastest.
std::vector<Point> grid_points(const std::vector<GridAxis>& grid) {
  std::vector<Point> points{Point{}};
  for (const GridAxis& axis : grid) {
    std::vector<Point> longer;
    for (const Point& point : points) {
      for (const ConfigNode& value : axis.values) {
        longer.push_back(point);
        longer.back().push_back({axis.key, axis.where, value});
      }
    }
    points = std::move(longer);
  }
  return points;
}

// Every varied key in the order of its first appearance; one key, one place.
std::vector<std::string> varied_keys(const SweepFile& sweep) {
  std::vector<std::string> keys;
  const auto add = [&](const std::string& key) {
    if (std::find(keys.begin(), keys.end(), key) == keys.end()) keys.push_back(key);
  };
  for (const Variant& variant : sweep.list) {
    for (const Assignment& assignment : variant.values) add(assignment.key);
  }
  const auto add_new = [&](const std::string& key, const std::string& where) {
    if (std::find(keys.begin(), keys.end(), key) != keys.end()) {
      fail(where, "'" + key + "' is varied twice, expected in one of list, latin_hypercube, grid");
    }
    keys.push_back(key);
  };
  for (const HypercubeAxis& axis : sweep.hypercube.axes) add_new(axis.key, axis.where);
  for (const GridAxis& axis : sweep.grid) add_new(axis.key, axis.where);
  return keys;
}

std::string unquoted(const std::string& text) {
  if (text.size() < 2 || text.front() != '"') return text;
  std::string plain;
  for (std::size_t i = 1; i + 1 < text.size(); ++i) {
    if (text[i] == '\\') ++i;
    plain += text[i];
  }
  return plain;
}

std::vector<Variant> variants_of(const SweepFile& sweep) {
  return sweep.list.empty() ? std::vector<Variant>{Variant{}} : sweep.list;
}

/// Makes runs out of points.
class Expander {
 public:
  Expander(const SweepFile& sweep, SweepPlan& plan) : sweep_(sweep), plan_(plan) {}

  void add(const BaseScenario& base, const Variant& variant, const Point& sample,
           const Point& grid) {
    ConfigNode source = node_of(base.file);
    for (const Point* point : {&sweep_.set, &variant.values, &sample, &grid}) {
      for (const Assignment& a : *point) set_value(source, a.key, a.where, a.value);
    }
    const std::string name = base.file.stem().string();
    if (sweep_.seeds.empty()) add(make_scenario(name, source), variant);
    for (const std::uint64_t seed : sweep_.seeds) {
      ConfigNode seeded = source;
      set_seed(seeded, seed, sweep_.seeds_where);
      add(make_scenario(name, std::move(seeded)), variant);
    }
  }

 private:
  void add(const Scenario& scenario, const Variant& variant) {
    const auto parameters = list_parameters(scenario.config);
    PlannedRun run;
    run.scenario = scenario.name;
    run.variant = variant.name;
    run.values = values_of(parameters, scenario.source);
    run.seed = scenario.config.seed;
    run.resolved = write_yaml(parameters);
    for (run.repeat = 1; run.repeat <= sweep_.repeats; ++run.repeat) {
      run.id = run_id(plan_.build, run.scenario, run.repeat, run.resolved);
      plan_.runs.push_back(run);
    }
  }

  const ConfigNode& node_of(const std::filesystem::path& file) {
    const auto [at, added] = nodes_.try_emplace(file);
    if (added) at->second = load_yaml(file);
    return at->second;
  }

  // The value that counts, whether the point names it or not.
  std::vector<std::string> values_of(const std::vector<ParameterInfo>& parameters,
                                     const ConfigNode& source) const {
    std::vector<std::string> values;
    for (const std::string& key : plan_.keys) {
      const auto at = std::find_if(parameters.begin(), parameters.end(),
                                   [&](const auto& p) { return p.key == key; });
      values.push_back(at != parameters.end() ? unquoted(at->value) : text_at(source, key));
    }
    return values;
  }

  static std::string text_at(const ConfigNode& source, std::string_view key) {
    const ConfigNode* node = &source;
    while (node && !key.empty()) {
      const auto dot = std::min(key.find('.'), key.size());
      node = node->find(key.substr(0, dot));
      key.remove_prefix(std::min(dot + 1, key.size()));
    }
    return node ? flow_text(*node) : "";
  }

  const SweepFile& sweep_;
  SweepPlan& plan_;
  std::map<std::filesystem::path, ConfigNode> nodes_;
};

}  // namespace

std::string run_id(const std::string& build, const std::string& scenario, int repeat,
                   const std::string& resolved) {
  return content_hash(build + "\n" + scenario + "\n" + std::to_string(repeat) + "\n" + resolved);
}

std::string content_hash(std::string_view bytes) {
  return fmt::format("{:016x}", XXH3_64bits(bytes.data(), bytes.size()));
}

std::string content_hash_of_file(const std::filesystem::path& file) {
  std::ifstream stream(file, std::ios::binary);
  const std::string bytes(std::istreambuf_iterator<char>(stream), {});
  if (!stream) throw std::runtime_error(file.string() + ": cannot be read");
  return content_hash(bytes);
}

std::vector<const PlannedRun*> SweepPlan::flying_order() const {
  std::map<std::uint64_t, std::size_t> rank;  // of a seed, by first appearance
  for (const PlannedRun& run : runs) rank.try_emplace(run.seed, rank.size());
  std::vector<const PlannedRun*> order;
  std::set<std::string> seen;
  for (const PlannedRun& run : runs) {
    if (seen.insert(run.id).second) order.push_back(&run);
  }
  std::stable_sort(order.begin(), order.end(), [&](const auto* a, const auto* b) {
    return std::pair(a->repeat, rank[a->seed]) < std::pair(b->repeat, rank[b->seed]);
  });
  return order;
}

double count_runs(const SweepFile& sweep) {
  double scenarios = 0;
  for (const Variant& variant : variants_of(sweep)) {
    scenarios += variant.base ? 1.0 : static_cast<double>(sweep.bases.size());
  }
  double points = std::max(1, sweep.hypercube.samples);
  for (const GridAxis& axis : sweep.grid) points *= static_cast<double>(axis.values.size());
  const auto seeds = static_cast<double>(std::max<std::size_t>(1, sweep.seeds.size()));
  return scenarios * points * seeds * sweep.repeats;
}

SweepPlan expand(const SweepFile& sweep, const std::string& build) {
  SweepPlan plan;
  plan.name = sweep.name;
  plan.build = build;
  plan.keys = varied_keys(sweep);
  plan.repeats = sweep.repeats;
  plan.timeout_s = sweep.timeout_s;
  plan.retries = sweep.retries;
  const std::vector<Variant> variants = variants_of(sweep);
  if (const double runs = count_runs(sweep); runs > kMostRuns) {
    fail(sweep.where, fmt::format("asks for {:.15g} runs, expected at most {}", runs, kMostRuns));
  }
  const std::vector<Point> samples = hypercube_points(sweep.hypercube);
  const std::vector<Point> grid = grid_points(sweep.grid);
  Expander expander(sweep, plan);
  for (const Variant& variant : variants) {
    plan.has_variants |= !variant.name.empty();
    const std::vector<BaseScenario> bases =
        variant.base ? std::vector<BaseScenario>{*variant.base} : sweep.bases;
    for (const BaseScenario& base : bases) {
      for (const Point& sample : samples) {
        for (const Point& point : grid) expander.add(base, variant, sample, point);
      }
    }
  }
  return plan;
}

}  // namespace arex::sim
