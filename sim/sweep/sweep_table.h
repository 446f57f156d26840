#pragma once

#include <string>

#include "sweep/sweep_folder.h"

namespace arex::sim {

/// sweep.csv and sweep_host.csv.
struct SweepTables {
  /// One row a run, in the plan's order: run,scenario[,variant],KEYS...,seed[,repeat],failure,
  /// detail,FIGURES... The same runs give the same bytes, whatever happened on the way.
  std::string results;
  /// run,host,attempt and what the clocks of the host say.
  std::string host;
};
SweepTables sweep_tables(const SweepPlan& plan, const SweepFolder& folder);

}  // namespace arex::sim
