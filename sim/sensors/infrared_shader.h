#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "math/pose.h"
#include "messages/sensors.h"
#include "sensors/infrared_backdrop.h"
#include "sensors/infrared_config.h"
#include "sensors/infrared_lamps.h"
#include "sensors/infrared_light.h"
#include "sensors/infrared_materials.h"
#include "sensors/infrared_shot.h"
#include "sensors/infrared_sun.h"
#include "sensors/renderer.h"
#include "sensors/scene.h"
#include "worlds/world.h"

namespace arex::sim {

/// Draws a world as an infrared camera sees it.
///
/// The rasteriser finds the triangle of four samples in each pixel; what differs among them is
/// shaded for itself, what is the same once, and eight pixels of one triangle at a time. A surface
/// is its albedo with a procedural texture, under the sun where it shines, and under the baked
/// light of sky, lamps and other surfaces. All of it is sums, products, quotients and square roots
/// in a fixed order: the same bits on every host.
class InfraredShader {
 public:
  /// The world is copied; it need not outlive the shader, nor need the scene.
  InfraredShader(const InfraredLightConfig& light, const worlds::World& world, const Scene& scene,
                 const PinholeCamera& camera);

  /// What is seen from X_WC. Callable from any thread, one at a time.
  void draw(const Pose& X_WC, InfraredScene& out);

  static constexpr int kSamples = 2;  ///< along each axis of a pixel

  [[nodiscard]] const std::vector<Lamp>& lamps() const { return lamps_; }
  [[nodiscard]] const SunMap& sun() const { return sun_; }
  [[nodiscard]] const LightGrid& grid() const { return grid_; }
  /// Triangles of the samples of the last picture, kSamples width * kSamples height.
  [[nodiscard]] const std::vector<std::uint32_t>& triangles() const { return triangles_; }
  /// The pinhole of the samples.
  [[nodiscard]] const PinholeCamera& sample_camera() const { return fine_; }

 private:
  struct View {
    Vec3f eye_W;
    Vec3f right_W, down_W;  ///< the image's axes, unit
  };
  /// Light that comes from a triangle along a ray, of depth 1 in C, as a white surface's, lx.
  [[nodiscard]] float surface(const View& view, std::uint32_t triangle, const Vec3f& ray_W,
                              float inverse_depth) const;
  [[nodiscard]] float textured(const SurfaceFacet& facet, const Material& material, const Vec3f& p,
                               const Vec3f& ray_W, float z, float towards) const;
  /// Where a facet shows the eye which side, under what light from sky, lamps and surfaces.
  struct Side {
    Vec3f normal_W;
    Float8 near, far;  ///< weights of the side seen, and of the other
    float sun_lx = 0;  ///< where the sun reaches it
  };
  [[nodiscard]] Side side_of(const SurfaceFacet& facet, const Material& material,
                             bool from_behind) const;
  [[nodiscard]] float indirect(const Side& side, const Material& material, const Vec3f& p) const;
  /// Whether all samples of eight pixels show one triangle, which is no backdrop.
  [[nodiscard]] bool is_even(std::size_t first_sample) const;
  void eight_pixels(const View& view, const Vec3f& row_W, int u, std::size_t first_sample,
                    float* light, float* inverse_depth) const;
  [[nodiscard]] float pixel(const View& view, const Vec3f& row_W, int u, int v,
                            float& inverse_depth) const;

  PinholeCamera camera_, fine_;
  std::vector<Lamp> lamps_;
  SunMap sun_;
  LightGrid grid_;
  float sun_lx_ = 0;
  InfraredSurfaces surfaces_;
  Backdrop backdrop_;
  Renderer renderer_;
  float lamp_lx_ = 0, pixel_rad_ = 0, off_surface_m_ = 0;
  std::vector<float> column_x_;  ///< (u - cx) / fx
  std::vector<float> fine_inverse_depth_;
  std::vector<std::uint32_t> triangles_;
};

}  // namespace arex::sim
