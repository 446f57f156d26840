#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "run/scenario.h"
#include "run/simulation.h"

namespace arex::sim {

/// What the host spent on a run.
struct HostTime {
  double wall_s = 0;
  double cpu_s = 0;
};

/// summary.json: every figure of figure_list(). What this run had no module for, or nothing to
/// measure, is null.
nlohmann::ordered_json summarise(const Scenario& scenario, const FlightResult& result,
                                 const HostTime& host);

/// Version with the commit it was built from, and compiler, as summaries name them.
std::string build_version();
std::string build_compiler();

/// A file's text of it. Bytes that are no UTF-8, as a file's name may have, become U+FFFD.
std::string json_text(const nlohmann::ordered_json& json);

/// Every number and text of a summary with its dotted key; a list by its length, `targets.count`.
std::vector<std::pair<std::string, std::string>> flatten(const nlohmann::ordered_json& summary);

/// Whether a summary's field, by its dotted key, is a time of the host: two runs of one scenario
/// differ in these only.
bool depends_on_host(std::string_view column);

/// odometry_error.csv: estimate minus truth, aligned at the first pose; position in W, m, and
/// rotation vector in W, rad.
std::string odometry_error_csv(const std::vector<PosePair>& poses);

/// timing.csv: module,calls,median_ms,p99_ms,total_s.
std::string timing_csv(const std::vector<TimingRow>& rows);

}  // namespace arex::sim
