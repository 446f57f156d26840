#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

namespace arex::sim {

/// A page that needs nothing but itself: the viewer's style and script and the data are inside.
/// @param main HTML of the page's body, escaped already.
std::string report_page(const std::string& title, const std::string& main,
                        const nlohmann::ordered_json& payload);

/// The same of a page that needs no script.
std::string report_page(const std::string& title, const std::string& main);

/// One figure of the summary at the top.
struct KeyFigure {
  std::string label;
  std::string value;
  std::string note;  ///< may be empty
};
std::string key_figures_html(const std::vector<KeyFigure>& figures);

/// Shortest text of a number with so many significant digits.
std::string number_text(double value, int digits = 3);

/// A unit as people write it: m² for m^2.
std::string unit_text(const std::string& unit);

/// A typed name in words: "no candidates" for no_candidates.
std::string words(std::string name);

/// A share in percent. What is not the whole is never rounded to 100 %.
std::string percent_text(double share);

}  // namespace arex::sim
