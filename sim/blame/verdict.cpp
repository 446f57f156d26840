#include "blame/verdict.h"

#include <fmt/format.h>

#include <algorithm>
#include <nlohmann/json.hpp>

#include "config/text.h"
#include "run/fault_log.h"

namespace arex::sim {
namespace {

using nlohmann::ordered_json;

constexpr const char* kBlameRow = "{:<10} {:<38} {:<9} {:<10} {:>8}  {}\n";

const FlightEnd* find_flight(const std::vector<FlightEnd>& flights, std::string_view name) {
  const auto found = std::find_if(flights.begin(), flights.end(),
                                  [&](const FlightEnd& flight) { return flight.name == name; });
  return found == flights.end() ? nullptr : &*found;
}

/// What tells two failures apart; see effect_on().
std::string kind_of_failure(const FlightEnd& flight) {
  if (flight.outcome != "stuck" && flight.outcome != "lost") return flight.outcome;
  // Behind it stands what else had been told: "takeoff: height not reached: vibration".
  std::string reason = flight.reason.substr(0, flight.reason.find(kAfter));
  const std::size_t state = reason.find(": ");
  if (state != std::string::npos) reason = reason.substr(0, reason.find(": ", state + 2));
  return flight.outcome + ": " + reason;
}

/// A failure as a noun.
std::string noun_of(const FlightEnd& failed) {
  if (failed.outcome == "collided") return "the collision";
  if (failed.outcome == "timed_out") return "the timeout";
  return "'" + printable(kind_of_failure(failed)) + "'";
}

std::string end_text(const FlightEnd& flight) {
  return fmt::format("{} at {:.1f} s: {}", flight.outcome, flight.sim_time_s,
                     printable(flight.reason));
}

std::string_view name_of(BlamedModule module) {
  return kBlamedModules[static_cast<std::size_t>(module)];
}

std::string list_of_modules(const std::vector<BlamedModule>& modules) {
  std::string text;
  for (const BlamedModule module : modules) {
    if (!text.empty()) text += " and ";
    text += name_of(module);
  }
  return text;
}

std::string text_of_module(const Verdict& verdict, const FlightEnd& failed) {
  const std::string_view truth = replacement_text(*verdict.module);
  std::string text =
      verdict.then
          ? fmt::format("{}: {} disappears with {}; the flight then ends {}",
                        name_of(*verdict.module), noun_of(failed), truth, end_text(*verdict.then))
          : fmt::format("{}: with {} the mission succeeds", name_of(*verdict.module), truth);
  if (!verdict.through.empty()) {
    text += "; the failure runs through " + list_of_modules(verdict.through);
  }
  if (verdict.exact_sensors_help) {
    text += "; with exact sensors, too, but these were no worse than such devices are";
  }
  return text;
}

std::string text_of(const Verdict& verdict, const FlightEnd& failed) {
  switch (verdict.kind) {
    case Verdict::Kind::kModule:
      return text_of_module(verdict, failed);
    case Verdict::Kind::kSeveral:
      if (!verdict.through.empty()) {
        return fmt::format(
            "several: the mission succeeds only with all of them; {} alone disappears with truth "
            "in {}",
            noun_of(failed), list_of_modules(verdict.through));
      }
      if (!verdict.then) return "several: no single truth ends the failure, all together do";
      return fmt::format("several: {} disappears only with all of them; the flight then ends {}",
                         noun_of(failed), end_text(*verdict.then));
    case Verdict::Kind::kTime:
      return "time: nobody's fault, with twice the time the mission succeeds";
    case Verdict::Kind::kPlanning: {
      std::string text =
          "planning: no truth ends the failure; what is asked, or how it is planned, is at fault";
      if (verdict.then) text += "; with twice the time it ends " + end_text(*verdict.then);
      return text;
    }
    case Verdict::Kind::kNotReproduced:
      if (!verdict.then) return "not reproduced: another build flew it, and this one does not fail";
      return "not reproduced: another build flew it, and this one ends " + end_text(*verdict.then);
  }
  return {};
}

/// The modules, along the flow of data, whose truth has this effect on the failure.
std::vector<BlamedModule> modules_with(Effect effect, const FlightEnd& failed,
                                       const std::vector<FlightEnd>& flights) {
  std::vector<BlamedModule> modules;
  for (std::size_t i = 0; i < kBlamedModules.size(); ++i) {
    const FlightEnd* flight = find_flight(flights, kBlamedModules[i]);
    if (flight && effect_on(failed, *flight) == effect) {
      modules.push_back(static_cast<BlamedModule>(i));
    }
  }
  return modules;
}

/// Lays the failure to the first of those modules.
void lay_to(const std::vector<BlamedModule>& modules, bool sensors_as_sold, Verdict& verdict) {
  verdict.kind = Verdict::Kind::kModule;
  verdict.exact_sensors_help =
      sensors_as_sold && modules.front() == BlamedModule::kSensors && modules.size() > 1;
  const auto first = modules.begin() + (verdict.exact_sensors_help ? 1 : 0);
  verdict.module = *first;
  verdict.through.assign(first + 1, modules.end());
}

/// What kept from failing so, the best first: see judge().
Verdict best_of(const FlightEnd& failed, const std::vector<FlightEnd>& flights,
                bool sensors_as_sold) {
  Verdict verdict;
  const auto had = [&](const char* name, Effect effect) {
    const FlightEnd* flight = find_flight(flights, name);
    return flight && effect_on(failed, *flight) == effect;
  };
  const auto helping = modules_with(Effect::kSucceeded, failed, flights);
  const auto partly = modules_with(Effect::kGone, failed, flights);
  if (!helping.empty()) {
    lay_to(helping, sensors_as_sold, verdict);
  } else if (had("all", Effect::kSucceeded)) {
    verdict.kind = Verdict::Kind::kSeveral;
    verdict.through = partly;
  } else if (had("time", Effect::kSucceeded)) {
    verdict.kind = Verdict::Kind::kTime;
  } else if (!partly.empty()) {
    lay_to(partly, sensors_as_sold, verdict);
    verdict.then = *find_flight(flights, name_of(*verdict.module));
  } else if (had("all", Effect::kGone)) {
    verdict.kind = Verdict::Kind::kSeveral;
    verdict.then = *find_flight(flights, "all");
  } else if (had("time", Effect::kGone)) {
    verdict.then = *find_flight(flights, "time");  // it was no matter of time alone
  }
  return verdict;
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

Effect effect_on(const FlightEnd& failure, const FlightEnd& flight) {
  if (flight.succeeded()) return Effect::kSucceeded;
  if (kind_of_failure(flight) == kind_of_failure(failure)) return Effect::kRemains;
  return flight.sim_time_s > failure.sim_time_s ? Effect::kGone : Effect::kCutShort;
}

Verdict judge(const FlightEnd& failed, const std::vector<FlightEnd>& flights,
              bool sensors_as_sold) {
  const FlightEnd* again = find_flight(flights, "as_flown");
  const FlightEnd& reference = again ? *again : failed;
  Verdict verdict;
  if (again && effect_on(failed, *again) != Effect::kRemains) {
    verdict.kind = Verdict::Kind::kNotReproduced;
    if (!again->succeeded()) verdict.then = *again;
  } else {
    verdict = best_of(reference, flights, sensors_as_sold);
  }
  verdict.text = text_of(verdict, reference);
  const bool proves_little =
      verdict.kind == Verdict::Kind::kPlanning &&
      std::any_of(flights.begin(), flights.end(), [&](const FlightEnd& flight) {
        return effect_on(reference, flight) == Effect::kCutShort;
      });
  if (proves_little) verdict.text += "; some flights failed otherwise before it was due";
  return verdict;
}

std::string_view effect_text(const Blame& blame, const FlightEnd& flight) {
  const FlightEnd* again = find_flight(blame.flights, "as_flown");
  const bool held_against_another = again && flight.name != "as_flown";
  return kEffects[static_cast<std::size_t>(
      effect_on(held_against_another ? *again : blame.failed, flight))];
}

ordered_json blame_json(const Blame& blame) {
  ordered_json json{{"run", blame.run}, {"scenario", blame.scenario}, {"seed", blame.seed}};
  json["failed"] = json_of(blame.failed);
  json["flights"] = ordered_json::array();
  for (const FlightEnd& flight : blame.flights) {
    json["flights"].push_back(json_of(flight));
    json["flights"].back()["failure"] = effect_text(blame, flight);
  }
  const Verdict& verdict = blame.verdict;
  ordered_json& judged = json["verdict"];
  judged["kind"] = kVerdictKinds[static_cast<std::size_t>(verdict.kind)];
  judged["module"] = nullptr;
  if (verdict.module) judged["module"] = name_of(*verdict.module);
  judged["through"] = ordered_json::array();
  for (const BlamedModule module : verdict.through) judged["through"].push_back(name_of(module));
  judged["then"] = nullptr;
  if (verdict.then) judged["then"] = json_of(*verdict.then);
  judged["text"] = verdict.text;
  return json;
}

std::string blame_table(const Blame& blame) {
  std::string table =
      fmt::format(kBlameRow, "truth in", "by", "failure", "outcome", "time, s", "why");
  const auto add = [&](const FlightEnd& flight, std::string_view name, std::string_view effect) {
    table += fmt::format(kBlameRow, name, flight.text, effect, flight.outcome,
                         fmt::format("{:.1f}", flight.sim_time_s), printable(flight.reason));
  };
  add(blame.failed, "-", "-");
  for (const FlightEnd& flight : blame.flights) {
    add(flight, flight.name, effect_text(blame, flight));
  }
  return table + blame.verdict.text + "\n";
}

}  // namespace arex::sim
