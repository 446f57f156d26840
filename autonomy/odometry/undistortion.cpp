#include "odometry/undistortion.h"

#include <cmath>

#include "math/so3.h"

namespace arex {
namespace {

/// A segment made ready for its points: in L at the instant, p = M (q + t x (q + t/2 x (q + t/3 x
/// q))) + c(tau), with q the point in B at its own time, t = w tau the small turn since the
/// segment's middle (fourth order is left out: below 1e-6 rad at 10 rad/s) and c the vehicle's
/// path.
struct PointTransform {
  Mat3 M;
  Vec3 w;
  Vec3 c0, c1, c2;
};

PointTransform make_transform(const MotionSegment& segment, const Pose& X_LO, double half_dt_s) {
  const Pose middle = segment.pose_at(half_dt_s);
  const Vec3 v_middle = segment.v_OB + half_dt_s * segment.a_OB;
  PointTransform t;
  t.M = X_LO.R * middle.R;
  t.w = segment.w_OB_B;
  t.c0 = X_LO * middle.p;
  t.c1 = X_LO.R * v_middle;
  t.c2 = 0.5 * (X_LO.R * segment.a_OB);
  return t;
}

}  // namespace

Pose MotionSegment::pose_at(double since_begin_s) const {
  return {X_OB.R * so3::Exp(w_OB_B * since_begin_s),
          X_OB.p + v_OB * since_begin_s + 0.5 * since_begin_s * since_begin_s * a_OB};
}

MotionSegment motion_segment(const NavigationState& x, const ImuInterval& imu) {
  const NavigationState y = propagate(x, imu);
  MotionSegment segment;
  segment.begin = imu.begin;
  segment.end = imu.end;
  segment.X_OB = x.X_OB();
  segment.v_OB = x.v_OB;
  segment.w_OB_B = x.rate(imu.mean_gyro());
  segment.a_OB = (y.v_OB - x.v_OB) / imu.dt_s();
  return segment;
}

std::vector<ScanPoint> undistort(const LidarScan& scan, const std::vector<MotionSegment>& segments,
                                 const Pose& X_OB, const Pose& X_BL, const LidarNoiseConfig& config,
                                 double body_radius_m) {
  std::vector<ScanPoint> out;
  if (segments.empty()) return out;
  out.reserve(scan.points.size());

  const Pose X_LO = (X_OB * X_BL).inverse();
  std::vector<PointTransform> transforms;
  transforms.reserve(segments.size());
  for (const MotionSegment& segment : segments) {
    transforms.push_back(
        make_transform(segment, X_LO, 0.5 * to_seconds(segment.end - segment.begin)));
  }

  const double body_radius2 = body_radius_m * body_radius_m;
  const double blind2 = config.blind_m * config.blind_m;
  const double max_range2 = config.max_range_m * config.max_range_m;
  std::size_t s = 0;
  for (std::size_t i = 0; i < scan.points.size(); ++i) {
    const LidarPoint& point = scan.points[i];
    const Stamp stamp = scan.stamp + point.offset_ns;
    while (s + 1 < segments.size() && stamp >= segments[s].end) ++s;
    while (s > 0 && stamp < segments[s].begin) --s;

    const Vec3 p_L = point.p_L.cast<double>();
    const double range2 = p_L.squaredNorm();
    const Vec3 q = X_BL.R * p_L + X_BL.p;
    // Written so that a NaN is dropped too.
    if (!(range2 >= blind2 && range2 <= max_range2 && q.squaredNorm() >= body_radius2)) continue;

    const PointTransform& t = transforms[s];
    const double tau = 1e-9 * static_cast<double>(stamp - segments[s].begin) -
                       0.5e-9 * static_cast<double>(segments[s].end - segments[s].begin);
    const Vec3 turn = t.w * tau;
    const Vec3 third = q + (1.0 / 3) * turn.cross(q);
    const Vec3 second = q + 0.5 * turn.cross(third);
    const Vec3 turned = q + turn.cross(second);
    const Vec3 moved = t.M * turned + (t.c0 + tau * (t.c1 + tau * t.c2));
    out.push_back({moved.cast<float>(), static_cast<float>(std::sqrt(range2)),
                   static_cast<std::uint32_t>(i)});
  }
  return out;
}

}  // namespace arex
