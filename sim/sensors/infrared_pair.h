#pragma once

#include <cstdint>
#include <memory>

#include "math/pose.h"
#include "messages/stereo_image.h"
#include "sensors/d430_stereo.h"
#include "sensors/infrared_config.h"
#include "sensors/infrared_imager.h"
#include "sensors/infrared_shader.h"
#include "sensors/infrared_shot.h"
#include "sensors/scene.h"
#include "worlds/world.h"

namespace arex::sim {

/// The D430's left and right infrared imagers in a world. Frame C: the left one's, that of the
/// depth image; z forward, x right, y down.
///
/// A frame is a pure function of (config, world, X_BC, seed, shot): it may be drawn on any thread,
/// in any order, only when somebody reads it. One frame at a time.
class InfraredPair {
 public:
  /// @param unit the depth camera as built, whose left imager this is
  /// @param strips that a picture may be drawn in side by side; how many they are changes no bit
  /// The world is copied; neither it nor the scene need outlive this.
  InfraredPair(const InfraredConfig& config, const D430Config& unit, const worlds::World& world,
               const Scene& scene, const Pose& X_BC, std::uint64_t seed, int strips = 1);

  [[nodiscard]] std::shared_ptr<StereoImage> capture(const InfraredShot& shot,
                                                     const Split& split = in_turn);

  [[nodiscard]] const InfraredShader& shader() const { return shader_; }
  /// The light that the left eye's last frame was made of.
  [[nodiscard]] const InfraredScene& left_scene() const { return left_; }
  [[nodiscard]] PinholeCamera camera() const { return camera_; }

 private:
  [[nodiscard]] CameraTwist twist(const InfraredShot& shot, const Pose& X_BE) const;
  void take(const InfraredShot& shot, const Pose& X_BE, std::uint64_t eye, const Split& split,
            InfraredScene& scene, std::vector<std::uint8_t>& grey);

  InfraredConfig config_;
  PinholeCamera camera_;
  double baseline_m_;
  Pose X_BC_;
  std::uint64_t seed_;
  InfraredShader shader_;
  InfraredImager imager_;
  InfraredScene left_, right_;
};

}  // namespace arex::sim
