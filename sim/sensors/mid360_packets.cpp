#include "sensors/mid360_packets.h"

#include <algorithm>
#include <vector>

namespace arex::sim {
namespace {

static_assert(LidarScan::kFiring_ns == Mid360Pattern::kFiringPeriod);
static_assert(LidarScan::kLines == Mid360Pattern::kLines);

// Of a recorded unit: 259 us RMS within -410..+667 us. The lesser of two uniform draws over that
// span has just this RMS, 259.0.
constexpr double kMeasuredRms_us = 259, kEarliest_us = -410, kLatest_us = 667;

}  // namespace

LidarPackets::LidarPackets(double jitter_s, std::uint64_t seed)
    : jitter_s_(jitter_s), stream_(seed, "mid360.packet") {}

Stamp LidarPackets::stamp(std::int64_t index) const {
  if (jitter_s_ == 0) return index * kPeriod;
  RandomStream random = stream_.fork(static_cast<std::uint64_t>(index));
  const double first = random.uniform(), lesser = std::min(first, random.uniform());
  const double jitter_s =
      jitter_s_ / kMeasuredRms_us * (kEarliest_us + (kLatest_us - kEarliest_us) * lesser);
  return std::max<Stamp>(0, index * kPeriod + from_seconds(jitter_s));
}

LidarScan LidarPackets::frame(Stamp begin, Stamp end, std::span<const LidarScan> parts) const {
  const std::int64_t first = begin / kPeriod, last = end / kPeriod;
  std::vector<Stamp> stamps;
  for (std::int64_t index = first; index < last; ++index) stamps.push_back(stamp(index));
  LidarScan scan;
  scan.end = end;
  scan.stamp = stamps.empty() ? begin : *std::min_element(stamps.begin(), stamps.end());
  for (const Stamp s : stamps) {
    scan.packets_ns.push_back(static_cast<std::uint32_t>(s - scan.stamp));
  }
  std::size_t points = 0;
  for (const LidarScan& part : parts) points += part.points.size();
  scan.points.reserve(points);
  for (const LidarScan& part : parts) {
    for (LidarPoint point : part.points) {
      const std::int64_t firing =
          (part.stamp + point.offset_ns) / Mid360Pattern::kFiringPeriod - first * kPoints;
      if (firing < 0 || firing >= scan.firings()) continue;
      point.firing = static_cast<std::uint16_t>(firing);
      point.offset_ns = scan.firing_ns(firing);
      scan.points.push_back(point);
    }
  }
  return scan;
}

}  // namespace arex::sim
