#include "sensors/frame_detection.h"

#include <gtest/gtest.h>

#include <cmath>

#include "math/so3.h"
#include "sensors/mid360_pattern.h"

namespace arex::sim {
namespace {

// As models/arex/arex.xml has it: at the nose, tilted forward by 45 degrees.
Pose mount() { return {so3::Exp({0, to_radians(45), 0}), {0.15, 0, 0.01}}; }

SparseAnswer look(double thickness_m, double distance_m, double rate_hz = 10,
                  std::uint64_t seed = 1) {
  Mid360Config lidar;
  lidar.rate_hz = rate_hz;
  SparseQuery query;
  query.thickness_m = thickness_m;
  query.distance_m = distance_m;
  return look_at_bars(query, lidar, mount(), seed);
}

/// Where a ray from the LiDAR meets a round bar, by the quadratic equation.
bool meets(const Vec3& o, const Vec3& d, const Vec2& axis, double radius, double half) {
  const Vec2 from = o.head<2>() - axis, along = d.head<2>();
  const double a = along.squaredNorm(), b = from.dot(along);
  const double c = from.squaredNorm() - radius * radius;
  const double discriminant = b * b - a * c;
  if (!(discriminant >= 0)) return false;
  const double t = (-b - std::sqrt(discriminant)) / a;
  return t > 0 && std::abs(o.z() + t * d.z()) <= half;
}

// Without noise and with an infinitely thin beam, what returns is a matter of geometry alone.
TEST(SparseFrames, ReturnsAreThoseOfThePatternOnARoundBar) {
  Mid360Config lidar;
  lidar.noise_free = true;
  lidar.beam_half_angle_deg = 0;
  lidar.packet_jitter_s = 0;
  const Mid360Pattern pattern(lidar.pattern, lidar.pattern_turn_deg);
  const Pose X_BL = mount();
  for (const double distance : {1.5, 4.0}) {
    SparseQuery query;
    query.thickness_m = 0.05;
    query.distance_m = distance;
    query.frames = 5;
    std::int64_t expected = 0;
    for (std::int64_t i = 0; i < 5 * 20'000; ++i) {
      const Vec3 d = X_BL.R * pattern.direction(i);
      for (const double heading : bar_headings()) {
        expected += meets(X_BL.p, d, distance * Vec2(std::cos(heading), std::sin(heading)), 0.025,
                          0.5 * query.length_m);
      }
    }
    const double looks = 5.0 * static_cast<double>(bar_headings().size());
    const double found = look_at_bars(query, lidar, X_BL, 1).returns_per_frame;
    // The bar is a prism of twelve sides: a little thinner, 1.1 % on average.
    EXPECT_NEAR(found, static_cast<double>(expected) / looks, 0.05 * found + 0.05) << distance;
    EXPECT_GT(found, 1) << distance;
  }
}

// The paper's claim: a frame overlooks small obstacles. It depends on how small and how far.
TEST(SparseFrames, OneFrameMissesWhatIsThinAndFarAndFiveFramesShowMore) {
  for (std::uint64_t seed = 1; seed <= 3; ++seed) {
    EXPECT_LT(look(0.03, 2, 10, seed).missed_one, 0.01) << seed;
    const SparseAnswer twig = look(0.01, 8, 10, seed);
    EXPECT_GT(twig.missed_one, 0.3) << seed;
    EXPECT_LT(twig.missed_five, 0.6 * twig.missed_one) << seed;
    EXPECT_GE(twig.missed_lone, twig.missed_one) << seed;
  }
}

TEST(SparseFrames, MissMoreTheThinnerTheFartherAndTheShorterTheyAre) {
  EXPECT_GT(look(0.01, 6).missed_one, look(0.03, 6).missed_one);
  EXPECT_GT(look(0.01, 10).missed_one, look(0.01, 4).missed_one);
  EXPECT_GT(look(0.01, 4, 50).missed_one, look(0.01, 4, 10).missed_one);
  // A fifth of the time is a fifth of the returns.
  EXPECT_NEAR(look(0.1, 4, 50).returns_per_frame / look(0.1, 4, 10).returns_per_frame, 0.2, 0.02);
}

}  // namespace
}  // namespace arex::sim
