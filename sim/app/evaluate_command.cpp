#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <nlohmann/json.hpp>

#include "app/commands.h"
#include "config/config.h"
#include "config/text.h"
#include "evaluation/comparison.h"
#include "files/files.h"
#include "report/evaluation_report.h"
#include "run/file_io.h"

namespace arex::app {
namespace {

namespace fs = std::filesystem;

// A run folder's truth, or the file itself.
fs::path reference_file(const fs::path& name) {
  if (!fs::is_directory(name)) return name;
  const fs::path truth = name / "truth.tum";
  if (fs::exists(truth)) return truth;
  throw ConfigError(name.string() + ": holds no truth.tum, expected a run folder or a trajectory");
}

std::vector<double> deltas_of(const std::vector<std::string>& texts) {
  std::vector<double> deltas_m;
  for (const std::string& text : texts) {
    const auto delta = parse_double(text);
    if (!delta || *delta <= 0) {
      throw ConfigError("--delta: is '" + shortened(text) + "', expected metres above 0");
    }
    deltas_m.push_back(*delta);
  }
  return deltas_m;
}

sim::EvaluationOptions options_of(const EvaluateArguments& arguments) {
  sim::EvaluationOptions options;
  options.alignment = sim::alignment_named(arguments.align).value();
  options.poses_to_align = arguments.poses_to_align;
  options.max_time_difference_s = arguments.max_time_difference_s;
  options.time_offset_s = arguments.time_offset_s;
  options.pairs_from_reference = arguments.pairs_from_reference;
  if (!arguments.deltas_m.empty()) options.deltas_m = deltas_of(arguments.deltas_m);
  return options;
}

// Code points, which is near enough to columns for the names of files.
std::size_t width_of(const std::string& text) {
  return static_cast<std::size_t>(std::count_if(text.begin(), text.end(), [](char c) {
    return (static_cast<unsigned char>(c) & 0xc0) != 0x80;
  }));
}

std::string padding(const std::string& text, std::size_t width) {
  return std::string(width - std::min(width, width_of(text)), ' ');
}

// A figure a line, an estimate a column; the best of several is marked.
void print_table(const sim::Comparison& comparison) {
  const std::vector<sim::ComparedFigure> figures = sim::figures_of(comparison);
  const auto label_of = [](const sim::ComparedFigure& figure) {
    return figure.label + (figure.unit.empty() ? "" : ", " + figure.unit);
  };
  std::size_t width = 0;
  for (const sim::ComparedFigure& figure : figures)
    width = std::max(width, width_of(label_of(figure)));
  const auto print_cell = [](const std::string& name, const std::string& text, const char* mark) {
    const std::size_t column = std::max<std::size_t>(10, width_of(name));
    std::printf("  %s%s%s", padding(text, column).c_str(), text.c_str(), mark);
  };
  std::printf("%s", std::string(width, ' ').c_str());
  std::vector<std::string> names;
  for (const sim::ComparedEstimate& estimate : comparison.estimates) {
    names.push_back(printable(estimate.name));
    print_cell(names.back(), names.back(), " ");
  }
  std::printf("\n");
  for (const sim::ComparedFigure& figure : figures) {
    const std::string label = label_of(figure);
    std::printf("%s%s", label.c_str(), padding(label, width).c_str());
    for (std::size_t i = 0; i < names.size(); ++i) {
      print_cell(names[i], figure.text(i), figure.is_best(i) ? "*" : " ");
    }
    std::printf("\n");
  }
  if (names.size() > 1) std::printf("* the least\n");
}

void print_notes(const std::string& file, const std::vector<std::string>& notes) {
  for (const std::string& note : notes) {
    std::printf("%s: %s\n", printable(file).c_str(), note.c_str());
  }
}

}  // namespace

int evaluate(const EvaluateArguments& arguments) {
  std::vector<std::string> files = arguments.files;
  std::string truth = arguments.truth;
  if (truth.empty()) {
    if (files.size() < 2) {
      throw ConfigError("arex evaluate: " + files.front() +
                        " alone, expected estimates and behind them what they are compared with");
    }
    truth = files.back();
    files.pop_back();
  }
  const sim::EvaluationOptions options = options_of(arguments);
  std::optional<sim::TrajectoryFormat> format;
  if (!arguments.format.empty()) format = sim::format_named(arguments.format);
  std::optional<sim::OutputFolder> folder;
  if (!arguments.out.empty()) {
    folder.emplace(arguments.out);
    for (const char* name : {"evaluation.json", "evaluation.html"}) {
      check_writable(folder->path() / name);
    }
  }
  std::vector<sim::Trajectory> estimates;
  estimates.reserve(files.size());
  for (const std::string& file : files) estimates.push_back(sim::read_trajectory(file, format));
  const sim::Comparison comparison = sim::compare(
      sim::read_trajectory(reference_file(truth), format), std::move(estimates), options);

  print_table(comparison);
  print_notes(comparison.reference.file, sim::notes_of(comparison.reference));
  for (const sim::ComparedEstimate& estimate : comparison.estimates) {
    print_notes(estimate.trajectory.file, sim::notes_of(estimate, options));
  }
  if (folder) {
    const fs::path page = folder->path() / "evaluation.html";
    write_atomically(folder->path() / "evaluation.json",
                     sim::comparison_json(comparison).dump(2) + "\n");
    write_atomically(page, sim::evaluation_report_html(comparison));
    std::printf("%s\n", page.c_str());
  }
  return 0;
}

}  // namespace arex::app
