#include "stack/standing_faults.h"

#include <algorithm>
#include <array>
#include <optional>

namespace arex {
namespace {

/// Of these a part has one at a time: the newest stands.
constexpr std::array<std::string_view, 8> kStates{
    " silent",          " stuck",         " late", " readings missing",
    " returns missing", " returns false", " weak", " stopped"};
constexpr std::string_view kNoisy = " noisy";

/// The part whose state a fault is; the whole name where it is no state.
std::string_view part_of(std::string_view name) {
  for (const std::string_view state : kStates) {
    if (name.ends_with(state)) return name.substr(0, name.size() - state.size());
  }
  return name;
}

/// `text` without its ending; nothing if it ends otherwise.
std::optional<std::string> without(std::string_view text, std::string_view ending) {
  if (!text.ends_with(ending)) return std::nullopt;
  return std::string(text.substr(0, text.size() - ending.size()));
}

std::string name_of(EventKind kind, const std::string& detail) {
  if (kind == EventKind::kVibration) return "vibration";
  const std::string name = detail.substr(0, detail.find(':'));
  return name == "attitude" ? "attitudes that differ" : name;
}

}  // namespace

void StandingFaults::add(EventKind kind, const std::string& detail) {
  const bool shakes = kind == EventKind::kVibration;
  if (!shakes && kind != EventKind::kSensorFault && kind != EventKind::kVehicleFault) return;
  const bool over =
      shakes ? detail.ends_with("over") : detail.ends_with("again") || detail.ends_with("any more");
  if (over) {
    end(shakes ? "vibration" : detail);
    return;
  }
  const std::string name = name_of(kind, detail);
  const auto same = std::find_if(standing_.begin(), standing_.end(), [&](const Fault& fault) {
    return part_of(fault.name) == part_of(name);
  });
  if (same == standing_.end()) {
    standing_.push_back({kind, name});
  } else {
    same->name = name;
  }
}

void StandingFaults::end(const std::string& over) {
  const std::optional<std::string> sound = without(over, " sound again");
  const std::optional<std::string> quiet = without(over, " quiet again");
  std::string told = over;  // "depth not noisy any more" ends "depth noisy"
  if (const auto no_more = without(over, " any more")) {
    const std::size_t negation = no_more->find(" not ");
    if (negation != std::string::npos) {
      told = no_more->substr(0, negation) + no_more->substr(negation + 4);
    }
  }
  std::erase_if(standing_, [&](const Fault& fault) {
    const bool is_noise = fault.name.ends_with(kNoisy);
    const std::string whose(is_noise ? *without(fault.name, kNoisy) : part_of(fault.name));
    return (sound && whose == *sound) || (quiet && is_noise && whose == *quiet) ||
           fault.name == told;
  });
}

// The battery's current swings with the motors and shows first what ails them or the frame.
std::string_view StandingFaults::first() const {
  const auto is_cause = [](const Fault& fault) { return fault.kind != EventKind::kSensorFault; };
  if (standing_.empty()) return {};
  if (standing_.front().name == "power noisy") {
    const auto cause = std::find_if(standing_.begin(), standing_.end(), is_cause);
    if (cause != standing_.end()) return cause->name;
  }
  return standing_.front().name;
}

}  // namespace arex
