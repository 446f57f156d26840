#include "report/targets.h"

#include <optional>
#include <sstream>

namespace arex::sim {
namespace {

std::optional<Vec3> parse_point(const std::string& text) {
  std::istringstream stream(text);
  Vec3 p;
  if (stream >> p.x() >> p.y() >> p.z()) return p;
  return std::nullopt;
}

}  // namespace

std::vector<RunTarget> run_targets(const Table& events) {
  std::vector<RunTarget> targets;
  const std::vector<double> times = events.numbers("time_s");
  for (std::size_t i = 0; i < events.rows.size(); ++i) {
    const std::string kind = events.text(i, "kind");
    if (kind == "target_selected") {
      if (const auto p = parse_point(events.text(i, "detail"))) {
        targets.push_back({times[i], *p, false});
      }
    } else if (kind == "target_reached" && !targets.empty()) {
      targets.back().reached = true;
    }
  }
  return targets;
}

}  // namespace arex::sim
