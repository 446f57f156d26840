/// Front and back end of the visual-inertial odometry, each by itself, on flights through the
/// simulator's worlds with 10 images a second, the right eye on every other one:
///
///     visual_odometry_bench [SECONDS] [WORLD]...      default 60, forest and garage
#include <time.h>

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <span>
#include <string>
#include <vector>

#include "../odometry/flights.h"
#include "messages/vehicle.h"
#include "odometry/visual/feature_tracker.h"
#include "odometry/visual/visual_estimator.h"
#include "scoring/odometry_error.h"
#include "sensors/infrared_exposure.h"
#include "sensors/infrared_pair.h"

namespace {

using namespace arex;  // NOLINT: a program of one file

constexpr Stamp kPeriod = kNanosecondsPerSecond / 10;

double cpu_ms() {
  timespec t{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &t);
  return 1e3 * static_cast<double>(t.tv_sec) + 1e-6 * static_cast<double>(t.tv_nsec);
}

void row(const char* name, std::vector<double> v) {
  if (v.empty()) return;
  std::sort(v.begin(), v.end());
  std::printf("  %-30s %8.2f %8.2f %8.2f\n", name, v[v.size() / 2], v[v.size() * 99 / 100],
              v.back());
}

void measure(const std::string& world, double longest_s) {
  bench::FlightOptions options;
  options.world = world;
  options.longest_s = longest_s;
  const bench::Flight flight(options, {});
  const Pose X_BC = VehicleConfig{}.X_BC();
  const sim::InfraredConfig camera;
  const sim::D430Config unit = sim::D430Config{}.as_built(1);
  sim::InfraredPair pair(camera, unit, flight.world(), flight.scene(), X_BC, 1);
  sim::AutoExposure exposure(camera.sensor);
  const VisualInertialConfig config;
  FeatureTracker tracker(config.tracker, 1);
  VisualEstimator estimator(config, X_BC);
  std::vector<double> front_ms, back_ms;
  std::vector<sim::PosePair> track;
  Stamp tracked = 0;
  std::size_t handed = 0;
  for (int i = 0; i < flight.scans(); ++i) {
    sim::InfraredShot shot;
    shot.exposure = exposure.next();
    shot.right = i % camera.right_every == 0;
    const sim::Truth truth = flight.truth(Stamp{i} * kPeriod);
    shot.stamp = truth.stamp;
    shot.X_WB = truth.X_WB;
    shot.v_WB = truth.v_WB;
    shot.w_WB_B = truth.w_WB_B;
    const auto image = pair.capture(shot);
    exposure.add(sim::central_mean(image->left, image->width, image->height), shot.exposure);
    std::size_t end = handed;
    while (end < flight.imu().size() && flight.imu()[end].stamp < shot.stamp + kPeriod / 2) ++end;
    estimator.add_imu(std::span(flight.imu()).subspan(handed, end - handed));
    handed = end;

    const double begin = cpu_ms();
    const FeatureFrame features =
        tracker.track(*image, estimator.camera_turn(tracked, image->time_ns));
    const double followed = cpu_ms();
    const VisualUpdate update = estimator.add(features);
    const double done = cpu_ms();
    tracker.forget(update.window.outliers);
    tracked = image->time_ns;
    if (update.status == OdometryStatus::kInitialising) continue;
    front_ms.push_back(followed - begin);
    back_ms.push_back(done - followed);
    track.push_back({update.stamp, truth.X_WB, update.state.X_OB()});
  }
  std::printf("%s: %zu images, ATE %.3f m; ms of CPU   median      p99      max\n", world.c_str(),
              track.size(), sim::score_odometry(track).ate_rmse_m);
  row("front end", front_ms);
  row("back end", back_ms);
}

}  // namespace

int main(int argc, char** argv) {
  const double longest_s = argc > 1 ? std::atof(argv[1]) : 60;
  std::vector<std::string> worlds(argv + std::min(argc, 2), argv + argc);
  if (worlds.empty()) worlds = {"forest", "garage"};
  for (const std::string& world : worlds) measure(world, longest_s);
}
