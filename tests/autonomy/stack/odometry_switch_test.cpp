#include "stack/odometry_switch.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "math/random.h"
#include "math/so3.h"

namespace arex {
namespace {

constexpr Stamp kStep = 5'000'000;

/// A flight on a circle at 1 m/s, as a source has it whose O is turned, shifted and drifts.
struct Source {
  double yaw_rad = 0;
  Vec3 shift_m = Vec3::Zero();
  Vec3 drift_mps = Vec3::Zero();

  [[nodiscard]] Odometry at(Stamp stamp, OdometryStatus status = OdometryStatus::kOk,
                            Stamp corrected = -1) const {
    const double t = to_seconds(stamp);
    const Mat3 turn = so3::from_yaw(yaw_rad);
    Odometry odometry;
    odometry.stamp = stamp;
    odometry.correction_stamp = corrected < 0 ? stamp : corrected;
    odometry.status = status;
    odometry.X_OB.R = turn * so3::from_yaw(0.1 * t) * so3::Exp({0.05, -0.03, 0});
    odometry.X_OB.p = turn * Vec3(10 * std::sin(0.1 * t), 10 * (1 - std::cos(0.1 * t)), 1.5) +
                      shift_m + t * drift_mps;
    odometry.v_OB = turn * Vec3(std::cos(0.1 * t), std::sin(0.1 * t), 0);
    return odometry;
  }
};

/// Flies 60 s; from 20 to 40 s the first source has no correction. What the controller sees.
struct Flight {
  std::vector<Odometry> seen;
  std::vector<std::pair<Stamp, std::size_t>> changes;
};

Flight fly(const Source& first, const Source& second, bool lost_at_once) {
  OdometrySwitch sources({}, 2);
  Flight flight;
  for (Stamp now = kStep; now < from_seconds(60); now += kStep) {
    const bool silent = now > from_seconds(20) && now < from_seconds(40);
    Odometry a = first.at(now);
    if (silent) {
      const double lost_s = to_seconds(now) - 20;
      a = first.at(now,
                   lost_at_once || lost_s > 3 ? OdometryStatus::kLost : OdometryStatus::kDegenerate,
                   from_seconds(20));
      a.X_OB.p += 0.02 * lost_s * lost_s * Vec3::UnitX();  // on the IMU alone
    }
    const Odometry b = second.at(now);
    if (const auto next = sources.update({&a, &b})) flight.changes.emplace_back(now, *next);
    flight.seen.push_back(sources.in_common_frame(sources.flying() == 0 ? a : b));
  }
  return flight;
}

TEST(OdometrySwitch, HandsOverAndBackWithoutAStep) {
  const Source first, second{0.8, Vec3(-3, 2, 0.4), Vec3(0.004, -0.003, 0.001)};
  for (const bool at_once : {false, true}) {
    const Flight flight = fly(first, second, at_once);
    ASSERT_EQ(flight.changes.size(), 2U);
    EXPECT_EQ(flight.changes[0].second, 1U);
    EXPECT_EQ(flight.changes[1].second, 0U);
    EXPECT_NEAR(to_seconds(flight.changes[0].first), at_once ? 20.005 : 20.505, 0.01);
    EXPECT_NEAR(to_seconds(flight.changes[1].first), 42, 0.02);
    for (std::size_t i = 1; i < flight.seen.size(); ++i) {
      const Odometry &before = flight.seen[i - 1], &now = flight.seen[i];
      const double step = (now.X_OB.p - before.X_OB.p - to_seconds(kStep) * before.v_OB).norm();
      EXPECT_LT(step, 0.002) << to_seconds(now.stamp);
      EXPECT_LT(so3::angle(before.X_OB.R.transpose() * now.X_OB.R), 0.002);
    }
  }
}

// What is left between two sources is in roll and pitch, too, and they need not tell of the same
// moment: a LiDAR's estimates are 25 ms older than those of the eyes, which is 10 mrad of a turn.
TEST(OdometrySwitch, HandsOverBetweenSourcesThatTiltAndLag) {
  constexpr Stamp kLag = 5 * kStep;
  const Source first, second{0.8, Vec3(-3, 2, 0.4), Vec3::Zero()};
  const Mat3 tilt = so3::Exp({0.012, -0.009, 0});
  OdometrySwitch sources({}, 2);
  Pose off_before;
  int changes = 0;
  for (Stamp now = 2 * kLag; now < from_seconds(30); now += kStep) {
    const bool silent = now > from_seconds(10) && now < from_seconds(15);
    const Odometry a = first.at(now - kLag, silent ? OdometryStatus::kLost : OdometryStatus::kOk);
    Odometry b = second.at(now);
    b.X_OB.R = b.X_OB.R * tilt;
    if (sources.update({&a, &b})) ++changes;
    const Odometry seen = sources.in_common_frame(sources.flying() == 0 ? a : b);
    const Pose off = first.at(seen.stamp).X_OB.inverse() * seen.X_OB;
    if (now > 2 * kLag) {
      EXPECT_LT((off.p - off_before.p).norm(), 0.004) << to_seconds(now);
      EXPECT_LT(so3::angle(off_before.R.transpose() * off.R), 0.001) << to_seconds(now);
    }
    off_before = off;
  }
  EXPECT_EQ(changes, 2);
  EXPECT_LT(so3::angle(off_before.R), 1e-9);
}

TEST(OdometrySwitch, GoesOnInTheFrameOfTheFirst) {
  const Source first, second{-2, Vec3(30, -20, 1), Vec3(0.004, 0, 0)};
  const Flight flight = fly(first, second, false);
  for (const Odometry& seen : flight.seen) {
    const Odometry truth = first.at(seen.stamp);
    // 20 s of the second's drift, and what the IMU alone was off by.
    EXPECT_LT((seen.X_OB.p - truth.X_OB.p).norm(), 0.1) << to_seconds(seen.stamp);
    EXPECT_LT((seen.v_OB - truth.v_OB).norm(), 0.02);
  }
  EXPECT_LT((flight.seen.back().X_OB.p - first.at(flight.seen.back().stamp).X_OB.p).norm(), 1e-9);
}

TEST(OdometrySwitch, TurnsTheCovarianceWithTheFrame) {
  OdometrySwitch sources({}, 2);
  const Source first, second{M_PI / 2, Vec3::Zero(), Vec3::Zero()};
  Odometry a = first.at(kStep), b = second.at(kStep);
  b.covariance.diagonal() << 1, 2, 3, 4, 9, 16;
  static_cast<void>(sources.update({&a, &b}));
  static_cast<void>(sources.in_common_frame(a));
  a = first.at(2 * kStep, OdometryStatus::kLost);
  const Odometry later = second.at(2 * kStep);
  b.stamp = later.stamp;
  b.X_OB = later.X_OB;
  b.correction_stamp = later.stamp;
  ASSERT_EQ(sources.update({&a, &b}), 1U);
  const auto P = sources.in_common_frame(b).covariance;
  EXPECT_NEAR(P(3, 3), 9, 1e-9);
  EXPECT_NEAR(P(4, 4), 4, 1e-9);
  EXPECT_NEAR(P(5, 5), 16, 1e-9);
  EXPECT_NEAR(P(0, 0), 1, 1e-9);
}

// Where a lost source is to look for itself: where it would have the vehicle, were it sound.
TEST(OdometrySwitch, TellsEachSourceWhereItWouldBe) {
  const Source first, second{0.4, {3, -2, 0.5}, Vec3::Zero()};
  constexpr double kRest = 1e-3;  // m, rad: of the change of source, still being taken back
  OdometrySwitch sources({}, 2);
  for (Stamp now = kStep; now < from_seconds(10); now += kStep) {
    const bool lost = now > from_seconds(5);
    const Odometry a = first.at(now, lost ? OdometryStatus::kLost : OdometryStatus::kOk);
    const Odometry b = second.at(now);
    static_cast<void>(sources.update({&a, &b}));
    static_cast<void>(sources.in_common_frame(sources.flying() == 0 ? a : b));
    const Pose off_a = first.at(now).X_OB.inverse() * sources.in_frame_of(0).X_OB;
    EXPECT_LT(off_a.p.norm(), kRest);
    EXPECT_LT(so3::angle(off_a.R), kRest);
    if (now == kStep) continue;  // its frame is laid over the flying one's by now
    const Pose off_b = second.at(now).X_OB.inverse() * sources.in_frame_of(1).X_OB;
    EXPECT_LT(off_b.p.norm(), kRest);
    EXPECT_LT(so3::angle(off_b.R), kRest);
  }
  EXPECT_EQ(sources.flying(), 1U);
}

TEST(OdometrySwitch, StaysWhereNoneIsBetter) {
  OdometrySwitch sources({}, 2);
  const Source source;
  for (Stamp now = kStep; now < from_seconds(3); now += kStep) {
    const Odometry a = source.at(now, OdometryStatus::kLost);
    const Odometry b = source.at(now, OdometryStatus::kDegenerate);
    EXPECT_FALSE(sources.update({&a, &b}));
    static_cast<void>(sources.in_common_frame(a));
  }
  EXPECT_EQ(sources.flying(), 0U);
}

TEST(OdometrySwitch, LeavesTheOnlySourceAlone) {
  OdometrySwitch sources({}, 1);
  RandomStream random(1, "odometry");
  Odometry odometry = Source{}.at(kStep);
  odometry.X_OB.p = Vec3(-0.0, 1e-300, 3);
  const Odometry seen = sources.in_common_frame(odometry);
  EXPECT_EQ(seen.X_OB.p, odometry.X_OB.p);
  EXPECT_TRUE(std::signbit(seen.X_OB.p.x()));
  EXPECT_EQ(seen.X_OB.R, odometry.X_OB.R);
}

}  // namespace
}  // namespace arex
