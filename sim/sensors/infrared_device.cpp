#include "sensors/infrared_device.h"

#include <span>

#include "sensors/infrared_pair.h"

namespace arex::sim {
namespace {

std::uint64_t hash_of(const StereoImage& image) {
  Fingerprint hash;
  hash.add_bytes(std::span<const std::uint8_t>(image.left));
  hash.add_bytes(std::span<const std::uint8_t>(image.right));
  return hash.value();
}

}  // namespace

InfraredDevice::InfraredDevice(const InfraredConfig& config, const D430Config& unit,
                               const Pose& X_BC_drawn, const DeviceContext& context)
    : config_(config),
      unit_(unit),
      X_BC_drawn_(X_BC_drawn),
      world_(context.world),
      scene_(context.scene),
      X_BC_(context.X_BS),
      seed_(context.seed),
      jobs_(context.jobs),
      lane_(jobs_.add_lane("infrared")),
      outlets_(context.outlets),
      line_(context.faults, context.seed, "infrared"),
      auto_exposure_(config.sensor) {}

InfraredDevice::~InfraredDevice() = default;

void InfraredDevice::fire(const Moment& moment) {
  now_ = moment.now;
  if (!line_.sound()) pass(std::nullopt);
  const Stamp opened = from_seconds(static_cast<double>(frame_) / config_.rate_hz);
  if (opened <= moment.now) open(opened);
  if (open_ && open_->stamp <= moment.now) expose(moment);
}

void InfraredDevice::open(Stamp opened) {
  InfraredShot shot;
  shot.exposure = auto_exposure_.next();
  shot.stamp = opened + from_seconds(shot.exposure.exposure_s) / 2;
  shot.right = frame_ % config_.right_every == 0;
  open_ = shot;
  ++frame_;
}

/// In the middle of the exposure, which lies between two ticks.
void InfraredDevice::expose(const Moment& moment) {
  InfraredShot shot = *open_;
  open_.reset();
  const double fraction = 1.0 - static_cast<double>(moment.now - shot.stamp) / kNanosecondsPerTick;
  shot.X_WB = interpolate(moment.before.X_WB, moment.truth.X_WB, fraction);
  shot.v_WB = moment.truth.v_WB;
  shot.w_WB_B = moment.truth.w_WB_B;
  const Stamp closed = shot.stamp + from_seconds(shot.exposure.exposure_s) / 2;
  const Stamp due = closed + from_seconds(config_.latency_s);
  jobs_.schedule(lane_, due, [this, shot]() -> JobQueue::Delivery {
    if (!pair_) {
      // Twice as many strips as threads: they do not all take as long.
      const int strips = jobs_.threads() == 1 ? 1 : 2 * jobs_.threads();
      pair_ = std::make_unique<InfraredPair>(config_, unit_, world_, scene_, X_BC_, seed_, strips);
    }
    const auto split = [this](std::size_t count, const std::function<void(std::size_t)>& piece) {
      jobs_.split(count, piece);
    };
    const std::shared_ptr<StereoImage> image = pair_->capture(shot, split);
    image->camera.X_BC = X_BC_drawn_;
    const double mean = central_mean(image->left, image->width, image->height);
    return [this, image, shot, mean, hash = hash_of(*image)] {
      auto_exposure_.add(mean, shot.exposure);
      if (line_.sound()) {
        hand_on(image, hash);
      } else {
        pass(image);
      }
      if (outlets_.on_images) outlets_.on_images(shot, *image, mean);
    };
  });
}

void InfraredDevice::pass(const std::optional<StereoImagePtr>& image) {
  line_.pass(now_, image,
             [this](const StereoImagePtr& arrived) { hand_on(arrived, hash_of(*arrived)); });
}

void InfraredDevice::hand_on(const StereoImagePtr& image, std::uint64_t hash) {
  note(hash);
  outlets_.frames.add(hash);
  outlets_.software->add_images(image);
  for (BagWriter* bag : outlets_.bags) bag->infrared(*image);
}

}  // namespace arex::sim
