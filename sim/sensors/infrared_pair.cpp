#include "sensors/infrared_pair.h"

#include "math/random.h"
#include "math/so3.h"

namespace arex::sim {

InfraredPair::InfraredPair(const InfraredConfig& config, const D430Config& unit,
                           const worlds::World& world, const Scene& scene, const Pose& X_BC,
                           std::uint64_t seed, int strips)
    : config_(config),
      camera_(unit.camera()),
      baseline_m_(unit.baseline_m),
      X_BC_(X_BC),
      seed_(seed),
      shader_(config.light, world, scene, camera_, strips),
      imager_(config.sensor, camera_) {
  if (!config.mount_error_rad.isZero(0)) X_BC_.R = X_BC.R * so3::Exp(config.mount_error_rad);
}

/// @param X_BE the eye in B
CameraTwist InfraredPair::twist(const InfraredShot& shot, const Pose& X_BE) const {
  const Vec3 v_B = shot.X_WB.R.transpose() * shot.v_WB + shot.w_WB_B.cross(X_BE.p);
  return {X_BE.R.transpose() * v_B, X_BE.R.transpose() * shot.w_WB_B};
}

void InfraredPair::take(const InfraredShot& shot, const Pose& X_BE, std::uint64_t eye,
                        const Split& split, InfraredScene& scene, std::vector<std::uint8_t>& grey) {
  const double projector_x_m = DotProjector::kBesideLeftEye_m - (eye == 0 ? 0 : baseline_m_);
  shader_.draw(shot.X_WB * X_BE, scene, split, projector_x_m);
  RandomStream frame = RandomStream(seed_, "infrared").fork(static_cast<std::uint64_t>(shot.stamp));
  imager_.expose(scene, shot.exposure, twist(shot, X_BE), frame.fork(eye).bits(), grey, split);
}

std::shared_ptr<StereoImage> InfraredPair::capture(const InfraredShot& shot, const Split& split) {
  auto image = std::make_shared<StereoImage>();
  image->time_ns = shot.stamp + from_seconds(config_.clock_offset_s);
  image->width = camera_.width;
  image->height = camera_.height;
  image->exposure_s = shot.exposure.exposure_s;
  image->gain = shot.exposure.gain;
  image->camera = {camera_.width, camera_.height, camera_.fx, camera_.cx,
                   camera_.cy,    baseline_m_,    {}};
  take(shot, X_BC_, 0, split, left_, image->left);
  if (shot.right) {
    const Pose X_CR{Mat3::Identity(), Vec3(baseline_m_, 0, 0)};
    take(shot, X_BC_ * X_CR, 1, split, right_, image->right);
  }
  return image;
}

}  // namespace arex::sim
