#pragma once

#include <cstdint>
#include <vector>

#include "math/pose.h"
#include "math/random.h"
#include "messages/sensors.h"
#include "sensors/d430_stereo.h"
#include "sensors/renderer.h"
#include "worlds/world.h"

namespace arex::sim {

/// The depth camera in a world. Frames W, B and C: z forward, x right, y down, the left imager's.
///
/// The seed is the unit's: its focal length, its bias and the pattern of its noise come from it.
/// A frame is a pure function of (config, world, X_BC, seed, stamp, pose): it may be rendered only
/// when somebody reads it, on any thread, in any order. One frame at a time per device.
class D430 {
 public:
  /// The world must outlive this.
  D430(const D430Config& config, const worlds::World& world, const Pose& X_BC, std::uint64_t seed);

  /// The frame taken at `stamp` with the body at X_WB.
  [[nodiscard]] std::shared_ptr<DepthImage> capture(Stamp stamp, const Pose& X_WB);

  /// Of this unit, as its frames say.
  [[nodiscard]] PinholeCamera camera() const { return config_.camera(); }

  [[nodiscard]] Renderer::Statistics last_frame() const { return renderer_.last_frame(); }

 private:
  [[nodiscard]] std::uint64_t view_seed(const Pose& X_WC) const;

  D430Config config_;  ///< as built
  Pose X_BC_;
  RandomStream random_;
  RandomStream views_;
  Renderer renderer_;
  StereoModel stereo_;
  std::vector<float> inverse_depth_;
};

}  // namespace arex::sim
