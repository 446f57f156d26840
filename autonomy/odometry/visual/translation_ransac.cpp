#include "odometry/visual/translation_ransac.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

#include "math/so3.h"

namespace arex {
namespace {

/// A camera's motion between two views: where it went, and what the gyro's turn lacks.
struct Motion {
  Vec3 direction = Vec3::Zero();  ///< unit
  Mat3 turn = Mat3::Identity();   ///< takes `before` to where a translation alone would start from
};

/// Distance of `after` from the line on which the motion puts it, signed.
double off_line(const Motion& motion, const Vec3& before, const Vec3& after) {
  const Vec3 line = motion.direction.cross(motion.turn * before);
  const double slope = line.head<2>().norm();
  // A point that lies where the translation leads to stays where it is.
  constexpr double kNoLine = 1e-9;
  if (slope < kNoLine) return (after - before).head<2>().norm();
  return line.dot(after) / slope;
}

/// Direction and turn that all pairs which fit agree on: Gauss-Newton, weighted as a Cauchy
/// distribution of scale `off` has it.
Motion refined(Motion motion, std::span<const Vec3> before, std::span<const Vec3> after,
               const std::vector<bool>& fits, double off) {
  constexpr int kIterations = 5;
  // 1 sigma, rad: of the gyro's turn with a clock that is some milliseconds off; of the direction,
  // a step that is still one of these equations'.
  constexpr double kTurn = 3e-3, kDirection = 0.3;
  const Mat3 as_told = motion.turn;
  for (int iteration = 0; iteration < kIterations; ++iteration) {
    const Vec3 t = motion.direction;
    const Vec3 a = t.unitOrthogonal(), b = t.cross(a);
    using Vec5 = Eigen::Matrix<double, 5, 1>;
    Vec5 sigma;
    sigma << kTurn, kTurn, kTurn, kDirection, kDirection;
    Eigen::Matrix<double, 5, 5> H = (off / sigma.array()).square().matrix().asDiagonal();
    Vec5 g = Vec5::Zero();
    g.head<3>() = H.topLeftCorner<3, 3>() * so3::Log(as_told.transpose() * motion.turn);
    for (std::size_t i = 0; i < before.size(); ++i) {
      if (!fits[i]) continue;
      const Vec3 turned = motion.turn * before[i];
      const Vec3 line = t.cross(turned);
      const double slope = line.head<2>().norm();
      constexpr double kNear = 0.02;  // to where it leads, rad: a line there has no direction
      if (slope < kNear * turned.norm()) continue;
      const double r = line.dot(after[i]) / slope;
      Vec5 J;  // the slope taken as constant
      J << motion.turn.transpose() * turned.cross(after[i].cross(t)), turned.cross(after[i]).dot(a),
          turned.cross(after[i]).dot(b);
      J /= slope;
      const double weight = 1 / (1 + r * r / (off * off));
      H.noalias() += weight * J * J.transpose();
      g.noalias() += weight * r * J;
    }
    const Vec5 step = -H.ldlt().solve(g);
    motion.turn = motion.turn * so3::Exp(step.head<3>());
    motion.direction = (t + step[3] * a + step[4] * b).normalized();
  }
  return motion;
}

}  // namespace

std::vector<bool> fit_translation(std::span<const Vec3> before, std::span<const Vec3> after,
                                  const MotionFit& off, int trials, RandomStream random) {
  const std::size_t n = before.size();
  std::vector<bool> best(n, true);
  // What has not moved fits any translation.
  const auto moved = [&](std::size_t i) { return (after[i] - before[i]).head<2>().norm(); };
  std::vector<std::size_t> moving;
  for (std::size_t i = 0; i < n; ++i) {
    if (moved(i) > off.coarse) moving.push_back(i);
  }
  constexpr std::size_t kLeast = 3;
  if (moving.size() < kLeast) return best;
  const auto fitting = [&](const Motion& motion, double most) {
    std::vector<bool> fits(n);
    for (std::size_t i = 0; i < n; ++i) {
      fits[i] = moved(i) <= most || std::abs(off_line(motion, before[i], after[i])) <= most;
    }
    return fits;
  };
  std::ptrdiff_t most = -1;
  Motion found;
  const int last = static_cast<int>(moving.size()) - 1;
  for (int trial = 0; trial < trials; ++trial) {
    const std::size_t a = moving[static_cast<std::size_t>(random.uniform_int(0, last))];
    const std::size_t b = moving[static_cast<std::size_t>(random.uniform_int(0, last))];
    const Vec3 t = before[a].cross(after[a]).cross(before[b].cross(after[b]));
    if (a == b || t.norm() < 1e-12) continue;
    const Motion motion{t.normalized(), Mat3::Identity()};
    std::vector<bool> fits = fitting(motion, off.coarse);
    const std::ptrdiff_t count = std::count(fits.begin(), fits.end(), true);
    if (count > most) {
      most = count;
      best = std::move(fits);
      found = motion;
    }
  }
  // Five unknowns, and as many again that say whether they are right.
  constexpr std::ptrdiff_t kLeastToRefine = 10;
  if (most < kLeastToRefine) return best;
  return fitting(refined(found, before, after, best, 0.5 * off.fine), off.fine);
}

}  // namespace arex
