#pragma once

#include <array>
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
  /// Surfaces that pixels of a row show and whose light is still to be found.
  struct Queue {
    std::vector<std::uint32_t> slot;  ///< where their light goes
    std::vector<std::uint32_t> triangle;
    std::array<std::vector<float>, 3> ray_W;  ///< of depth 1 in C
    std::vector<float> inverse_depth;

    void add(std::uint32_t to, std::uint32_t of, const Vec3f& ray, float depth);
    void fill_up();  ///< repeats the last until their number is one of eights
    void clear();
  };
  /// What a pixel shows, and in how many of its samples; its light stands in four slots.
  struct Mixture {
    int surfaces = 0;
    std::array<float, 4> samples{};
  };
  /// Where a facet shows the eye which side, under what light from sky, lamps and surfaces.
  struct Side {
    Vec3f normal_W;
    Float8 near, far;  ///< weights of the side seen, and of the other
    float sun_lx;      ///< where the sun reaches it
  };
  [[nodiscard]] Side side_of(const SurfaceFacet& facet, const Material& material,
                             bool from_behind) const;
  [[nodiscard]] float indirect(const Side& side, const Material& material, const Vec3f& p) const;
  /// Whether all samples of eight pixels show one triangle, which is no backdrop.
  [[nodiscard]] bool is_even(std::size_t first_sample) const;
  void eight_pixels(const View& view, const Vec3f& row_W, int u, std::size_t first_sample,
                    float* light, float* inverse_depth) const;
  void split_pixel(const View& view, const Vec3f& row_W, int u, int v, float& inverse_depth);
  [[nodiscard]] Float8 eight_surfaces(const View& view, std::size_t first) const;
  void shade_queues(const View& view);
  [[nodiscard]] float mixed(int u) const;
  /// What pixels cover of surfaces at depth z, m. @param squared of their rays' lengths
  [[nodiscard]] Float8 footprint_of(const Float8& z, const Float8& towards,
                                    const Float8& squared) const;
  static Float8 seam(const Float8& at, const Float8& spacing, const Float8& footprint);
  /// What a point of a surface of unit normal n, of either side, is asked for the sun off it: more
  /// than its slope makes of a texel of the map.
  [[nodiscard]] Vec3f off_towards_sun(const Vec3f& n) const;

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
  Queue surface_queue_, backdrop_queue_;
  std::vector<Mixture> mixtures_;    ///< of a row's pixels
  std::vector<float> scattered_lx_;  ///< four slots for each
};

}  // namespace arex::sim
