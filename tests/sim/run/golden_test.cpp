// Golden hashes: the missions of golden.json, flown whole, have the hashes that stand there, on
// every host. `golden_test NAME` flies one; `golden_test --update [NAME...]` writes them anew.
#include <algorithm>
#include <cstdio>
#include <fstream>
#include <nlohmann/json.hpp>
#include <string>
#include <string_view>
#include <vector>

#include "run/simulation.h"

namespace arex::sim {
namespace {

using nlohmann::ordered_json;

constexpr const char* kFile = AREX_SOURCE_DIR "/tests/sim/run/golden.json";
constexpr int kSkipped = 77;
constexpr std::uint64_t kSeed = 1;

#if defined(__OPTIMIZE__) && defined(NDEBUG) && !defined(__SANITIZE_ADDRESS__) && \
    !defined(__SANITIZE_THREAD__)
constexpr bool kOptimised = true;
#else
constexpr bool kOptimised = false;
#endif

ordered_json hashes_of(const Simulation& simulation) {
  // In the order of cause and effect within a tick.
  const std::map<std::string, std::string> devices = simulation.device_hashes();
  const auto of = [&](const char* name) {
    const auto found = devices.find(name);
    return found == devices.end() ? Fingerprint().text() : found->second;
  };
  return {{"imu", of("imu")},
          {"lidar", of("lidar")},
          {"depth", of("depth")},
          {"trajectory", simulation.trajectory_hash()}};
}

/// Flies a mission: its hashes after 1, 2, 4, ... seconds and at its end, by the time in seconds.
ordered_json fly(const std::string& name) {
  const Scenario scenario =
      load_scenario(AREX_SOURCE_DIR "/scenarios/" + name + ".yaml", {}, kSeed);
  Simulation simulation(scenario, 2);
  ordered_json rows = ordered_json::object();
  Stamp next = kNanosecondsPerSecond;
  const auto note = [&] {
    rows[ordered_json(to_seconds(simulation.now())).dump()] = hashes_of(simulation);
  };
  while (simulation.tick()) {
    if (simulation.now() < next) continue;
    note();
    next *= 2;
  }
  note();
  return rows;
}

/// Says where a flight first leaves the golden one. @return whether it does
bool differs(const std::string& name, const ordered_json& golden, const ordered_json& flown) {
  std::string before = "0";
  for (const auto& [time, expected] : golden.items()) {
    if (!flown.contains(time)) {
      std::printf("%s: same up to %s s, but does not end at %s s\n", name.c_str(), before.c_str(),
                  time.c_str());
      return true;
    }
    for (const auto& [hash, value] : expected.items()) {
      if (flown[time][hash] == value) continue;
      std::printf("%s: first differs between %s and %s s, in: %s (%s, golden %s)\n", name.c_str(),
                  before.c_str(), time.c_str(), hash.c_str(), flown[time][hash].dump().c_str(),
                  value.dump().c_str());
      return true;
    }
    before = time;
  }
  if (golden.size() == flown.size()) return false;
  std::printf("%s: same up to %s s, but does not end there\n", name.c_str(), before.c_str());
  return true;
}

int run(std::vector<std::string> names) {
  std::ifstream file(kFile);
  ordered_json golden = ordered_json::parse(file);
  const bool update = !names.empty() && names.front() == "--update";
  if (update) names.erase(names.begin());
  if (names.empty()) {
    for (const auto& [name, rows] : golden["missions"].items()) names.push_back(name);
  }
  const std::string compiler = "g++ " __VERSION__;
  if (!kOptimised || (!update && compiler != golden["compiler"])) {
    std::printf("skipped: golden hashes are those of %s, optimised and without sanitizers\n",
                golden["compiler"].get<std::string>().c_str());
    return kSkipped;
  }
  bool same = true;
  for (const std::string& name : names) {
    if (!update && golden["missions"].at(name).empty()) {
      std::printf("skipped: no golden hashes of %s yet; scripts/golden --update writes them\n",
                  name.c_str());
      return kSkipped;
    }
    const ordered_json flown = fly(name);
    if (update) {
      golden["missions"][name] = flown;
    } else {
      same = !differs(name, golden["missions"].at(name), flown) && same;
    }
  }
  if (update) {
    golden["compiler"] = compiler;
    std::ofstream(kFile) << golden.dump(1) << '\n';
  }
  return same ? 0 : 1;
}

}  // namespace
}  // namespace arex::sim

int main(int argc, char** argv) { return arex::sim::run({argv + 1, argv + argc}); }
