#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>
#include <utility>
#include <vector>

#include "sweep/sweep_folder.h"

namespace arex::sim {

/// Every number and text of a summary with its dotted key; a list by its length, as
/// `targets.count`.
std::vector<std::pair<std::string, std::string>> flatten(const nlohmann::ordered_json& summary);

/// sweep.csv and sweep_host.csv.
struct SweepTables {
  /// One row a run, in the plan's order: run,scenario[,variant],KEYS...,seed[,repeat],failure,
  /// detail,SUMMARY... The same runs give the same bytes, whatever happened on the way.
  std::string results;
  /// run,host,attempt and what the clocks of the host say.
  std::string host;
};
SweepTables sweep_tables(const SweepPlan& plan, const SweepFolder& folder);

}  // namespace arex::sim
