#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "report/result_table.h"
#include "report/run_record.h"

namespace arex::sim {

/// One of the runs laid over each other.
struct OverlaidRun {
  std::size_t row = 0;    ///< of the table
  std::size_t group = 0;  ///< which colour it has
  std::string title;
  std::string world;  ///< the same text for runs through the same world from the same start
  Table coverage;
  std::vector<TimedPose> truth;  ///< X_OB
};

/// Runs laid over each other: of up to six each has a colour of its own, of more each
/// configuration has one.
struct Overlay {
  std::vector<std::string> groups;  ///< the colours' names
  std::size_t all_groups = 0;       ///< those for which no colour was left as well
  std::vector<OverlaidRun> runs;
};

/// Of the runs that are still there, evenly from all groups if they are too many.
Overlay overlay_of(const ResultTable& results);

/// Coverage over time and over distance on common axes; OverlayPayload in
/// scripts/report/src/payload.ts.
nlohmann::ordered_json overlay_json(const Overlay& overlay);

/// The true paths of each world over its map. Nothing if there are none.
std::string overlaid_paths_html(const ResultTable& results, const Overlay& overlay);

}  // namespace arex::sim
