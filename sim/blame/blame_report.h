#pragma once

#include <filesystem>
#include <string>

#include "blame/verdict.h"

namespace arex::sim {

/// blame.html: the verdict, the table of flights and their true paths over the failed run's map.
/// Needs neither a network nor a script.
/// @param folder of the blame, with the flights' run folders in it
[[nodiscard]] std::string blame_report_html(const Blame& blame,
                                            const std::filesystem::path& folder);

}  // namespace arex::sim
