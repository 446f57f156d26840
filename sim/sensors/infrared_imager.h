#pragma once

#include <cstdint>
#include <vector>

#include "jobs/split.h"
#include "messages/sensors.h"
#include "sensors/eight.h"
#include "sensors/infrared_config.h"
#include "sensors/infrared_shot.h"

namespace arex::sim {

/// Where the image of a point moves, px/s: of a standing point seen along the ray (x, y, 1) at
/// inverse depth q (1/m).
Vec2 image_velocity(const PinholeCamera& camera, const CameraTwist& twist, double x, double y,
                    double q);

/// Optics, shutter and pixels of one eye: from the light of a scene to grey values.
///
/// The scene is smeared along the way that each pixel's surface takes while the shutter is open,
/// spread by the optics, dimmed towards the corners; electrons come as photons do and are read with
/// noise. Gaussian for Poisson: 30 electrons make grey value 1.
class InfraredImager {
 public:
  InfraredImager(const InfraredSensorConfig& config, const PinholeCamera& camera);

  /// @param seed of this eye and frame
  /// @param grey resized to width * height
  void expose(const InfraredScene& scene, const InfraredExposure& exposure,
              const CameraTwist& twist, std::uint64_t seed, std::vector<std::uint8_t>& grey,
              const Split& split = in_turn);

  /// The smeared and spread light that the pixels of the last frame received, lx.
  [[nodiscard]] const std::vector<float>& received() const { return spread_; }

 private:
  /// Rows from the first up to the end.
  struct Rows {
    int first = 0, end = 0;
  };
  /// How far images of a row's surfaces go while the shutter is open, px.
  struct Ways {
    std::vector<float> u, v;
  };
  [[nodiscard]] Rows rows_of(std::size_t piece) const;
  void smear(const InfraredScene& scene, double exposure_s, const CameraTwist& twist,
             const Rows& rows);
  void smear_row(const InfraredScene& scene, double exposure_s, const CameraTwist& twist, int v,
                 Ways& ways);
  void find_ways(const InfraredScene& scene, int v, double exposure_s, const CameraTwist& twist,
                 Ways& ways) const;
  [[nodiscard]] float mean_along(const std::vector<float>& in, int u, int v, float du,
                                 float dv) const;
  [[nodiscard]] Float8 mean_along_eight(const std::vector<float>& in, int u, int v,
                                        const Ways& ways) const;
  void spread_along_rows(const Rows& rows);
  void spread_along_columns(const Rows& rows);
  void read(const InfraredExposure& exposure, std::uint64_t seed, const Rows& rows,
            std::vector<std::uint8_t>& grey) const;

  InfraredSensorConfig config_;
  PinholeCamera camera_;
  std::vector<float> vignette_;  ///< share of the light that comes through, of each pixel
  std::vector<float> column_x_;  ///< (u - cx) / fx
  std::vector<float> smeared_, rows_, spread_;
};

}  // namespace arex::sim
