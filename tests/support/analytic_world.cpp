#include "support/analytic_world.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

namespace arex::test {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr double kMaxRange = 40;
constexpr double kPi = std::numbers::pi;

/// Direction of the MID-360's firing i in L, device mode.
Vec3 firing_direction(std::int64_t i) {
  const double k = static_cast<double>(i % 4), n = static_cast<double>(i / 4);
  const double s = 2 * k - 3;
  const auto radians = [](double degrees) { return std::fmod(degrees, 360.0) * kPi / 180; };
  const double phi = radians(0.0712760 * n - 0.5811), psi = radians(-1.3037986 * n + 269.3687);
  const double c1 = std::cos(phi), c2 = std::cos(2 * phi), c3 = std::cos(3 * phi);
  const double s1 = std::sin(phi), s2 = std::sin(2 * phi), s3 = std::sin(3 * phi);
  const double sp = s * std::sin(psi), cp = s * std::cos(psi);
  const double X = .841105 - .149469 * c1 - .006457 * c2 - .013360 * c3 +
                   sp * (-.006298 - .008555 * c1 - .001854 * c2) -
                   cp * (.008757 * s1 + .001364 * s2);
  const double Y = .441196 * s1 - .000309 * s2 + .029662 * s3 +
                   sp * (-.000009 * s1 + .002280 * s2) -
                   cp * (-.015054 + .000084 * c1 + .002295 * c2);
  const double Z = .334269 + .373870 * c1 + .000328 * c2 + .031313 * c3 +
                   sp * (.014109 - .000554 * c1 + .002253 * c2) -
                   cp * (.000678 * s1 - .002274 * s2);
  const Vec3 d = Eigen::AngleAxisd(psi, Vec3::UnitZ()) * Vec3(X, Y, Z);
  return Vec3(d.x(), -d.y(), d.z()).normalized();
}

}  // namespace

SensorNoise SensorNoise::none() { return {0, 0, 0, 0, 0, Vec3::Zero(), Vec3::Zero()}; }

AnalyticWorld AnalyticWorld::forest(std::uint64_t seed, double length_x_m, double length_y_m) {
  AnalyticWorld world;
  world.has_ground_ = true;
  world.ground_z_ = -0.14;
  world.roughness_m_ = 0.12;
  RandomStream random(seed, "analytic forest");
  const double a = 0.5 * length_x_m, b = 0.5 * length_y_m;
  while (world.cylinders_.size() < 120) {
    const Vec2 c(random.uniform(-a - 15, a + 15), random.uniform(-15, 2 * b + 15));
    const double radius = random.uniform(0.1, 0.3);
    const double ellipse = std::hypot(c.x() / a, (c.y() - b) / b);
    const bool near_path = std::abs(ellipse - 1) * std::min(a, b) < 2 || c.norm() < 2.5;
    if (!near_path) world.cylinders_.push_back({c, radius, -1, random.uniform(4, 9)});
  }
  return world;
}

AnalyticWorld AnalyticWorld::hall() {
  AnalyticWorld world;
  world.boxes_.push_back({{-15, -6, -0.14}, {15, 14, 3.86}, true});
  for (int i = -1; i <= 1; ++i) {
    for (int j = 0; j <= 1; ++j) {
      const Vec3 c(9.0 * i + 1.5, 7.0 * j + 1.2 - 4.0 * (1 - j), 0);
      world.boxes_.push_back({c + Vec3(-0.3, -0.3, -1), c + Vec3(0.3, 0.3, 4), false});
    }
  }
  return world;
}

AnalyticWorld AnalyticWorld::plain() {
  AnalyticWorld world;
  world.has_ground_ = true;
  world.ground_z_ = -0.14;
  return world;
}

AnalyticWorld AnalyticWorld::parked_car() {
  AnalyticWorld world = plain();
  world.boxes_.push_back({{7.8, -0.9, -1}, {12.2, 0.9, world.ground_z_ + 1.5}, false});
  return world;
}

double AnalyticWorld::ground(double x, double y) const {
  const double flat = std::min(1.0, std::hypot(x, y) / 2);  // level at the start
  return ground_z_ + flat * roughness_m_ *
                         (std::sin(0.9 * x + 0.4 * y) * std::cos(0.7 * y) +
                          0.4 * std::sin(2.1 * x) * std::sin(1.7 * y + 1));
}

double AnalyticWorld::cast(const Vec3& o, const Vec3& d, Vec3& normal) const {
  double best = kInfinity;
  for (const Cylinder& c : cylinders_) {
    const Vec2 m = o.head<2>() - c.centre;
    const double qa = d.head<2>().squaredNorm(), qb = m.dot(d.head<2>());
    const double discriminant = qb * qb - qa * (m.squaredNorm() - c.radius * c.radius);
    if (discriminant <= 0) continue;
    const double t = (-qb - std::sqrt(discriminant)) / qa;
    const double z = o.z() + t * d.z();
    if (t <= 0 || t >= best || z < c.low || z > c.high) continue;
    best = t;
    normal = {(m.x() + t * d.x()) / c.radius, (m.y() + t * d.y()) / c.radius, 0};
  }
  for (const Box& box : boxes_) {
    double enter = -kInfinity, leave = kInfinity;
    int enter_axis = 0, leave_axis = 0;
    for (int i = 0; i < 3; ++i) {
      double t0 = (box.low[i] - o[i]) / d[i], t1 = (box.high[i] - o[i]) / d[i];
      if (t0 > t1) std::swap(t0, t1);
      if (t0 > enter) enter = t0, enter_axis = i;
      if (t1 < leave) leave = t1, leave_axis = i;
    }
    const double t = box.inside_out ? leave : enter;
    if (enter > leave || t <= 0 || t >= best) continue;
    best = t;
    const int axis = box.inside_out ? leave_axis : enter_axis;
    normal = Vec3::Zero();
    normal[axis] = d[axis] > 0 ? -1 : 1;
  }
  if (has_ground_) {
    // March to the first sample below the ground, then bisect.
    const double limit = std::min(best, kMaxRange);
    const auto height = [&](double t) {
      const Vec3 p = o + t * d;
      return p.z() - ground(p.x(), p.y());
    };
    double t = 0;
    while (t < limit) {
      const double above = height(t);
      if (above <= 0) break;
      t += std::max(0.02, d.z() >= 0 ? 1.0 : 0.4 * above);
    }
    if (t > 0 && height(std::min(t, limit)) <= 0) {
      double low = 0, high = std::min(t, limit);
      for (double s = std::max(0.0, t - 1.5); s < high; s += 0.02) {
        if (height(s) <= 0) {
          high = s;
          break;
        }
        low = s;
      }
      for (int i = 0; i < 30; ++i) {
        const double middle = 0.5 * (low + high);
        (height(middle) > 0 ? low : high) = middle;
      }
      best = high;
      const Vec3 p = o + best * d;
      constexpr double h = 1e-4;
      normal = Vec3(-(ground(p.x() + h, p.y()) - ground(p.x() - h, p.y())) / (2 * h),
                    -(ground(p.x(), p.y() + h) - ground(p.x(), p.y() - h)) / (2 * h), 1)
                   .normalized();
    }
  }
  return best <= kMaxRange ? best : kInfinity;
}

double AnalyticWorld::distance(const Vec3& p) const {
  double best = kInfinity;
  for (const Cylinder& c : cylinders_) {
    best = std::min(best, std::abs((p.head<2>() - c.centre).norm() - c.radius));
  }
  for (const Box& box : boxes_) {
    const Vec3 outside = (box.low - p).cwiseMax(p - box.high).cwiseMax(0);
    const double inside = (p - box.low).cwiseMin(box.high - p).minCoeff();
    best = std::min(best, outside.norm() > 0 ? outside.norm() : std::abs(inside));
  }
  if (has_ground_) best = std::min(best, std::abs(p.z() - ground(p.x(), p.y())));
  return best;
}

std::vector<ImuSample> simulate_imu(const AnalyticMotion& motion, Stamp end,
                                    const SensorNoise& noise, std::uint64_t seed) {
  constexpr Stamp kPeriod = 5'000'000;
  constexpr double kRate = 200;
  RandomStream random(seed, "imu");
  Vec3 gyro_bias = noise.gyro_bias, accel_bias = noise.accel_bias;
  std::vector<ImuSample> samples;
  for (Stamp stamp = 0; stamp <= end; stamp += kPeriod) {
    ImuSample sample = motion.imu(stamp);
    sample.gyro_radps += gyro_bias + noise.imu * 1.0e-4 * std::sqrt(kRate) * random.normal3();
    sample.accel_mps2 += accel_bias + noise.imu * 1.4e-3 * std::sqrt(kRate) * random.normal3();
    gyro_bias += noise.imu * 2e-5 / std::sqrt(kRate) * random.normal3();
    accel_bias += noise.imu * 1e-3 / std::sqrt(kRate) * random.normal3();
    const double t = to_seconds(stamp);
    if (motion.at(t).v_OB.norm() > 0) {  // rotors turn once it moves
      const double once = std::sin(2 * kPi * 114.3 * t), blade = std::sin(2 * kPi * 228.6 * t + 1);
      sample.accel_mps2 += noise.vibration * (2 * once * Vec3(0.8, 0.5, 0.3) +
                                              blade * Vec3(0.2, 0.3, 0.9) + 0.3 * random.normal3());
      sample.gyro_radps += noise.vibration * 0.03 * once * Vec3(0.6, 0.7, 0.4);
    }
    samples.push_back(sample);
  }
  return samples;
}

LidarScan simulate_scan(const AnalyticWorld& world, const AnalyticMotion& motion, const Pose& X_BL,
                        Stamp stamp, const SensorNoise& noise, std::uint64_t seed, int stride) {
  constexpr int kFirings = 20000;
  constexpr std::uint32_t kFiringPeriod = 5000;
  LidarScan scan;
  scan.stamp = stamp;
  scan.end = stamp + Stamp{kFirings} * kFiringPeriod;
  const std::int64_t first = stamp / kFiringPeriod;
  const RandomStream streams(seed, "lidar");
  for (int i = 0; i < kFirings; i += stride) {
    RandomStream random = streams.fork(static_cast<std::uint64_t>(first + i));
    const Stamp fired = stamp + Stamp{i} * kFiringPeriod;
    const Pose X_OL = motion.at(to_seconds(fired)).X_OB * X_BL;
    const Vec3 told_L = firing_direction(first + i);
    const Vec3 true_L = (told_L + noise.lidar_angle_rad * random.normal3()).normalized();
    const Vec3 d_O = X_OL.R * true_L;
    Vec3 normal;
    double range = world.cast(X_OL.p, d_O, normal);
    if (!(range < kInfinity)) continue;
    const double incidence = std::max(std::abs(normal.dot(d_O)), 0.05);
    if (noise.lidar > 0 && incidence < 0.1) continue;  // grazing beams do not come back
    range += noise.lidar * std::hypot(0.0034, 0.00073 * range) / std::pow(incidence, 0.78) *
                 random.normal() +
             noise.extra_range_m * random.normal();
    LidarPoint point;
    point.p_L = (range * told_L).cast<float>();
    point.intensity = 30;
    point.offset_ns = static_cast<std::uint32_t>(i) * kFiringPeriod;
    point.line = static_cast<std::uint8_t>(i % 4);
    scan.points.push_back(point);
  }
  return scan;
}

}  // namespace arex::test
