#include "blame/verdict.h"

#include <fmt/format.h>

#include <algorithm>
#include <nlohmann/json.hpp>

#include "config/text.h"

namespace arex::sim {
namespace {

using nlohmann::ordered_json;

bool succeeds(const std::vector<FlightEnd>& flights, std::string_view name) {
  return std::any_of(flights.begin(), flights.end(), [&](const FlightEnd& flight) {
    return flight.name == name && flight.succeeded();
  });
}

std::string_view name_of(BlamedModule module) {
  return kBlamedModules[static_cast<std::size_t>(module)];
}

std::string text_of(const Verdict& verdict) {
  switch (verdict.kind) {
    case Verdict::Kind::kModule: {
      std::string text = fmt::format("{}: with {} the mission succeeds", name_of(*verdict.module),
                                     replacement_text(*verdict.module));
      for (std::size_t i = 0; i < verdict.through.size(); ++i) {
        text += (i == 0 ? "; the failure runs through " : " and ");
        text += name_of(verdict.through[i]);
      }
      if (verdict.exact_sensors_help) {
        text += "; with exact sensors, too, but these were no worse than such devices are";
      }
      return text;
    }
    case Verdict::Kind::kSeveral:
      return "several: no single truth ends the failure, all together do";
    case Verdict::Kind::kTime:
      return "time: nobody's fault, with twice the time the mission succeeds";
    case Verdict::Kind::kPlanning:
      return "planning: no truth ends the failure; what is asked, or how it is planned, is at "
             "fault";
    case Verdict::Kind::kNotReproduced:
      return "not reproduced: another build flew it, and this one does not fail";
  }
  return {};
}

ordered_json json_of(const FlightEnd& flight) {
  return {{"name", flight.name},
          {"replaced", flight.text},
          {"outcome", flight.outcome},
          {"reason", flight.reason},
          {"sim_time_s", flight.sim_time_s},
          {"trajectory_hash", flight.trajectory_hash}};
}

}  // namespace

Verdict judge(const std::vector<FlightEnd>& flights, bool sensors_as_sold) {
  Verdict verdict;
  for (std::size_t i = 0; i < kBlamedModules.size(); ++i) {
    if (!succeeds(flights, kBlamedModules[i])) continue;
    const auto module = static_cast<BlamedModule>(i);
    if (verdict.module) {
      verdict.through.push_back(module);
    } else {
      verdict.module = module;
    }
  }
  if (sensors_as_sold && verdict.module == BlamedModule::kSensors && !verdict.through.empty()) {
    verdict.module = verdict.through.front();
    verdict.through.erase(verdict.through.begin());
    verdict.exact_sensors_help = true;
  }
  if (succeeds(flights, "as_flown")) {
    verdict = {};
    verdict.kind = Verdict::Kind::kNotReproduced;
  } else if (verdict.module) {
    verdict.kind = Verdict::Kind::kModule;
  } else if (succeeds(flights, "all")) {
    verdict.kind = Verdict::Kind::kSeveral;
  } else if (succeeds(flights, "time")) {
    verdict.kind = Verdict::Kind::kTime;
  }
  verdict.text = text_of(verdict);
  return verdict;
}

ordered_json blame_json(const Blame& blame) {
  ordered_json json{{"run", blame.run}, {"scenario", blame.scenario}, {"seed", blame.seed}};
  json["failed"] = json_of(blame.failed);
  json["flights"] = ordered_json::array();
  for (const FlightEnd& flight : blame.flights) json["flights"].push_back(json_of(flight));
  const Verdict& verdict = blame.verdict;
  ordered_json& judged = json["verdict"];
  judged["kind"] = kVerdictKinds[static_cast<std::size_t>(verdict.kind)];
  judged["module"] = nullptr;
  if (verdict.module) judged["module"] = name_of(*verdict.module);
  judged["through"] = ordered_json::array();
  for (const BlamedModule module : verdict.through) judged["through"].push_back(name_of(module));
  judged["text"] = verdict.text;
  return json;
}

std::string blame_table(const Blame& blame) {
  std::string table = fmt::format("{:<10} {:<38} {:<10} {:>8}  {}\n", "truth in", "by", "outcome",
                                  "time, s", "why");
  std::vector<FlightEnd> rows{blame.failed};
  rows.insert(rows.end(), blame.flights.begin(), blame.flights.end());
  for (const FlightEnd& flight : rows) {
    const bool is_run = &flight == &rows.front();
    table += fmt::format("{:<10} {:<38} {:<10} {:>8.1f}  {}\n", is_run ? "-" : flight.name,
                         flight.text, flight.outcome, flight.sim_time_s, printable(flight.reason));
  }
  return table + blame.verdict.text + "\n";
}

}  // namespace arex::sim
