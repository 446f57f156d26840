#pragma once

#include <array>
#include <deque>
#include <optional>

#include "autopilot/health_config.h"
#include "math/types.h"

namespace arex {

/// Finds the rotors that give less than they are told, without a word from the speed controllers.
///
/// What thrust and torque are missing, by the accelerometer and by what the rate loop has to add,
/// is shared out among the rotors by the inverse of the allocation. A weak rotor stands out alone.
/// A shifted centre of mass, drag and wind take from two at once, and a wrong mass from all four:
/// so what counts is the lowest against the second lowest. Of several weak rotors none need stand
/// out: each counts against what it gave before in this flight, which load and balance do not
/// change.
class MotorWatch {
 public:
  /// @param mix the allocation's inverse: wrench (thrust N, torque N m in B) to rotor thrusts
  /// @param weight_n of the vehicle
  MotorWatch(const MotorWatchConfig& config, const Eigen::Matrix4d& mix, double weight_n)
      : config_(config), mix_(mix), hover_n_(weight_n / 4) {}

  struct Missing {
    Vec4 steady = Vec4::Zero();   ///< wrench that a whole second of flight shows to be missing
    Vec4 at_once = Vec4::Zero();  ///< the same of this moment
  };
  /// @param dt_s since the last call in the air
  void update(const Missing& missing, double dt_s);
  /// The vehicle is not in the air: what was seen is forgotten.
  void reset();

  struct Finding {
    int motor = 0;        ///< 0..3, MotorCommand's order
    double fraction = 0;  ///< of a hovering rotor's thrust that is missing
    bool stopped = false;
  };
  /// What is new since the last call, one after the other.
  [[nodiscard]] std::optional<Finding> take();

  /// Of the steady shares, the lowest against the second lowest, over a hovering rotor's thrust.
  [[nodiscard]] double weakness() const;

 private:
  /// How long one motor has been the lowest by more than a limit.
  struct Suspicion {
    int motor = -1;
    double since_s = 0;
    std::array<bool, 4> told{};  ///< of each motor, once a flight
  };
  /// What a rotor usually gives, and for how long it has given less.
  struct Usual {
    Vec4 beyond_n = Vec4::Zero();
    double learnt_s = 0;
    std::array<double, 4> fallen_s{};
  };
  struct Lowest {
    int motor = 0;
    double fraction = 0;
  };
  [[nodiscard]] Lowest lowest(const Vec4& thrust_n) const;
  static bool grows(Suspicion& suspicion, const Lowest& lowest, double limit, double dt_s,
                    double needed_s);

  void compare_with_usual(double dt_s);

  static constexpr double kSteady_s = 1.0, kAtOnce_s = 0.03;  ///< time constants of the means

  MotorWatchConfig config_;
  Eigen::Matrix4d mix_;
  double hover_n_;
  Vec4 steady_n_ = Vec4::Zero(), at_once_n_ = Vec4::Zero();  ///< of each rotor, beyond its command
  Suspicion weak_, stopped_;
  Usual usual_;
  std::deque<Finding> findings_;
};

}  // namespace arex
