#pragma once

#include <vector>

#include "sensors/lidar_model.h"
#include "sensors/scene.h"

namespace arex::sim {

struct SurveyConfig {
  double rate_hz = 5;
  double range_m = 12;
  double spacing_m = 0.1;
  double height_m = 8;
  double latency_s = 0;

  void fields(auto& f) {
    f("rate_hz", rate_hz, "frames; a whole number of ticks each");
    f("range_m", range_m, "surfaces up to here are reported");
    f("spacing_m", spacing_m, "of the points on a surface: at most one in each cube of this edge");
    f("height_m", height_m, "surfaces higher than this above the ground are left out");
    f("latency_s", latency_s, "the moment of a frame to its delivery");
    f.check(rate_hz >= 1 && rate_hz <= 50, "1 <= rate_hz <= 50");
    f.check(!(rate_hz > 0) || from_seconds(1 / rate_hz) % kNanosecondsPerTick == 0,
            "1 / rate_hz a whole number of milliseconds");
    f.check(range_m >= 1 && range_m <= 100, "1 <= range_m <= 100");
    f.check(spacing_m >= 0.05 && spacing_m <= 1, "0.05 <= spacing_m <= 1");
    f.check(height_m > 0 && height_m <= 100, "0 < height_m <= 100");
    f.check(latency_s >= 0 && latency_s <= 60, "0 <= latency_s <= 60");
  }
};

/// What a surveyor with the world's plans would report, for ablations: the oracle of the maps. At
/// one moment of each frame, without noise and without a blind zone, a return from every known
/// surface point in range that is in sight, all around. What hides behind something is not
/// reported: an exploration still has to go there.
class SurveyLidar : public LidarModel {
 public:
  /// @param points_W of the surfaces of the scene's world, spacing_m apart
  /// @param X_BS the mount; what is in sight is so from here
  SurveyLidar(const SurveyConfig& config, const Scene& scene, std::vector<Vec3f> points_W,
              const Pose& X_BS);

  [[nodiscard]] Stamp period() const override;
  [[nodiscard]] LidarScan scan(std::span<const Truth> ticks, Stamp frame_begin = 0) const override;
  [[nodiscard]] LidarScan frame(Stamp begin, Stamp end,
                                std::span<const LidarScan> parts) const override;

 private:
  [[nodiscard]] std::vector<Vec3f> points_near(const Vec3& p_W) const;

  SurveyConfig config_;
  const Scene& scene_;
  Pose X_BS_;
  // The points in columns of kTile_m, so that those in range are found.
  std::vector<Vec3f> points_W_;
  std::vector<std::size_t> first_of_tile_;  ///< one more than there are tiles
  Vec2 low_ = Vec2::Zero();
  Eigen::Vector2i tiles_ = Eigen::Vector2i::Zero();
};

}  // namespace arex::sim
