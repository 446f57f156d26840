#include "physics/wind.h"

#include <cmath>

#include "math/so3.h"

namespace arex::sim {
namespace {

constexpr double kMetresPerFoot = 0.3048;

/// The integrals of s^k exp(-2 s) over [0, d], k = 0, 1, 2.
std::array<double, 3> noise_integrals(double d) {
  if (d < 1e-2) {  // the closed forms cancel
    return {d * (1 - d * (1 - d * (2.0 / 3 - d / 3))),
            d * d * (1.0 / 2 - d * (2.0 / 3 - d * (1.0 / 2 - d * 4 / 15))),
            d * d * d * (1.0 / 3 - d * (1.0 / 2 - d * (2.0 / 5 - d * 2 / 9)))};
  }
  const double e = std::exp(-2 * d);
  return {(1 - e) / 2, (1 - e * (1 + 2 * d)) / 4, (1 - e * (1 + 2 * d + 2 * d * d)) / 4};
}

}  // namespace

DrydenWind::Cascade::Cascade(double time_constant_s, RandomStream& random) {
  const double d = kSecondsPerTick / time_constant_s;
  decay = std::exp(-d);
  coupling = d * decay;
  const auto [q11, q12, q22] = noise_integrals(d);
  noise_11 = std::sqrt(q11);
  noise_21 = q12 / noise_11;
  noise_22 = std::sqrt(q22 - noise_21 * noise_21);
  // Stationary covariance: the integrals to infinity, 1/2, 1/4, 1/4.
  const double n1 = random.normal(), n2 = random.normal();
  x1 = std::sqrt(0.5) * n1;
  x2 = std::sqrt(0.125) * (n1 + n2);
}

void DrydenWind::Cascade::step(RandomStream& random) {
  const double n1 = random.normal(), n2 = random.normal();
  x2 = coupling * x1 + decay * x2 + noise_21 * n1 + noise_22 * n2;
  x1 = decay * x1 + noise_11 * n1;
}

DrydenWind::DrydenWind(const WindConfig& config, std::uint64_t seed)
    : mean_(config.mean_mps), random_(seed, "physics.wind") {
  const double speed = mean_.norm();
  gusty_ = speed > 0 && config.turbulence_scale > 0;
  if (gusty_) {
    if (mean_.head<2>().norm() > 0) R_W_gust_ = so3::from_yaw(std::atan2(mean_.y(), mean_.x()));
    const double h_ft = config.altitude_m / kMetresPerFoot;
    const double shape = 0.177 + 0.000823 * h_ft;
    const double sigma_w = 0.1 * speed * config.turbulence_scale;
    const double sigma_u = sigma_w / std::pow(shape, 0.4);
    const double length_u = h_ft / std::pow(shape, 1.2) * kMetresPerFoot;
    sigma_ = {sigma_u, sigma_u, sigma_w};
    time_ = Vec3(length_u, length_u, config.altitude_m) / speed;
    for (int axis = 0; axis < 3; ++axis) {
      filters_[static_cast<std::size_t>(axis)] = Cascade(time_[axis], random_);
    }
  }
  compose();
}

void DrydenWind::step() {
  if (!gusty_) return;
  for (Cascade& filter : filters_) filter.step(random_);
  compose();
}

void DrydenWind::compose() {
  // Longitudinal: sigma sqrt(2 T)/(1 + T s). Others: sigma sqrt(T) (1 + sqrt(3) T s)/(1 + T s)^2.
  const auto transverse = [](const Cascade& f) { return f.x2 + std::sqrt(3.0) * (f.x1 - f.x2); };
  const Vec3 gust(sigma_.x() * std::sqrt(2.0) * filters_[0].x1,
                  sigma_.y() * transverse(filters_[1]), sigma_.z() * transverse(filters_[2]));
  velocity_ = mean_ + R_W_gust_ * gust;
}

}  // namespace arex::sim
