#include "sensors/depth_device.h"

#include <span>

namespace arex::sim {
namespace {

std::uint64_t hash_of(const DepthImage& image) {
  Fingerprint hash;
  hash.add_bytes(std::span<const float>(image.depth_m));
  return hash.value();
}

}  // namespace

DepthDevice::DepthDevice(const D430Config& config, double latency_s, const DeviceContext& context)
    : name_(context.name),
      config_(config),
      world_(context.world),
      X_BC_(context.X_BS),
      seed_(context.seed),
      latency_(from_seconds(latency_s)),
      jobs_(context.jobs),
      lane_(jobs_.add_lane(name_.empty() ? "depth" : name_)),
      outlets_(context.outlets),
      line_(context.faults, context.seed, name_.empty() ? "depth" : name_) {}

void DepthDevice::fire(const Moment& moment) {
  now_ = moment.now;
  if (!line_.sound()) pass(std::nullopt);
  // 30 Hz does not divide a millisecond: the shutter opens between two ticks.
  const Stamp stamp = from_seconds(static_cast<double>(frame_) / config_.rate_hz);
  if (stamp > moment.now) return;
  ++frame_;
  if (!outlets_.software->accepts_depth(name_, stamp)) return;
  const double fraction = moment.now == stamp
                              ? 1.0
                              : 1.0 - static_cast<double>(moment.now - stamp) / kNanosecondsPerTick;
  const Pose X_WB = interpolate(moment.before.X_WB, moment.truth.X_WB, fraction);
  jobs_.schedule(lane_, stamp + latency_, [this, stamp, X_WB]() -> JobQueue::Delivery {
    if (!camera_) camera_ = std::make_unique<D430>(config_, world_, X_BC_, seed_);
    const std::shared_ptr<DepthImage> frame = camera_->capture(stamp, X_WB);
    frame->device = name_;
    return [this, frame, hash = hash_of(*frame)] {
      if (line_.sound()) {
        hand_on(frame, hash);
      } else {
        pass(frame);
      }
    };
  });
}

void DepthDevice::pass(const std::optional<DepthImagePtr>& frame) {
  line_.pass(now_, frame,
             [this](const DepthImagePtr& arrived) { hand_on(arrived, hash_of(*arrived)); });
}

void DepthDevice::hand_on(const DepthImagePtr& frame, std::uint64_t hash) {
  note(hash);
  outlets_.frames.add(hash);
  outlets_.software->add_depth(frame);
  for (BagWriter* bag : outlets_.bags) bag->depth(*frame);
}

}  // namespace arex::sim
