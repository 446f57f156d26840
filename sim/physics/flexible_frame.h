#pragma once

#include <array>
#include <cstdint>

#include "math/types.h"
#include "physics/airframe.h"
#include "physics/truth.h"

namespace arex::sim {

/// How the airframe gives way. As made it is stiff.
struct FrameConfig {
  double load_ratio = 0;             ///< 0 stiff; else of the load's inertia (mass) to the plate's
  double mode_hz = 80;               ///< [E]
  double mode_damping = 0.03;        ///< [E] carbon plates, bolted
  double unbalance_n = 1.0;          ///< [E] 13 g propeller, 0.15 mm off its axis at 716 rad/s
  double unbalance_height_m = 0.03;  ///< [E] of the propellers above the centre of mass
  double reference_speed_radps = 716;  ///< hover

  void fields(auto& f) {
    f("load_ratio", load_ratio,
      "0 stiff frame; else inertia and mass of the load (battery, computer) over those of the "
      "plate "
      "with arms, IMU, LiDAR and camera, which gives way against it");
    f("mode_hz", mode_hz, "at which the plate swings against the load [E]");
    f("mode_damping", mode_damping, "its damping ratio [E]");
    f("unbalance_n", unbalance_n, "centrifugal force of each propeller at the reference speed [E]");
    f("unbalance_height_m", unbalance_height_m, "of the propellers above the centre of mass [E]");
    f("reference_speed_radps", reference_speed_radps, "rotor speed of that force: hover");
    f.check(load_ratio >= 0 && load_ratio <= 100, "0 <= load_ratio <= 100");
    f.check(mode_hz >= 1 && mode_hz < 500, "1 <= mode_hz < 500");
    f.check(mode_damping > 0 && mode_damping < 1, "0 < mode_damping < 1");
    f.check(unbalance_n >= 0, "unbalance_n >= 0");
    f.check(unbalance_height_m >= 0, "unbalance_height_m >= 0");
    f.check(reference_speed_radps > 0, "reference_speed_radps > 0");
  }
};

/// A frame that is not stiff: the plate with arms, rotors and all that senses (IMU, LiDAR, camera)
/// swings against the load on a spring.
///
/// A force that gives the whole the acceleration a moves the plate, beside the rigid motion, by
/// r q, r the load over the plate, with q'' + 2 z w q' + w^2 q = a; likewise about each axis with
/// the angular acceleration. For two bodies on one spring this is exact, and the whole moves as if
/// it were stiff. The forces are those of the rigid body's own motion, the rotors' torques among
/// them, so that the rate loop drives the mode that its gyro hears; and the unbalance of the
/// propellers, whose centrifugal forces turn with them.
///
/// Source: Meirovitch, Fundamentals of Vibrations, 2001, chapter 5 (two degrees of freedom).
class FlexibleFrame {
 public:
  FlexibleFrame(const FrameConfig& config, const Airframe& airframe, std::uint64_t seed);

  [[nodiscard]] bool stiff() const { return config_.load_ratio == 0; }

  /// Advances by the tick that ended in `rigid`. @pre successive ticks
  void step(const Truth& rigid);

  /// The motion of the plate: of B's frame as the sensors see it.
  [[nodiscard]] const Truth& plate() const { return plate_; }
  /// The same a tick before.
  [[nodiscard]] const Truth& plate_before() const { return plate_before_; }

 private:
  /// One mode about or along the three axes of B: q and its rate.
  struct Mode {
    Vec3 value = Vec3::Zero(), rate = Vec3::Zero();
  };
  /// Acceleration and angular acceleration in B.
  struct Drive {
    Vec3 linear = Vec3::Zero(), angular = Vec3::Zero();
  };
  [[nodiscard]] Drive unbalance(const std::array<double, 4>& rotor_radps);
  void swing(Mode& mode, const Vec3& drive) const;
  void move_plate(const Truth& rigid);

  FrameConfig config_;
  std::array<Vec3, 4> p_BR_;
  double mass_kg_;
  Mat3 inverse_inertia_;
  std::array<double, 4> angle_rad_{};  ///< of the unbalances
  Mode turn_, shift_;
  // Exact propagation over one tick under a constant acceleration.
  Eigen::Matrix2d transition_;
  Eigen::Vector2d input_;
  Truth plate_, plate_before_;
  bool begun_ = false;
};

}  // namespace arex::sim
