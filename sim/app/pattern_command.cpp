#include <cmath>
#include <cstdio>
#include <numbers>

#include "app/commands.h"
#include "sensors/mid360_pattern.h"

namespace arex::app {

int pattern(const PatternArguments& arguments) {
  constexpr double kDegrees = 180 / std::numbers::pi;
  const sim::Mid360Pattern pattern(arguments.mode == "table" ? sim::PatternMode::kTable
                                                             : sim::PatternMode::kDevice);
  std::printf("time_s,line,azimuth_deg,elevation_deg\n");
  for (std::int64_t i = 0; i < std::int64_t{sim::Mid360Pattern::kLines} * arguments.shots; ++i) {
    const Vec3 d = pattern.direction(i);
    std::printf("%.6f,%d,%.4f,%.4f\n", to_seconds(i * sim::Mid360Pattern::kFiringPeriod),
                static_cast<int>(i % sim::Mid360Pattern::kLines),
                kDegrees * std::atan2(d.y(), d.x()), kDegrees * std::asin(d.z()));
  }
  return std::fflush(stdout) == 0 ? 0 : 1;
}

}  // namespace arex::app
