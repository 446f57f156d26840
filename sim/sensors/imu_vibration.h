#pragma once

#include <array>
#include <cstdint>

#include "math/random.h"
#include "math/types.h"

namespace arex::sim {

/// What the rotors shake into the autopilot. Amplitudes at hover, all growing with the square of
/// the rotor speed.
struct VibrationConfig {
  double once_per_rev_mps2 = 2.0;      ///< [E] peak, unbalance turning in the rotor plane
  double blade_pass_mps2 = 1.0;        ///< [E] peak, thrust ripple of two blades along z
  double broadband_mps2 = 0.3;         ///< [E] RMS of each axis, white up to 500 Hz
  double gyro_radps = 0.03;            ///< [E] peak, once per revolution about x and y
  double reference_speed_radps = 716;  ///< rotor speed of those amplitudes: hover
  double frame_mode_hz = 80;           ///< [E] plate with arms and IMU against the load
  double frame_mode_damping = 0.03;    ///< [E]
  double frame_coupling = 0;           ///< 0 stiff frame, else inertia of load over plate

  void fields(auto& f) {
    f("once_per_rev_mps2", once_per_rev_mps2, "peak at hover, once per revolution, x and y [E]");
    f("blade_pass_mps2", blade_pass_mps2, "peak at hover, twice per revolution, along z [E]");
    f("broadband_mps2", broadband_mps2, "RMS of each axis at hover [E]");
    f("gyro_radps", gyro_radps, "peak at hover, once per revolution, about x and y [E]");
    f("reference_speed_radps", reference_speed_radps, "rotor speed of those amplitudes: hover");
    f("frame_mode_hz", frame_mode_hz, "mode of the plate with arms and IMU against the load [E]");
    f("frame_mode_damping", frame_mode_damping, "its damping ratio [E]");
    f("frame_coupling", frame_coupling, "0 stiff frame, else inertia of load over plate");
    f.check(once_per_rev_mps2 >= 0, "once_per_rev_mps2 >= 0");
    f.check(blade_pass_mps2 >= 0, "blade_pass_mps2 >= 0");
    f.check(broadband_mps2 >= 0, "broadband_mps2 >= 0");
    f.check(gyro_radps >= 0, "gyro_radps >= 0");
    f.check(reference_speed_radps > 0, "reference_speed_radps > 0");
    f.check(frame_mode_hz > 0 && frame_mode_hz < 500, "0 < frame_mode_hz < 500");
    f.check(frame_mode_damping > 0 && frame_mode_damping < 1, "0 < frame_mode_damping < 1");
    f.check(frame_coupling >= 0, "frame_coupling >= 0");
  }
};

/// A weak frame is two inertias on a spring: the plate that carries arms and IMU, which the rotors
/// turn (J1), and the load (J2). A torque that gives the whole the angular acceleration alpha turns
/// the plate, beside the rigid motion, by (J2/J1) q with q'' + 2 z w q' + w^2 q = alpha. The
/// rotors' torques are in alpha, so the rate loop excites the mode that it hears.
///
/// The four rotors turn at slightly different speeds, so their lines beat. Each contributes half of
/// the configured amplitude: four incoherent halves have the RMS of one whole.
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
  void rock(const Vec3& alpha_B);

  VibrationConfig config_;
  RandomStream stream_;
  std::array<double, 4> phase_rad_{};
  // Angle and rate q of the frame's mode, about each axis, and their exact
  // propagation over one tick under a constant angular acceleration.
  Vec3 mount_angle_ = Vec3::Zero();
  Vec3 mount_rate_ = Vec3::Zero();
  Eigen::Matrix2d transition_;
  Eigen::Vector2d input_;
};

}  // namespace arex::sim
