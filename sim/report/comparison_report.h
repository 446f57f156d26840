#pragma once

#include <filesystem>
#include <nlohmann/json_fwd.hpp>
#include <string>

#include "report/result_table.h"

namespace arex::sim {

/// report.html of a sweep or of several runs: outcomes and failures by cause as plain HTML; curves,
/// heat map, side by side and the table of runs by the embedded viewer.
/// @param directory where the page will stand: its links to run folders are relative to it.
std::string comparison_report_html(const ResultTable& results, const std::string& title,
                                   const std::filesystem::path& directory);

/// What the viewer draws; the fields are those of SweepPayload in scripts/report/src/payload.ts.
nlohmann::ordered_json comparison_payload(const ResultTable& results,
                                          const std::filesystem::path& directory);

}  // namespace arex::sim
