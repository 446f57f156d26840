#include "run/dshot.h"

#include <algorithm>
#include <cmath>

namespace arex::sim {
namespace dshot {
namespace {

constexpr int kChecksumBits = 4;

std::uint16_t checksum(std::uint16_t payload) {
  return (payload ^ payload >> 4 ^ payload >> 8) & 0xf;
}

}  // namespace

int value_of(double throttle) {
  if (throttle <= 0) return 0;
  return kLeast + static_cast<int>(std::lround(std::min(throttle, 1.0) * (kMost - kLeast)));
}

double throttle_of(int value) {
  if (value < kLeast) return 0;
  return static_cast<double>(value - kLeast) / (kMost - kLeast);
}

std::uint16_t encode(int value, bool telemetry) {
  const auto payload = static_cast<std::uint16_t>(value << 1 | (telemetry ? 1 : 0));
  return static_cast<std::uint16_t>(payload << kChecksumBits | checksum(payload));
}

std::optional<int> decode(std::uint16_t frame) {
  const auto payload = static_cast<std::uint16_t>(frame >> kChecksumBits);
  if (checksum(payload) != (frame & 0xf)) return std::nullopt;
  return payload >> 1;
}

}  // namespace dshot

DshotWires::DshotWires(const DshotConfig& config, std::uint64_t seed)
    : config_(config),
      frame_share_(dshot::kBits / config.rate_hz / kSecondsPerTick),
      timeout_(static_cast<int>(std::lround(config.signal_timeout_s / kSecondsPerTick))),
      random_(seed, "dshot") {}

std::uint16_t DshotWires::disturbed(std::uint16_t frame) {
  if (config_.bit_error_rate == 0) return frame;
  for (int bit = 0; bit < dshot::kBits; ++bit) {
    if (random_.uniform() < config_.bit_error_rate) frame ^= static_cast<std::uint16_t>(1 << bit);
  }
  return frame;
}

MotorCommand DshotWires::carry(const MotorCommand& command) {
  if (!config_.enabled) return command;
  MotorCommand obeyed;
  for (std::size_t i = 0; i < wires_.size(); ++i) {
    Wire& wire = wires_[i];
    const double before = wire.throttle;
    const auto value =
        dshot::decode(disturbed(dshot::encode(dshot::value_of(command.throttle[i]))));
    refused_ += !value;
    wire.silent = value ? 0 : wire.silent + 1;
    if (value) wire.throttle = dshot::throttle_of(*value);
    if (wire.silent > timeout_) wire.throttle = 0;
    obeyed.throttle[i] = frame_share_ * before + (1 - frame_share_) * wire.throttle;
  }
  return obeyed;
}

}  // namespace arex::sim
