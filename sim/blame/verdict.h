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

/// What became of a failure in another flight.
enum class Effect {
  kSucceeded,  ///< there is none
  kGone,       ///< it is gone, and the flight fails otherwise, later
  kRemains,    ///< it is there
  kCutShort,   ///< the flight fails otherwise before it was due: that proves nothing
};
inline constexpr std::array<std::string_view, 4> kEffects{"gone", "gone", "remains", "cut_short"};

/// What became of `failure` in `flight`. Failures are of one kind where their outcomes are the
/// same, and of stuck and lost vehicles what the mission or the odometry lacked: which trunk was
/// hit, and how fast, makes no other failure.
[[nodiscard]] Effect effect_on(const FlightEnd& failure, const FlightEnd& flight);

/// Whom a failure is laid to.
struct Verdict {
  enum class Kind {
    kModule,         ///< truth in one module's place ends the failure
    kSeveral,        ///< it takes truth in several places
    kTime,           ///< nobody: with twice the time it succeeds
    kPlanning,       ///< no truth ends it: what is asked, or how it is planned
    kNotReproduced,  ///< this build does not fail, or not so
  };
  Kind kind = Kind::kPlanning;
  std::optional<BlamedModule> module;  ///< the first, along the flow of data, that ends it
  /// Further ones that end it: the failure runs through them. Of several: those with which it is
  /// gone, and the flight fails otherwise.
  std::vector<BlamedModule> through;
  bool exact_sensors_help = false;  ///< too, though they were as sold
  /// How the flight ends in which the failure is gone, where none succeeds.
  std::optional<FlightEnd> then;
  std::string text;  ///< one sentence
};
inline constexpr std::array<std::string_view, 5> kVerdictKinds{"module", "several", "time",
                                                               "planning", "not_reproduced"};

/// Judges by what became of the failure in which experiment.
///
/// A flight that succeeds counts for more than one in which the failure is gone and another one
/// comes later: those are heard only where nothing succeeds. Where truth in several single places
/// ends the failure, it is laid to the first along the flow of data: bad depth frames spoil the
/// maps, so that clean frames and true maps both help, and the frames are at fault. Exact sensors
/// help many a module that does not cope with real ones: sensors that are no worse than such
/// devices are (sensors_are_as_sold) are at fault only where nothing else helps. More time counts
/// only where no truth helps in the given time.
///
/// @param failed the run; where it had to be flown again (as_flown), that flight's end is what the
/// others are held against
[[nodiscard]] Verdict judge(const FlightEnd& failed, const std::vector<FlightEnd>& flights,
                            bool sensors_as_sold);

/// What a blame knows.
struct Blame {
  std::string run;  ///< the run folder
  std::string scenario;
  std::uint64_t seed = 0;
  FlightEnd failed;  ///< the run itself, named as_flown
  std::vector<FlightEnd> flights;
  Verdict verdict;
};

/// What became of the failure in one of its flights, in words: of kEffects.
[[nodiscard]] std::string_view effect_text(const Blame& blame, const FlightEnd& flight);
/// blame.json.
[[nodiscard]] nlohmann::ordered_json blame_json(const Blame& blame);
/// The table that `arex blame` prints, its verdict below.
[[nodiscard]] std::string blame_table(const Blame& blame);

}  // namespace arex::sim
