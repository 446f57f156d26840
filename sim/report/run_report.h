#pragma once

#include <filesystem>
#include <nlohmann/json_fwd.hpp>
#include <string>

#include "report/run_record.h"

namespace arex::sim {

/// What a report shows of a cloud at most: what the page's size allows.
inline constexpr std::size_t kMaxReportPoints = 200'000;

/// report.html of one run: summary, path over the map, events and timing as plain HTML; replay and
/// charts by the embedded viewer. Parts that a run did not record are left out and named.
std::string run_report_html(const RunRecord& run);

/// What the viewer draws, compact. The fields are those of RunPayload in
/// scripts/report/src/payload.ts.
nlohmann::ordered_json run_payload(const RunRecord& run);

/// Reads the run folder and writes its report.html. @return whether the run is a finished one.
/// @param title of the run among others, see RunRecord
/// @throws std::runtime_error naming what cannot be read or written.
bool write_run_report(const std::filesystem::path& folder, const std::string& title = "");

}  // namespace arex::sim
