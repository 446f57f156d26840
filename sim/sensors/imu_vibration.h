#pragma once

#include <array>
#include <cstdint>
#include <string_view>

#include "math/random.h"
#include "math/types.h"

namespace arex::sim {

/// How strongly the vehicle shakes, each as a recorded one.
enum class VibrationLevel : std::uint8_t {
  kNone,     ///< rotors shake nothing
  kSmooth,   ///< an AscTec Firefly hexacopter with a damped sensor (EuRoC)
  kTypical,  ///< a Cube Orange quadrotor's strength; spectra midway between the other two's
  kRough,    ///< an F450 kit quadrotor with an fmu-v5 flown hard (PX4 log)
};
inline const std::array<std::string_view, 4>& enum_names(VibrationLevel /*level*/) {
  static constexpr std::array<std::string_view, 4> kNames{"none", "smooth", "typical", "rough"};
  return kNames;
}

/// What the rotors shake into the autopilot.
struct VibrationConfig {
  VibrationLevel level = VibrationLevel::kTypical;
  double scale = 1;                    ///< of all amplitudes of the level
  double reference_speed_radps = 716;  ///< rotor speed of the level's amplitudes: hover

  void fields(auto& f) {
    f("level", level,
      "as a recorded vehicle: smooth EuRoC's Firefly, rough an F450, typical between");
    f("scale", scale, "of all amplitudes of the level");
    f("reference_speed_radps", reference_speed_radps, "rotor speed of the amplitudes: hover");
    f.check(scale >= 0 && scale <= 100, "0 <= scale <= 100");
    f.check(reference_speed_radps > 0, "reference_speed_radps > 0");
  }
};

/// Of one axis at the reference speed: m/s^2 or rad/s. Densities are one-sided, per sqrt(Hz).
struct AxisVibration {
  static constexpr std::size_t kModes = 3;

  double wash = 0;                     ///< density of the propellers' wash, above 3 Hz
  std::array<double, kModes> modes{};  ///< densities at the middle of the structure's modes
  double once_per_rev = 0;             ///< peak of four rotors' unbalance, if they kept in step
  double twice_per_rev = 0;            ///< peak at blade pass likewise
};

/// Accelerometer x, y, z, then gyro x, y, z.
using VibrationSpectrum = std::array<AxisVibration, 6>;
[[nodiscard]] const VibrationSpectrum& vibration_spectrum(VibrationLevel level);

/// Broadband shaking from propeller wash, bare and through three modes of the structure, and lines
/// at once and twice each rotor's own speed. All grow with thrust, that is with the square of the
/// speed; what does not turn does not shake. The spectra vanish below 3 Hz, for an airframe that is
/// shaken stays where it is: neither velocity nor attitude drifts by it, nor by how thrust changes.
///
/// The four rotors turn at different speeds, so their lines beat. Their unbalances differ; squared
/// they sum to one, as the level's amplitudes mean.
class VibrationModel {
 public:
  struct Shake {
    Vec3 accel_mps2 = Vec3::Zero();
    Vec3 gyro_radps = Vec3::Zero();
  };

  VibrationModel(const VibrationConfig& config, std::uint64_t seed);

  /// The next tick's vibration, in B.
  Shake step(const std::array<double, 4>& rotor_radps);

 private:
  static constexpr std::size_t kAxes = 6, kRotors = 4;
  using Six = Eigen::Matrix<double, 6, 1>;

  /// Second-order sections of all six axes side by side, direct form I.
  struct Shaper {
    double b0 = 0, b1 = 0, b2 = 0, a1 = 0, a2 = 0;
    Six gain = Six::Zero();
    Six x1 = Six::Zero(), x2 = Six::Zero(), y1 = Six::Zero(), y2 = Six::Zero();
    Six filter(const Six& force);
  };
  static Shaper wash_shaper();
  static Shaper mode_shaper(double frequency_hz, double damping);
  Six broadband(double thrust);
  Six lines(const std::array<double, kRotors>& rotor_radps);

  VibrationConfig config_;
  const VibrationSpectrum& spectrum_;
  RandomStream stream_;
  std::array<Shaper, 1 + AxisVibration::kModes> shapers_;
  std::array<double, kRotors> unbalance_{};  ///< squares sum to 1
  /// Cosine and sine of a line's phase against its rotor.
  std::array<std::array<std::array<double, 2>, kAxes>, kRotors> phase_{};
  std::array<double, kRotors> angle_rad_{};  ///< of the rotors
};

}  // namespace arex::sim
