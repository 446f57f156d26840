#pragma once

#include <string>

#include "evaluation/comparison.h"

namespace arex::sim {

/// evaluation.html: the figures of all estimates side by side, their tracks from above and their
/// errors over time and distance. Needs neither a network nor a script.
std::string evaluation_report_html(const Comparison& comparison);

}  // namespace arex::sim
