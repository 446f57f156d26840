#pragma once

#include <cstdint>
#include <memory>
#include <optional>

#include "sensors/d430_stereo.h"
#include "sensors/device.h"
#include "sensors/faulty_line.h"
#include "sensors/infrared_exposure.h"
#include "sensors/infrared_shot.h"

namespace arex::sim {

class InfraredPair;

/// The infrared pair of a flight. Shutters open at the rate; each frame's exposure is chosen then,
/// by the frames delivered so far.
class InfraredDevice : public Device {
 public:
  /// @param unit the depth camera as built, whose left imager this is
  /// @param context its X_BS: C in B
  /// @param X_BC_drawn where the drawings have it
  InfraredDevice(const InfraredConfig& config, const D430Config& unit, const Pose& X_BC_drawn,
                 const DeviceContext& context);
  ~InfraredDevice() override;

  void fire(const Moment& moment) override;

 private:
  void open(Stamp opened);
  void expose(const Moment& moment);
  /// Through the line of a device that is not sound.
  void pass(const std::optional<StereoImagePtr>& image);
  void hand_on(const StereoImagePtr& image, std::uint64_t hash);

  InfraredConfig config_;
  D430Config unit_;
  Pose X_BC_drawn_;
  const worlds::World& world_;
  const Scene& scene_;
  Pose X_BC_;
  std::uint64_t seed_;
  JobQueue& jobs_;
  JobQueue::Lane lane_;
  Outlets& outlets_;
  FaultyLine<StereoImagePtr> line_;
  Stamp now_ = 0;
  AutoExposure auto_exposure_;
  std::unique_ptr<InfraredPair> pair_;  ///< made when the first frame is drawn; in jobs of its lane
  std::int64_t frame_ = 0;              ///< index of the next
  std::optional<InfraredShot> open_;    ///< the frame whose shutter is open, up to its middle
};

}  // namespace arex::sim
