#pragma once

#include <cstdint>
#include <span>

#include "math/random.h"
#include "messages/sensors.h"
#include "sensors/mid360_pattern.h"

namespace arex::sim {

/// How the device sends what it fired: 96 firings a packet, with or without a return, and one stamp
/// for all of them. The stamps jitter by more than a packet lasts, so that times of points run
/// backwards now and then; the firings themselves keep their 5 us.
///
/// A packet's stamp is a pure function of its index and the seed.
class LidarPackets {
 public:
  static constexpr int kPoints = LidarScan::kPacketPoints;
  static constexpr Stamp kPeriod = kPoints * Mid360Pattern::kFiringPeriod;

  /// @param jitter_s RMS of the stamps about the firings' true times; 0: none
  LidarPackets(double jitter_s, std::uint64_t seed);

  /// When packet `index` says that its first point was fired, ns.
  [[nodiscard]] Stamp stamp(std::int64_t index) const;

  /// The first firing of a frame that begins at `begin`: that of the packet being filled then.
  [[nodiscard]] static std::int64_t first_firing(Stamp begin) { return begin / kPeriod * kPoints; }

  /// The frame [begin, end): the packets that became full in it, with their stamps.
  /// @param parts scans that cover its firings from first_firing(begin) on, in order, with true
  /// times
  [[nodiscard]] LidarScan frame(Stamp begin, Stamp end, std::span<const LidarScan> parts) const;

 private:
  double jitter_s_;
  RandomStream stream_;
};

}  // namespace arex::sim
