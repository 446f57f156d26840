// CPU time of the infrared pair in the default forest, garage and pine stand:
// `infrared_bench [FRAMES] [FOLDER]`; into FOLDER go the first left images, to look at what is
// timed.
#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <fstream>
#include <numbers>
#include <span>
#include <string>
#include <vector>

#include "files/png.h"
#include "math/fingerprint.h"
#include "math/random.h"
#include "messages/vehicle.h"
#include "sensors/infrared_exposure.h"
#include "sensors/infrared_pair.h"
#include "worlds/recipes.h"

namespace {

using namespace arex;  // NOLINT: a program of one file

double cpu_ms() {
  timespec t{};
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &t);
  return static_cast<double>(t.tv_sec) * 1e3 + static_cast<double>(t.tv_nsec) * 1e-6;
}

/// A place 1.5 m above what is below, at least 1 m from everything.
Pose somewhere(const worlds::World& world, const sim::Scene& scene, RandomStream& random,
               double z_from) {
  for (;;) {
    const Vec3 low = world.bounds.low, high = world.bounds.high;
    Vec3 p(random.uniform(low.x() + 3, high.x() - 3), random.uniform(low.y() + 3, high.y() - 3),
           z_from);
    const sim::Hit ground = scene.cast(p, -Vec3::UnitZ(), 50);
    if (!ground.valid()) continue;
    p.z() += 1.5 - ground.distance_m;
    if (scene.distance_to_surface(p, 1, worlds::ClassSet::all()) < 1) continue;
    const Vec3 tilt(random.uniform(-0.1, 0.1), random.uniform(-0.1, 0.1), 0);
    return {so3::from_yaw(random.uniform(0, 2 * std::numbers::pi)) * so3::Exp(tilt), p};
  }
}

void save(const std::vector<std::uint8_t>& grey, int width, int height, const std::string& file) {
  RgbImage picture{width, height, {}};
  for (const std::uint8_t value : grey) picture.rgb.insert(picture.rgb.end(), 3, value);
  const std::string bytes = png_bytes(picture);
  std::ofstream(file, std::ios::binary)
      .write(bytes.data(), static_cast<std::streamsize>(bytes.size()));
}

void row(const char* name, std::vector<double> v) {
  std::sort(v.begin(), v.end());
  std::printf("  %-30s %8.2f %8.2f\n", name, v[v.size() / 2], v[v.size() * 95 / 100]);
}

void measure(const std::string& name, const worlds::World& world, double z_from, int frames,
             const std::string& folder) {
  const sim::Scene scene(world);
  const double t0 = cpu_ms();
  sim::InfraredConfig config;
  const sim::D430Config unit = sim::D430Config{}.as_built(1);
  sim::InfraredPair pair(config, unit, world, scene, VehicleConfig{}.X_BC(), 1);
  const double t1 = cpu_ms();
  std::printf("%s: %zu triangles, %zu lamps, %zu nodes of light %.2f m apart, baked in %.0f ms\n",
              name.c_str(), world.mesh.triangles.size(), pair.shader().lamps().size(),
              pair.shader().grid().nodes(), pair.shader().grid().spacing_m(), t1 - t0);
  sim::Renderer renderer(world, pair.shader().sample_camera(),
                         sim::InfraredShader::renderer_options(config.light));
  sim::AutoExposure exposure(config.sensor);
  RandomStream random(2, "poses");
  std::vector<double> draw_ms, left_ms, pair_ms, drawn;
  Fingerprint hash;
  std::vector<float> inverse_depth;
  std::vector<std::uint32_t> triangles;
  for (int i = 0; i < frames; ++i) {
    sim::InfraredShot shot;
    shot.X_WB = somewhere(world, scene, random, z_from);
    shot.v_WB = shot.X_WB.R * Vec3(1.5, 0, 0);
    shot.w_WB_B = Vec3(0, 0, 0.3);
    shot.right = false;
    for (int k = 0; k < 8 && i < 6; ++k) {  // as it would be after a while there
      shot.exposure = exposure.next();
      const auto image = pair.capture(shot);
      exposure.add(sim::central_mean(image->left, image->width, image->height), shot.exposure);
    }
    shot.stamp = i;
    const double a = cpu_ms();
    renderer.render_triangles(shot.X_WB * VehicleConfig{}.X_BC(), inverse_depth, triangles);
    const double b = cpu_ms();
    const auto left = pair.capture(shot);
    const double c = cpu_ms();
    shot.right = true;
    const auto both = pair.capture(shot);
    pair_ms.push_back(cpu_ms() - c);
    hash.add_bytes(std::span<const std::uint8_t>(both->left));
    hash.add_bytes(std::span<const std::uint8_t>(both->right));
    draw_ms.push_back(b - a);
    drawn.push_back(1e-3 * static_cast<double>(renderer.last_frame().triangles));
    left_ms.push_back(c - b);
    if (!folder.empty() && i < 6) {
      save(both->left, both->width, both->height, folder + "/" + name + std::to_string(i) + ".png");
      std::printf("  %s%d: exposed %.3f ms, gain %.2f\n", name.c_str(), i, 1e3 * both->exposure_s,
                  both->gain);
    }
  }
  std::printf("  %d frames at random poses, ms of CPU     median      p95\n", frames);
  row("triangles of one eye", draw_ms);
  row("left image", left_ms);
  row("pair", pair_ms);
  row("thousands of triangles drawn", drawn);
  std::printf("  hash of the pairs: %016llx\n", static_cast<unsigned long long>(hash.value()));
}

}  // namespace

int main(int argc, char** argv) {
  const int frames = argc > 1 ? std::atoi(argv[1]) : 40;
  const std::string folder = argc > 2 ? argv[2] : "";
  const std::string only = argc > 3 ? argv[3] : "";
  worlds::WorldConfig config;
  const auto world = [&](worlds::WorldKind kind) {
    config.kind = kind;
    return worlds::build_world(config, 1, VehicleConfig{}.radius_m);
  };
  if (only.empty() || only == "forest") {
    measure("forest", world(worlds::WorldKind::kForest), 1.8, frames, folder);
  }
  if (only.empty() || only == "garage") {
    measure("garage", world(worlds::WorldKind::kGarage), config.garage.ceiling_z_m - 1, frames,
            folder);
  }
  if (only.empty() || only == "pine") {
    measure("pine", world(worlds::WorldKind::kPine), 2, frames, folder);
  }
}
