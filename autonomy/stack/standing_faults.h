#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "messages/events.h"

namespace arex {

/// Which faults of sensors and vehicle have been told and not been said to be over, by the events
/// alone.
class StandingFaults {
 public:
  /// @param detail of an event of any kind. @pre called in the order of time
  void add(EventKind kind, const std::string& detail);

  /// The first that stands, without its numbers: "lidar silent", "motor 2 weak", "vibration";
  /// empty: none does. What came after it is more likely its consequence.
  [[nodiscard]] std::string_view first() const;

 private:
  struct Fault {
    EventKind kind;
    std::string name;
  };
  void end(const std::string& over);

  std::vector<Fault> standing_;  ///< in the order in which they were told
};

}  // namespace arex
