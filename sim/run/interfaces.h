#pragma once

#include <array>
#include <cstdint>
#include <string_view>

namespace arex::sim {

/// The wire between autopilot and speed controllers (paper: DShot600).
struct DshotConfig {
  bool enabled = false;
  double rate_hz = 600e3;  ///< DShot600 by its name
  double bit_error_rate = 0;
  double signal_timeout_s = 0.1;  ///< as long as BLHeli_32's, about

  void fields(auto& f) {
    f("enabled", enabled,
      "throttles reach the speed controllers as DShot frames; false: at once, and whole");
    f("rate_hz", rate_hz, "bits a second; the throttle in force changes when a frame is through");
    f("bit_error_rate", bit_error_rate,
      "share of bits that arrive turned round; a frame whose checksum is wrong is not obeyed");
    f("signal_timeout_s", signal_timeout_s, "without a good frame for longer the motors stop");
    f.check(rate_hz >= 16e3 && rate_hz <= 1e7, "16e3 <= rate_hz <= 1e7 (a frame within a tick)");
    f.check(bit_error_rate >= 0 && bit_error_rate <= 0.5, "0 <= bit_error_rate <= 0.5");
    f.check(signal_timeout_s >= 0.001, "signal_timeout_s >= 0.001 (a tick)");
  }
};

/// The serial line between autopilot and companion computer (paper: a UART; it prints no rate).
struct UartConfig {
  bool enabled = false;
  double rate_hz = 921600;   ///< PX4's default for a companion computer
  double latency_s = 0.001;  ///< scheduling at either end [E]
  double jitter_s = 0.001;   ///< [E]
  double loss = 0;
  int buffer_bytes = 2048;  ///< [E]

  void fields(auto& f) {
    f("enabled", enabled,
      "IMU, status and battery go up and commands come down a serial line; false: at once. The "
      "autopilot descends by itself after autopilot.command_timeout_s without a command");
    f("rate_hz", rate_hz, "bits a second, ten for each byte; one line for each direction");
    f("latency_s", latency_s, "of each message, beside the time that its bytes take");
    f("jitter_s", jitter_s, "added to it, uniform from 0 to this; messages keep their order");
    f("loss", loss, "share of the messages that get lost, either way");
    f("buffer_bytes", buffer_bytes, "of a sender; what finds it full is lost");
    f.check(rate_hz >= 1200 && rate_hz <= 1e8, "1200 <= rate_hz <= 1e8");
    f.check(latency_s >= 0 && latency_s <= 1, "0 <= latency_s <= 1");
    f.check(jitter_s >= 0 && jitter_s <= 1, "0 <= jitter_s <= 1");
    f.check(loss >= 0 && loss <= 1, "0 <= loss <= 1");
    f.check(buffer_bytes >= 128 && buffer_bytes <= 1 << 20, "128 <= buffer_bytes <= 2^20");
  }
};

/// What the flight controller is connected by.
struct InterfaceConfig {
  enum class Command : std::uint8_t { kNewtons, kThrottle };
  friend constexpr std::array<std::string_view, 2> enum_names(Command) {
    return {"newtons", "throttle"};
  }

  Command command = Command::kNewtons;
  double throttle_voltage_v = 15.1;  ///< four cells, hovering, at half of a flight
  DshotConfig dshot;
  UartConfig uart;

  void fields(auto& f) {
    f("command", command,
      "how the companion says how much thrust it wants: newtons; or throttle, as a share of full "
      "thrust, which it takes for that at throttle_voltage_v, whatever the battery has left "
      "(paper)");
    f("throttle_voltage_v", throttle_voltage_v,
      "of the battery that the companion's throttle for hovering was found on. A fuller one lifts "
      "the "
      "vehicle by what its position gain leaves: 0.1 m at either end of a flight");
    f("dshot", dshot, "between autopilot and speed controllers");
    f("uart", uart, "between autopilot and companion computer");
    f.check(throttle_voltage_v > 1 && throttle_voltage_v < 100, "1 < throttle_voltage_v < 100");
  }
};

}  // namespace arex::sim
