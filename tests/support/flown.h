#pragma once

#include <string>

#include "run/simulation.h"
#include "support/temporary_folder.h"

namespace arex::test {

/// A flight, and what was told meanwhile.
struct Flown {
  sim::FlightResult result;
  std::string events;  ///< events.csv

  [[nodiscard]] bool told(const std::string& what) const {
    return events.find(what) != std::string::npos;
  }
};

/// Flies a scenario to its end.
/// @param look called after each tick with the simulation
template <class Look>
Flown fly(const sim::Scenario& scenario, int threads, const Look& look) {
  const TemporaryFolder folder;
  Flown flown;
  {
    sim::Recorder recorder(folder.path(), "");
    sim::Simulation simulation(scenario, threads);
    simulation.record_to(recorder);
    while (simulation.tick()) look(simulation);
    flown.result = simulation.finish();
    recorder.flush();
  }
  flown.events = read_text(folder / "events.csv");
  return flown;
}

}  // namespace arex::test
