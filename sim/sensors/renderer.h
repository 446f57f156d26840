#pragma once

#include <memory>
#include <string>
#include <vector>

#include "math/pose.h"
#include "messages/sensors.h"
#include "sensors/egl.h"
#include "worlds/world.h"

namespace arex::sim {

struct RendererOptions {
  EglOptions egl;
  double near_m = 0.02;  ///< nothing closer is drawn; costs no precision, the depth is reciprocal
  double far_m = 12.0;   ///< nothing deeper is drawn
  bool cull = true;      ///< draw only the chunks that may be seen; off, for tests
};

/// Draws what a pinhole camera sees of a world, from a copy of its mesh on the graphics device.
///
/// Each kind of picture is a pass: shaders and a framebuffer of its own over the same mesh, culling
/// and projection. Depth is the only one so far; an infrared image adds a grey attachment and a
/// fragment shader, and the right imager is the same pass from a shifted pose.
class Renderer {
 public:
  struct Statistics {
    std::size_t chunks = 0;
    std::size_t triangles = 0;
  };

  /// The world is copied; it need not outlive the renderer.
  Renderer(const worlds::World& world, const PinholeCamera& camera, const RendererOptions& options);
  ~Renderer();

  /// 1/z of the nearest surface in each pixel (1/m; z the depth in C), rows from the top, 0 where
  /// there is nothing up to far_m. Linear across the image of a plane, and so is the precision:
  /// better than 0.1 mm at 10 m. `out` is resized. Callable from any thread.
  void render_inverse_depth(const Pose& X_WC, std::vector<float>& out);

  /// What the last frame drew.
  [[nodiscard]] Statistics last_frame() const;
  [[nodiscard]] const std::string& renderer_name() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace arex::sim
