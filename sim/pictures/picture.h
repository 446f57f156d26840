#pragma once

#include <cstdint>
#include <filesystem>
#include <limits>
#include <memory>
#include <numbers>
#include <vector>

#include "files/png.h"
#include "math/pose.h"
#include "messages/sensors.h"
#include "worlds/world.h"

/// Colour pictures of a world, for people: `arex render`, reports, the README.
namespace arex::sim {

using Picture = RgbImage;

/// @throws std::runtime_error if the file cannot be written.
void save_png(const Picture& picture, const std::filesystem::path& file);

struct PictureOptions {
  int width = 1280;
  int height = 720;
  double field_of_view_rad = 70.0 / 180.0 * std::numbers::pi;  ///< across the width
  double visibility_m = 220;  ///< the haze has swallowed 63 % of a surface this far away
  /// Surfaces above this height in W are left out, and the sun shines in: a look under the ceiling.
  double cut_above_m = std::numeric_limits<double>::infinity();
  enum class Light : std::uint8_t {
    kAutomatic,  ///< headlight if the world has a ceiling that is not cut away
    kSun,
    kSunAndHeadlight,  ///< the sun where it reaches, and a lamp at the camera
  } light = Light::kAutomatic;

  bool operator==(const PictureOptions&) const = default;
};

/// Things drawn into the world.
struct PictureOverlay {
  struct Path {
    std::vector<Vec3> points_W;
    Vec3 colour{0.95, 0.25, 0.1};  ///< linear red, green, blue, 0..1
    double radius_m = 0.03;
  };
  std::vector<Path> paths;
  std::vector<Pose> vehicles;  ///< X_WB of each
};

/// A camera at `eye` that looks at `target`, its image upright. @pre not straight up or down.
Pose look_at(const Vec3& eye, const Vec3& target);

/// Draws one world from as many places as wanted. Callable from any thread.
class PictureRenderer {
 public:
  /// The world is copied; it need not outlive this.
  explicit PictureRenderer(const worlds::World& world);
  ~PictureRenderer();

  /// Camera frame C: z forward, x right, y down. A view that is the same as the one before costs
  /// its overlay only.
  [[nodiscard]] Picture render(const Pose& X_WC, const PictureOptions& options = {},
                               const PictureOverlay& overlay = {});

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

/// One picture of a world; for several, keep a PictureRenderer.
Picture render_picture(const worlds::World& world, const Pose& X_WC,
                       const PictureOptions& options = {}, const PictureOverlay& overlay = {});

}  // namespace arex::sim
