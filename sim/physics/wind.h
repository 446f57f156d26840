#pragma once

#include <array>
#include <cstdint>

#include "math/random.h"
#include "math/types.h"
#include "physics/physics_config.h"

namespace arex::sim {

/// Mean wind with Dryden gusts, sampled every tick (1 ms).
///
/// Low-altitude scales and shaping filters of MIL-F-8785C, 3.7.2.2 and 3.7.3.4, with the mean wind
/// in the place of the wind at 20 ft and of the air speed: frozen turbulence that the mean wind
/// carries past a vehicle far slower than an aeroplane. Longitudinal gusts lie along the horizontal
/// mean wind. Each filter is discretised exactly, with the covariance of its noise integrated over
/// the tick, and starts in its stationary distribution.
class DrydenWind {
 public:
  DrydenWind(const WindConfig& config, std::uint64_t seed);

  /// Advances by one tick. Without mean wind or turbulence_scale there are no gusts.
  void step();

  /// Velocity of the air in W, m/s.
  [[nodiscard]] const Vec3& velocity() const { return velocity_; }
  /// Standard deviations of the gusts: along the wind, across, vertical, m/s.
  [[nodiscard]] const Vec3& gust_sigma() const { return sigma_; }
  /// Correlation times L/V of the same, s.
  [[nodiscard]] const Vec3& gust_time() const { return time_; }

 private:
  /// x1 = n/(1 + T s), x2 = x1/(1 + T s), unit-intensity noise n, both scaled by sqrt(T).
  struct Cascade {
    double decay = 0, coupling = 0;  ///< transition [[decay, 0], [coupling, decay]]
    double noise_11 = 0, noise_21 = 0, noise_22 = 0;  ///< Cholesky factor of one tick's noise
    double x1 = 0, x2 = 0;

    Cascade() = default;
    Cascade(double time_constant_s, RandomStream& random);
    void step(RandomStream& random);
  };
  void compose();

  Vec3 mean_ = Vec3::Zero();
  Mat3 R_W_gust_ = Mat3::Identity();
  Vec3 sigma_ = Vec3::Zero();
  Vec3 time_ = Vec3::Zero();
  bool gusty_ = false;
  std::array<Cascade, 3> filters_;
  RandomStream random_;
  Vec3 velocity_ = Vec3::Zero();
};

}  // namespace arex::sim
