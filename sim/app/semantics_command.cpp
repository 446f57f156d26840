#include <array>
#include <cstdio>
#include <filesystem>
#include <string_view>

#include "app/commands.h"
#include "config/config.h"
#include "config/text.h"
#include "files/files.h"
#include "report/run_record.h"
#include "run/file_io.h"
#include "run/run_folder.h"
#include "semantics/cloud_file.h"
#include "semantics/pcl_models.h"
#include "semantics/semantic_picture.h"

namespace arex::app {
namespace {

namespace fs = std::filesystem;

constexpr std::array<std::string_view, 3> kOutputs{"semantic.pcd", "objects.csv", "semantic.png"};

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
    return build_semantic_map(cloud.points, path, config);
  } catch (const ConfigError& problem) {
    throw ConfigError(file.string() + ": " + problem.what());
  }
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
  for (const std::string_view name : kOutputs) {
    files.push_back({std::string(name), folder.path() / name});
    check_writable(files.back().file);
  }
  sim::expect_different_files(files);

  SemanticMap map = map_of(cloud, path, config, input.cloud);
  map.origin = cloud.origin;
  write_semantic_pcd(folder.path() / "semantic.pcd", cloud, map);
  write_atomically(folder.path() / "objects.csv", objects_csv(map));
  write_atomically(folder.path() / "semantic.png", png_bytes(draw_semantic_map(map, path)));
  print_counts(map, cloud, folder.path());
  return 0;
}

}  // namespace arex::app
