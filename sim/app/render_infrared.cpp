#include "app/render_infrared.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <optional>

#include "config/config.h"
#include "math/so3.h"
#include "physics/airframe.h"
#include "pictures/picture.h"
#include "report/table.h"
#include "run/file_io.h"
#include "sensors/infrared_exposure.h"
#include "sensors/infrared_pair.h"

namespace arex::app {
namespace {

constexpr double kSameFrame = 2e-3;  // of two stamps of one frame, s

/// One value of a frame's row in a table, found by the nearest time.
std::size_t nearest_row(const std::vector<double>& times, double time) {
  const auto nearest = std::min_element(times.begin(), times.end(), [time](double a, double b) {
    return std::abs(a - time) < std::abs(b - time);
  });
  return static_cast<std::size_t>(nearest - times.begin());
}

Pose pose_at(const std::vector<sim::TimedPose>& truth, double time_s) {
  const auto after =
      std::lower_bound(truth.begin() + 1, truth.end() - 1, time_s,
                       [](const sim::TimedPose& pose, double time) { return pose.time_s < time; });
  const sim::TimedPose& b = *after;
  const sim::TimedPose& a = *(after - 1);
  const double span = b.time_s - a.time_s;
  const double fraction = span > 0 ? std::clamp((time_s - a.time_s) / span, 0.0, 1.0) : 0;
  return interpolate(a.X, b.X, fraction);
}

/// Pose and motion by the recorded truth.
sim::InfraredShot shot_at(const std::vector<sim::TimedPose>& truth, const Pose& X_WO,
                          double time_s) {
  constexpr double kStep = 0.01;  // two poses of the recording, s
  const Pose before = X_WO * pose_at(truth, time_s - 0.5 * kStep);
  const Pose after = X_WO * pose_at(truth, time_s + 0.5 * kStep);
  sim::InfraredShot shot;
  shot.stamp = from_seconds(time_s);
  shot.X_WB = X_WO * pose_at(truth, time_s);
  shot.v_WB = (after.p - before.p) / kStep;
  shot.w_WB_B = so3::Log(before.R.transpose() * after.R) / kStep;
  shot.right = false;
  return shot;
}

/// A row of infrared.csv; nothing: an older run's, which says how but not from where.
std::optional<sim::InfraredShot> shot_of(const sim::Table& frames, std::size_t row) {
  const auto at = [&](const char* name) {
    const std::vector<double> values = frames.numbers(name);
    return values.empty() ? std::nan("") : values[row];
  };
  sim::InfraredShot shot;
  shot.stamp = from_seconds(at("time_s"));
  shot.X_WB.p = Vec3(at("x_m"), at("y_m"), at("z_m"));
  shot.X_WB.R = Quat(at("qw"), at("qx"), at("qy"), at("qz")).toRotationMatrix();
  shot.v_WB = Vec3(at("vx_mps"), at("vy_mps"), at("vz_mps"));
  shot.w_WB_B = Vec3(at("wx_radps"), at("wy_radps"), at("wz_radps"));
  shot.right = false;
  const bool whole = shot.X_WB.p.allFinite() && shot.X_WB.R.allFinite() && shot.v_WB.allFinite() &&
                     shot.w_WB_B.allFinite();
  return whole ? std::optional(shot) : std::nullopt;
}

/// Of a scene that nobody looked at before: as auto exposure settles in front of it.
sim::InfraredExposure settled(const sim::InfraredSensorConfig& config, sim::InfraredPair& pair,
                              sim::InfraredShot shot) {
  constexpr int kFrames = 20;
  sim::AutoExposure exposure(config);
  for (int i = 0; i < kFrames; ++i) {
    shot.exposure = exposure.next();
    const auto image = pair.capture(shot);
    exposure.add(sim::central_mean(image->left, image->width, image->height), shot.exposure);
    if (exposure.next().exposure_s == shot.exposure.exposure_s &&
        exposure.next().gain == shot.exposure.gain) {
      break;
    }
  }
  return exposure.next();
}

sim::Picture in_colour(const StereoImage& image) {
  sim::Picture picture{image.width, image.height, {}};
  picture.rgb.reserve(3 * image.left.size());
  for (const std::uint8_t grey : image.left) picture.rgb.insert(picture.rgb.end(), 3, grey);
  return picture;
}

/// A ring of 3 px around a feature; red when it was just found, green once it has been followed for
/// 20 frames.
void draw_feature(double u, double v, double age, sim::Picture& picture) {
  constexpr double kOld = 20, kInner = 2.2, kOuter = 3.4;
  const double old = std::clamp(age / kOld, 0.0, 1.0);
  const auto red = static_cast<std::uint8_t>(255 * (1 - old));
  const auto green = static_cast<std::uint8_t>(80 + 175 * old);
  const int column = static_cast<int>(std::lround(u)), row = static_cast<int>(std::lround(v));
  for (int y = row - 4; y <= row + 4; ++y) {
    for (int x = column - 4; x <= column + 4; ++x) {
      const double distance = std::hypot(x - u, y - v);
      const bool inside = x >= 0 && y >= 0 && x < picture.width && y < picture.height;
      if (!inside || distance < kInner || distance > kOuter) continue;
      std::uint8_t* pixel =
          &picture.rgb[3 * (static_cast<std::size_t>(y) * static_cast<std::size_t>(picture.width) +
                            static_cast<std::size_t>(x))];
      pixel[0] = red;
      pixel[1] = green;
      pixel[2] = 40;
    }
  }
}

/// Those of vio_features.csv that stand in the frame nearest to `time_s`, if the run has any.
int draw_features(const std::filesystem::path& folder, double time_s, double period_s,
                  sim::Picture& picture) {
  const sim::Table table = sim::read_table(folder / "vio_features.csv");
  const std::vector<double> times = table.numbers("time_s");
  if (times.empty()) return 0;
  const double frame = times[nearest_row(times, time_s)];
  if (std::abs(frame - time_s) > 0.5 * period_s) return 0;
  const std::vector<double> u = table.numbers("u"), v = table.numbers("v");
  const std::vector<double> age = table.numbers("age");
  int drawn = 0;
  for (std::size_t i = 0; i < times.size(); ++i) {
    if (std::abs(times[i] - frame) > kSameFrame || !std::isfinite(u[i] + v[i])) continue;
    draw_feature(u[i], v[i], std::isfinite(age[i]) ? age[i] : 0, picture);
    ++drawn;
  }
  return drawn;
}

/// Where the vehicle got no such image, or another: the picture is what the pair took, or would
/// have.
std::string remarks_at(const sim::ScenarioConfig& config, double time_s) {
  if (!config.draws_infrared()) return "; the vehicle flew without this camera";
  std::string told;
  for (const sim::FaultConfig& fault : config.faults) {
    if (fault.device != "infrared" || !fault.holds(from_seconds(time_s))) continue;
    told += fmt::format("; fault then: infrared {}, so the vehicle did not get this image as it is",
                        sim::kFaultKindNames[static_cast<std::size_t>(fault.kind)]);
  }
  return told;
}

}  // namespace

void draw_infrared(const RenderArguments& arguments, const sim::Scenario& scenario,
                   const worlds::World& world, const std::vector<sim::TimedPose>& truth) {
  const sim::ScenarioConfig& config = scenario.config;
  const double begin = truth.front().time_s, end = truth.back().time_s;
  double time = arguments.time_s.value_or(0.5 * end);
  if (!(time >= begin && time <= end)) {
    throw ConfigError(fmt::format(
        "--time {:g}: lies outside of the flight, expected {:.2f} to {:.2f} s", time, begin, end));
  }
  const sim::Scene scene(world);
  sim::InfraredPair pair(config.infrared, config.depth.model.as_built(config.seed), world, scene,
                         sim::load_airframe().X_BC, config.seed);
  const sim::Table frames = sim::read_table(arguments.folder + "/infrared.csv");
  const std::vector<double> times = frames.numbers("time_s");
  std::optional<std::size_t> row;
  if (!times.empty()) row = nearest_row(times, time);
  if (row) time = times[*row];
  const std::optional<sim::InfraredShot> taken = row ? shot_of(frames, *row) : std::nullopt;
  sim::InfraredShot shot = taken ? *taken : shot_at(truth, sim::start_pose(world), time);
  if (row) {
    shot.exposure = {frames.numbers("exposure_s")[*row], frames.numbers("gain")[*row]};
  } else {
    shot.exposure = settled(config.infrared.sensor, pair, shot);
  }
  sim::Picture picture = in_colour(*pair.capture(shot));
  const int features =
      draw_features(arguments.folder, time, 1.0 / config.infrared.rate_hz, picture);
  sim::save_png(picture, arguments.out);
  std::printf("%s: left infrared image of %.3f s, exposed %.3f ms, gain %.2f, %d features%s\n",
              arguments.out.c_str(), time, 1e3 * shot.exposure.exposure_s, shot.exposure.gain,
              features, remarks_at(config, time).c_str());
}

}  // namespace arex::app
