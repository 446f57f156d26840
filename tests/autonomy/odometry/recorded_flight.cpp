#include "recorded_flight.h"

#include <algorithm>
#include <memory>
#include <optional>
#include <utility>

#include "math/so3.h"

namespace arex::test {

Pose mounting() { return VehicleConfig{}.X_BL(); }

Recording record(const AnalyticWorld& world, const AnalyticMotion& motion, double duration_s,
                 const SensorNoise& noise, std::uint64_t seed, int stride, const Pose& X_BL) {
  Recording r{world, motion, {}, {}, 0};
  const Stamp end = from_seconds(duration_s);
  r.imu = simulate_imu(motion, end, noise, seed);
  for (Stamp t = 0; t + kFrame <= end; t += kFrame) {
    r.scans.push_back(
        std::make_shared<LidarScan>(simulate_scan(world, motion, X_BL, t, noise, seed, stride)));
  }
  return r;
}

const Recording& forest() {
  static const Recording r =
      record(AnalyticWorld::forest(3, 24, 16), {loop_points(24, 16, 1.5, 1.5, 0.8, 1), 0.8, 1.5},
             16, {}, 3, 4);
  return r;
}

const Recording& standing() {
  static const Recording r = record(AnalyticWorld::hall(), {{Vec4::Zero()}, 1, 100}, 61, {}, 5, 16);
  return r;
}

Recording with_imu(Recording recording, const Vec3& gyro_scale, Stamp clock_offset) {
  for (ImuSample& sample : recording.imu) {
    sample.gyro_radps = sample.gyro_radps.cwiseProduct(gyro_scale);
    sample.stamp += clock_offset;
  }
  recording.imu_clock_offset = clock_offset;
  return recording;
}

LidarInertialConfig defaults() {
  LidarInertialConfig config;
  config.imu.delay_s = 0;
  return config;
}

Flown fly(const Recording& r, const LidarInertialConfig& config, Stamp latency,
          const Tamper& tamper) {
  LidarInertialOdometry odometry(config, mounting(), kRadius);
  Flown run;
  std::size_t next = 0;
  std::optional<ScanUpdate> pending;
  for (const ImuSample& sample : r.imu) {
    const Odometry now = odometry.add_imu(sample);
    const Stamp arrival = sample.stamp - r.imu_clock_offset;
    if (next < r.scans.size() && arrival >= r.scans[next]->end) {
      LidarScanPtr scan = r.scans[next++];
      if (tamper) scan = tamper(scan);
      if (scan) pending = odometry.correct(odometry.prepare(scan));
    }
    if (pending && arrival >= pending->stamp + latency) {
      odometry.apply(*pending);
      if (now.status != OdometryStatus::kInitialising) {
        const Pose& after = odometry.odometry().X_OB;
        run.largest_step_m = std::max(run.largest_step_m, (after.p - now.X_OB.p).norm());
        run.largest_step_rad =
            std::max(run.largest_step_rad, so3::angle(now.X_OB.R.transpose() * after.R));
      }
      run.updates.push_back(std::move(*pending));
      pending.reset();
    }
    run.fast.push_back(odometry.odometry());
  }
  run.need = odometry.need();
  return run;
}

double position_error(const Recording& r, Stamp stamp, const Vec3& p_OB) {
  return (p_OB - r.motion.at(to_seconds(stamp)).X_OB.p).norm();
}

double worst_error(const Recording& r, const Flown& run) {
  double worst = 0;
  for (const ScanUpdate& u : run.updates) {
    if (u.status == OdometryStatus::kInitialising) continue;
    worst = std::max(worst, position_error(r, u.stamp, u.state.p_OB));
  }
  return worst;
}

int count(const Flown& run, OdometryStatus status) {
  int n = 0;
  for (const Odometry& o : run.fast) n += o.status == status;
  return n;
}

}  // namespace arex::test
