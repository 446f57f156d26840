#include "flights.h"

#include <algorithm>
#include <cmath>
#include <fstream>
#include <sstream>

#include "physics/airframe.h"
#include "sensors/imu.h"
#include "sensors/mid360.h"
#include "worlds/garage_plan.h"
#include "worlds/recipes.h"

namespace arex::bench {
namespace {

constexpr double kRest = 3.0;
constexpr double kKnot = 0.8;
constexpr double kSpinUp = 2.5;         // rotors turn from here on
constexpr double kHoverSpeed = 716;     // rad/s, at hover
constexpr double kGroundOffset = 0.14;  // B above the pad

/// Control points along a polyline at constant speed, the yaw along it.
void follow(std::vector<Vec4>& points, const std::vector<Vec3>& corners, double step) {
  for (std::size_t i = 0; i + 1 < corners.size(); ++i) {
    const Vec3 leg = corners[i + 1] - corners[i];
    const int n = std::max(1, static_cast<int>(std::lround(leg.norm() / step)));
    const double before = points.empty() ? 0 : points.back()[3];
    const double yaw = leg.head<2>().norm() > 0.1
                           ? before + so3::wrap(std::atan2(leg.y(), leg.x()) - before)
                           : before;
    // Turn over the first second of a leg.
    for (int k = 1; k <= n; ++k) {
      const Vec3 p = corners[i] + leg * k / n;
      points.emplace_back(p.x(), p.y(), p.z(), k == 1 ? 0.5 * (before + yaw) : yaw);
    }
  }
}

test::AnalyticMotion make_motion(const FlightOptions& options) {
  const double step = options.speed_mps * kKnot;
  if (options.world == "forest") {
    return {test::loop_points(36, 18, 1.5, options.speed_mps, kKnot, 2), kKnot, kRest};
  }
  // As scenarios/garage_waypoints.yaml: down the ramp, along the aisles and back by the middle one.
  std::vector<Vec4> points{Vec4::Zero()};
  const worlds::GaragePlan plan = worlds::plan_garage(worlds::GarageRecipe{}, options.seed);
  const double crest = plan.crest_x, foot = plan.foot_x;
  follow(points,
         {{0, 0, 0},
          {0, 0, 1.3},
          {crest, 0, 1.3},
          {foot, 0, -7.2},
          {58, 0, -7.2},
          {58, 16.5, -7.2},
          {97, 16.5, -7.2},
          {97, 0, -7.2},
          {40, 0, -7.2}},
         step);
  return {points, kKnot, kRest};
}

worlds::World make_world(const FlightOptions& options, const test::AnalyticMotion& motion) {
  worlds::WorldConfig config;
  if (options.world == "garage") {
    config.kind = worlds::WorldKind::kGarage;
  } else {
    worlds::Corridor corridor;
    for (double t = kRest; t < motion.end_s(); t += 1) {
      corridor.points_m.emplace_back(motion.at(t).X_OB.p.head<2>());
    }
    corridor.width_m = 1.6;
    config.forest.corridors.push_back(corridor);
  }
  return worlds::build_world(config, options.seed, sim::load_airframe().radius_m);
}

}  // namespace

std::string FlightOptions::name() const {
  std::ostringstream text;
  text << world << "-" << seed;
  if (lidar_noise_floor_m > 0) text << "-lidar" << lidar_noise_floor_m;
  if (imu_noise_factor != 1) text << "-imu" << imu_noise_factor;
  if (extrinsic_error_rad.norm() > 0) text << "-extrinsic" << extrinsic_error_rad.norm();
  if (noise_free) text << "-clean";
  return text.str();
}

struct Flight::Simulation {
  explicit Simulation(const FlightOptions& options)
      : motion(make_motion(options)), world(make_world(options, motion)), scene(world) {
    X_WO = world.X_WS;
    X_WO.p += kGroundOffset * X_WO.R.col(2);
    const sim::Airframe airframe = sim::load_airframe();
    sim::Mid360Config config;
    config.noise_free = options.noise_free;
    config.echo.range_noise_floor_m = options.lidar_noise_floor_m;
    config.extrinsic_rotation_error_rad = options.extrinsic_error_rad;
    lidar =
        std::make_unique<sim::Mid360>(config, scene, airframe.X_BL, airframe.shapes, options.seed);
  }

  [[nodiscard]] sim::Truth truth(Stamp stamp) const {
    const test::MotionState state = motion.at(to_seconds(stamp));
    sim::Truth truth;
    truth.stamp = stamp;
    truth.X_WB = X_WO * state.X_OB;
    truth.v_WB = X_WO.R * state.v_OB;
    truth.w_WB_B = state.w_OB_B;
    truth.a_WB = X_WO.R * state.a_OB;
    if (to_seconds(stamp) >= kSpinUp) {
      const double thrust = (state.a_OB + Vec3(0, 0, kGravity)).norm() / kGravity;
      truth.rotor_radps.fill(kHoverSpeed * std::sqrt(thrust));
    }
    return truth;
  }

  test::AnalyticMotion motion;
  worlds::World world;
  sim::Scene scene;
  Pose X_WO;
  std::unique_ptr<sim::Mid360> lidar;
};

Flight::Flight(const FlightOptions& options, const std::filesystem::path& recordings)
    : options_(options), simulation_(std::make_unique<Simulation>(options)) {
  if (!recordings.empty()) {
    file_ = recordings / options.name();
    std::filesystem::create_directories(file_);
  }
  scans_ =
      static_cast<int>(std::floor(std::min(simulation_->motion.end_s(), options.longest_s) * 10));
  sim::ImuConfig config;
  config.noise_free = options.noise_free;
  config.gyro_noise_density *= options.imu_noise_factor;
  config.gyro_walk_density *= options.imu_noise_factor;
  config.accel_noise_density *= options.imu_noise_factor;
  config.accel_walk_density *= options.imu_noise_factor;
  sim::ImuModel model(config, options.seed);
  for (Stamp stamp = 0; stamp <= Stamp{scans_} * 100'000'000 + 50'000'000;
       stamp += kNanosecondsPerTick) {
    model.sample(simulation_->truth(stamp));
    if (model.output()) imu_.push_back(*model.output());
  }
}

Flight::~Flight() = default;

LidarScanPtr Flight::scan(int i) {
  constexpr int kTicks = 100;
  const std::filesystem::path file = file_ / std::to_string(i);
  auto scan = std::make_shared<LidarScan>();
  if (!file_.empty() && std::filesystem::exists(file)) {
    std::ifstream in(file, std::ios::binary);
    scan->stamp = Stamp{i} * kTicks * kNanosecondsPerTick;
    scan->end = scan->stamp + kTicks * kNanosecondsPerTick;
    scan->points.resize(std::filesystem::file_size(file) / sizeof(LidarPoint));
    in.read(reinterpret_cast<char*>(scan->points.data()),
            static_cast<std::streamsize>(scan->points.size() * sizeof(LidarPoint)));
    return scan;
  }
  std::vector<sim::Truth> ticks;
  for (int k = 0; k <= kTicks; ++k) {
    ticks.push_back(simulation_->truth((Stamp{i} * kTicks + k) * kNanosecondsPerTick));
  }
  *scan = simulation_->lidar->scan(ticks);
  if (!file_.empty()) {
    std::ofstream(file, std::ios::binary)
        .write(reinterpret_cast<const char*>(scan->points.data()),
               static_cast<std::streamsize>(scan->points.size() * sizeof(LidarPoint)));
  }
  return scan;
}

Pose Flight::X_WB(Stamp stamp) const {
  return simulation_->X_WO * simulation_->motion.at(to_seconds(stamp)).X_OB;
}

sim::Truth Flight::truth(Stamp stamp) const { return simulation_->truth(stamp); }

const worlds::World& Flight::world() const { return simulation_->world; }

const sim::Scene& Flight::scene() const { return simulation_->scene; }

double Flight::distance_m() const {
  double distance = 0;
  const test::AnalyticMotion& motion = simulation_->motion;
  for (double t = 0; t < motion.end_s(); t += 0.1) {
    distance += (motion.at(t + 0.1).X_OB.p - motion.at(t).X_OB.p).norm();
  }
  return distance;
}

double Flight::surface_distance(const Vec3& p_W) const {
  return simulation_->scene.distance_to_surface(p_W, 1.0, worlds::ClassSet::all());
}

}  // namespace arex::bench
