#include "synthetic_flight.h"

#include <algorithm>
#include <cmath>
#include <deque>
#include <map>
#include <utility>

#include "math/random.h"
#include "math/so3.h"
#include "messages/vehicle.h"

namespace arex::test {
namespace {

constexpr double kNearest = 0.6, kFurthest = 40;  // m along the optical axis
constexpr int kCell = 60;                         // px

/// Points of stems and ground about the loop.
std::vector<Vec3> forest_points(std::uint64_t seed) {
  RandomStream random(seed, "points");
  std::vector<Vec3> points;
  for (int stem = 0; stem < 220; ++stem) {
    const Vec2 at(random.uniform(-35, 35), random.uniform(-25, 40));
    // The vehicle's way, an ellipse about (0, 8) with half-axes of 12 and 8 m, stays clear.
    const double way = std::hypot(at.x() / 12, (at.y() - 8) / 8);
    if (way > 0.75 && way < 1.3) continue;
    for (int i = 0; i < 40; ++i) {
      const double angle = random.uniform(0, 6.283185307);
      points.emplace_back(at.x() + 0.2 * std::cos(angle), at.y() + 0.2 * std::sin(angle),
                          random.uniform(-0.1, 6));
    }
  }
  for (int i = 0; i < 6000; ++i) {
    points.emplace_back(random.uniform(-35, 35), random.uniform(-25, 40),
                        -0.14 + 0.05 * random.normal());
  }
  return points;
}

struct Projection {
  Vec2 left_px, right_px;
};

/// What of one exposure's points both eyes see.
class Eyes {
 public:
  Eyes(const SyntheticConfig& config, std::vector<Vec3> points)
      : config_(config), points_(std::move(points)), noise_(config.seed, "pixels") {}

  FeatureFrame expose(const Pose& X_OB, Stamp stamp, bool right) {
    const Pose mount{camera_mount().R * so3::Exp(config_.mount_error_rad), camera_mount().p};
    const Pose X_CO = (X_OB * mount).inverse();
    std::map<std::size_t, Projection> visible;
    for (std::size_t i = 0; i < points_.size(); ++i) {
      if (const auto p = project(X_CO * points_[i])) visible.emplace(i, *p);
    }
    choose(visible);
    FeatureFrame frame;
    frame.stamp = stamp;
    for (const auto& [point, id] : followed_)
      frame.features.push_back(seen(id, visible.at(point), right));
    std::sort(frame.features.begin(), frame.features.end(),
              [](const TrackedFeature& a, const TrackedFeature& b) { return a.id < b.id; });
    return frame;
  }

 private:
  [[nodiscard]] std::optional<Projection> project(const Vec3& p_C) const {
    if (p_C.z() < kNearest || p_C.z() > kFurthest) return std::nullopt;
    const Vec2 left(camera_.f_px * p_C.x() / p_C.z() + camera_.cx,
                    camera_.f_px * p_C.y() / p_C.z() + camera_.cy);
    const Vec2 right = left - Vec2(camera_.f_px * camera_.baseline_m / p_C.z(), 0);
    if (right.x() < 5 || left.x() > camera_.width - 5) return std::nullopt;
    if (left.y() < 5 || left.y() > camera_.height - 5) return std::nullopt;
    return Projection{left, right};
  }

  /// Follows on what is still visible, and takes new points into cells that lack some.
  void choose(const std::map<std::size_t, Projection>& visible) {
    std::erase_if(followed_, [&](const auto& f) { return !visible.contains(f.first); });
    std::map<int, int> count;
    const auto cell_of = [](const Projection& p) {
      return static_cast<int>(p.left_px.y()) / kCell * 100 +
             static_cast<int>(p.left_px.x()) / kCell;
    };
    for (const auto& [point, id] : followed_) ++count[cell_of(visible.at(point))];
    constexpr int kShare = 2;
    for (const auto& [point, projection] : visible) {
      if (static_cast<int>(followed_.size()) >= config_.features) return;
      if (followed_.contains(point) || count[cell_of(projection)] >= kShare) continue;
      ++count[cell_of(projection)];
      followed_.emplace(point, next_id_++);
    }
  }

  TrackedFeature seen(std::int64_t id, const Projection& p, bool right) {
    const auto normalised = [&](const Vec2& px) {
      const double u = px.x() + config_.pixel_std * noise_.normal();
      const double v = px.y() + config_.pixel_std * noise_.normal();
      return Vec2((u - camera_.cx) / camera_.f_px, (v - camera_.cy) / camera_.f_px);
    };
    TrackedFeature feature{id, normalised(p.left_px), std::nullopt};
    if (right) feature.right = normalised(p.right_px);
    return feature;
  }

  SyntheticConfig config_;
  StereoCamera camera_;
  std::vector<Vec3> points_;
  RandomStream noise_;
  std::map<std::size_t, std::int64_t> followed_;  ///< by point
  std::int64_t next_id_ = 0;
};

}  // namespace

Pose camera_mount() { return VehicleConfig{}.X_BC(); }

SyntheticFlight synthesise(const SyntheticConfig& config) {
  SyntheticFlight flight{
      {loop_points(24, 16, 1.5, config.speed_mps, 0.8, config.rounds), 0.8, config.rest_s},
      {},
      {},
      from_seconds(config.clock_offset_s),
      0};
  const Stamp end = from_seconds(flight.motion.end_s());
  flight.imu = simulate_imu(flight.motion, end, config.imu, config.seed);
  Eyes eyes(config, forest_points(config.seed));
  int exposure = 0;
  const Stamp period = from_seconds(1 / config.rate_hz);
  Vec3 last = flight.motion.at(0).X_OB.p;
  for (Stamp t = period; t <= end; t += period, ++exposure) {
    const MotionState truth = flight.motion.at(to_seconds(t));
    flight.frames.push_back(
        eyes.expose(truth.X_OB, t + flight.clock_offset, exposure % config.right_every == 0));
    flight.path_m += (truth.X_OB.p - last).norm();
    last = truth.X_OB.p;
  }
  return flight;
}

VisualInertialConfig synthetic_defaults() {
  VisualInertialConfig config;
  config.imu.delay_s = 0;
  return config;
}

SyntheticRun fly(const SyntheticFlight& flight, const VisualInertialConfig& config,
                 const TamperFrame& tamper, double latency_s) {
  VisualInertialOdometry odometry(config, camera_mount(), 1);
  SyntheticRun run;
  std::deque<VisualUpdate> pending;
  std::vector<ImuSample> unhanded;
  std::size_t next = 0;
  double square = 0, nees = 0;
  int started = 0, in_flight = 0;
  for (const ImuSample& sample : flight.imu) {
    odometry.add_imu(sample);
    unhanded.push_back(sample);
    while (next < flight.frames.size() &&
           sample.stamp >= flight.frames[next].stamp - flight.clock_offset + from_seconds(0.03)) {
      FeatureFrame frame = flight.frames[next++];
      if (tamper) tamper(frame);
      pending.push_back(odometry.correct(frame, std::exchange(unhanded, {})));
    }
    while (!pending.empty() &&
           sample.stamp >= pending.front().stamp - flight.clock_offset + from_seconds(latency_s)) {
      const Odometry before = odometry.odometry();
      odometry.apply(pending.front());
      const VisualUpdate& update = pending.front();
      if (before.status != OdometryStatus::kInitialising) {
        run.largest_step_m =
            std::max(run.largest_step_m, (odometry.odometry().X_OB.p - before.X_OB.p).norm());
      }
      run.faults.insert(run.faults.end(), update.faults.begin(), update.faults.end());
      run.updates.push_back(update);
      pending.pop_front();
    }
    const Odometry& now = odometry.odometry();
    run.fast.push_back(now);
    if (now.status == OdometryStatus::kInitialising) continue;
    // Both begin at O with heading zero; what the start errs by in tilt is an error.
    const Pose truth = flight.motion.at(to_seconds(sample.stamp)).X_OB;
    const Vec3 error = now.X_OB.p - truth.p;
    square += error.squaredNorm();
    ++started;
    run.end_m = error.norm();
    run.worst_m = std::max(run.worst_m, run.end_m);
    run.worst_yaw_rad =
        std::max(run.worst_yaw_rad, std::abs(so3::wrap(so3::yaw(now.X_OB.R) - so3::yaw(truth.R))));
    constexpr double kMoved = 0.5;  // m
    if (truth.p.norm() < kMoved) continue;
    nees += error.dot(now.covariance.bottomRightCorner<3, 3>().ldlt().solve(error));
    ++in_flight;
  }
  run.ate_m = std::sqrt(square / std::max(1, started));
  run.nees_position = nees / std::max(1, in_flight);
  return run;
}

}  // namespace arex::test
