#pragma once

#include <string>
#include <vector>

#include "report/result_table.h"

namespace arex::sim {

/// How the runs of one configuration ended, counted: a row of the outcome matrix.
struct OutcomeRow {
  std::string title;
  int continued = 0;  ///< the mission succeeded
  int landed = 0;     ///< it gave up its mission, and came down in one piece
  int collided = 0;
  int lost = 0;       ///< it came down without knowing where it was
  int timed_out = 0;  ///< or was interrupted
  int broken = 0;     ///< no flight: the run crashed, was refused, ...
  int untold = 0;     ///< collided without a typed event before
  /// What was told first, by how many of them: "sensor_fault: lidar silent (5)", and by how many
  /// nothing was.
  std::string told;
  double told_after_s = 0;  ///< the longest; not a number: nothing was told
};

/// In the order in which the configurations first appear.
std::vector<OutcomeRow> outcome_matrix(const ResultTable& results);

/// The section of a report; empty where no scenario had faults of which anything was told.
std::string outcomes_html(const ResultTable& results);

}  // namespace arex::sim
