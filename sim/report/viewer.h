#pragma once

#include <string_view>

namespace arex::sim {

/// The bundled viewer of scripts/report, embedded at build time.
std::string_view viewer_script();
std::string_view viewer_style();

}  // namespace arex::sim
