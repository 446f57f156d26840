#include "report/viewer.h"

// viewer_data.S holds the two files.
extern "C" {
extern const char arex_viewer_script_begin[];
extern const char arex_viewer_script_end[];
extern const char arex_viewer_style_begin[];
extern const char arex_viewer_style_end[];
}

namespace arex::sim {

std::string_view viewer_script() { return {arex_viewer_script_begin, arex_viewer_script_end}; }
std::string_view viewer_style() { return {arex_viewer_style_begin, arex_viewer_style_end}; }

}  // namespace arex::sim
