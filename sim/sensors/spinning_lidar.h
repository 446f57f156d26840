#pragma once

#include <optional>
#include <vector>

#include "math/pose.h"
#include "math/random.h"
#include "sensors/lidar_model.h"
#include "sensors/mid360_airframe.h"
#include "sensors/scene.h"

namespace arex::sim {

/// A LiDAR of lasers in a fan that turns about the sensor's z, by default a Velodyne VLP-16 (user
/// manual 63-9243).
struct SpinningLidarConfig {
  double rate_hz = 10;  ///< turns; a whole number of ticks each
  double latency_s = 0.003;
  int rings = 16;
  double lowest_deg = -15;
  double highest_deg = 15;
  int columns = 1800;        ///< of a turn
  double range_min_m = 0.5;  ///< nearer surfaces return nothing [E]
  double range_max_m = 100;
  double range_at_tenth_m = 50;        ///< at 10 % reflectivity [E]
  double range_sigma_m = 0.01;         ///< +- 3 cm typical accuracy, taken for three sigma
  double dropout_probability = 0.002;  ///< [E]
  bool noise_free = false;

  void fields(auto& f) {
    f("rate_hz", rate_hz, "turns");
    f("latency_s", latency_s, "end of a turn to its delivery");
    f("rings", rings, "lasers");
    f("lowest_deg", lowest_deg, "elevation of the first laser");
    f("highest_deg", highest_deg, "elevation of the last; the others evenly between");
    f("columns", columns, "firings of each laser in a turn");
    f("range_min_m", range_min_m, "nearer surfaces return nothing [E]");
    f("range_max_m", range_max_m, "whatever the reflectivity");
    f("range_at_tenth_m", range_at_tenth_m, "maximum range at 10 % reflectivity [E]");
    f("range_sigma_m", range_sigma_m, "noise of a range");
    f("dropout_probability", dropout_probability, "returns lost for no visible reason [E]");
    f("noise_free", noise_free, "exact ranges, every surface in range returns");
    f.check(rate_hz >= 1 && rate_hz <= 100, "1 <= rate_hz <= 100");
    f.check(!(rate_hz > 0) || from_seconds(1 / rate_hz) % kNanosecondsPerTick == 0,
            "1 / rate_hz a whole number of milliseconds");
    f.check(latency_s >= 0 && latency_s <= 60, "0 <= latency_s <= 60");
    f.check(rings >= 1 && rings <= 128, "1 <= rings <= 128");
    f.check(lowest_deg >= -90 && highest_deg <= 90 && lowest_deg <= highest_deg,
            "-90 <= lowest_deg <= highest_deg <= 90");
    f.check(columns >= 4 && columns <= 4096, "4 <= columns <= 4096");
    f.check(range_min_m > 0 && range_max_m > range_min_m && range_max_m <= 2000,
            "0 < range_min_m < range_max_m <= 2000");
    f.check(range_at_tenth_m > 0, "range_at_tenth_m > 0");
    f.check(range_sigma_m >= 0 && range_sigma_m <= 1, "0 <= range_sigma_m <= 1");
    f.check(dropout_probability >= 0 && dropout_probability <= 1, "0 <= dropout_probability <= 1");
  }
};

/// Firings follow one another at equal times: in column k, at azimuth -2 pi k / columns (clockwise
/// from above, as Velodyne's turn), the lasers from the lowest to the highest. `line` of a point is
/// its ring. One return of each, of an infinitely thin beam.
class SpinningLidar : public LidarModel {
 public:
  /// @param airframe_B the solids that it may see; X_WS is the pose in B
  SpinningLidar(const SpinningLidarConfig& config, const Scene& scene, const Pose& X_BL,
                const std::vector<worlds::CollisionShape>& airframe_B, std::uint64_t seed);

  [[nodiscard]] Stamp period() const override;
  [[nodiscard]] LidarScan scan(std::span<const Truth> ticks) const override;

 private:
  struct Firing;
  [[nodiscard]] Firing firing(std::int64_t number) const;
  [[nodiscard]] std::optional<LidarPoint> receive(const Firing& firing, const Ray& ray,
                                                  const RayHit& hit) const;

  SpinningLidarConfig config_;
  const Scene& scene_;
  Pose X_BL_;
  AirframeMask airframe_;
  std::vector<Vec3> fan_L_;  ///< the lasers of the first column, unit
  RandomStream stream_;
};

}  // namespace arex::sim
