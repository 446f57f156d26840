#include "report/overlay.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <nlohmann/json.hpp>

#include "report/map_picture.h"
#include "report/payload.h"
#include "report/svg.h"

namespace arex::sim {
namespace {

using nlohmann::ordered_json;

constexpr std::size_t kMaxRuns = 48;
constexpr std::size_t kMaxWorlds = 6;
constexpr std::size_t kSteps = 400;               // of a common axis
constexpr std::size_t kBackdropPoints = 200'000;  // where there is no 2D map

std::string colour(std::size_t group) { return "var(--line-" + std::to_string(group + 1) + ")"; }

// What a run's world is made from. A world from a file is the same for every seed.
std::string world_of(const std::filesystem::path& run) {
  std::string world;
  std::string seed;
  bool from_file = false;
  for (const auto& [key, value] : resolved_keys(run)) {
    if (key == "seed") seed = value;
    if (!key.starts_with("world.")) continue;
    from_file = from_file || (key == "world.kind" && value == "file");
    world += fmt::format("{}={}\n", key, value);
  }
  return from_file ? world : world + "seed=" + seed;
}

// The newest value at each step of an axis; none before the run began or after it ended.
std::vector<double> on_common_axis(const std::vector<double>& x, const std::vector<double>& y,
                                   double end) {
  std::vector<double> values(kSteps, std::numeric_limits<double>::quiet_NaN());
  std::size_t next = 0;
  for (std::size_t i = 0; i < kSteps && !x.empty(); ++i) {
    const double at = end * static_cast<double>(i) / (kSteps - 1);
    while (next < x.size() && x[next] <= at) ++next;
    // The last step that a run reaches shows where it ended.
    const bool over = next == x.size() && at > x.back() + end / (kSteps - 1);
    if (next > 0 && !over) values[i] = y[next - 1];
  }
  return values;
}

struct World {
  std::string name;
  std::filesystem::path folder;  ///< whose map is drawn
  std::vector<DrawnPath> paths;
};

std::vector<World> worlds_of(const ResultTable& results, const Overlay& overlay) {
  std::vector<World> worlds;
  std::map<std::string, std::size_t> known;
  for (const OverlaidRun& run : overlay.runs) {
    if (run.truth.empty()) continue;
    const auto [found, is_new] = known.emplace(run.world, worlds.size());
    if (is_new) {
      worlds.push_back({results.table.text(run.row, "scenario") + ", seed " +
                            results.table.text(run.row, "seed"),
                        results.folders[run.row],
                        {}});
    }
    worlds[found->second].paths.push_back({&run.truth, colour(run.group), run.title});
  }
  return worlds;
}

}  // namespace

Overlay overlay_of(const ResultTable& results) {
  const std::vector<std::string> titles = run_titles(results);
  std::vector<std::size_t> rows;
  for (std::size_t i = 0; i < results.folders.size(); ++i) {
    if (is_run_folder(results.folders[i])) rows.push_back(i);
  }
  Overlay overlay;
  if (rows.size() < 2) return overlay;
  const std::vector<std::string> names =
      rows.size() <= kLineColours ? titles : configuration_titles(results);
  std::vector<std::string> groups;
  std::vector<std::vector<std::size_t>> members;
  for (const std::size_t row : rows) {
    const auto found = std::find(groups.begin(), groups.end(), names[row]);
    const auto group = static_cast<std::size_t>(found - groups.begin());
    if (found == groups.end()) {
      groups.push_back(names[row]);
      members.emplace_back();
    }
    members[group].push_back(row);
  }
  overlay.all_groups = groups.size();
  groups.resize(std::min(groups.size(), kLineColours));
  overlay.groups = groups;
  for (std::size_t group = 0; group < groups.size(); ++group) {
    const std::size_t most = kMaxRuns / groups.size();
    for (std::size_t i = 0; i < std::min(most, members[group].size()); ++i) {
      const std::size_t row = members[group][i];
      const std::filesystem::path& folder = results.folders[row];
      overlay.runs.push_back({row, group, titles[row], world_of(folder),
                              read_table(folder / "coverage.csv"), read_tum(folder / "truth.tum")});
    }
  }
  return overlay;
}

ordered_json overlay_json(const Overlay& overlay) {
  ordered_json json{{"groups", overlay.groups},
                    {"all_groups", overlay.all_groups},
                    {"axes", ordered_json::object()},
                    {"runs", ordered_json::array()}};
  for (const OverlaidRun& run : overlay.runs) {
    json["runs"].push_back({{"title", run.title}, {"group", run.group}});
  }
  for (const char* axis : {"time_s", "distance_m"}) {
    double end = 0;
    for (const OverlaidRun& run : overlay.runs) {
      for (const double x : run.coverage.numbers(axis)) {
        if (x > end) end = x;  // not one that is missing
      }
    }
    json["axes"][axis] = {{"end", end}, {"steps", kSteps}};
    for (std::size_t i = 0; i < overlay.runs.size(); ++i) {
      const Table& coverage = overlay.runs[i].coverage;
      const std::vector<double> x = coverage.numbers(axis);
      for (const char* name : {"area_fraction", "surface_fraction"}) {
        json["runs"][i][axis][name] = quantised(on_common_axis(x, coverage.numbers(name), end));
      }
    }
  }
  return json;
}

std::string overlaid_paths_html(const ResultTable& results, const Overlay& overlay) {
  const std::vector<World> worlds = worlds_of(results, overlay);
  if (worlds.empty()) return {};
  std::string html = "<section id=\"paths\">\n<h2>Paths</h2>\n<p class=\"map-key\">";
  for (std::size_t group = 0; group < overlay.groups.size(); ++group) {
    html += "<span><i style=\"border-color:" + colour(group) + "\"></i>" +
            escape_markup(overlay.groups[group]) + "</span>";
  }
  html += "<span><i class=\"ring\"></i>start</span></p>\n<div class=\"maps\">\n";
  for (std::size_t i = 0; i < std::min(worlds.size(), kMaxWorlds); ++i) {
    RunRecord backdrop;
    backdrop.map = read_map(worlds[i].folder);
    if (!backdrop.map) backdrop.cloud = read_cloud(worlds[i].folder / "cloud.pcd", kBackdropPoints);
    html += "<figure>\n<h3>" + escape_markup(worlds[i].name) + "</h3>\n" +
            overlaid_paths_svg(backdrop, worlds[i].paths) + "</figure>\n";
  }
  html +=
      "</div>\n<p class=\"note\">True paths, a dot where each ends, over the map that the first of "
      "each world's runs made.";
  if (worlds.size() > kMaxWorlds) {
    html += " The first " + std::to_string(kMaxWorlds) + " of " + std::to_string(worlds.size()) +
            " worlds.";
  }
  return html + "</p>\n</section>\n";
}

}  // namespace arex::sim
