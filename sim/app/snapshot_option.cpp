#include "app/snapshot_option.h"

#include <cstdio>

#include "config/config.h"
#include "config/text.h"
#include "run/snapshot.h"

namespace arex::app {

std::vector<Stamp> snapshot_times(const std::vector<std::string>& texts, double end_s,
                                  const std::string& end) {
  std::vector<Stamp> times;
  for (const std::string& text : texts) {
    const double time_s = parse_double(text).value_or(0);
    const bool in_mission = time_s > 0 && time_s < end_s;  // any other need not be a Stamp
    const Stamp time = in_mission ? from_seconds(time_s) : 0;
    if (time == 0 || time % kNanosecondsPerTick != 0) {
      throw ConfigError("--snapshot: is '" + shortened(text) +
                        "', expected seconds above 0 and below " + end + ", " +
                        config_detail::format_scalar(end_s) + ", in whole milliseconds");
    }
    times.push_back(time);
  }
  return times;
}

void tell_missed(const std::vector<Stamp>& times, const char* what, Stamp end) {
  for (const Stamp time : times) {
    std::fprintf(stderr, "arex: no snapshot at %s s, for the %s ended at %.3f s\n",
                 sim::snapshot_name(time).c_str(), what, to_seconds(end));
  }
}

}  // namespace arex::app
