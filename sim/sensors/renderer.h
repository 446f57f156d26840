#pragma once

#include <cstddef>
#include <cstdint>
#include <limits>
#include <memory>
#include <vector>

#include "math/pose.h"
#include "messages/sensors.h"
#include "worlds/world.h"

namespace arex::sim {

struct RendererOptions {
  double near_m = 0.02;  ///< nothing closer is drawn
  double far_m = 12.0;   ///< nothing deeper is drawn
  bool cull = true;      ///< draw only the chunks that may be seen; off, for tests
  /// Leaves that would look smaller, as squares of this side, are merged into fewer and larger
  /// ones; 0: never (DetailOfMesh).
  double least_leaf_px = 0;
  /// Solids that would look thinner are left out; 0: none.
  double least_width_px = 0;
  /// What surfaces are drawn in, side by side, each as wide as the others but for the last; strips
  /// begin at multiples of strip_align_px. How many they are changes no bit.
  int strips = 1;
  int strip_align_px = 1;
};

/// What a pinhole camera sees of a world: a depth rasteriser on the CPU.
///
/// Which triangles a pixel's centre ray passes, and how deep, is decided in double precision by
/// additions, multiplications and comparisons whose results IEEE 754 fixes: the same bits on every
/// host, whatever its graphics. The edge of two triangles is one line, whichever of them asks, so
/// that a closed surface has no holes; and the nearest surface wins whatever is drawn first.
///
/// Source: Olano and Greer, Triangle scan conversion using 2D homogeneous coordinates, 1997: edges
/// are planes through the eye, so that nothing is clipped, in front of the eye or beside it.
class Renderer {
 public:
  static constexpr const char* kName = "rasterizer in double precision";  ///< in a run's summary

  struct Statistics {
    std::size_t chunks = 0;
    std::size_t triangles = 0;  ///< what lies in two strips counts twice
  };

  /// The world must outlive the renderer: what is looked at first is prepared then.
  Renderer(const worlds::World& world, const PinholeCamera& camera, const RendererOptions& options);
  Renderer(worlds::World&&, const PinholeCamera&, const RendererOptions&) = delete;
  ~Renderer();

  /// 1/z of the nearest surface in each pixel (1/m; z the depth in C), rows from the top, 0 where
  /// there is nothing up to far_m. Linear across the image of a plane; exact to single precision.
  /// `out` is resized. Callable from any thread, one at a time.
  void render_inverse_depth(const Pose& X_WC, std::vector<float>& out);

  static constexpr std::uint32_t kNoTriangle = std::numeric_limits<std::uint32_t>::max();
  /// The same with the triangle that is seen: indices into Mesh::triangles, kNoTriangle where there
  /// is nothing. Of two in the same place it is the one drawn first, which the pose decides.
  void render_triangles(const Pose& X_WC, std::vector<float>& inverse_depth,
                        std::vector<std::uint32_t>& triangles);
  /// The same in strips, for who wants to read it row by row. Find what is visible first, then draw
  /// the strips; those may be drawn and read from several threads, each from one at a time. What is
  /// drawn stays until the next picture.
  void find_visible(const Pose& X_WC);
  void draw_strip(std::size_t strip);
  /// The columns of a strip.
  struct Columns {
    int first = 0, count = 0;
  };
  [[nodiscard]] std::size_t strips() const;
  [[nodiscard]] Columns columns(std::size_t strip) const;
  /// Of a drawn strip, `count` rows from v on, one behind the other.
  void read_rows(std::size_t strip, int v, int count, float* inverse_depth,
                 std::uint32_t* triangles) const;

  /// What the last frame drew.
  [[nodiscard]] Statistics last_frame() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace arex::sim
