#pragma once

#include <algorithm>
#include <cstdint>
#include <deque>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "math/random.h"
#include "sensors/fault.h"
#include "sensors/reading_faults.h"

namespace arex::sim {

/// The line between a sensor and those who read it: hands readings on as they are, or as the
/// faults of the device make them. One of a sound device costs a comparison.
///
/// What is random is drawn from a stream of the line's own, one draw after the other, so that a
/// fault changes nothing of what the sensor itself measures.
template <class Reading>
class FaultyLine {
 public:
  /// @param faults of all devices
  /// @param device whose faults count
  /// @param line tells the lines of one device apart
  FaultyLine(const std::vector<FaultConfig>& faults, std::uint64_t seed, const std::string& device,
             const std::string& line = "")
      : random_(seed, "fault " + device + line) {
    std::copy_if(faults.begin(), faults.end(), std::back_inserter(faults_),
                 [&](const FaultConfig& fault) { return fault.device == device; });
  }

  [[nodiscard]] bool sound() const { return faults_.empty(); }

  /// To be called at every tick of a device that is not sound, for what is late.
  /// @param reading if there is a new one
  /// @param deliver called with each reading that arrives now, in the order measured
  template <class Deliver>
  void pass(Stamp now, const std::optional<Reading>& reading, const Deliver& deliver) {
    if (sound()) {
      if (reading) deliver(*reading);
      return;
    }
    if (reading) add(now, *reading);
    while (!under_way_.empty() && under_way_.front().first <= now) {
      const Reading arrived = std::move(under_way_.front().second);
      under_way_.pop_front();
      deliver(arrived);
    }
  }

 private:
  void add(Stamp now, Reading reading) {
    Stamp arrival = now;
    bool stuck = false;
    const Reading measured = reading;
    for (const FaultConfig& fault : faults_) {
      if (!fault.holds(now)) continue;
      switch (fault.kind) {
        case FaultKind::kSilent:
          return;
        case FaultKind::kDropping:
          if (random_.uniform() < fault.share) return;
          break;
        case FaultKind::kStuck:
          stuck = true;
          if (held_) reading = with_stamps_of(measured, *held_);
          break;
        case FaultKind::kDelayed:
          arrival = std::max(arrival, now + from_seconds(fault.delay_s));
          break;
        default:
          reading = spoilt(reading, fault, random_);
      }
    }
    if (!stuck || !held_) held_ = measured;
    // A line does not overtake itself.
    if (!under_way_.empty()) arrival = std::max(arrival, under_way_.back().first);
    under_way_.emplace_back(arrival, std::move(reading));
  }

  std::vector<FaultConfig> faults_;
  RandomStream random_;
  std::optional<Reading> held_;  ///< the last one before it got stuck
  std::deque<std::pair<Stamp, Reading>> under_way_;
};

}  // namespace arex::sim
