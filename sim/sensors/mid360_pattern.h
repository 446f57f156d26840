#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <string_view>

#include "math/types.h"

namespace arex::sim {

/// How the scanner's two rotations run.
enum class PatternMode : std::uint8_t {
  kDevice,  ///< the speeds, sense and orientation of a measured unit: never repeats in a mission
  kTable,   ///< the maker's published pattern table
};
inline const std::array<std::string_view, 2>& enum_names(PatternMode /*mode*/) {
  static constexpr std::array<std::string_view, 2> kNames{"device", "table"};
  return kNames;
}

/// Firing directions of the MID-360: a fast rotation psi and a slow one phi, four laser lines.
/// Point i leaves at i * 5 us from line k = i mod 4 of shot n = i div 4.
///
/// Unit vectors in L: z the dome's axis, elevation above the sensor's horizon. A pure function of
/// the firing's index: the phases are counted in integers of 1e-8 degrees and never drift.
/// Source: Fourier series fitted by least squares to all 800,000 rows of the maker's table, 4 s:
/// elevation 0.0105 deg RMS, azimuth * cos(el) 0.0070 deg RMS (the table's grid is 0.01 deg). A
/// unit that was read from its raw frames differs in its speeds, runs the other way round and is
/// turned about z.
class Mid360Pattern {
 public:
  static constexpr int kLines = 4;
  static constexpr Stamp kFiringPeriod = 5'000;  ///< ns
  static constexpr Stamp kShotPeriod = kLines * kFiringPeriod;
  static constexpr int kShotsPerTick = static_cast<int>(kNanosecondsPerTick / kShotPeriod);

  /// The four lines of one shot, side by side.
  struct Shot {
    Eigen::Array4d x, y, z;
  };

  /// About z, of the unit: its lines stack at azimuth 0 and 180 degrees, the table's at 90 and 270.
  static constexpr double kUnitTurn_deg = -89.5;

  /// @param turn_deg of the device about z; the table is as it was published
  explicit Mid360Pattern(PatternMode mode, double turn_deg = kUnitTurn_deg);

  /// Direction of one firing.
  [[nodiscard]] Vec3 direction(std::int64_t firing) const;

  /// Directions of consecutive shots, at most kShotsPerTick of them.
  void directions(std::int64_t first_shot, std::span<Shot> shots) const;

 private:
  /// Cosine and sine of an angle.
  struct Turn {
    double c = 1, s = 0;
    Turn operator*(const Turn& o) const { return {c * o.c - s * o.s, s * o.c + c * o.s}; }
  };
  /// An angle that grows by the same amount each shot.
  struct Phase {
    std::int64_t start = 0, rate = 0;       ///< 1e-8 deg, 1e-8 deg per shot
    std::array<Turn, kShotsPerTick> steps;  ///< of 0, 1, 2, ... shots
    [[nodiscard]] Turn at(std::int64_t shot) const;
  };
  static Turn turn_by(double angle_deg);
  static Phase make_phase(std::int64_t start, std::int64_t rate);
  [[nodiscard]] Shot shot_at(const Turn& phi, const Turn& psi) const;

  double handedness_;  ///< of the scan: +1 as the table, -1 mirrored in y
  Turn turn_;          ///< about z, after the mirror
  Phase phi_, psi_;
};

}  // namespace arex::sim
