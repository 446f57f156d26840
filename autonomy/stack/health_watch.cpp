#include "stack/health_watch.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <utility>

namespace arex {
namespace {

constexpr double kImuHz = 200;
constexpr double kImageMemory = 50;    // frames
constexpr double kGyroStep_radps = 1;  // RMS of all axes; airframes that shake give 0.4
constexpr int kPixelStep = 8;          // a survey needs no more of 400,000 pixels
constexpr int kGlare = 20;             // pixels to each side: beyond what an edge or a twig hides
constexpr int kFewSurfaces = 300;      // pixels; of fewer no share is told

constexpr StreamWatchConfig kImuStream{
    .silent_s = 0.03, .stuck_readings = 20, .late_s = 0.006, .learnt_readings = 100};
// What is silent of a LiDAR is LidarWatch's to say.
constexpr StreamWatchConfig kLidarStream{
    .silent_s = 1e6, .stuck_readings = 2, .late_s = 0.08, .learnt_readings = 10};
constexpr StreamWatchConfig kImageStream{.silent_s = 0.5,
                                         .silent_periods = 3,
                                         .stuck_readings = 2,
                                         .late_s = 0.08,
                                         .learnt_readings = 10};
constexpr StreamWatchConfig kMocapStream{.silent_s = 0.1, .stuck_readings = 40};

struct Survey {
  double valid = 0;  ///< share of the pixels looked at
  double sum_m = 0;  ///< of their depths
  double rough = 0;  ///< mean deviation from the neighbours' mean, of the depth
  double holes = 0;  ///< of the pixels with one surface on both sides, the share without a depth
  bool surfaces = false;  ///< there are enough of those to tell
};

/// Where the pixels left and right show one surface, a sound camera has a depth between them; sky
/// and what is out of range leave no such holes.
void survey_holes(const DepthImage& image, Survey& survey) {
  constexpr float kSameSurface = 0.05F;  // of the depth
  int between = 0, holes = 0;
  for (int v = 0; v < image.camera.height; v += kPixelStep) {
    for (int u = kGlare; u + kGlare < image.camera.width; u += kPixelStep) {
      const float left = image.at(u - kGlare, v), right = image.at(u + kGlare, v);
      if (left == 0 || right == 0) continue;
      if (std::abs(left - right) > kSameSurface * std::min(left, right)) continue;
      ++between;
      holes += image.at(u, v) == 0;
    }
  }
  survey.surfaces = between >= kFewSurfaces;
  if (survey.surfaces) survey.holes = static_cast<double>(holes) / between;
}

/// Returns between two of their laser line at the same range: leaves and twigs, of which a depth
/// camera makes little, have none.
std::vector<Vec3f> points_on_surfaces(const LidarScan& scan) {
  constexpr float kSameSurface = 0.03F;  // of the range
  struct Line {
    const LidarPoint* before = nullptr;
    const LidarPoint* middle = nullptr;
  };
  std::array<Line, 256> lines;
  std::vector<Vec3f> points;
  for (const LidarPoint& point : scan.points) {
    Line& line = lines[point.line];
    if (line.before != nullptr) {
      const float range = line.middle->p_L.norm();
      const float least = std::min(line.before->p_L.norm(), point.p_L.norm());
      const float most = std::max(line.before->p_L.norm(), point.p_L.norm());
      const bool one_surface =
          std::max(most, range) - std::min(least, range) < kSameSurface * range;
      if (one_surface) points.push_back(line.middle->p_L);
    }
    line = {line.middle, &point};
  }
  return points;
}

Survey survey(const DepthImage& image) {
  constexpr float kSameSurface = 0.1F;  // of the depth
  constexpr float kNear_m = 3;          // beyond, a stereo camera's own noise is as large
  Survey seen;
  int looked = 0, valid = 0, smooth = 0;
  double deviation = 0;
  for (int v = 0; v < image.camera.height; v += kPixelStep) {
    for (int u = kPixelStep; u + kPixelStep < image.camera.width; u += kPixelStep) {
      ++looked;
      const float here = image.at(u, v);
      if (here == 0) continue;
      ++valid;
      seen.sum_m += static_cast<double>(here);
      const float left = image.at(u - 4, v), right = image.at(u + 4, v);
      const float mean = 0.5F * (left + right);
      if (left == 0 || right == 0 || mean > kNear_m) continue;
      if (std::abs(left - right) > kSameSurface * mean) continue;
      if (std::abs(here - mean) > 3 * kSameSurface * mean) continue;
      ++smooth;
      deviation += std::abs(here - mean) / mean;
    }
  }
  if (looked == 0) return {};
  constexpr int kFew = 100;  // say nothing
  seen.valid = static_cast<double>(valid) / looked;
  if (smooth >= kFew) seen.rough = deviation / smooth;
  survey_holes(image, seen);
  return seen;
}

}  // namespace

HealthWatch::HealthWatch(const HealthWatchConfig& config, VehicleConfig vehicle,
                         ExpectedSensors expected)
    : config_(config),
      vehicle_(std::move(vehicle)),
      expected_(expected),
      vibration_(config.vibration, kImuHz),
      field_(config.field_step_gauss),
      gyro_steps_("imu", kGyroStep_radps) {}

StreamWatch& HealthWatch::stream(const std::string& name, const StreamWatchConfig& config) {
  return streams_.try_emplace(name, name, config).first->second;
}

void HealthWatch::add_imu(Stamp now, const ImuSample& imu) {
  const Vec3 &w = imu.gyro_radps, &a = imu.accel_mps2;
  stream("imu", kImuStream)
      .add(now, imu.stamp, std::array{w.x(), w.y(), w.z(), a.x(), a.y(), a.z()});
  vibration_.add(w, a);
  field_.add(imu.field_gauss);
  gyro_steps_.add(w);
}

void HealthWatch::add_scan(Stamp now, const LidarScanPtr& scan) {
  std::array<double, StreamWatch::kValues> ends{};
  if (!scan->points.empty()) {
    const Vec3f &first = scan->points.front().p_L, &last = scan->points.back().p_L;
    ends = {first.x(), first.y(), first.z(), last.x(), last.y(), last.z()};
  }
  stream(scan->device.empty() ? "lidar" : scan->device, kLidarStream).add(now, scan->end, ends);
  if (scan->device.empty()) scan_ = scan;
}

// Into the sky and close before the ground there is nothing to measure, and no fault in it. The
// surfaces that the LiDAR has met within the camera's reach and view, a sound camera measures.
bool HealthWatch::is_excused(const DepthImage& image) const {
  constexpr Stamp kFresh = kNanosecondsPerSecond / 2;
  constexpr double kNearest_m = 0.5, kReach_m = 5;  // what any stereo depth camera measures
  constexpr int kFew = 100;                         // points
  if (!scan_ || image.stamp - scan_->end > kFresh) return false;
  const Pose X_CL = vehicle_.X_BC(image.device).inverse() * vehicle_.X_BL();
  const PinholeCamera& camera = image.camera;
  int there = 0, unseen = 0;
  for (const Vec3f& p_L : points_on_surfaces(*scan_)) {
    const Vec3 p_C = X_CL * Vec3(p_L.cast<double>());
    if (p_C.z() < kNearest_m || p_C.z() > kReach_m) continue;
    const double u = camera.cx + camera.fx * p_C.x() / p_C.z();
    const double v = camera.cy + camera.fy * p_C.y() / p_C.z();
    if (!(u > -0.5 && v > -0.5 && u < camera.width - 0.5 && v < camera.height - 0.5)) continue;
    ++there;
    unseen += image.at(static_cast<int>(std::lround(u)), static_cast<int>(std::lround(v))) == 0;
  }
  return there < kFew || unseen < (1 - config_.blind_share) * there;
}

void HealthWatch::add_depth(Stamp now, const DepthImage& image) {
  const std::string name = image.device.empty() ? "depth" : image.device;
  const Survey seen = survey(image);
  // Dark images are alike, and nothing stuck.
  const double tells_apart = seen.valid > 0 ? 0 : to_seconds(image.stamp);
  stream(name, kImageStream).add(now, image.stamp, std::array{seen.sum_m, tells_apart});
  Images& images = images_[name];
  if (images.usual_valid < 0) images.usual_valid = seen.valid;
  if (images.usual_rough < 0 && seen.rough > 0) images.usual_rough = seen.rough;
  const bool blind = seen.valid < config_.blind_share * images.usual_valid;
  const bool excused = blind && is_excused(image);
  const bool rough = images.usual_rough > 0 && seen.rough > config_.rough_fraction &&
                     seen.rough > config_.rough_factor * images.usual_rough;
  if (images.usual_holes < 0 && seen.surfaces) images.usual_holes = seen.holes;
  const bool tells = (!blind || excused) && seen.surfaces;
  constexpr double kOver = 0.5;  // of the limit: it has ended
  const double limit = (images.holes.told ? kOver : 1) * config_.holes_share;
  const bool holes = tells && seen.holes > images.usual_holes + limit;
  if (tells) images.holes.add(now, holes);
  if (!excused) images.blind.add(now, blind);
  images.rough.add(now, rough);
  // What is wrong does not become usual.
  if (!blind) images.usual_valid += (seen.valid - images.usual_valid) / kImageMemory;
  if (!rough && seen.rough > 0) {
    images.usual_rough += (seen.rough - images.usual_rough) / kImageMemory;
  }
  if (tells && !holes) {
    images.usual_holes += (seen.holes - images.usual_holes) / kImageMemory;
  }
  tell_images(now, name, images);
}

void HealthWatch::add_images(Stamp now, const StereoImage& images) {
  constexpr std::size_t kEach = 61;  // pixels: of every row some, of no column all
  double sum = 0, moment = 0;
  std::uint8_t least = 255, most = 0;
  for (std::size_t i = 0; i < images.left.size(); i += kEach) {
    const std::uint8_t grey = images.left[i];
    sum += grey;
    moment += static_cast<double>(i) * grey;
    least = std::min(least, grey);
    most = std::max(most, grey);
  }
  // Black images are alike, and white ones, and nothing stuck.
  const double tells_apart = least < most ? 0 : to_seconds(images.time_ns);
  stream("infrared", kImageStream).add(now, images.time_ns, std::array{sum, moment, tells_apart});
}

void HealthWatch::tell_images(Stamp now, const std::string& name, Images& images) {
  const auto tell = [&](Finding& finding, const char* what) {
    if (!finding.told && finding.frames >= config_.frames) {
      finding.told = true;
      report(now, EventKind::kSensorFault, name + " " + what);
    } else if (finding.told && finding.frames == 0 &&
               now - finding.newest >= from_seconds(config_.sound_s)) {
      finding.told = false;
      report(now, EventKind::kSensorFault, name + " not " + what + " any more");
    }
  };
  tell(images.blind, "blinded");
  tell(images.holes, "blinded in part");
  tell(images.rough, "noisy");
}

void HealthWatch::add_mocap(Stamp now, const MocapSample& mocap) {
  const Vec3 &p = mocap.X_OB.p, &v = mocap.v_OB;
  stream("mocap", kMocapStream)
      .add(now, mocap.stamp, std::array{p.x(), p.y(), p.z(), v.x(), v.y(), v.z()});
}

void HealthWatch::expect(Stamp now) {
  if (expected_.imu) stream("imu", kImuStream).expect(now);
  if (expected_.depth) stream("depth", kImageStream).expect(now);
  if (expected_.infrared) stream("infrared", kImageStream).expect(now);
}

std::vector<Event> HealthWatch::update(Stamp now, const Flight& flight) {
  if (flight.armed) expect(now);
  for (auto& [name, stream] : streams_) {
    if (auto change = stream.update(now, flight.in_air)) {
      report(now, EventKind::kSensorFault, *std::move(change));
    }
  }
  if (auto change = field_.update(flight.in_air)) {
    report(now, EventKind::kSensorFault, *std::move(change));
  }
  const auto shaken = vibration_.update();
  if (shaken && flight.armed) report(now, EventKind::kVibration, *shaken);
  const auto imu = streams_.find("imu");
  const bool faulty = imu != streams_.end() && imu->second.faulty();
  const bool jumps_about = gyro_steps_.step_rms() > kGyroStep_radps;
  if (faulty || jumps_about || vibration_.shakes()) imu_faulty_ = now;
  const double difference = flight.attitude_difference_rad;
  if (contradicts_.holds(flight.in_air && difference > config_.attitude_limit_rad, now,
                         from_seconds(config_.lasting_s))) {
    report(now, EventKind::kSensorFault,
           fmt::format("attitude: autopilot and odometry differ by {:.0f} degrees",
                       difference * 180 / std::numbers::pi));
  }
  if (off_path_.holds(flight.in_air && flight.off_path_m > config_.off_path_m, now,
                      from_seconds(config_.lasting_s))) {
    report(now, EventKind::kVehicleFault,
           fmt::format("out of control: {:.1f} m off its path", flight.off_path_m));
  }
  return std::exchange(events_, {});
}

bool HealthWatch::imu_sound(Stamp now) const {
  constexpr Stamp kAfter = 2 * kNanosecondsPerSecond;  // until odometry has found itself again
  return imu_faulty_ < 0 || now - imu_faulty_ > kAfter;
}

void HealthWatch::report(Stamp now, EventKind kind, std::string detail) {
  events_.push_back({now, kind, std::move(detail)});
}

}  // namespace arex
