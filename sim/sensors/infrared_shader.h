#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "jobs/split.h"
#include "math/pose.h"
#include "messages/sensors.h"
#include "sensors/infrared_backdrop.h"
#include "sensors/infrared_config.h"
#include "sensors/infrared_lamps.h"
#include "sensors/infrared_light.h"
#include "sensors/infrared_materials.h"
#include "sensors/infrared_projector.h"
#include "sensors/infrared_shot.h"
#include "sensors/infrared_sun.h"
#include "sensors/renderer.h"
#include "sensors/scene.h"
#include "worlds/world.h"

namespace arex::sim {

/// Draws a world as an infrared camera sees it.
///
/// The rasteriser finds the triangle of four samples in each pixel; what differs among them is
/// shaded for itself, what is the same once, and eight pixels of one triangle at a time; other
/// pixels' surfaces eight of one kind at a time. A surface
/// is its albedo with a procedural texture, under the sun where it shines, and under the baked
/// light of sky, lamps and other surfaces. All of it is sums, products, quotients and square roots
/// in a fixed order: the same bits on every host.
class InfraredShader {
 public:
  /// The world is copied; it need not outlive the shader, nor need the scene.
  /// @param strips that a picture may be drawn in; how many they are changes no bit
  InfraredShader(const InfraredLightConfig& light, const worlds::World& world, const Scene& scene,
                 const PinholeCamera& camera, int strips = 1);

  /// What is seen from X_WC, drawn in strips side by side. Callable from any thread, one at a time.
  /// @param projector_x_m where the projector stands along this eye's x axis
  void draw(const Pose& X_WC, InfraredScene& out, const Split& split = in_turn,
            double projector_x_m = DotProjector::kBesideLeftEye_m);

  static constexpr int kSamples = 2;  ///< along each axis of a pixel

  [[nodiscard]] const std::vector<Lamp>& lamps() const { return lamps_; }
  [[nodiscard]] const SunMap& sun() const { return sun_; }
  [[nodiscard]] const LightGrid& grid() const { return grid_; }
  /// The pinhole of the samples.
  [[nodiscard]] const PinholeCamera& sample_camera() const { return fine_; }
  /// How they are drawn.
  static RendererOptions renderer_options(const InfraredLightConfig& light, int strips = 1) {
    // Eight pixels are shaded together: strips begin where eights do.
    return {.far_m = light.draw_range_m,
            .least_leaf_px = kSamples * light.least_leaf_px,
            .least_width_px = kSamples * light.least_width_px,
            .strips = strips,
            .strip_align_px = 8 * kSamples};
  }

 private:
  struct View {
    Vec3f eye_W;
    Vec3f right_W, down_W, ahead_W;  ///< the camera's axes
    float projector_x_m = 0;
  };
  /// Rows of pixels that are shaded together: the rows of samples lie in the cache meanwhile.
  static constexpr int kBand = 2;

  /// Surfaces of one kind that pixels of a band show and whose light is still to be found.
  struct Queue {
    static constexpr std::size_t kCapacity = 64;
    std::size_t count = 0;
    std::array<float*, kCapacity> to;  ///< where their light goes
    std::array<std::uint32_t, kCapacity> triangle;
    std::array<std::array<float, kCapacity>, 3> ray_W;  ///< of depth 1 in C
    std::array<float, kCapacity> inverse_depth;

    void add(float* light, std::uint32_t of, const Vec3f& ray, float depth) {
      to[count] = light;
      triangle[count] = of;
      for (std::size_t k = 0; k < 3; ++k) ray_W[k][count] = ray[static_cast<Eigen::Index>(k)];
      inverse_depth[count++] = depth;
    }
    void fill_up();  ///< repeats the last until their number is one of eights
    [[nodiscard]] std::array<Float8, 3> rays(std::size_t first) const {
      return {load_eight(&ray_W[0][first]), load_eight(&ray_W[1][first]),
              load_eight(&ray_W[2][first])};
    }
  };
  /// A pixel of several surfaces, and in how many of its samples it shows which.
  struct Mixture {
    float* pixel;
    std::size_t surfaces = 0;
    std::array<float, 4> samples, light_lx;
  };
  /// Facets of eight triangles.
  struct EightFacets;

  /// A strip of the picture, and what shading it needs.
  struct Strip {
    std::size_t index = 0;                         ///< the renderer's
    std::size_t first = 0;                         ///< of its columns of pixels
    std::vector<float> column_x;                   ///< (u - cx) / fx
    std::array<std::vector<float>, 3> row_rays_W;  ///< of a row's pixels, of depth 1 in C
    std::vector<float> band_inverse_depth;         ///< of a band's samples
    std::vector<std::uint32_t> band_triangles;
    std::vector<Queue> queues;      ///< by kind, the last is the backdrop's
    std::vector<Mixture> mixtures;  ///< of a band
    std::size_t mixed = 0;          ///< of them
  };
  [[nodiscard]] Strip make_strip(std::size_t index) const;

  void draw_strip(const View& view, Strip& strip, InfraredScene& out);
  void draw_band(const View& view, Strip& strip, int v_first, InfraredScene& out) const;
  void add_dots(const View& view, const Strip& strip, int v, const float* depths,
                const std::uint32_t* triangles, InfraredScene& out) const;
  void draw_row(const View& view, Strip& strip, int v, const float* depths,
                const std::uint32_t* triangles, InfraredScene& out) const;
  void eight_pixels(const View& view, const Strip& strip, std::size_t u, std::uint32_t triangle,
                    const Float8& q, float* light) const;
  void split_pixel(const View& view, Strip& strip, const Vec3f& ray_W,
                   const std::array<std::uint32_t, 4>& seen, const std::array<float, 4>& q,
                   float* light) const;
  /// Notes a surface. @param light where its light goes
  void show(const View& view, std::vector<Queue>& queues, std::uint32_t triangle,
            const Vec3f& ray_W, float inverse_depth, float* light) const {
    std::size_t kind = backdrop_kind();
    if (triangle != Renderer::kNoTriangle) {
      kind = surfaces_.kind(triangle);
      __builtin_prefetch(&surfaces_.facet(triangle));  // nobody can guess which comes next
    }
    queues[kind].add(light, triangle, ray_W, inverse_depth);
    if (queues[kind].count == Queue::kCapacity) shade(view, queues, kind);
  }
  [[nodiscard]] std::size_t backdrop_kind() const { return surfaces_.kinds(); }
  void shade(const View& view, std::vector<Queue>& queues, std::size_t kind) const;
  /// Light of eight surfaces of a kind, from number `first` of its queue on, as white ones', lx.
  [[nodiscard]] Float8 eight_surfaces(const View& view, const Queue& queue, std::size_t kind,
                                      std::size_t first) const;
  [[nodiscard]] Float8 lit_alike(const EightFacets& facets, const Int8& from_behind) const;
  [[nodiscard]] Float8 lit_from_place_to_place(const Material& material, const EightFacets& facets,
                                               const Int8& from_behind,
                                               const std::array<Float8, 3>& p) const;
  /// What pixels cover of surfaces at depth z, m. @param squared of their rays' lengths
  [[nodiscard]] Float8 footprint_of(const Float8& z, const Float8& towards,
                                    const Float8& squared) const;
  static Float8 seam(const Float8& at, const Float8& spacing, const Float8& footprint);
  /// What a point of a surface is asked for the sun off it, along its normal on the side of the
  /// sun, m: more than its slope makes of a texel of the map.
  [[nodiscard]] float off_towards_sun() const { return static_cast<float>(2 * sun_.texel_m()); }

  PinholeCamera camera_, fine_;
  std::vector<Lamp> lamps_;
  SunMap sun_;
  LightGrid grid_;
  float sun_lx_ = 0;
  InfraredSurfaces surfaces_;
  Backdrop backdrop_;
  std::optional<DotProjector> projector_;
  Renderer renderer_;
  float lamp_lx_ = 0, pixel_rad_ = 0, off_surface_m_ = 0;
  std::vector<Strip> strips_;
};

}  // namespace arex::sim
