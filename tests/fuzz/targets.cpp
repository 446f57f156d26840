#include "fuzz/targets.h"

#include <nlohmann/json.hpp>
#include <optional>
#include <stdexcept>

#include "autonomy/semantics/cloud_bytes.h"
#include "config/config.h"
#include "evaluation/comparison.h"
#include "fuzz/bag_corpus.h"
#include "fuzz/corpus.h"
#include "fuzz/mutation.h"
#include "report/comparison_report.h"
#include "report/evaluation_report.h"
#include "report/page.h"
#include "report/result_table.h"
#include "report/run_record.h"
#include "report/run_report.h"
#include "run/requirement.h"
#include "run/scenario.h"
#include "semantics/cloud_file.h"
#include "semantics/semantic_map.h"
#include "support/temporary_folder.h"
#include "sweep/slurm.h"
#include "sweep/sweep_folder.h"
#include "sweep/sweep_plan.h"

namespace arex::test {
namespace {

namespace fs = std::filesystem;

constexpr double kMostRuns = 200;  // more are expanded as these are, and take their time

// What resolves once must resolve to itself: otherwise a run cannot be flown again.
void expect_the_same_again(const sim::Scenario& scenario) {
  const std::string resolved = scenario.resolved_yaml();
  const sim::Scenario again = sim::make_scenario("again", parse_yaml(resolved, "resolved.yaml"));
  if (again.resolved_yaml() != resolved) throw std::runtime_error("resolved.yaml resolves anew");
}

void read_scenario(const fs::path& folder, RandomStream& random) {
  static const std::vector<std::string> others = texts_of(shipped_scenarios());
  const std::string text = shipped_scenarios().at(any_name(shipped_scenarios(), random));
  write_text(folder / "case.yaml", damage_yaml(text, others, random));
  expect_the_same_again(sim::load_scenario(folder / "case.yaml", {}, {}));
}

// Every parameter, with values that somebody may give it.
void read_overrides(const fs::path& folder, RandomStream& random) {
  static const auto parameters = list_parameters(sim::ScenarioConfig{});
  std::vector<std::string> overrides;
  std::string all;
  const int count = random.uniform_int(1, 3);
  for (int i = 0; i < count; ++i) {
    const int at = random.uniform_int(0, static_cast<int>(parameters.size()) - 1);
    overrides.push_back(parameters[static_cast<std::size_t>(at)].key + "=" + hostile_value(random));
    if (random.uniform_int(0, 9) == 0)
      overrides.back() = damage_bytes(overrides.back(), {}, random);
    all += overrides.back() + "\n";
  }
  write_text(folder / "overrides.txt", all);
  const auto seed = random.uniform_int(0, 1) == 0 ? std::optional(random.bits()) : std::nullopt;
  expect_the_same_again(sim::load_scenario({}, overrides, seed));
}

void read_sweep(const fs::path& folder, RandomStream& random) {
  write_files(shipped_folder(), folder);
  const std::string name = any_name(shipped_sweeps(), random);
  const fs::path file = folder / "sweeps" / name;
  write_text(file, damage_yaml(shipped_sweeps().at(name), texts_of(shipped_sweeps()), random));
  const sim::SweepFile sweep = sim::load_sweep_file(file);
  if (sim::count_runs(sweep) <= kMostRuns) sim::expand(sweep, "build");
}

void report_run(const fs::path& folder, RandomStream& random) {
  write_files(recorded_run(), folder);
  damage_files(recorded_run(), folder, random);
  sim::run_report_html(sim::read_run(folder, 1000));
}

// What the command `render` reads, but for the drawing.
void read_flight(const fs::path& folder, RandomStream& random) {
  write_files(recorded_run(), folder);
  damage_files(recorded_run(), folder, random);
  sim::read_tum(folder / "truth.tum");
  sim::load_scenario(folder / "resolved.yaml", {}, {});
}

// Somebody's trajectory, in each of the formats, against a whole one.
void compare_trajectories(const fs::path& folder, RandomStream& random) {
  std::string tum, euroc, kitti;
  for (int i = 0; i < 12; ++i) {
    const std::string x = std::to_string(i), y = std::to_string(i * i % 7);
    tum += x + " " + x + " " + y + " 1 0 0 0 1\n";
    euroc += x + "000000000," + x + "," + y + ",1,1,0,0,0,0.1,0.1,0.1\n";
    kitti += "1 0 0 " + x + " 0 1 0 " + y + " 0 0 1 1\n";
  }
  const bool stamped = random.uniform() < 0.7;
  const std::string& whole = stamped ? random.uniform() < 0.5 ? tum : euroc : kitti;
  const std::string damaged = damage_bytes(whole, {tum, euroc, kitti, "nan", "1e59", "-0"}, random);
  write_text(folder / "estimate.txt", damaged);
  sim::EvaluationOptions options;
  options.alignment = static_cast<sim::Alignment>(random.uniform_int(0, 5));
  static_cast<void>(sim::evaluation_report_html(
      sim::compare(sim::parse_trajectory(stamped ? tum : kitti, "truth"),
                   {sim::read_trajectory(folder / "estimate.txt")}, options)));
}

void report_sweep(const fs::path& folder, RandomStream& random) {
  write_files(recorded_sweep(), folder);
  damage_files(recorded_sweep(), folder, random);
  const sim::ResultTable results = sim::read_results({folder});
  sim::comparison_report_html(results, "case", folder);
}

void read_requirement(const fs::path& folder, RandomStream& random) {
  const std::string text =
      damage_bytes("coverage.area_fraction>=0.95", {"outcome==succeeded"}, random);
  write_text(folder / "requirement.txt", text);
  sim::parse_requirement(text);
}

void read_batch(const fs::path& folder, RandomStream& random) {
  write_text(
      folder / "batch.json",
      damage_bytes(R"({"timeout_s": 60.0, "retries": 1, "runs": [{"id": "0", "scenario": "x"}]})",
                   {"[[[[[[", "{\"runs\": 3}", "\"id\": 7,"}, random));
  sim::load_batch(folder / "batch.json");
}

// What a sweep finds in a folder that others have written.
void read_sweep_folder(const fs::path& folder, RandomStream& random) {
  const std::string summary = R"({"outcome": "succeeded", "reason": "landed", "seed": 1})";
  const std::string failure = R"({"failure": "crashed", "detail": "signal 11"})";
  fs::create_directories(folder / "runs/1");
  fs::create_directories(folder / "runs/2.failed");
  write_text(folder / "runs/1/summary.json", damage_bytes(summary, {failure, "[[[["}, random));
  write_text(folder / "runs/1/host.json", damage_bytes(summary, {failure, "[[[["}, random));
  write_text(folder / "runs/2.failed/failure.json", damage_bytes(failure, {summary, "7"}, random));
  const sim::SweepFolder sweep(folder);
  if (const auto found = sweep.summary("1")) {
    if (!found->at("outcome").is_string()) throw std::runtime_error("an outcome that is no text");
  }
  static_cast<void>(sweep.host("1"));
  static_cast<void>(sweep.state("2"));
}

// A cloud in each encoding, and what is read of it as a map.
void read_cloud(const fs::path& folder, RandomStream& random) {
  static const std::vector<std::string> sound = all_encodings(some_points(150));
  const std::string& bytes =
      sound[static_cast<std::size_t>(random.uniform_int(0, static_cast<int>(sound.size()) - 1))];
  write_text(folder / "cloud", damage_bytes(bytes, sound, random));
  const CloudFile cloud = read_cloud_file(folder / "cloud");
  const SemanticMap map = build_semantic_map(cloud.points, {}, {});
  if (map.labels.size() != cloud.points.size()) throw std::runtime_error("labels got lost");
}

}  // namespace

std::vector<Target> all_targets() {
  return {{"scenario", read_scenario},
          {"overrides", read_overrides},
          {"sweep", read_sweep},
          {"run report", report_run},
          {"overrides, too", read_overrides},
          {"flight", read_flight},
          {"trajectories", compare_trajectories},
          {"sweep report", report_sweep},
          {"requirement", read_requirement},
          {"batch", read_batch},
          {"sweep folder", read_sweep_folder},
          {"world file", read_damaged_world},
          {"cloud", read_cloud},
          {"recording", read_recording},
          {"scenario, too", read_scenario}};
}

}  // namespace arex::test
