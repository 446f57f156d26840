#pragma once

#include <optional>
#include <string>
#include <vector>

#include "messages/events.h"
#include "scoring/figures.h"
#include "sensors/fault.h"

namespace arex::sim {

/// What the vehicle said of the faults that a scenario gave it.
class FaultLog {
 public:
  explicit FaultLog(const std::vector<FaultConfig>& faults);

  /// What the flight software told. @pre called in the order of time
  void add(const Event& event);

  /// Sets the figures `faults.*`.
  void add_figures(Figures& figures) const;

 private:
  std::optional<Stamp> begin_;  ///< of the first fault; none: nothing was to go wrong
  int events_ = 0;
  std::string told_;  ///< the first typed event after that
  Stamp told_at_ = 0;
};

}  // namespace arex::sim
