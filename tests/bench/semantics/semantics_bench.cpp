// Scores of the semantic map on the clouds that missions would leave, and its time:
//
//     semantics_bench forest|garage FIRST_SEED LAST_SEED [key=value]... [--keep FOLDER] [--list]
//         [--run FOLDER]
//
// Keys are those of `world` and `semantics`, as in a scenario. --keep stores the clouds in a folder
// and takes them from there the next time; --list names what was missed or invented; --run takes
// world, cloud and path of a run instead of making them, with any one seed.

#include <chrono>
#include <cstdio>
#include <ctime>
#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

#include "config/config.h"
#include "report/run_record.h"
#include "run/file_io.h"
#include "run/run_folder.h"
#include "run/scenario.h"
#include "scoring/odometry_error.h"
#include "scoring/semantic_score.h"
#include "semantics/cloud_file.h"
#include "semantics/semantic_map.h"
#include "semantics/semantic_picture.h"
#include "support/mapped_cloud.h"
#include "worlds/recipes.h"

namespace arex {
namespace {

namespace fs = std::filesystem;

struct Trial {
  worlds::WorldConfig world;
  SemanticConfig semantics;
  void fields(auto& f) {
    f("world", world, "where to fly");
    f("semantics", semantics, "the semantic map");
  }
};

template <class T>
void write_all(std::ofstream& out, const std::vector<T>& values) {
  const std::size_t count = values.size();
  out.write(reinterpret_cast<const char*>(&count), sizeof count);
  out.write(reinterpret_cast<const char*>(values.data()),
            static_cast<std::streamsize>(count * sizeof(T)));
}
template <class T>
void read_all(std::ifstream& in, std::vector<T>& values) {
  std::size_t count = 0;
  in.read(reinterpret_cast<char*>(&count), sizeof count);
  values.resize(count);
  in.read(reinterpret_cast<char*>(values.data()), static_cast<std::streamsize>(count * sizeof(T)));
}

support::MappedCloud cloud_of(const worlds::World& world,
                              const support::MappedCloudOptions& options, std::uint64_t seed,
                              const fs::path& kept) {
  support::MappedCloud cloud;
  if (!kept.empty() && fs::exists(kept)) {
    std::ifstream in(kept, std::ios::binary);
    read_all(in, cloud.points_O);
    read_all(in, cloud.path_O);
    in.read(reinterpret_cast<char*>(&cloud.X_WO), sizeof cloud.X_WO);
    return cloud;
  }
  cloud = support::map_world(world, options, seed);
  if (!kept.empty()) {
    std::ofstream out(kept, std::ios::binary);
    write_all(out, cloud.points_O);
    write_all(out, cloud.path_O);
    out.write(reinterpret_cast<const char*>(&cloud.X_WO), sizeof cloud.X_WO);
  }
  return cloud;
}

/// What a run has left; O in W by the best fit of its trajectories, as the run's own score has it.
support::MappedCloud cloud_of_run(const worlds::World& world, const fs::path& run) {
  constexpr double kStep = 0.25;  // m
  support::MappedCloud cloud;
  cloud.points_O = read_cloud_file(run / "cloud.pcd").points;
  const auto truth = sim::read_tum(run / "truth.tum"),
             estimate = sim::read_tum(run / "estimate.tum");
  const Pose X_WO = sim::start_pose(world) * truth.front().X.inverse();
  std::vector<sim::PosePair> pairs;
  for (std::size_t i = 0, j = 0; i < estimate.size(); ++i) {
    while (j < truth.size() && truth[j].time_s < estimate[i].time_s) ++j;
    if (j == truth.size()) break;
    const Vec3& p = estimate[i].X.p;
    if (cloud.path_O.empty() || (p - cloud.path_O.back()).norm() > kStep) cloud.path_O.push_back(p);
    if (truth[j].time_s > estimate[i].time_s) continue;
    pairs.push_back({from_seconds(truth[j].time_s), X_WO * truth[j].X, estimate[i].X});
  }
  cloud.X_WO = sim::align_map(pairs);
  return cloud;
}

void print_misses(const SemanticMap& map, const sim::SemanticScore& score, const Pose& X_WO) {
  for (const auto& truth : score.truth) {
    double nearest = 1e9;
    const SemanticObject* object = nullptr;
    for (const auto& found : map.objects) {
      if (found.kind != truth.kind) continue;
      const double d = ((X_WO * found.position).head<2>() - truth.position).norm();
      if (d < nearest) {
        nearest = d;
        object = &found;
      }
    }
    const auto name = kSemanticClassNames[static_cast<std::size_t>(truth.kind)];
    std::printf("  true %-7.*s %7.2f %7.2f size %.3f mapped %.2f%s", static_cast<int>(name.size()),
                name.data(), truth.position.x(), truth.position.y(), truth.size,
                truth.mapped_fraction, truth.counts ? "" : " (does not count)");
    if (object && nearest < 3) {
      std::printf("  found %.3f off, size %.3f x %.3f, seen %.2f", nearest, object->size.x(),
                  object->size.y(), object->seen_fraction);
    }
    std::printf("\n");
  }
  for (const auto& found : map.objects) {
    double nearest = 1e9;
    const Vec2 p = (X_WO * found.position).head<2>();
    for (const auto& truth : score.truth) {
      if (truth.kind == found.kind) nearest = std::min(nearest, (p - truth.position).norm());
    }
    const auto name = kSemanticClassNames[static_cast<std::size_t>(found.kind)];
    if (nearest > 0.4) {
      std::printf(
          "  found %-7.*s %7.2f %7.2f size %.3f x %.3f x %.3f yaw %.2f base %.2f, confidence %.2f, "
          "nearest true %.2f\n",
          static_cast<int>(name.size()), name.data(), p.x(), p.y(), found.size.x(), found.size.y(),
          found.size.z(), found.yaw_rad, found.base_z, found.confidence, nearest);
    }
  }
}

int main_of(const std::vector<std::string>& words) {
  Trial trial;
  fs::path keep;
  fs::path run;
  bool list = false;
  ConfigNode root;
  root.kind = ConfigNode::Kind::kMap;
  const bool garage = words.at(0) == "garage";
  apply_override(root, "world.kind=" + words.at(0));
  support::MappedCloudOptions options;
  if (garage) {
    for (const char* value : {"length_m=50", "width_m=30", "rooms=2"})
      apply_override(root, std::string("world.garage.") + value);
    options.low_m = {-2, -15};
    options.high_m = {50, 15};
    options.spacing_m = 2.0;
  } else {
    apply_override(root, "world.forest.size_m=[34, 30]");
  }
  for (std::size_t i = 3; i < words.size(); ++i) {
    if (words[i] == "--keep") {
      keep = words.at(++i);
    } else if (words[i] == "--run") {
      run = words.at(++i);
    } else if (words[i] == "--list") {
      list = true;
    } else {
      apply_override(root, words[i]);
    }
  }
  read_config(root, trial);
  if (!keep.empty()) fs::create_directories(keep);
  for (std::uint64_t seed = std::stoull(words.at(1)); seed <= std::stoull(words.at(2)); ++seed) {
    const worlds::World world =
        run.empty() ? worlds::build_world(trial.world, seed, 0.305)
                    : sim::load_scenario(run / "resolved.yaml", {}, {}).build_world();
    const fs::path kept =
        keep.empty() ? fs::path() : keep / (words[0] + std::to_string(seed) + ".cloud");
    const auto cloud =
        run.empty() ? cloud_of(world, options, seed, kept) : cloud_of_run(world, run);
    std::vector<Vec3f> path;
    for (const Vec3& p : cloud.path_O) path.push_back(p.cast<float>());
    const std::clock_t begin = std::clock();
    const SemanticMap map = build_semantic_map(cloud.points_O, path, trial.semantics);
    const double seconds = static_cast<double>(std::clock() - begin) / CLOCKS_PER_SEC;
    const auto score = sim::score_semantics(map, cloud.points_O, cloud.X_WO, world);
    std::printf("seed %llu: %zu points, planar %.2f, %.2f s\n",
                static_cast<unsigned long long>(seed), cloud.points_O.size(),
                map.planarity.fraction, seconds);
    for (std::size_t i = 0; i < sim::kScoredClasses.size(); ++i) {
      const auto& c = score.classes[i];
      if (c.found == 0 && c.mapped == 0) continue;
      const auto name = kSemanticClassNames[static_cast<std::size_t>(sim::kScoredClasses[i])];
      std::printf(
          "  %-7.*s P %.3f R %.3f F1 %.3f  position %.3f size %.3f (found %zu right %zu mapped %zu "
          "sized %zu)\n",
          static_cast<int>(name.size()), name.data(), c.precision, c.recall, c.f1,
          c.position_median_m, c.size_median_m, c.found, c.right, c.mapped, c.sized);
    }
    if (list) print_misses(map, score, cloud.X_WO);
    if (!keep.empty()) {
      std::ofstream(keep / (words[0] + std::to_string(seed) + ".png"), std::ios::binary)
          << png_bytes(draw_semantic_map(map, path));
    }
  }
  return 0;
}

}  // namespace
}  // namespace arex

int main(int argc, char** argv) {
  try {
    return arex::main_of({argv + 1, argv + argc});
  } catch (const std::exception& error) {
    std::fprintf(stderr, "semantics_bench: %s\n", error.what());
    return 2;
  }
}
