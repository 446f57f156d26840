#include "report/page.h"

#include <fmt/format.h>

#include <algorithm>
#include <nlohmann/json.hpp>

#include "report/payload.h"
#include "report/viewer.h"

namespace arex::sim {
namespace {

// Up to the end of what it says.
std::string page_up_to_main(const std::string& title, const std::string& main) {
  std::string html = "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n";
  html += "<meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n";
  html += "<title>" + escape_markup(title) + "</title>\n";
  html += "<link rel=\"icon\" href=\"data:,\">\n";  // or a browser asks for one
  html.append("<style>\n").append(viewer_style()).append("</style>\n</head>\n<body>\n<main>\n");
  return html + main + "</main>\n";
}

}  // namespace

std::string report_page(const std::string& title, const std::string& main,
                        const nlohmann::ordered_json& payload) {
  std::string html = page_up_to_main(title, main);
  html += "<script type=\"application/json\" id=\"data\">";
  html += json_for_script(payload);
  html += "</script>\n<script>\n";
  html.append(viewer_script()).append("</script>\n</body>\n</html>\n");
  return html;
}

std::string report_page(const std::string& title, const std::string& main) {
  return page_up_to_main(title, main) + "</body>\n</html>\n";
}

std::string key_figures_html(const std::vector<KeyFigure>& figures) {
  std::string html = "<dl class=\"figures\">\n";
  for (const KeyFigure& figure : figures) {
    html += "<div><dt>" + escape_markup(figure.label) + "</dt><dd>" + escape_markup(figure.value);
    if (!figure.note.empty()) html += "<small>" + escape_markup(figure.note) + "</small>";
    html += "</dd></div>\n";
  }
  return html + "</dl>\n";
}

std::string number_text(double value, int digits) { return fmt::format("{:.{}g}", value, digits); }

std::string unit_text(const std::string& unit) {
  std::string text = unit;
  for (const auto& [plain, raised] : {std::pair{"^2", "²"}, {"^3", "³"}}) {
    const std::size_t at = text.find(plain);
    if (at != std::string::npos) text.replace(at, 2, raised);
  }
  return text;
}

std::string words(std::string name) {
  std::replace(name.begin(), name.end(), '_', ' ');
  return name;
}

std::string percent_text(double share) {
  if (share < 1 && share > 0.9995) return "> 99.9 %";
  return number_text(100 * share) + " %";
}

}  // namespace arex::sim
