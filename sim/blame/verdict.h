#pragma once

#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <vector>

#include "blame/experiments.h"

namespace arex::sim {

/// How one flight of a blame ended.
struct FlightEnd {
  std::string name;  ///< of the experiment
  std::string text;  ///< what was replaced by what
  std::string outcome;
  std::string reason;
  double sim_time_s = 0;
  std::string trajectory_hash;

  [[nodiscard]] bool succeeded() const { return outcome == "succeeded"; }
};

/// Whom a failure is laid to.
struct Verdict {
  enum class Kind {
    kModule,         ///< truth in one module's place ends the failure
    kSeveral,        ///< it takes truth in several places
    kTime,           ///< nobody: with twice the time it succeeds
    kPlanning,       ///< no truth ends it: what is asked, or how it is planned
    kNotReproduced,  ///< this build does not fail
  };
  Kind kind = Kind::kPlanning;
  std::optional<BlamedModule> module;  ///< the first, along the flow of data, that ends it
  std::vector<BlamedModule> through;   ///< further ones that end it: the failure runs through them
  bool exact_sensors_help = false;     ///< too, though they were as sold
  std::string text;                    ///< one sentence
};
inline constexpr std::array<std::string_view, 5> kVerdictKinds{"module", "several", "time",
                                                               "planning", "not_reproduced"};

/// Judges by which experiments succeeded.
///
/// Where truth in several single places ends the failure, it is laid to the first along the flow of
/// data: bad depth frames spoil the maps, so that clean frames and true maps both help, and the
/// frames are at fault. Exact sensors help many a module that does not cope with real ones: sensors
/// that are no worse than such devices are (sensors_are_as_sold) are at fault only where nothing
/// else helps. More time counts only where no truth helps in the given time.
[[nodiscard]] Verdict judge(const std::vector<FlightEnd>& flights, bool sensors_as_sold);

/// What a blame knows.
struct Blame {
  std::string run;  ///< the run folder
  std::string scenario;
  std::uint64_t seed = 0;
  FlightEnd failed;  ///< the run itself, named as_flown
  std::vector<FlightEnd> flights;
  Verdict verdict;
};

/// blame.json.
[[nodiscard]] nlohmann::ordered_json blame_json(const Blame& blame);
/// The table that `arex blame` prints, its verdict below.
[[nodiscard]] std::string blame_table(const Blame& blame);

}  // namespace arex::sim
