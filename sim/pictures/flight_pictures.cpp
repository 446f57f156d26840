#include "pictures/flight_pictures.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace arex::sim {
namespace {

constexpr std::size_t kPathStride = 20;   // of 200 Hz poses: 10 Hz
constexpr double kHeadingTime = 1.5;      // s, in which the chase camera turns after the vehicle
constexpr double kCutAbove = 1.0;         // m above the vehicle: what the top view leaves out
constexpr double kCutSlack = 0.5;         // m, before it moves: the shadows are drawn anew then
constexpr int kInsetShare = 3;            // the top view takes a third of the chase view's width
constexpr int kInsetMargin = 12;          // pixels
constexpr double kChaseRadius = 0.012;    // m, of the path
constexpr double kTopRadius = 1.3;        // pixels
constexpr double kTopMark = 7;            // pixels, of the vehicle seen from above
constexpr double kSmallestOverview = 12;  // m
constexpr int kRingCorners = 24;
const Vec3 kMarkColour(0.9, 0.02, 0.12);

Eigen::AlignedBox3d box_of(const std::vector<TimedPose>& path) {
  Eigen::AlignedBox3d box;
  for (const TimedPose& pose : path) box.extend(pose.X.p);
  // Something beside the path is to be seen as well.
  const Vec3 room =
      (0.15 * box.sizes()).cwiseMax(Vec3(kSmallestOverview, kSmallestOverview, 0) / 4);
  return {box.min() - room, box.max() + room};
}

/// From above the middle of the path, high enough to see all of it, its longer side across.
struct TopCamera {
  Pose X_WC;
  double metres_per_pixel = 0;

  TopCamera(const Eigen::AlignedBox3d& box, const PictureOptions& options) {
    const Vec3 size = box.sizes();
    const bool x_across = size.x() >= size.y();
    const double across = x_across ? size.x() : size.y();
    const double along = x_across ? size.y() : size.x();
    const double aspect = static_cast<double>(options.width) / options.height;
    const double seen = std::max(across, along * aspect);  // across the picture, m
    const double height = seen / 2 / std::tan(options.field_of_view_rad / 2);
    // A little from the side, so that upright things show their height.
    const Vec3 back = x_across ? Vec3(0, -1, 0) : Vec3(-1, 0, 0);
    X_WC = look_at(box.center() + 0.2 * height * back + Vec3(0, 0, height), box.center());
    metres_per_pixel = seen / options.width;
  }
};

// What the top view takes of the whole picture: as much as its own shape needs.
PictureOptions inset_options(const Eigen::AlignedBox3d& box, PictureOptions options) {
  const double x = box.sizes().x(), y = box.sizes().y();
  const double aspect = std::clamp(std::max(x, y) / std::min(x, y), 1.0, 3.0);
  options.width /= kInsetShare;
  options.height = static_cast<int>(options.width / aspect);
  return options;
}

// Puts a picture into the upper right corner of another, with a white frame.
void inset(Picture& picture, const Picture& small) {
  constexpr int kFrame = 2;
  const auto pixel = [](const Picture& of, int u, int v) {
    return 3 * (static_cast<std::size_t>(v) * static_cast<std::size_t>(of.width) +
                static_cast<std::size_t>(u));
  };
  const int left = picture.width - small.width - kInsetMargin;
  for (int v = -kFrame; v < small.height + kFrame; ++v) {
    for (int u = -kFrame; u < small.width + kFrame; ++u) {
      const bool inside = u >= 0 && v >= 0 && u < small.width && v < small.height;
      std::uint8_t* to = &picture.rgb[pixel(picture, left + u, kInsetMargin + v)];
      if (inside) {
        std::copy_n(&small.rgb[pixel(small, u, v)], 3, to);
      } else {
        std::fill_n(to, 3, 255);
      }
    }
  }
}

}  // namespace

FlightPictures::FlightPictures(const worlds::World& world, const Pose& X_WO,
                               const std::vector<TimedPose>& truth, View view,
                               const PictureOptions& options)
    : view_(view), options_(options) {
  for (std::size_t i = 0; i < truth.size(); i += kPathStride) {
    path_.push_back({truth[i].time_s, X_WO * truth[i].X});
  }
  if (view != View::kTop) chase_ = std::make_unique<PictureRenderer>(world);
  if (view != View::kChase) top_ = std::make_unique<PictureRenderer>(world);
}

FlightPictures::~FlightPictures() = default;

Picture FlightPictures::at(double time_s, double path_until_s) {
  if (view_ == View::kTop) return top(time_s, path_until_s, options_);
  Picture picture = chase(time_s, path_until_s);
  if (view_ == View::kBoth) {
    inset(picture, top(time_s, path_until_s, inset_options(box_of(path_), options_)));
  }
  return picture;
}

Picture FlightPictures::chase(double time_s, double path_until_s) {
  const Pose X_WB = vehicle_at(time_s);
  const double yaw = so3::yaw(X_WB.R);
  if (heading_time_s_ < 0 || time_s < heading_time_s_) {
    heading_rad_ = yaw;
  } else {
    const double share = 1 - std::exp((heading_time_s_ - time_s) / kHeadingTime);
    heading_rad_ += share * so3::wrap(yaw - heading_rad_);
  }
  heading_time_s_ = time_s;
  // Behind and above the vehicle, looking a little ahead of it.
  const Mat3 R = so3::from_yaw(heading_rad_);
  const Pose X_WC = look_at(X_WB.p + R * Vec3(-2.6, 0.5, 0.9), X_WB.p + R * Vec3(1.5, 0, 0));
  return chase_->render(X_WC, options_, overlay(time_s, path_until_s, kChaseRadius));
}

Picture FlightPictures::top(double time_s, double path_until_s, const PictureOptions& options) {
  const Vec3 p_WB = vehicle_at(time_s).p;
  const TopCamera camera(box_of(path_), options);
  PictureOptions cut = options;
  if (!(std::abs(p_WB.z() + kCutAbove - cut_above_m_) <= kCutSlack)) {
    cut_above_m_ = p_WB.z() + kCutAbove;
  }
  cut.cut_above_m = cut_above_m_;
  auto drawn = overlay(time_s, path_until_s, kTopRadius * camera.metres_per_pixel);
  // From high above, the vehicle itself is a speck: a ring stands around it.
  PictureOverlay::Path ring{{}, kMarkColour, kTopRadius * camera.metres_per_pixel};
  for (int i = 0; i <= kRingCorners; ++i) {
    const double angle = 2 * std::numbers::pi * i / kRingCorners;
    const Vec3 out(std::cos(angle), std::sin(angle), 0);
    ring.points_W.push_back(p_WB + kTopMark * camera.metres_per_pixel * out);
  }
  drawn.paths.push_back(std::move(ring));
  return top_->render(camera.X_WC, cut, drawn);
}

Pose FlightPictures::vehicle_at(double time_s) const {
  const auto after =
      std::upper_bound(path_.begin(), path_.end(), time_s,
                       [](double time, const TimedPose& pose) { return time < pose.time_s; });
  if (after == path_.begin()) return path_.front().X;
  if (after == path_.end()) return path_.back().X;
  const TimedPose& before = *(after - 1);
  return interpolate(before.X, after->X,
                     (time_s - before.time_s) / (after->time_s - before.time_s));
}

PictureOverlay FlightPictures::overlay(double time_s, double path_until_s, double radius_m) const {
  PictureOverlay overlay;
  overlay.vehicles.push_back(vehicle_at(time_s));
  PictureOverlay::Path path;
  path.radius_m = radius_m;
  for (const TimedPose& pose : path_) {
    if (pose.time_s > path_until_s) break;
    path.points_W.push_back(pose.X.p);
  }
  if (path.points_W.size() > 1) overlay.paths.push_back(std::move(path));
  return overlay;
}

}  // namespace arex::sim
