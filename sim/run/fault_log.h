#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "messages/events.h"
#include "scoring/figures.h"
#include "sensors/fault.h"
#include "stack/standing_faults.h"

namespace arex::sim {

/// In a run's reason, behind what happened: the fault that had been told before and still stood.
inline constexpr std::string_view kAfter = " after ";

/// What the vehicle said of faults, those that a scenario gave it and others.
class FaultLog {
 public:
  explicit FaultLog(const std::vector<FaultConfig>& faults);

  /// What the flight software told. @pre called in the order of time
  void add(const Event& event);

  /// The first fault that was told and stands, or else what the odometry says of itself while it is
  /// degenerate or lost; empty: all is well, as far as was told.
  [[nodiscard]] std::string standing() const;
  /// The first fault that stood when the mission last said that it is stuck: what a vehicle suffers
  /// on its way down is no cause of that, and what its odometry lacks the mission tells itself.
  [[nodiscard]] const std::string& standing_when_stuck() const { return when_stuck_; }

  /// Sets the figures `faults.*`.
  void add_figures(Figures& figures) const;

 private:
  std::optional<Stamp> begin_;  ///< of the first fault; none: nothing was to go wrong
  int events_ = 0;
  std::string told_;  ///< the first typed event after that
  Stamp told_at_ = 0;
  StandingFaults standing_;
  std::string odometry_;  ///< its newest status, if that is no good one
  std::string when_stuck_;
};

}  // namespace arex::sim
