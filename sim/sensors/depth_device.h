#pragma once

#include <cstdint>
#include <memory>
#include <optional>

#include "sensors/d430.h"
#include "sensors/device.h"
#include "sensors/faulty_line.h"

namespace arex::sim {

/// A D430 that is drawn only when somebody reads its frame.
class DepthDevice : public Device {
 public:
  /// @param latency_s from the exposure of a frame to its delivery
  DepthDevice(const D430Config& config, double latency_s, const DeviceContext& context);

  void fire(const Moment& moment) override;

 private:
  /// Through the line of a device that is not sound.
  void pass(const std::optional<DepthImagePtr>& frame);
  void hand_on(const DepthImagePtr& frame, std::uint64_t hash);

  std::string name_;
  D430Config config_;
  const worlds::World& world_;
  Pose X_BC_;
  std::uint64_t seed_;
  Stamp latency_;
  JobQueue& jobs_;
  JobQueue::Lane lane_;
  Outlets& outlets_;
  FaultyLine<DepthImagePtr> line_;
  Stamp now_ = 0;
  std::unique_ptr<D430> camera_;  ///< made when the first frame is read; in jobs of its lane
  std::int64_t frame_ = 0;        ///< index of the next
};

}  // namespace arex::sim
