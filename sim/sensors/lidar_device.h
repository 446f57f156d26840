#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

#include "sensors/device.h"
#include "sensors/faulty_line.h"
#include "sensors/lidar_model.h"

namespace arex::sim {

/// A LiDAR that fires at every tick. The parts of a frame are cast while the next ones are fired,
/// side by side; all become visible with the frame.
class LidarDevice : public Device {
 public:
  /// @param latency_s after the frame's last firing
  LidarDevice(std::unique_ptr<const LidarModel> lidar, double latency_s,
              const DeviceContext& context);

  void fire(const Moment& moment) override;

 private:
  struct Frame;
  void deliver(const Frame& frame);
  /// Through the line of a device that is not sound.
  void pass(const std::optional<LidarScanPtr>& scan);
  void hand_on(const LidarScanPtr& scan, std::uint64_t hash);

  std::string name_;
  std::unique_ptr<const LidarModel> lidar_;
  Stamp latency_;
  JobQueue& jobs_;
  JobQueue::Lane lane_;
  Outlets& outlets_;
  FaultyLine<LidarScanPtr> line_;
  Stamp now_ = 0;
  std::vector<Truth> part_;  ///< ticks of the part being fired; a frame's first has one more
  Stamp part_begin_ = 0;
  std::shared_ptr<Frame> frame_;  ///< being fired
};

}  // namespace arex::sim
