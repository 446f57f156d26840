// CPU time of one depth frame in the default forest: `depth_bench [FRAMES]`.
#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <numbers>
#include <vector>

#include "math/random.h"
#include "messages/vehicle.h"
#include "sensors/d430.h"
#include "worlds/forest.h"

namespace {

using namespace arex;  // NOLINT: a program of one file

double cpu_ms() {
  timespec t{};
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &t);
  return static_cast<double>(t.tv_sec) * 1e3 + static_cast<double>(t.tv_nsec) * 1e-6;
}

/// Flying height above the ground, m.
Vec3 stand(const worlds::World& world, double x, double y) {
  return {x, y, world.terrain.at(x, y) + 1.5};
}

}  // namespace

int main(int argc, char** argv) {
  const int frames = argc > 1 ? std::atoi(argv[1]) : 100;
  const worlds::World world = worlds::build({}, 1);
  const sim::D430Config config{};
  const Pose X_BC = VehicleConfig{}.X_BC();
  sim::D430 device(config, world, X_BC, 1);
  sim::Renderer renderer(world, config.camera(), {.far_m = config.draw_range_m});
  sim::StereoModel stereo(config);
  std::printf("%zu triangles, %zu chunks\n", world.mesh.triangles.size(), world.mesh.chunks.size());

  RandomStream random(2, "poses");
  std::vector<double> draw_ms, noise_ms, frame_ms, triangles;
  std::vector<float> inverse_depth, depth;
  for (int i = 0; i < frames; ++i) {
    const Pose X_WB{so3::from_yaw(random.uniform(0, 2 * std::numbers::pi)),
                    stand(world, random.uniform(-22, 22), random.uniform(-18, 18))};
    const double t0 = cpu_ms();
    renderer.render_inverse_depth(X_WB * X_BC, inverse_depth);
    const double t1 = cpu_ms();
    stereo.measure(inverse_depth, static_cast<std::uint64_t>(i), depth);
    const double t2 = cpu_ms();
    const DepthImagePtr image = device.capture(i, X_WB);
    const double t3 = cpu_ms();
    draw_ms.push_back(t1 - t0);
    noise_ms.push_back(t2 - t1);
    frame_ms.push_back(t3 - t2);
    triangles.push_back(static_cast<double>(renderer.last_frame().triangles));
  }
  std::printf("%d frames at random poses, 1.5 m up; CPU time, all threads\n", frames);
  std::printf("%-28s %8s %8s\n", "", "median", "p95");
  const auto row = [](const char* name, std::vector<double> v) {
    std::sort(v.begin(), v.end());
    std::printf("%-28s %8.2f %8.2f\n", name, v[v.size() / 2], v[v.size() * 95 / 100]);
  };
  row("draw, ms", draw_ms);
  row("stereo model, ms", noise_ms);
  row("whole frame, ms", frame_ms);
  row("triangles drawn", triangles);
}
