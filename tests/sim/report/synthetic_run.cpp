#include "synthetic_run.h"

#include <array>
#include <cmath>
#include <cstdio>
#include <limits>
#include <nlohmann/json.hpp>
#include <numbers>
#include <string>

#include "math/random.h"
#include "math/types.h"
#include "run/recorder.h"
#include "support/temporary_folder.h"

namespace arex::sim::test {
namespace {

constexpr double kHalfWidth = 8;  // m, of the room
constexpr double kUnknown = std::numeric_limits<double>::quiet_NaN();

Pose helix(double t, double duration) {
  const double angle = 2 * std::numbers::pi * t / duration;
  const Vec3 p(5 * std::cos(angle) - 5, 5 * std::sin(angle), 1.5 + 0.5 * std::sin(2 * angle));
  return {so3::from_yaw(angle + std::numbers::pi / 2), p};
}

std::vector<Vec3f> room(std::size_t points) {
  RandomStream random(1, "room");
  std::vector<Vec3f> cloud;
  cloud.reserve(points);
  for (std::size_t i = 0; i < points; ++i) {
    // One wall after the other, in the order of first sight.
    const double angle = std::numbers::pi / 2 * static_cast<double>(4 * i / points);
    const Vec3 p_wall(kHalfWidth, random.uniform(-kHalfWidth, kHalfWidth), random.uniform(0, 4));
    cloud.push_back((so3::from_yaw(angle) * p_wall - Vec3(5, 0, 0)).cast<float>());
  }
  return cloud;
}

void write_flight(Recorder& recorder, const SyntheticRun& run) {
  for (Stamp stamp = 0; stamp <= from_seconds(run.duration_s); stamp += 5'000'000) {
    const double t = to_seconds(stamp);
    const Pose X = helix(t, run.duration_s);
    FlightSample sample;
    sample.truth_X_OB = X;
    sample.estimate_X_OB = Pose{X.R, X.p + Vec3(0.02 * std::sin(t), 0.001 * t, 0)};
    if (stamp % 50'000'000 == 0) {
      FlightRow& row = sample.row.emplace();
      row.stamp = stamp;
      row.speed_mps = 1 + 0.2 * std::sin(t);
      row.odometry_error_m = 0.001 * t;
      row.clearance_m = t < 2 ? kUnknown : 1.2 + std::sin(0.7 * t);
      row.height_m = X.p.z();
      row.battery_power_w = 240;
      row.battery_fraction = 1 - 0.2 * t / run.duration_s;
    }
    recorder.sample(stamp, sample);
  }
}

void write_decisions(Recorder& recorder, const SyntheticRun& run) {
  for (std::size_t i = 0; i < run.decisions; ++i) {
    Decision decision;
    decision.stamp =
        from_seconds(run.duration_s * static_cast<double>(i) / static_cast<double>(run.decisions));
    decision.sequence = static_cast<int>(i);
    for (std::size_t j = 0; j < run.candidates; ++j) {
      Candidate candidate;
      candidate.point = {-5 + 0.5 * static_cast<double>(j), 0.3 * static_cast<double>(i)};
      decision.candidates.push_back(candidate);
    }
    if (!decision.candidates.empty()) decision.winner = i % decision.candidates.size();
    recorder.decision(decision);
  }
}

void write_maps(Recorder& recorder) {
  const int cells = 200;
  std::string pgm = "P5\n200 200\n255\n";
  for (int y = 0; y < cells; ++y) {
    for (int x = 0; x < cells; ++x) {
      const int distance = std::max(std::abs(x - 100), std::abs(y - 100));
      pgm += distance > 82 ? '\xCD' : distance > 78 ? '\0' : '\xFE';
    }
  }
  recorder.write_file("map2d.pgm", pgm);
  recorder.write_file("map2d.yaml",
                      "image: map2d.pgm\nresolution: 0.1\norigin: [-15, -10, 0]\nnegate: 0\n");
}

void write_coverage(Recorder& recorder, double duration) {
  std::string csv = "time_s,distance_m,area_fraction,surface_fraction,volume_m3\n";
  std::array<char, 96> line{};
  for (double t = 1; t < duration; t += 1) {
    const double share = 1 - std::exp(-4 * t / duration);
    std::snprintf(line.data(), line.size(), "%.3f,%.3f,%.5f,%.5f,%.3f\n", t, t, share, 0.9 * share,
                  100 * t);
    csv += line.data();
  }
  recorder.write_file("coverage.csv", csv);
}

nlohmann::ordered_json summary_of(const SyntheticRun& run) {
  return {{"outcome", "succeeded"},
          {"reason", "mission done"},
          {"scenario", "room"},
          {"seed", 7},
          {"sim_time_s", run.duration_s},
          {"wall_time_s", 10.0},
          {"real_time_factor", run.duration_s / 10},
          {"trajectory_hash", "0123456789abcdef"},
          {"distance_m", 31.4},
          {"targets", nlohmann::ordered_json::array()},
          {"coverage", {{"area_fraction", 0.98}, {"surface_fraction", 0.88}, {"t95_s", nullptr}}},
          {"map", nullptr},
          {"odometry", {{"source", "mocap"}, {"ate_rmse_m", 0.02}, {"ate_max_m", 0.03}}},
          {"exploration", {{"targets", 2}, {"stop", "little_left"}}},
          {"tracking", {{"rmse_m", 0.05}, {"landing_error_m", nullptr}}},
          {"collisions", 0}};
}

}  // namespace

void write_synthetic_run(const std::filesystem::path& folder, const SyntheticRun& run) {
  Recorder recorder(folder, "seed: 7\nplanning:\n  inflation_m: 0.5\n");
  write_flight(recorder, run);
  write_decisions(recorder, run);
  recorder.event({0, EventKind::kMissionState, "takeoff"});
  recorder.event({from_seconds(2), EventKind::kTargetSelected, "0.00 5.00 1.50"});
  recorder.event({from_seconds(run.duration_s / 2), EventKind::kTargetReached, "0.00 5.00 1.50"});
  recorder.event({from_seconds(run.duration_s / 2), EventKind::kTargetSelected, "-5 -5 1.5"});
  recorder.event({from_seconds(run.duration_s - 1), EventKind::kStuck, "<b>\"&'</b></script>"});
  std::vector<CloudGrowth> growth;
  for (int i = 1; i <= 20; ++i) {
    growth.push_back({from_seconds(run.duration_s * i / 20),
                      run.cloud_points * static_cast<std::size_t>(i) / 20});
  }
  if (run.cloud_points > 0) recorder.write_cloud(room(run.cloud_points), growth);
  write_maps(recorder);
  write_coverage(recorder, run.duration_s);
  recorder.write_file("timing.csv",
                      "module,calls,median_ms,p99_ms,total_s\nlidar,300,1.5,2.5,0.5\n"
                      "mapping,300,5.5,35.0,2.1\n");
  recorder.flush();
  if (run.finished) recorder.write_summary(summary_of(run));
}

void write_synthetic_sweep(const std::filesystem::path& folder) {
  std::string csv =
      "run,scenario,planning.inflation_m,exploration.weight_direction,seed,failure,detail,outcome,"
      "reason,sim_time_s,coverage.area_fraction\n";
  RandomStream random(2, "sweep");
  int number = 0;
  std::array<char, 256> line{};
  for (const double inflation : {0.3, 0.5, 0.7}) {
    for (const int weight : {1, 3}) {
      for (int seed = 1; seed <= 4; ++seed, ++number) {
        const char* tail = "succeeded,mission done";
        if (number == 5) tail = "collided,hit trunk 4 at 1.20 m/s";
        std::snprintf(line.data(), line.size(), "runs/%016d,room,%g,%d,%d,", number, inflation,
                      weight, seed);
        csv += line.data();
        if (number == 9) {
          csv += "crashed,\"signal 11, <core>\",,,,\n";
          continue;
        }
        std::snprintf(line.data(), line.size(), ",,%s,%.2f,%.4f\n", tail,
                      100 + 40 * inflation + 5 * weight + random.uniform(-5, 5), 0.98);
        csv += line.data();
      }
    }
  }
  write_synthetic_run(folder / "runs/0000000000000000", {});
  arex::test::write_text(folder / "sweep.csv", csv);
}

void write_synthetic_failures(const std::filesystem::path& folder, int successes) {
  std::string csv =
      "run,scenario,planning.inflation_m,seed,failure,detail,outcome,reason,distance_m,"
      "battery.remaining_fraction\n";
  for (const double inflation : {0.3, 0.5}) {
    for (int i = 0; i < 4; ++i) {
      const bool succeeded = i < (inflation < 0.4 && successes > 0 ? 4 : successes);
      const double distance = (inflation < 0.4 ? 10 : 13) + i;
      csv += "runs/" + std::to_string(i) + ",room," + (inflation < 0.4 ? "0.3" : "0.5") + "," +
             std::to_string(18446744073709551612U + static_cast<unsigned>(i)) + ",,," +
             (succeeded ? "succeeded,mission done," : "collided,hit trunk 4 at 1.20 m/s,") +
             std::to_string(succeeded ? distance : distance / 5) + ",0.5\n";
    }
  }
  std::filesystem::create_directories(folder);
  arex::test::write_text(folder / "sweep.csv", csv);
}

void write_synthetic_hypercube(const std::filesystem::path& folder) {
  constexpr int kPoints = 40;
  std::string csv =
      "run,scenario,imu.gyro_noise,lidar.range_noise_m,seed,failure,detail,outcome,sim_time_s\n";
  std::array<char, 160> line{};
  for (int i = 0; i < kPoints; ++i) {
    const double x = 0.1 + 0.8 * i / (kPoints - 1);
    const double y = 0.1 + 0.8 * (7 * i % kPoints) / (kPoints - 1);
    std::snprintf(line.data(), line.size(), "runs/%d,room,%.4f,%.4f,1,,,succeeded,%.3f\n", i, x, y,
                  10 * x);
    csv += line.data();
  }
  std::filesystem::create_directories(folder);
  arex::test::write_text(folder / "sweep.csv", csv);
}

}  // namespace arex::sim::test
