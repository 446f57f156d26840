#include <array>
#include <cstddef>
#include <cstdio>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <optional>
#include <string_view>
#include <vector>

#include "app/commands.h"
#include "config/config.h"
#include "config/text.h"
#include "files/files.h"
#include "report/run_record.h"
#include "run/file_io.h"
#include "run/run_folder.h"
#include "run/scenario.h"
#include "scoring/odometry_error.h"
#include "scoring/semantic_score.h"
#include "semantics/cloud_file.h"
#include "semantics/pcl_models.h"
#include "semantics/planarity.h"
#include "semantics/semantic_picture.h"

namespace arex::app {
namespace {

namespace fs = std::filesystem;

constexpr std::array<std::string_view, 3> kOutputs{"semantic.pcd", "objects.csv", "semantic.png"};
constexpr std::string_view kScores = "semantic_score.csv";

/// The semantics section of a scenario, without a file around it.
SemanticConfig config_of(const std::vector<std::string>& overrides) {
  ConfigNode root;
  root.kind = ConfigNode::Kind::kMap;
  for (const std::string& assignment : overrides) apply_override(root, assignment);
  SemanticConfig config;
  read_config(root, config);
  return config;
}

struct Input {
  fs::path cloud;
  std::vector<Vec3> path;  ///< flown, in the cloud's frame
};

Input input_of(const fs::path& given) {
  std::error_code none;
  if (!fs::is_directory(given, none)) return {given, {}};
  if (!sim::is_run_folder(given) || !fs::exists(given / "cloud.pcd", none)) {
    throw ConfigError(given.string() +
                      ": holds no cloud.pcd of a run, expected a point cloud or a run folder");
  }
  constexpr double kStep = 0.25;  // m, between points of the path
  Input input{given / "cloud.pcd", {}};
  for (const sim::TimedPose& pose : sim::read_tum(given / "estimate.tum")) {
    if (input.path.empty() || (pose.X.p - input.path.back()).norm() > kStep) {
      input.path.push_back(pose.X.p);
    }
  }
  return input;
}

/// Whether a folder is that of a flight that has come to its end: what it has flown through can be
/// built again, truth.tum and all. A replay's world is not known.
bool has_world(const fs::path& folder) {
  std::error_code none;
  if (!fs::is_directory(folder, none)) return false;
  const auto summary = sim::read_summary(folder);
  return summary && !summary->contains("replay");
}

/// O in W, as the flight's own score has it: by the best fit of the trajectories.
Pose place_of_map(const fs::path& run, const worlds::World& world) {
  const std::vector<sim::TimedPose> truth = sim::read_tum(run / "truth.tum");
  const std::vector<sim::TimedPose> estimate = sim::read_tum(run / "estimate.tum");
  if (truth.empty() || estimate.empty()) return sim::start_pose(world);
  // truth.tum is in the O of the odometry's begin, when the vehicle stood where it starts.
  const Pose X_WO = sim::start_pose(world) * truth.front().X.inverse();
  std::vector<sim::PosePair> pairs;
  for (std::size_t i = 0, j = 0; i < estimate.size(); ++i) {
    while (j < truth.size() && truth[j].time_s < estimate[i].time_s) ++j;
    if (j == truth.size()) break;
    if (truth[j].time_s > estimate[i].time_s) continue;
    pairs.push_back({from_seconds(truth[j].time_s), X_WO * truth[j].X, estimate[i].X});
  }
  return sim::align_map(pairs);
}

/// The map of a flight against the world that it was flown in; nothing, and a line that says so, if
/// that cannot be built any more.
std::optional<sim::SemanticScore> score_of_run(const fs::path& run, const SemanticMap& map,
                                               const CloudFile& cloud) {
  try {
    const sim::Scenario scenario = sim::load_scenario(run / "resolved.yaml", {}, {});
    const worlds::World world = scenario.build_world();
    const Pose X_WC = place_of_map(run, world) * Pose{Mat3::Identity(), cloud.origin};
    return sim::score_semantics(map, cloud.points, X_WC, world, scenario.config.scoring.semantic);
  } catch (const ConfigError& problem) {
    std::fprintf(stderr, "arex: not scored: %s\n", printable(problem.what()).c_str());
    return std::nullopt;
  }
}

std::string scores_csv(const sim::SemanticScore& score) {
  std::string text = sim::csv_header(kScores);
  for (std::size_t i = 0; i < sim::kScoredClasses.size(); ++i) {
    const sim::ClassScore& of_class = score.classes[i];
    text += kSemanticClassNames[static_cast<std::size_t>(sim::kScoredClasses[i])];
    for (const double value : {of_class.precision, of_class.recall, of_class.f1,
                               of_class.position_median_m, of_class.size_median_m}) {
      text += "," + sim::csv_number(value, 4);
    }
    for (const std::size_t count :
         {of_class.found, of_class.right, of_class.mapped, of_class.sized}) {
      text += "," + std::to_string(count);
    }
    text += "\n";
  }
  return text;
}

void print_scores(const sim::SemanticScore& score) {
  std::printf("  against the world: precision, recall, F1, position and size error (median, m)\n");
  for (std::size_t i = 0; i < sim::kScoredClasses.size(); ++i) {
    const sim::ClassScore& of_class = score.classes[i];
    if (of_class.found == 0 && of_class.mapped == 0) continue;
    const auto name = kSemanticClassNames[static_cast<std::size_t>(sim::kScoredClasses[i])];
    std::printf("  %-8.*s %5.3f %5.3f %5.3f %6.3f %6.3f\n", static_cast<int>(name.size()),
                name.data(), of_class.precision, of_class.recall, of_class.f1,
                of_class.position_median_m, of_class.size_median_m);
  }
}

void print_counts(const SemanticMap& map, const CloudFile& cloud, const fs::path& folder) {
  const auto scene = enum_names(map.scene)[static_cast<std::size_t>(map.scene)];
  std::printf("%s: %.*s, %zu points, %zu after thinning\n", printable(folder.string()).c_str(),
              static_cast<int>(scene.size()), scene.data(), cloud.points.size(), map.points_used);
  for (std::size_t i = 0; i < kSemanticClassNames.size(); ++i) {
    const std::size_t count = map.count(static_cast<SemanticClass>(i));
    if (count == 0) continue;
    std::printf("  %-8.*s %5zu\n", static_cast<int>(kSemanticClassNames[i].size()),
                kSemanticClassNames[i].data(), count);
  }
}

/// The map; what is wrong with the cloud is said with its name.
SemanticMap map_of(const CloudFile& cloud, const std::vector<Vec3f>& path,
                   const SemanticConfig& config, const fs::path& file) {
  try {
    expect_extent(cloud.points);
    SemanticMap map = build_semantic_map(cloud.points, path, config);
    if (map.points_used > 0) return map;
    throw ConfigError("its points lie kilometres from each other, expected a cloud of a place");
  } catch (const ConfigError& problem) {
    throw ConfigError(file.string() + ": " + problem.what());
  }
}

/// objects.csv comes last: where it stands, all the rest is of the same map.
void write_map(const fs::path& folder, const CloudFile& cloud, const SemanticMap& map,
               const std::vector<Vec3f>& path, const std::optional<sim::SemanticScore>& score) {
  std::vector<FileText> files{
      {folder / "semantic.pcd", semantic_pcd(cloud, map)},
      {folder / "semantic.png", png_bytes(draw_semantic_map(map, path))},
  };
  std::vector<fs::path> outdated;
  if (score) {
    files.push_back({folder / kScores, scores_csv(*score)});
  } else {
    outdated.push_back(folder / kScores);  // another map's
  }
  files.push_back({folder / "objects.csv", objects_csv(map)});
  write_together(files, outdated);
}

}  // namespace

int semantics(const SemanticsArguments& arguments) {
  if (!has_pcl()) throw ConfigError(kNoPcl);
  const SemanticConfig config = config_of(arguments.overrides);
  const Input input = input_of(arguments.input);
  const CloudFile cloud = read_cloud_file(input.cloud);
  std::vector<Vec3f> path;
  for (const Vec3& p : input.path) path.push_back((p - cloud.origin).cast<float>());

  const sim::OutputFolder folder(arguments.out);
  std::vector<sim::NamedFile> files{{"the cloud", input.cloud}};
  std::vector<std::string_view> outputs(kOutputs.begin(), kOutputs.end());
  const bool scored = has_world(arguments.input);
  if (scored) outputs.push_back(kScores);
  for (const std::string_view name : outputs) {
    files.push_back({std::string(name), folder.path() / name});
    check_writable(files.back().file);
  }
  sim::expect_different_files(files);

  SemanticMap map = map_of(cloud, path, config, input.cloud);
  const auto score = scored ? score_of_run(arguments.input, map, cloud) : std::nullopt;
  map.origin = cloud.origin;
  write_map(folder.path(), cloud, map, path, score);
  print_counts(map, cloud, folder.path());
  if (score) print_scores(*score);
  return 0;
}

}  // namespace arex::app
