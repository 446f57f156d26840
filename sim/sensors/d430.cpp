#include "sensors/d430.h"

#include <cmath>
#include <memory>

#include "math/so3.h"

namespace arex::sim {

D430::D430(const D430Config& config, const worlds::World& world, const Pose& X_BC,
           std::uint64_t seed)
    : config_(config.as_built(seed)),
      X_BC_(X_BC),
      random_(seed, "d430"),
      views_(seed, "d430.views"),
      renderer_(world, config_.camera(), {.far_m = config.draw_range_m}),
      stereo_(config_, seed) {}

/// The same for poses in the same cell of a grid: what hovers keeps its view, or comes back to it.
std::uint64_t D430::view_seed(const Pose& X_WC) const {
  const Vec3 place = X_WC.p / config_.view_step_m;
  const Vec3 turn = so3::Log(X_WC.R) / config_.view_step_rad;
  RandomStream view = views_;
  for (const double value : {place.x(), place.y(), place.z(), turn.x(), turn.y(), turn.z()}) {
    view = view.fork(static_cast<std::uint64_t>(std::llround(value)));
  }
  return view.bits();
}

std::shared_ptr<DepthImage> D430::capture(Stamp stamp, const Pose& X_WB) {
  const Pose X_WC = X_WB * X_BC_;
  renderer_.render_inverse_depth(X_WC, inverse_depth_);
  auto image = std::make_shared<DepthImage>();
  image->stamp = stamp;
  image->camera = config_.camera();
  const std::uint64_t frame_seed = random_.fork(static_cast<std::uint64_t>(stamp)).bits();
  stereo_.measure(inverse_depth_, frame_seed, view_seed(X_WC), image->depth_m);
  return image;
}

}  // namespace arex::sim
