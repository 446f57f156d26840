/// Accuracy and speed of the LiDAR-inertial odometry on flights through the simulator's worlds.
///
///     odometry_bench [--flights forest,garage] [--seeds 3] [--first-seed 1] [--lidar-noise 0.02]
///                    [--imu-noise 5] [--extrinsic-deg 1] [--clean] [--seconds 20] [--record DIR]
///                    [--trace FILE] [--set key=value]...
///
/// Every scan's update becomes visible 20 ms after its end, as in the stack. Times are the thread's
/// CPU time of the whole update, undistortion to map insertion.

#include <time.h>

#include <Eigen/Cholesky>
#include <algorithm>
#include <cstdio>
#include <cstring>
#include <fstream>
#include <sstream>

#include "config/config.h"
#include "flights.h"
#include "math/so3.h"
#include "odometry/lidar_inertial_odometry.h"
#include "scoring/odometry_error.h"

namespace {

using namespace arex;

constexpr Stamp kLatency = 20'000'000;

double cpu_ms() {
  timespec t{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &t);
  return 1e3 * static_cast<double>(t.tv_sec) + 1e-6 * static_cast<double>(t.tv_nsec);
}

double quantile(std::vector<double> values, double q) {
  if (values.empty()) return 0;
  std::sort(values.begin(), values.end());
  return values[static_cast<std::size_t>(q * static_cast<double>(values.size() - 1))];
}

struct Result {
  sim::OdometryScore fast, at_scans;  ///< at 200 Hz and at the scans' ends
  std::vector<double> update_ms;
  double largest_step_m = 0, largest_step_rad = 0;
  double matched = 0;
  int not_ok = 0;
  std::vector<double> map_error_m;
  /// At each update, 3 dimensions each; of the absolute pose, so that the drift of a map that the
  /// filter takes as given counts.
  std::vector<double> attitude_nees, position_nees;
  NavigationState last;
  std::size_t map_bytes = 0;
};

/// e^T P^-1 e of attitude and of position, the truth seen from where the odometry began.
void add_nees(const ScanUpdate& update, const Pose& X_OB_true, Result& result) {
  NavigationState truth = update.state;
  truth.R_OB = X_OB_true.R;
  truth.p_OB = X_OB_true.p;
  const ErrorVector e = local(update.state, truth);
  const auto nees = [&](int block) {
    const Mat3 P = update.pose_covariance.block<3, 3>(block, block);
    return e.segment<3>(block).dot(P.ldlt().solve(e.segment<3>(block)));
  };
  result.attitude_nees.push_back(nees(kRotation));
  result.position_nees.push_back(nees(kPosition));
}

Result fly(bench::Flight& flight, const LidarInertialConfig& config, std::ofstream& trace) {
  LidarInertialOdometry odometry(config, VehicleConfig{});
  Result result;
  std::vector<sim::PosePair> fast, at_scans;
  std::vector<std::pair<Stamp, PointsPtr>> clouds;
  ScanUpdate update;
  bool pending = false;
  int next_scan = 0;
  for (const ImuSample& sample : flight.imu()) {
    const Odometry now = odometry.add_imu(sample);
    if (now.status != OdometryStatus::kInitialising) {
      fast.push_back({sample.stamp, flight.X_WB(sample.stamp), now.X_OB});
    }
    if (pending && sample.stamp >= update.end + kLatency) {
      const Pose before = odometry.odometry().X_OB;
      const bool started = odometry.odometry().status != OdometryStatus::kInitialising;
      odometry.apply(update);
      const Pose after = odometry.odometry().X_OB;
      if (started) {
        result.largest_step_m = std::max(result.largest_step_m, (after.p - before.p).norm());
        result.largest_step_rad =
            std::max(result.largest_step_rad, so3::angle(before.R.transpose() * after.R));
      }
      pending = false;
    }
    if (next_scan < flight.scans() && sample.stamp == Stamp{next_scan + 1} * 100'000'000) {
      const ScanJob job = odometry.prepare(flight.scan(next_scan++));
      const double begin = cpu_ms();
      update = odometry.correct(job);
      const double spent = cpu_ms() - begin;
      pending = true;
      if (update.status == OdometryStatus::kInitialising) continue;
      at_scans.push_back({update.stamp, flight.X_WB(update.stamp), update.state.X_OB()});
      if (update.registration.points == 0) continue;
      add_nees(update, sim::align_at_start(at_scans).inverse() * at_scans.back().X_WB, result);
      result.update_ms.push_back(spent);
      result.matched += update.registration.matched;
      result.not_ok += update.status != OdometryStatus::kOk;
      if (next_scan % 20 == 0) clouds.emplace_back(update.stamp, update.points_O);
      if (trace.is_open()) {
        const Pose X_WO = sim::align_at_start(at_scans);
        const Pose X_WB = flight.X_WB(update.stamp), estimate = X_WO * update.state.X_OB();
        const Vec3 e = estimate.p - X_WB.p;
        const Vec3 r = so3::Log(estimate.R * X_WB.R.transpose());
        trace << to_seconds(update.stamp) << ',' << e.x() << ',' << e.y() << ',' << e.z() << ','
              << r.x() << ',' << r.y() << ',' << r.z() << ',' << X_WB.p.x() << ',' << X_WB.p.y()
              << ',' << X_WB.p.z() << ',' << update.registration.points << ','
              << update.registration.matched << ',' << update.registration.residual_rms_sigma << ','
              << update.registration.iterations << ',' << spent << ','
              << static_cast<int>(update.status) << ',' << update.registration.position_std_m[0]
              << ',' << update.registration.rotation_std_rad[0] << ','
              << update.state.b_a.transpose() << ',' << update.state.g_O.transpose() << '\n';
      }
    }
  }
  result.fast = sim::score_odometry(fast);
  result.at_scans = sim::score_odometry(at_scans);
  const Pose X_WO = sim::align_rigid(at_scans);
  for (const auto& [stamp, points] : clouds) {
    for (std::size_t i = 0; i < points->size(); i += 20) {
      result.map_error_m.push_back(flight.surface_distance(X_WO * (*points)[i].cast<double>()));
    }
  }
  result.matched /= std::max<double>(1, static_cast<double>(result.update_ms.size()));
  result.map_bytes = odometry.map().memory_bytes();
  result.last = update.state;
  return result;
}

void print_header() {
  std::printf(
      "%-28s %6s | %6s %6s %6s | %6s %6s | %6s %6s | %5s %5s %5s | %5s %5s | %4s %5s | %6s %6s "
      "%6s\n",
      "flight", "m", "ATE", "max", "SE3", "yaw", "200Hz", "RPE1", "RPE10", "ms", "p99", "max",
      "step", "deg", "bad", "used", "map50", "map95", ">0.3");
}

void print_row(const std::string& name, double distance, const Result& r) {
  const auto& s = r.at_scans;
  const double outliers =
      static_cast<double>(std::count_if(r.map_error_m.begin(), r.map_error_m.end(),
                                        [](double e) { return e > 0.3; })) /
      static_cast<double>(std::max<std::size_t>(1, r.map_error_m.size()));
  std::printf(
      "%-28s %6.1f | %6.4f %6.4f %6.4f | %6.3f %6.4f | %6.4f %6.4f | %5.2f %5.2f %5.2f | %5.3f "
      "%5.3f | %4d %5.0f | %6.4f %6.4f %6.4f\n",
      name.c_str(), distance, s.ate_rmse_m, s.ate_max_m, s.ate_se3_rmse_m, s.yaw_error_max_deg,
      r.fast.ate_rmse_m, s.rpe_1m_m, s.rpe_10m_m, quantile(r.update_ms, 0.5),
      quantile(r.update_ms, 0.99), quantile(r.update_ms, 1.0), r.largest_step_m,
      r.largest_step_rad * 57.29578, r.not_ok, r.matched, quantile(r.map_error_m, 0.5),
      quantile(r.map_error_m, 0.95), outliers);
  std::fflush(stdout);
}

/// Mean, and the band that 95 % of the updates lie in.
void print_nees(const char* what, const std::vector<double>& nees) {
  double mean = 0;
  for (const double value : nees) mean += value / static_cast<double>(nees.size());
  std::printf("    %s NEES: mean %.1f, 95 %% within %.2f-%.1f (consistent: 3, 0.22-9.35)\n", what,
              mean, quantile(nees, 0.025), quantile(nees, 0.975));
}

}  // namespace

int main(int argc, char** argv) {
  bench::FlightOptions options;
  std::string flights = "forest,garage", recordings, trace_file;
  std::uint64_t first_seed = 1, seeds = 3;
  ConfigNode overrides;
  overrides.kind = ConfigNode::Kind::kMap;
  for (int i = 1; i < argc; ++i) {
    const std::string key = argv[i];
    const auto value = [&]() -> std::string { return i + 1 < argc ? argv[++i] : ""; };
    if (key == "--flights") {
      flights = value();
    } else if (key == "--seeds") {
      seeds = std::stoull(value());
    } else if (key == "--first-seed") {
      first_seed = std::stoull(value());
    } else if (key == "--lidar-noise") {
      options.lidar_noise_floor_m = std::stod(value());
    } else if (key == "--imu-noise") {
      options.imu_noise_factor = std::stod(value());
    } else if (key == "--extrinsic-deg") {
      options.extrinsic_error_rad =
          Vec3(0.6, -0.6, 0.53).normalized() * std::stod(value()) / 57.29578;
    } else if (key == "--clean") {
      options.noise_free = true;
    } else if (key == "--seconds") {
      options.longest_s = std::stod(value());
    } else if (key == "--record") {
      recordings = value();
    } else if (key == "--trace") {
      trace_file = value();
    } else if (key == "--set") {
      apply_override(overrides, value());
    } else {
      std::fprintf(stderr, "unknown option %s\n", key.c_str());
      return 2;
    }
  }
  LidarInertialConfig config;
  read_config(overrides, config);
  print_header();
  std::istringstream names(flights);
  for (std::string world; std::getline(names, world, ',');) {
    options.world = world;
    for (std::uint64_t seed = first_seed; seed < first_seed + seeds; ++seed) {
      options.seed = seed;
      bench::Flight flight(options, recordings);
      std::ofstream trace;
      if (!trace_file.empty()) trace.open(trace_file + "-" + options.name() + ".csv");
      const Result result = fly(flight, config, trace);
      print_row(options.name(), flight.distance_m(), result);
      print_nees("attitude", result.attitude_nees);
      print_nees("position", result.position_nees);
      std::printf("    map %.1f MB\n", 1e-6 * static_cast<double>(result.map_bytes));
      if (config.estimate_extrinsics) {
        const Pose X_BL = VehicleConfig{}.X_BL();
        const Mat3 truth = X_BL.R * so3::Exp(options.extrinsic_error_rad);
        std::printf("    extrinsic: %.3f deg off, started %.3f deg off; %.1f mm\n",
                    so3::angle(truth.transpose() * result.last.X_BL.R) * 57.29578,
                    so3::angle(truth.transpose() * X_BL.R) * 57.29578,
                    1e3 * (result.last.X_BL.p - X_BL.p).norm());
      }
    }
  }
  return 0;
}
