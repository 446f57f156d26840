#pragma once

#include <filesystem>
#include <string>

#include "evaluation/comparison.h"

namespace arex::sim {

/// evaluation.html: the figures of all estimates side by side, their tracks from above and their
/// errors over time and distance. Needs neither a network nor a script.
std::string evaluation_report_html(const Comparison& comparison);

/// A run's odometry sources against its truth: how they begin, their tracks and their errors, as
/// sections of a report; empty where one flew alone.
std::string odometries_html(const std::filesystem::path& folder);

}  // namespace arex::sim
