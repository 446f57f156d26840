#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <nlohmann/json.hpp>

#include "app/commands.h"
#include "config/config.h"
#include "files/files.h"
#include "report/comparison_report.h"
#include "report/page.h"
#include "report/run_report.h"
#include "run/foreign_json.h"

namespace arex::app {
namespace {

namespace fs = std::filesystem;

constexpr const char* kReport = "report.html";
constexpr const char* kExpected = ", expected a run folder or the folder of a sweep";

void report_run(const fs::path& folder, const std::string& title) {
  const bool finished = sim::write_run_report(folder, title);
  std::printf("%s%s\n", (folder / kReport).c_str(), finished ? "" : " (unfinished run)");
}

void report_comparison(const std::vector<fs::path>& folders, const fs::path& directory,
                       const std::string& title, bool with_runs) {
  const sim::ResultTable results = sim::read_results(folders);
  if (with_runs) {
    for (std::size_t i = 0; i < results.folders.size(); ++i) {
      const fs::path& run = results.folders[i];
      if (sim::is_run_folder(run)) report_run(run, sim::run_title(results, i));
    }
  }
  const fs::path file = directory / kReport;
  write_atomically(file, sim::comparison_report_html(results, title, directory));
  std::printf("%s (%zu runs)\n", file.c_str(), results.folders.size());
}

// By what sweep.json calls it, otherwise by its folder.
std::string sweep_title(const fs::path& folder) {
  const auto bytes = sim::read_bytes(folder / "sweep.json");
  const auto json = sim::parse_object(bytes.value_or(""));
  const std::string otherwise = folder.filename().string();
  return "Sweep " + (json.is_object() ? sim::text_field(json, "name", otherwise) : otherwise);
}

// The deepest folder that holds all of them.
fs::path common_parent(const std::vector<fs::path>& folders) {
  fs::path common = folders.front().parent_path();
  for (const fs::path& folder : folders) {
    const fs::path parent = folder.parent_path();
    fs::path shared;
    auto a = common.begin();
    for (auto b = parent.begin(); a != common.end() && b != parent.end() && *a == *b; ++a, ++b) {
      shared /= *a;
    }
    common = shared;
  }
  return common;
}

fs::path folder_of_comparison(const std::vector<fs::path>& folders) {
  const fs::path directory = common_parent(folders);
  if (sim::is_run_folder(directory) || sim::is_sweep_folder(directory)) {
    throw ConfigError(directory.string() +
                      ": has a report of its own, expected folders side by side");
  }
  check_writable(directory / kReport);
  return directory;
}

}  // namespace

int report(const ReportArguments& arguments) {
  std::vector<fs::path> folders;
  for (const std::string& name : arguments.folders) {
    std::error_code error;
    const fs::path folder = fs::canonical(name, error);
    if (error) throw ConfigError(name + ": " + error.message() + kExpected);
    if (!fs::is_directory(folder)) throw ConfigError(name + ": is no folder" + kExpected);
    if (!sim::is_run_folder(folder) && !sim::is_sweep_folder(folder)) {
      throw ConfigError(name + ": holds neither a run (resolved.yaml) nor a sweep (sweep.json)" +
                        kExpected);
    }
    check_writable(folder / kReport);
    folders.push_back(folder);
  }
  const fs::path directory = folders.size() > 1 ? folder_of_comparison(folders) : fs::path();
  for (const fs::path& folder : folders) {
    if (sim::is_sweep_folder(folder)) {
      report_comparison({folder}, folder, sweep_title(folder), arguments.runs);
    } else {
      report_run(folder, sim::title_in_sweep(folder));
    }
  }
  if (folders.size() > 1) {
    report_comparison(folders, directory, std::to_string(folders.size()) + " folders compared",
                      false);
  }
  return 0;
}

}  // namespace arex::app
