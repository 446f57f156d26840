#include "sensors/d430.h"

#include <memory>

namespace arex::sim {

D430::D430(const D430Config& config, const worlds::World& world, const Pose& X_BC,
           std::uint64_t seed)
    : config_(config),
      X_BC_(X_BC),
      random_(seed, "d430"),
      renderer_(world, config.camera(), {.far_m = config.draw_range_m}),
      stereo_(config) {}

std::shared_ptr<DepthImage> D430::capture(Stamp stamp, const Pose& X_WB) {
  renderer_.render_inverse_depth(X_WB * X_BC_, inverse_depth_);
  auto image = std::make_shared<DepthImage>();
  image->stamp = stamp;
  image->camera = config_.camera();
  const std::uint64_t frame_seed = random_.fork(static_cast<std::uint64_t>(stamp)).bits();
  stereo_.measure(inverse_depth_, frame_seed, image->depth_m);
  return image;
}

}  // namespace arex::sim
