#include <fmt/format.h>

#include <cstdio>
#include <filesystem>

#include "app/commands.h"
#include "config/config.h"
#include "config/text.h"
#include "files/files.h"
#include "physics/airframe.h"
#include "report/page.h"
#include "report/svg.h"
#include "run/file_io.h"
#include "run/scenario.h"
#include "sensors/frame_detection.h"

namespace arex::app {
namespace {

constexpr double kMost_m = 50;
constexpr int kMostValues = 64;

/// The numbers of an option, or `otherwise` where it was not given.
std::vector<double> numbers_of(const std::vector<std::string>& texts, const char* option,
                               double most, std::vector<double> otherwise) {
  if (texts.empty()) return otherwise;
  std::vector<double> numbers;
  for (const std::string& text : texts) {
    const auto number = parse_double(text);
    if (!number || !(*number > 0 && *number <= most) || texts.size() > kMostValues) {
      throw ConfigError(fmt::format("{}: is '{}', expected up to {} numbers above 0 and up to {:g}",
                                    option, shortened(text), kMostValues, most));
    }
    numbers.push_back(*number);
  }
  return numbers;
}

/// A LiDAR of the scenario's at another rate. @throws ConfigError if it cannot have it.
sim::Mid360Config at_rate(const SparseArguments& arguments, double rate_hz) {
  std::vector<std::string> overrides = arguments.overrides;
  overrides.push_back("lidar.rate_hz=" + config_detail::format_scalar(rate_hz));
  overrides.emplace_back("odometry.latency_s=0");  // frames come faster than it takes by default
  overrides.emplace_back("mapping.latency_s=0");
  return sim::load_scenario({}, overrides, arguments.seed).config.lidar.model;
}

}  // namespace

int sparse(const SparseArguments& arguments) {
  const std::vector<double> thicknesses =
      numbers_of(arguments.thicknesses_m, "--thickness", 1, {0.005, 0.01, 0.02, 0.03, 0.05, 0.1});
  const std::vector<double> distances =
      numbers_of(arguments.distances_m, "--distance", kMost_m, {1, 2, 3, 4, 6, 8, 10, 15, 20});
  const std::vector<double> rates = numbers_of(arguments.rates_hz, "--rate", 50, {10, 20, 50});
  const Pose X_BL = sim::load_airframe().X_BL;
  const std::uint64_t seed = arguments.seed.value_or(1);
  const sim::OutputFolder made(arguments.out);
  const std::filesystem::path folder = made.path();
  for (const char* name : {"sparse.csv", "sparse.html"}) check_writable(folder / name);
  std::string csv =
      "rate_hz,thickness_m,distance_m,returns_per_frame,missed_one,missed_lone,missed_five\n";
  std::string charts;
  for (const double rate : rates) {
    const sim::Mid360Config lidar = at_rate(arguments, rate);
    std::vector<sim::Curve> curves;
    for (const double thickness : thicknesses) {
      sim::Curve curve{fmt::format("{:g} cm", 100 * thickness), distances, {}};
      for (const double distance : distances) {
        sim::SparseQuery query;
        query.thickness_m = thickness;
        query.distance_m = distance;
        query.frames = arguments.frames;
        const sim::SparseAnswer answer = sim::look_at_bars(query, lidar, X_BL, seed);
        csv += fmt::format("{:g},{:g},{:g},{:.3f},{:.4f},{:.4f},{:.4f}\n", rate, thickness,
                           distance, answer.returns_per_frame, answer.missed_one,
                           answer.missed_lone, answer.missed_five);
        curve.y.push_back(100 * answer.missed_one);
      }
      curves.push_back(curve);
    }
    charts += sim::chart_html(fmt::format("One frame at {:g} Hz", rate), "distance, m", "missed, %",
                              curves);
    charts += "<p class=\"map-key\">" + sim::key_html([&] {
                std::vector<std::string> labels;
                for (const sim::Curve& curve : curves) labels.push_back(curve.label);
                return labels;
              }()) +
              "</p>\n";
  }
  write_atomically(folder / "sparse.csv", csv);
  write_atomically(folder / "sparse.html",
                   sim::report_page("AREX: sparse frames",
                                    "<h1>What one frame misses</h1>\n<div class=\"charts\">\n" +
                                        charts + "</div>\n"));
  std::printf("%s\n%s\n", printable((folder / "sparse.csv").string()).c_str(),
              printable((folder / "sparse.html").string()).c_str());
  return 0;
}

}  // namespace arex::app
