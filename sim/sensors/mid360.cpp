#include "sensors/mid360.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <stdexcept>

#include "physics/airframe.h"

namespace arex::sim {
namespace {

constexpr int kLines = Mid360Pattern::kLines;
constexpr int kShots = Mid360Pattern::kShotsPerTick;
constexpr int kBeams = kLines * kShots;

// A false alarm is faint [E].
constexpr int kFalseAlarmIntensity = 10;

// A return is weak if its light is less than this multiple of the least that is detected [E].
constexpr float kModerateMargin = 2, kLowMargin = 1.3F;
// A merged echo that lies further than this share of their distance from both surfaces [E].
constexpr float kLowMergedShare = 0.2F;

bool within(Stamp stamp, double from_s, double for_s) {
  return stamp >= from_seconds(from_s) && stamp < from_seconds(from_s + for_s);
}

std::vector<worlds::CollisionShape> pick(const std::vector<worlds::CollisionShape>& airframe_B,
                                         bool rotors) {
  std::vector<worlds::CollisionShape> picked;
  for (const worlds::CollisionShape& shape : airframe_B) {
    if ((static_cast<AirframePart>(shape.object) == AirframePart::kRotor) == rotors) {
      picked.push_back(shape);
    }
  }
  return picked;
}

/// Points spread evenly over the unit sphere (Fibonacci lattice). Projected across a beam they are
/// places within its width.
struct Sphere {
  std::array<Vec3f, 256> points;
  Sphere() {
    for (std::size_t i = 0; i < points.size(); ++i) {
      const double z = 1 - (2 * static_cast<double>(i) + 1) / static_cast<double>(points.size());
      const double angle = static_cast<double>(i) * std::numbers::pi * (3 - std::sqrt(5.0));
      const double radius = std::sqrt(1 - z * z);
      points[i] = Vec3(radius * std::cos(angle), radius * std::sin(angle), z).cast<float>();
    }
  }
};
const Sphere kSphere;

/// Four vectors side by side.
struct Vectors {
  Eigen::Array4d x, y, z;
};

Vectors cross(const Vec3& a, const Vectors& b) {
  return {a.y() * b.z - a.z() * b.y, a.z() * b.x - a.x() * b.z, a.x() * b.y - a.y() * b.x};
}

/// Exp(fraction * phi) * v for four fractions. The series are exact to 1e-10 up to 0.1 rad, that is
/// 100 rad/s over a tick.
Vectors rotate(const Vec3& phi, const Eigen::Array4d& fraction, const Vectors& v) {
  const Eigen::Array4d theta2 = phi.squaredNorm() * fraction.square();
  const Eigen::Array4d a = fraction * (1 - theta2 / 6 * (1 - theta2 / 20));
  const Eigen::Array4d b = fraction.square() * (0.5 - theta2 / 24 * (1 - theta2 / 30));
  const Vectors once = cross(phi, v), twice = cross(phi, once);
  return {v.x + a * once.x + b * twice.x, v.y + a * once.y + b * twice.y,
          v.z + a * once.z + b * twice.z};
}

Vectors operator*(const Mat3& R, const Vectors& v) {
  return {R(0, 0) * v.x + R(0, 1) * v.y + R(0, 2) * v.z,
          R(1, 0) * v.x + R(1, 1) * v.y + R(1, 2) * v.z,
          R(2, 0) * v.x + R(2, 1) * v.y + R(2, 2) * v.z};
}

}  // namespace

struct Mid360::Tick {
  Stamp stamp = 0;
  std::int64_t first_firing = 0;
  std::array<Vec3f, kBeams> directions_L;
  std::array<Ray, kBeams> rays;
  std::array<RayHit, kBeams> hits;
  std::array<float, kBeams> cos_incidence;
  std::array<std::uint8_t, kBeams> merged;  ///< the tag's confidence
  // Beams that the airframe stops; they are not cast into the world.
  struct Stopped {
    std::size_t beam = 0;
    RayHit hit;
    float cos_incidence = 0;
  };
  std::array<Stopped, kBeams> stopped;
  std::size_t stopped_count = 0;
};

Mid360::Mid360(const Mid360Config& config, const Scene& scene, const Pose& X_BL,
               const std::vector<worlds::CollisionShape>& airframe_B, std::uint64_t seed)
    : config_(config),
      scene_(scene),
      X_BL_(X_BL *
            Pose{so3::Exp(config.extrinsic_rotation_error_rad), config.extrinsic_position_error_m}),
      pattern_(config.pattern, config.pattern_turn_deg),
      echo_(config.echo),
      packets_(config.noise_free ? 0 : config.packet_jitter_s, seed),
      body_(pick(airframe_B, false), X_BL_),
      rotors_(pick(airframe_B, true), X_BL_),
      stream_(seed, "mid360"),
      beam_stream_(seed, "mid360.beam"),
      rotor_stream_(seed, "mid360.rotor") {}

LidarScan Mid360::scan(std::span<const Truth> ticks, Stamp frame_begin) const {
  const std::int64_t from_firing = LidarPackets::first_firing(frame_begin);
  if (ticks.size() < 2) throw std::invalid_argument("a LiDAR frame needs at least two ticks");
  if (ticks.back().stamp - ticks.front().stamp > std::numeric_limits<std::uint32_t>::max()) {
    throw std::invalid_argument("a LiDAR frame of more than 4.29 s has no point offsets");
  }
  LidarScan scan;
  scan.stamp = ticks.front().stamp;
  scan.end = ticks.back().stamp;
  scan.points.reserve((ticks.size() - 1) * kBeams);
  Tick tick;
  for (std::size_t i = 0; i + 1 < ticks.size(); ++i) {
    if (within(ticks[i].stamp, config_.fault_silent_from_s, config_.fault_silent_for_s)) continue;
    aim(ticks[i], ticks[i + 1], tick);
    const auto left_out = std::clamp<std::int64_t>(from_firing - tick.first_firing, 0, kBeams);
    for (std::size_t k = 0; k < static_cast<std::size_t>(left_out); ++k) {
      tick.rays[k].max_distance_m = -1;
    }
    find_self_hits(tick);
    scene_.cast(tick.rays, tick.hits);
    for (std::size_t k = 0; k < kBeams; ++k) {
      tick.cos_incidence[k] = std::abs(tick.hits[k].normal_W.dot(tick.rays[k].direction_W));
    }
    if (!config_.noise_free && config_.beam_half_angle_deg > 0) split_beams(tick);
    for (std::size_t k = 0; k < tick.stopped_count; ++k) {
      const Tick::Stopped& stopped = tick.stopped[k];
      tick.hits[stopped.beam] = stopped.hit;
      tick.cos_incidence[stopped.beam] = stopped.cos_incidence;
      tick.merged[stopped.beam] = 0;
    }
    receive(tick, scan.stamp, scan.points);
  }
  if (from_firing > 0) {
    const auto earlier = [&](const LidarPoint& point) {
      return (scan.stamp + point.offset_ns) / Mid360Pattern::kFiringPeriod < from_firing;
    };
    scan.points.erase(scan.points.begin(),
                      std::find_if_not(scan.points.begin(), scan.points.end(), earlier));
  }
  return scan;
}

std::vector<Ray> Mid360::beams(std::span<const Truth> ticks) const {
  std::vector<Ray> rays;
  Tick tick;
  for (std::size_t i = 0; i + 1 < ticks.size(); ++i) {
    aim(ticks[i], ticks[i + 1], tick);
    rays.insert(rays.end(), tick.rays.begin(), tick.rays.end());
  }
  return rays;
}

void Mid360::aim(const Truth& from, const Truth& to, Tick& tick) const {
  if (to.stamp - from.stamp != kNanosecondsPerTick || from.stamp % kNanosecondsPerTick != 0) {
    throw std::invalid_argument("a LiDAR frame needs consecutive ticks");
  }
  tick.stamp = from.stamp;
  tick.first_firing = from.stamp / Mid360Pattern::kFiringPeriod;
  tick.stopped_count = 0;
  tick.merged.fill(0);
  std::array<Mid360Pattern::Shot, kShots> shots;
  pattern_.directions(tick.first_firing / kLines, shots);

  // X_WL(f) = (p + f (p' - p), R Exp(f phi)) X_BL, with the rotation carried into L's axes.
  const Mat3 R_WL = from.X_WB.R * X_BL_.R;
  const Vec3 phi_L = X_BL_.R.transpose() * so3::Log(from.X_WB.R.transpose() * to.X_WB.R);
  const Vec3 lever_L = X_BL_.R.transpose() * X_BL_.p;
  const Vectors lever{Eigen::Array4d::Constant(lever_L.x()), Eigen::Array4d::Constant(lever_L.y()),
                      Eigen::Array4d::Constant(lever_L.z())};
  const Vec3& p = from.X_WB.p;
  const Vec3 step = to.X_WB.p - p;
  const auto max_range = static_cast<float>(config_.echo.max_range_m);
  for (std::size_t n = 0; n < kShots; ++n) {
    const Eigen::Array4d fraction =
        (Eigen::Array4d(0, 1, 2, 3) + static_cast<double>(n) * kLines) / kBeams;
    const Vectors d_L{shots[n].x, shots[n].y, shots[n].z};
    const Vectors d_W = R_WL * rotate(phi_L, fraction, d_L);
    const Vectors o_W = R_WL * rotate(phi_L, fraction, lever);
    for (int k = 0; k < kLines; ++k) {
      const std::size_t beam = n * kLines + static_cast<std::size_t>(k);
      const Vec3 origin_W = p + fraction[k] * step + Vec3(o_W.x[k], o_W.y[k], o_W.z[k]);
      tick.directions_L[beam] = Vec3(d_L.x[k], d_L.y[k], d_L.z[k]).cast<float>();
      tick.rays[beam] = {origin_W.cast<float>(), Vec3(d_W.x[k], d_W.y[k], d_W.z[k]).cast<float>(),
                         0, max_range};
    }
  }
}

void Mid360::find_self_hits(Tick& tick) const {
  for (std::size_t i = 0; i < kBeams; ++i) {
    const Vec3f& d = tick.directions_L[i];
    AirframeMask::BodyHit hit;
    if (body_.near_body(d.x(), d.y(), d.z())) hit = body_.cast(d.cast<double>());
    if (!config_.noise_free && rotors_.near_body(d.x(), d.y(), d.z())) {
      // A beam meets a blade or passes between two of them.
      const AirframeMask::BodyHit blade = rotors_.cast(d.cast<double>());
      if (blade.distance_m < hit.distance_m &&
          rotor_stream_.fork(static_cast<std::uint64_t>(tick.first_firing) + i).uniform() <
              config_.rotor_solidity) {
        hit = blade;
      }
    }
    if (!hit.valid()) continue;
    Tick::Stopped& stopped = tick.stopped[tick.stopped_count++];
    stopped.beam = i;
    stopped.hit = {static_cast<float>(hit.distance_m), Vec3f::Zero(),
                   static_cast<float>(config_.airframe_reflectivity), 0};
    stopped.cos_incidence = std::abs(static_cast<float>(hit.normal_L.dot(d.cast<double>())));
    tick.rays[i].max_distance_m = -1;
  }
}

void Mid360::split_beams(Tick& tick) const {
  // A second ray, somewhere else in the beam's width, searched only as deep as its echo would merge
  // with the first one's. Where the two lie on different surfaces the device reports a range
  // between them.
  const auto separation = static_cast<float>(config_.echo_separation_m);
  const auto half_width = static_cast<float>(to_radians(config_.beam_half_angle_deg));
  const auto merged_share = static_cast<float>(config_.merged_share);
  const auto edge_step = static_cast<float>(config_.edge_step_m);
  std::array<Ray, kBeams> rays;
  std::array<RayHit, kBeams> hits;
  std::array<std::size_t, kBeams> beams;
  std::array<float, kBeams> shares;
  std::size_t count = 0;
  for (std::size_t i = 0; i < kBeams; ++i) {
    const RayHit& hit = tick.hits[i];
    if (!hit.valid()) continue;
    const std::uint64_t draw =
        beam_stream_.fork(static_cast<std::uint64_t>(tick.first_firing) + i).bits();
    if (static_cast<float>((draw >> 8) & 0xFFFF) * 0x1p-16F >= merged_share) continue;
    const Vec3f& d = tick.rays[i].direction_W;
    const Vec3f& offset = kSphere.points[draw & 0xFF];
    rays[count] = {tick.rays[i].origin_W, d + half_width * (offset - d.dot(offset) * d),
                   std::max(0.0F, hit.distance_m - separation), hit.distance_m + separation};
    // The centre's surface covers at least half of the beam.
    shares[count] = static_cast<float>(draw >> 40) * 0x1p-25F;
    beams[count++] = i;
  }
  scene_.cast({rays.data(), count}, {hits.data(), count});
  for (std::size_t j = 0; j < count; ++j) {
    RayHit& hit = tick.hits[beams[j]];
    const RayHit& other = hits[j];
    if (!other.valid()) continue;
    const Vec3f& d = tick.rays[beams[j]].direction_W;
    const Vec3f apart = other.distance_m * rays[j].direction_W - hit.distance_m * d;
    if (std::abs(hit.normal_W.dot(apart)) < edge_step ||
        std::abs(other.normal_W.dot(apart)) < edge_step) {
      continue;
    }
    const float light = (1 - shares[j]) * hit.reflectivity * tick.cos_incidence[beams[j]];
    const float other_light =
        shares[j] * other.reflectivity * std::abs(other.normal_W.dot(rays[j].direction_W));
    const float sum = std::max(light + other_light, 1e-9F);
    const float share = other_light / sum;
    hit.distance_m += share * (other.distance_m - hit.distance_m);
    tick.merged[beams[j]] =
        std::min(share, 1 - share) > kLowMergedShare ? LidarTag::kLow : LidarTag::kModerate;
  }
}

void Mid360::receive(const Tick& tick, Stamp scan_stamp, std::vector<LidarPoint>& points) const {
  const EchoConfig& echo = config_.echo;
  const bool burst =
      within(tick.stamp, config_.fault_false_burst_from_s, config_.fault_false_burst_for_s);
  const double false_alarm =
      burst ? config_.fault_false_burst_fraction : echo.false_alarm_probability;
  // One draw decides both: its upper half whether light comes back, its lower half false alarms.
  const auto false_below = static_cast<std::uint64_t>(std::round(false_alarm * 0x1p32));
  const auto kept = static_cast<float>(1 - config_.fault_dropout_fraction);
  const auto blind = static_cast<float>(echo.blind_m);
  const auto angle_sigma = static_cast<float>(to_radians(echo.angle_noise_deg));
  const auto offset = static_cast<std::uint32_t>(tick.stamp - scan_stamp);
  for (std::size_t i = 0; i < kBeams; ++i) {
    const RayHit& hit = tick.hits[i];
    LidarPoint point;
    point.offset_ns = offset + static_cast<std::uint32_t>(i * Mid360Pattern::kFiringPeriod);
    point.line = static_cast<std::uint8_t>(i % kLines);
    const Vec3f& d = tick.directions_L[i];
    const float r = hit.distance_m, cosine = tick.cos_incidence[i];
    const bool visible =
        hit.valid() && r >= blind && echo_.bright_enough(r, hit.reflectivity, cosine);
    if (config_.noise_free) {
      if (!visible) continue;
      point.p_L = r * d;
      point.intensity = EchoModel::intensity(hit.reflectivity, cosine);
      points.push_back(point);
      continue;
    }
    RandomStream stream = stream_.fork(static_cast<std::uint64_t>(tick.first_firing) + i);
    const std::uint64_t draw = stream.bits();
    if ((draw & 0xFFFFFFFF) < false_below) {
      point.p_L = static_cast<float>(stream.uniform(echo.blind_m, echo.max_range_m)) * d;
      point.intensity = static_cast<float>(stream.uniform_int(0, kFalseAlarmIntensity));
      point.tag = LidarTag::kLow << LidarTag::kWeakShift;
      points.push_back(point);
      continue;
    }
    const float chance = kept * echo_.fast_return_probability(cosine);
    if (!visible || static_cast<float>(draw >> 40) * 0x1p-24F >= chance) continue;
    // One isotropic draw: along the beam it is the range error, across it the angle error.
    const Vec3f noise = stream.normal3().cast<float>();
    const float along = noise.dot(d);
    point.p_L =
        (r + echo_.fast_range_sigma(r, cosine) * along) * d + r * angle_sigma * (noise - along * d);
    point.intensity = EchoModel::intensity(hit.reflectivity, cosine);
    point.tag = tag_of(tick, i);
    points.push_back(point);
  }
}

std::uint8_t Mid360::tag_of(const Tick& tick, std::size_t beam) const {
  const RayHit& hit = tick.hits[beam];
  const float margin = echo_.margin(hit.distance_m, hit.reflectivity, tick.cos_incidence[beam]);
  const int weak = margin < kLowMargin        ? LidarTag::kLow
                   : margin < kModerateMargin ? LidarTag::kModerate
                                              : 0;
  return static_cast<std::uint8_t>(tick.merged[beam] << LidarTag::kMergedShift |
                                   weak << LidarTag::kWeakShift);
}

}  // namespace arex::sim
