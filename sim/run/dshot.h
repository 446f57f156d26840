#pragma once

#include <array>
#include <cstdint>
#include <optional>

#include "math/random.h"
#include "messages/commands.h"
#include "run/interfaces.h"

namespace arex::sim {

/// DShot's frame: 11 bits of throttle, one that asks for telemetry, 4 of checksum; most significant
/// bit first. Values 1 to 47 are commands, 48 to 2047 the throttle, 0 stops the motor.
/// Source: Betaflight's and PX4's DShot drivers.
namespace dshot {

inline constexpr int kBits = 16;
inline constexpr int kLeast = 48, kMost = 2047;

/// The value of a throttle 0..1: 2000 steps; 0 is a stopped motor.
[[nodiscard]] int value_of(double throttle);
/// The throttle of a value; what is no throttle is 0.
[[nodiscard]] double throttle_of(int value);
/// @pre 0 <= value <= kMost
[[nodiscard]] std::uint16_t encode(int value, bool telemetry = false);
/// The value of a frame; none if its checksum is wrong.
[[nodiscard]] std::optional<int> decode(std::uint16_t frame);

}  // namespace dshot

/// The wires to the four speed controllers: a frame each at every tick of 1 ms, which takes its
/// time to go through.
class DshotWires {
 public:
  DshotWires(const DshotConfig& config, std::uint64_t seed);

  /// Sends a tick's command. @return what the motors make of it: the mean over the tick of the
  /// throttle in force, the old one's until the frame is through
  [[nodiscard]] MotorCommand carry(const MotorCommand& command);

  [[nodiscard]] std::int64_t refused() const { return refused_; }  ///< frames with a wrong checksum

 private:
  /// One controller.
  struct Wire {
    double throttle = 0;  ///< in force
    int silent = 0;       ///< ticks since the last good frame
  };
  [[nodiscard]] std::uint16_t disturbed(std::uint16_t frame);

  DshotConfig config_;
  double frame_share_;  ///< of a tick that a frame takes
  int timeout_;         ///< ticks
  RandomStream random_;
  std::array<Wire, 4> wires_{};
  std::int64_t refused_ = 0;
};

}  // namespace arex::sim
