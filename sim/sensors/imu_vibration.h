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
  double frame_mode_hz = 80;           ///< [E] plate with arms and IMU against the load
  double frame_mode_damping = 0.03;    ///< [E]
  double frame_coupling = 0;           ///< 0 stiff frame, else inertia of load over plate

  void fields(auto& f) {
    f("level", level,
      "as a recorded vehicle: smooth EuRoC's Firefly, rough an F450, typical between");
    f("scale", scale, "of all amplitudes of the level");
    f("reference_speed_radps", reference_speed_radps, "rotor speed of the amplitudes: hover");
    f("frame_mode_hz", frame_mode_hz, "mode of the plate with arms and IMU against the load [E]");
    f("frame_mode_damping", frame_mode_damping, "its damping ratio [E]");
    f("frame_coupling", frame_coupling, "0 stiff frame, else inertia of load over plate");
    f.check(scale >= 0 && scale <= 100, "0 <= scale <= 100");
    f.check(reference_speed_radps > 0, "reference_speed_radps > 0");
    f.check(frame_mode_hz > 0 && frame_mode_hz < 500, "0 < frame_mode_hz < 500");
    f.check(frame_mode_damping > 0 && frame_mode_damping < 1, "0 < frame_mode_damping < 1");
    f.check(frame_coupling >= 0, "frame_coupling >= 0");
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
/// shaken stays where it is: neither velocity nor attitude drifts by it.
///
/// The four rotors turn at different speeds, so their lines beat. Their unbalances differ; squared
/// they sum to one, as the level's amplitudes mean.
///
/// A weak frame is two inertias on a spring: the plate that carries arms and IMU, which the rotors
/// turn (J1), and the load (J2). A torque that gives the whole the angular acceleration alpha turns
/// the plate, beside the rigid motion, by (J2/J1) q with q'' + 2 z w q' + w^2 q = alpha. The
/// rotors' torques are in alpha, so the rate loop excites the mode that it hears.
class VibrationModel {
 public:
  struct Shake {
    Vec3 accel_mps2 = Vec3::Zero();
    Vec3 gyro_radps = Vec3::Zero();
  };

  VibrationModel(const VibrationConfig& config, std::uint64_t seed);

  /// The next tick's vibration, in B.
  /// @param alpha_B true angular acceleration of the airframe, rad/s^2, which drives the frame's
  /// mode.
  Shake step(const std::array<double, 4>& rotor_radps, const Vec3& alpha_B);

 private:
  static constexpr std::size_t kAxes = 6, kRotors = 4;
  using Six = Eigen::Matrix<double, 6, 1>;

  /// Second-order sections of all six axes side by side, direct form I.
  struct Shaper {
    double b0 = 0, b1 = 0, b2 = 0, a1 = 0, a2 = 0;
    Six gain = Six::Zero();
    Six x1 = Six::Zero(), x2 = Six::Zero(), y1 = Six::Zero(), y2 = Six::Zero();
    Six filter(const Six& white);
  };
  struct Lines {
    Six value = Six::Zero();
    Vec3 gyro_rate = Vec3::Zero();  ///< time derivative of the gyro's, rad/s^2
  };
  static Shaper wash_shaper();
  static Shaper mode_shaper(double frequency_hz, double damping);
  Six broadband();
  Lines lines(const std::array<double, kRotors>& rotor_radps);
  void rock(const Vec3& alpha_B);

  VibrationConfig config_;
  const VibrationSpectrum& spectrum_;
  RandomStream stream_;
  std::array<Shaper, 1 + AxisVibration::kModes> shapers_;
  std::array<double, kRotors> unbalance_{};  ///< squares sum to 1
  /// Cosine and sine of a line's phase against its rotor.
  std::array<std::array<std::array<double, 2>, kAxes>, kRotors> phase_{};
  std::array<double, kRotors> angle_rad_{};  ///< of the rotors
  // Angle and rate q of the frame's mode, about each axis, and their exact
  // propagation over one tick under a constant angular acceleration.
  Vec3 mount_angle_ = Vec3::Zero();
  Vec3 mount_rate_ = Vec3::Zero();
  Eigen::Matrix2d transition_;
  Eigen::Vector2d input_;
};

}  // namespace arex::sim
