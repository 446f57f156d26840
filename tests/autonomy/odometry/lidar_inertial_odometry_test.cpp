#include "odometry/lidar_inertial_odometry.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <functional>
#include <string>
#include <utility>

#include "math/so3.h"
#include "recorded_flight.h"
#include "support/analytic_world.h"

namespace arex {
namespace {

using namespace test;

TEST(StaticInitialiser, FindsDownAndTheGyroBias) {
  for (std::uint64_t seed = 1; seed <= 5; ++seed) {
    // Standing tilted: a motion's attitude is level, so the samples are turned.
    const Mat3 R_tilt = so3::Exp({0.05, -0.08, 0});
    test::SensorNoise noise;
    auto samples = test::simulate_imu({{Vec4::Zero()}, 1, 100}, from_seconds(2), noise, seed);
    for (ImuSample& s : samples) {
      s.accel_mps2 = R_tilt.transpose() * (s.accel_mps2 - noise.accel_bias) + noise.accel_bias;
    }
    const LidarInertialConfig config;
    const auto start = start_from_standstill(samples, mounting(), config);
    ASSERT_TRUE(start);
    const Mat3 down_error = start->state.R_OB * R_tilt.transpose();
    // The horizontal bias of 0.05 m/s^2 is what standing still cannot tell from a tilt.
    EXPECT_LT(so3::angle(so3::from_yaw(-so3::yaw(down_error)) * down_error), 1.2 * 0.05 / kGravity);
    EXPECT_LT((start->state.b_g - noise.gyro_bias).norm(), 5e-4);
    EXPECT_NEAR(start->state.g_O.norm(), kGravity, 1e-6);
    // So gravity in O and the bias are both in doubt, but not their sum in the measurement.
    const ErrorMatrix& P = start->covariance;
    EXPECT_NEAR(std::sqrt(P(kGravityBlock, kGravityBlock)), config.initialiser.accel_bias_std_mps2,
                0.005);
    Eigen::Matrix<double, 3, kErrorDim> H = Eigen::Matrix<double, 3, kErrorDim>::Zero();
    H.block<3, 3>(0, kGravityBlock) = -start->state.R_OB.transpose();
    H.block<3, 3>(0, kAccelBias) = Mat3::Identity();
    EXPECT_LT(std::sqrt((H * P * H.transpose()).diagonal().maxCoeff()), 0.005);
  }
}

TEST(StaticInitialiser, WaitsWhileItIsShakenOrTurned) {
  const LidarInertialConfig config;
  auto samples = test::simulate_imu({{Vec4::Zero()}, 1, 100}, from_seconds(2), {}, 1);
  ASSERT_TRUE(start_from_standstill(samples, mounting(), config));
  EXPECT_FALSE(start_from_standstill({samples.begin(), 100}, mounting(), config));  // too short
  auto shaken = samples;
  for (std::size_t i = 0; i < shaken.size(); ++i) {
    shaken[i].accel_mps2.x() += i % 2 == 0 ? 1 : -1;
  }
  EXPECT_FALSE(start_from_standstill(shaken, mounting(), config));
  auto turned = samples;
  for (ImuSample& s : turned) s.gyro_radps.z() += 0.3;
  EXPECT_FALSE(start_from_standstill(turned, mounting(), config));
  EXPECT_FALSE(start_from_standstill({}, mounting(), config));
}

TEST(StaticInitialiser, MeasuresTheWhiteNoise) {
  // 39 differences of 3 axes, neighbours correlated: 8 % of spread; four times that is allowed.
  constexpr double kGyro = 5e-4, kAccel = 7e-3, kSamplePeriod = 1e-9 * kPeriod;
  for (std::uint64_t seed = 1; seed <= 5; ++seed) {
    RandomStream random(seed, "white");
    std::vector<ImuSample> samples(200);
    for (std::size_t i = 0; i < samples.size(); ++i) {
      samples[i].stamp = static_cast<Stamp>(i) * kPeriod;
      samples[i].gyro_radps =
          Vec3(0.01, -0.02, 0.03) + kGyro / std::sqrt(kSamplePeriod) * random.normal3();
      samples[i].accel_mps2 =
          Vec3(0.1, 0, kGravity) + kAccel / std::sqrt(kSamplePeriod) * random.normal3();
    }
    const WhiteNoise measured = white_noise(samples);
    EXPECT_NEAR(measured.gyro / kGyro, 1, 0.32);
    EXPECT_NEAR(measured.accel / kAccel, 1, 0.32);
  }
  EXPECT_EQ(white_noise({}).gyro, 0);
}

// The noise of a bad IMU is not taken for motion: the start stays where it is.
TEST(LidarInertialOdometry, StandsStillWithANoisyImu) {
  test::SensorNoise noise;
  noise.imu = 5;
  noise.vibration = 0;  // before take-off
  noise.extra_range_m = 0.02;
  for (std::uint64_t seed = 1; seed <= 3; ++seed) {
    const Recording r =
        record(test::AnalyticWorld::hall(), {{Vec4::Zero()}, 1, 100}, 5, noise, seed, 16);
    const Flown run = fly(r);
    std::optional<NavigationState> start;
    for (const ScanUpdate& u : run.updates) {
      if (u.status == OdometryStatus::kInitialising) continue;
      if (!start) start = u.state;
      EXPECT_LT(so3::angle(start->R_OB.transpose() * u.state.R_OB), 1e-4);
      EXPECT_LT((u.state.p_OB - start->p_OB).norm(), 1e-3);
    }
    EXPECT_TRUE(start);
  }
}

TEST(LidarInertialOdometry, FollowsAFlightThroughAForest) {
  const Flown run = fly(forest());
  EXPECT_LT(worst_error(forest(), run), 0.03);
  EXPECT_EQ(count(run, OdometryStatus::kDegenerate), 0);
  EXPECT_EQ(count(run, OdometryStatus::kLost), 0);
  EXPECT_LT(run.largest_step_m, 0.03);
  EXPECT_LT(run.largest_step_rad, 0.3 * 3.14159 / 180);
  const ScanUpdate& last = run.updates.back();
  const test::MotionState truth = forest().motion.at(to_seconds(last.stamp));
  EXPECT_LT((last.state.v_OB - truth.v_OB).norm(), 0.05);
  EXPECT_LT(std::abs(so3::wrap(so3::yaw(last.state.R_OB) - so3::yaw(truth.X_OB.R))), 0.004);
  EXPECT_LT((last.state.b_g - Vec3(0.004, -0.003, 0.002)).norm(), 1e-3);
}

// Gyros are calibrated to half a percent, or not at all; clocks that nobody synchronised are tens
// of milliseconds apart. The scans tell both.
TEST(LidarInertialOdometry, FindsTheGyrosScaleAndTheImusClock) {
  const struct {
    Vec3 gyro_scale;
    Stamp clock_offset;
  } cases[] = {{{1.05, 1.05, 1.05}, 0},
               {{0.95, 1.03, 0.96}, 0},
               {{1, 1, 1}, 50'000'000},
               {{1, 1, 1}, -50'000'000},
               {{1.03, 0.97, 1.05}, 20'000'000}};
  // Half a minute of gusts: who flies evenly learns neither.
  RandomStream gusts(3, "gusts");
  std::vector<Vec4> points(4, Vec4::Zero());
  while (points.size() < 64) {
    points.push_back(Vec4(0, 0, 1.5, 0));
    points.back().head<3>() += 0.3 * gusts.normal3();
    points.back()[3] = 0.3 * gusts.normal3().x();
  }
  const Recording lively =
      record(test::AnalyticWorld::forest(3, 24, 16), {points, 0.5, 1.5}, 30, {}, 3, 8);
  for (const auto& [gyro_scale, clock_offset] : cases) {
    const Recording r = with_imu(lively, gyro_scale, clock_offset);
    const Flown run = fly(r);
    const NavigationState& state = run.updates.back().state;
    // Further off, the way is bent until the offset is found.
    const bool far = std::abs(clock_offset) > 20'000'000;
    EXPECT_LT(worst_error(r, run), far ? 0.1 : 0.06)
        << gyro_scale.transpose() << ", " << clock_offset;
    EXPECT_NEAR(state.t_d, 1e-9 * static_cast<double>(clock_offset), 1e-3);
    // About the axis that the flight turns about; it hardly rolls and pitches.
    EXPECT_NEAR((1 + state.s_g.z()) * gyro_scale.z(), 1, 0.005);
    EXPECT_EQ(count(run, OdometryStatus::kLost), 0);
  }
}

TEST(LidarInertialOdometry, TheFastOutputIsAsGoodAsTheScans) {
  const Flown run = fly(forest());
  double worst = 0;
  for (const Odometry& o : run.fast) {
    if (o.status != OdometryStatus::kOk) continue;
    worst = std::max(worst, position_error(forest(), o.stamp, o.X_OB.p));
    // And what the IMU's clock is believed to be off.
    // A scan corrects its middle.
    EXPECT_LE(o.stamp - o.correction_stamp,
              kFrame / 2 + kFrame + 20'000'000 + 5'000'000 + 1'000'000);
  }
  EXPECT_LT(worst, worst_error(forest(), run) + 0.01);
}

/// The raw points that an update's points_O came from, and when each was fired.
struct Fired {
  const LidarPoint* raw;
  double t_s;
};
std::vector<Fired> fired(const Recording& r, const ScanUpdate& update) {
  const LidarScan& scan = **std::find_if(r.scans.begin(), r.scans.end(),
                                         [&](const auto& s) { return s->end == update.end; });
  std::vector<Fired> out;
  std::size_t raw = 0;
  for (const float fraction : *update.fractions) {
    const double since_s = static_cast<double>(fraction) * to_seconds(scan.end - scan.stamp);
    while (1e-9 * scan.points[raw].offset_ns < since_s - 1e-7) ++raw;
    out.push_back({&scan.points[raw], to_seconds(scan.stamp) + since_s});
  }
  return out;
}

// O is level by the accelerometer, whose bias (3 and 4 cm/s^2) tilts it by 5 mrad: that is where
// the map is, not how good. So it is placed by the pose at the start, as a flight's error is.
TEST(LidarInertialOdometry, PointsLieOnTheSurfaces) {
  const Flown run = fly(forest());
  std::vector<double> errors;
  std::optional<Pose> X_WO;
  for (const ScanUpdate& u : run.updates) {
    if (u.status == OdometryStatus::kInitialising) continue;
    if (!X_WO) X_WO = forest().motion.at(to_seconds(u.stamp)).X_OB * u.state.X_OB().inverse();
    for (std::size_t i = 0; i < u.points_O->size(); i += 37) {
      errors.push_back(forest().world.distance(*X_WO * (*u.points_O)[i].cast<double>()));
    }
  }
  ASSERT_GT(errors.size(), 1000U);
  std::sort(errors.begin(), errors.end());
  const std::size_t p50 = errors.size() / 2, p95 = errors.size() * 95 / 100;
  EXPECT_LT(errors[p50], 0.015);
  EXPECT_LT(errors[p95], 0.05);
}

TEST(LidarInertialOdometry, HoldsStillOnAStaticVehicle) {
  const Flown run = fly(standing());
  EXPECT_LT(worst_error(standing(), run), 0.01);
  EXPECT_GT(count(run, OdometryStatus::kOk), 59 * 200);
}

TEST(LidarInertialOdometry, LatencyChangesWhenNotWhat) {
  const Flown now = fly(forest(), defaults(), 0), late = fly(forest(), defaults(), 60'000'000);
  ASSERT_EQ(now.updates.size(), late.updates.size() + 1);  // the last comes after the end
  for (std::size_t i = 0; i < late.updates.size(); ++i) {
    EXPECT_EQ(now.updates[i].state.p_OB, late.updates[i].state.p_OB);
    EXPECT_EQ(now.updates[i].state.R_OB, late.updates[i].state.R_OB);
  }
  // Once the late update is in, both outputs have integrated the same samples from the same anchor.
  int compared = 0;
  for (std::size_t i = 0; i < now.fast.size(); ++i) {
    if (now.fast[i].status == OdometryStatus::kInitialising ||
        now.fast[i].correction_stamp != late.fast[i].correction_stamp ||
        now.fast[i].stamp != late.fast[i].stamp) {
      continue;
    }
    ++compared;
    EXPECT_LT((now.fast[i].X_OB.p - late.fast[i].X_OB.p).norm(), 1e-12);
    EXPECT_LT((now.fast[i].v_OB - late.fast[i].v_OB).norm(), 1e-12);
  }
  EXPECT_GT(compared, 500);
}

TEST(LidarInertialOdometry, TwoRunsAreBitIdentical) {
  const Flown a = fly(forest()), b = fly(forest());
  ASSERT_EQ(a.updates.size(), b.updates.size());
  for (std::size_t i = 0; i < a.updates.size(); ++i) {
    EXPECT_EQ(a.updates[i].state.p_OB, b.updates[i].state.p_OB);
    EXPECT_EQ(a.updates[i].covariance, b.updates[i].covariance);
    EXPECT_TRUE(*a.updates[i].points_O == *b.updates[i].points_O);
  }
}

TEST(LidarInertialOdometry, SurvivesASecondWithoutScans) {
  const Tamper silence = [](const LidarScanPtr& scan) {
    return scan->stamp >= from_seconds(9) && scan->stamp < from_seconds(10) ? nullptr : scan;
  };
  const Flown run = fly(forest(), defaults(), 20'000'000, silence);
  EXPECT_LT(worst_error(forest(), run), 0.06);
  EXPECT_EQ(count(run, OdometryStatus::kLost), 0);
  EXPECT_GT(count(run, OdometryStatus::kDegenerate), 100);  // and says so meanwhile
  EXPECT_EQ(run.fast.back().status, OdometryStatus::kOk);
}

TEST(LidarInertialOdometry, SurvivesEmptyScans) {
  const Tamper empty = [](const LidarScanPtr& scan) -> LidarScanPtr {
    if (scan->stamp < from_seconds(9) || scan->stamp >= from_seconds(9.3)) return scan;
    auto none = std::make_shared<LidarScan>(*scan);
    none->points.clear();
    return none;
  };
  const Flown run = fly(forest(), defaults(), 20'000'000, empty);
  EXPECT_LT(worst_error(forest(), run), 0.04);
  EXPECT_EQ(run.fast.back().status, OdometryStatus::kOk);
}

TEST(LidarInertialOdometry, SurvivesTheLossOfEveryFifthPoint) {
  const Tamper downsampled = [](const LidarScanPtr& scan) {
    auto rest = std::make_shared<LidarScan>(*scan);
    RandomStream random(static_cast<std::uint64_t>(scan->stamp), "loss");
    std::erase_if(rest->points, [&](const LidarPoint&) { return random.uniform() < 0.2; });
    return rest;
  };
  EXPECT_LT(worst_error(forest(), fly(forest(), defaults(), 20'000'000, downsampled)), 0.03);
}

TEST(LidarInertialOdometry, SurvivesABurstOfFalseReturns) {
  for (const double share : {0.1, 0.5}) {
    const Tamper burst = [share](const LidarScanPtr& scan) -> LidarScanPtr {
      if (scan->stamp < from_seconds(8) || scan->stamp >= from_seconds(8.5)) return scan;
      auto wrong = std::make_shared<LidarScan>(*scan);
      RandomStream random(static_cast<std::uint64_t>(scan->stamp), "burst");
      for (LidarPoint& point : wrong->points) {
        if (random.uniform() < share) {
          point.p_L *= static_cast<float>(random.uniform(0.5, 20)) / point.p_L.norm();
        }
      }
      return wrong;
    };
    const Flown run = fly(forest(), defaults(), 20'000'000, burst);
    EXPECT_LT(worst_error(forest(), run), 0.04) << share;
    EXPECT_EQ(count(run, OdometryStatus::kLost), 0);
    EXPECT_EQ(run.fast.back().status, OdometryStatus::kOk);
  }
}

TEST(LidarInertialOdometry, RecoversOnItsMapAfterALoss) {
  // The scans of 1.5 s show another place: lost; then the world is back, the vehicle moved on.
  const Tamper elsewhere = [](const LidarScanPtr& scan) -> LidarScanPtr {
    if (scan->stamp < from_seconds(8) || scan->stamp >= from_seconds(9.5)) return scan;
    auto wrong = std::make_shared<LidarScan>(*scan);
    RandomStream random(static_cast<std::uint64_t>(scan->stamp), "elsewhere");
    for (LidarPoint& point : wrong->points) {
      point.p_L = (random.uniform(1, 25) * random.normal3().normalized()).cast<float>();
    }
    return wrong;
  };
  const Flown run = fly(forest(), defaults(), 20'000'000, elsewhere);
  EXPECT_GT(count(run, OdometryStatus::kLost), 50);
  EXPECT_EQ(run.fast.back().status, OdometryStatus::kOk);
  const ScanUpdate& last = run.updates.back();
  EXPECT_LT(position_error(forest(), last.stamp, last.state.p_OB), 0.05);
  EXPECT_TRUE(std::any_of(run.updates.begin(), run.updates.end(),
                          [](const ScanUpdate& u) { return u.recovered; }));
}

TEST(LidarInertialOdometry, SaysThatAPlainTellsTooLittle) {
  const Recording plain =
      record(test::AnalyticWorld::plain(), {test::loop_points(24, 16, 1.5, 1.5, 0.8, 1), 0.8, 1.5},
             6, {}, 1, 8);
  const Flown run = fly(plain);
  EXPECT_NE(run.fast.back().status, OdometryStatus::kOk);
  const auto weak = std::find_if(run.updates.begin(), run.updates.end(), [](const ScanUpdate& u) {
    return u.status == OdometryStatus::kDegenerate;
  });
  ASSERT_NE(weak, run.updates.end());
  EXPECT_GT(weak->registration.position_std_m[0], OdometryHealthConfig{}.degenerate_position_std_m);
  EXPECT_LT(std::abs(weak->registration.worst_position_axis_O.z()), 0.1);
}

TEST(LidarInertialOdometry, FindsAMountingThatIsOffByADegree) {
  const Vec3 offset = Vec3(0.6, -0.6, 0.53).normalized() * 0.01745;
  Pose X_BL = mounting();
  X_BL.R = X_BL.R * so3::Exp(offset);
  const Recording r = record(forest().world, forest().motion, 16, {}, 4, 8, X_BL);
  LidarInertialConfig config = defaults();
  config.estimate_extrinsics = true;
  const Flown run = fly(r, config);
  const Mat3 error = run.updates.back().state.X_BL.R.transpose() * X_BL.R;
  EXPECT_LT(so3::angle(error), 0.2 * 3.14159 / 180);
}

// From where the LiDAR was when a point was fired, the point lies as far off as it was measured.
TEST(LidarInertialOdometry, TellsWhenEachPointWasFired) {
  const Flown run = fly(forest());
  const auto p_OL = [](double t_s) { return (forest().motion.at(t_s).X_OB * mounting()).p; };
  double by_time = 0, by_rank = 0;
  int count = 0;
  for (const ScanUpdate& u : run.updates) {
    const auto size = static_cast<double>(u.points_O->size());
    ASSERT_EQ(u.fractions->size(), u.points_O->size());
    ASSERT_EQ(u.begin, u.end - kFrame);
    const std::vector<Fired> shots = fired(forest(), u);
    for (std::size_t i = 0; i < shots.size(); i += 7) {
      const double measured = shots[i].raw->p_L.norm();
      const Vec3 p_O = (*u.points_O)[i].cast<double>();
      const double rank_s = to_seconds(u.begin) + (static_cast<double>(i) + 0.5) / size * 0.1;
      by_time += std::abs((p_O - p_OL(shots[i].t_s)).norm() - measured);
      by_rank += std::abs((p_O - p_OL(rank_s)).norm() - measured);
      ++count;
    }
  }
  ASSERT_GT(count, 10000);
  EXPECT_LT(by_time / count, 0.01);
  EXPECT_LT(by_time, by_rank);
}

TEST(LidarInertialOdometry, AKnownDelayOfTheImuCostsNothing) {
  Recording late = forest();
  for (ImuSample& sample : late.imu) sample.stamp += 20'000'000;
  LidarInertialConfig config = defaults();
  config.imu.delay_s = 0.02;
  LidarInertialOdometry odometry(config, mounting(), kRadius),
      prompt(defaults(), mounting(), kRadius);
  std::size_t i = 0, j = 0;
  for (const LidarScanPtr& scan : late.scans) {
    // Both have heard the vehicle up to the scan's end.
    while (i < late.imu.size() && late.imu[i].stamp <= scan->end + 20'000'000) {
      odometry.add_imu(late.imu[i++]);
    }
    while (j < forest().imu.size() && forest().imu[j].stamp <= scan->end) {
      prompt.add_imu(forest().imu[j++]);
    }
    const ScanUpdate a = odometry.add_scan(scan), b = prompt.add_scan(scan);
    // What little differs comes of when the standing vehicle was seen to move.
    EXPECT_LT((a.state.p_OB - b.state.p_OB).norm(), 2e-3);
  }
  // The output is for the stamp of the sample: the newest reading is held over the delay.
  const Odometry& out = odometry.odometry();
  EXPECT_LT(position_error(forest(), out.stamp, out.X_OB.p), 0.03);
}

/// Turns on the spot ever faster; the gyro reads no more than `full_scale`.
Recording spin(double full_scale_radps, double rate_radps) {
  std::vector<Vec4> points(4, Vec4::Zero());
  constexpr double kKnot = 0.25;
  double rate = 0, yaw = 0;
  const auto turn = [&](double to, double seconds) {
    for (double t = 0; t < seconds; t += kKnot) {
      rate += std::clamp(to - rate, -2.0 * kKnot, 2.0 * kKnot);
      yaw += rate * kKnot;
      points.emplace_back(0, 0, 0, yaw);
    }
  };
  turn(rate_radps, 5);
  turn(0, 4);
  Recording r = record(test::AnalyticWorld::hall(), {points, kKnot, 2}, 12, {}, 6, 6);
  for (ImuSample& sample : r.imu) {
    sample.gyro_radps = sample.gyro_radps.cwiseMax(-full_scale_radps).cwiseMin(full_scale_radps);
  }
  return r;
}

TEST(LidarInertialOdometry, CarriesOnAndSaysSoWhileTheGyroIsClipped) {
  for (const double side : {1.0, -1.0}) {
    const Recording r = spin(2.5, side * 3.5);
    const Flown run = fly(r);
    EXPECT_LT(worst_error(r, run), 0.05);
    int clipped = 0;
    for (const ScanUpdate& u : run.updates) {
      const double rate = r.motion.at(to_seconds(u.stamp)).w_OB_B.norm();
      if (u.gyro_clipped) {
        ++clipped;
        EXPECT_NE(u.status, OdometryStatus::kOk);
        EXPECT_GT(rate, 1.9);
      }
      if (rate > 3.4) {
        // 12 mrad of error in the turn of a scan of 0.1 s, which shows half of it.
        EXPECT_NEAR(u.gyro.missing_radps.z(), rate - 2.5, 0.25);
      }
    }
    EXPECT_GT(clipped, 15);
    EXPECT_EQ(count(run, OdometryStatus::kLost), 0);
    EXPECT_EQ(run.fast.back().status, OdometryStatus::kOk);
    const ScanUpdate& last = run.updates.back();
    const Mat3 error = r.motion.at(to_seconds(last.stamp)).X_OB.R.transpose() * last.state.R_OB;
    EXPECT_LT(so3::angle(error), 0.01);
  }
}

/// The interval `k` of a gyro that turns about z from one rate to another, as it reads them.
ImuInterval clipped_yaw(int k, double begin_radps, double end_radps, double full_scale_radps) {
  ImuInterval imu;
  imu.gyro_begin = Vec3(0, 0, std::clamp(begin_radps, -full_scale_radps, full_scale_radps));
  imu.gyro_end = Vec3(0, 0, std::clamp(end_radps, -full_scale_radps, full_scale_radps));
  imu.begin = k * kPeriod;
  imu.end = (k + 1) * kPeriod;
  return imu;
}

// A ramp to a rate beyond full scale, as a drive turns a vehicle: until a scan tells, what is
// missing is no further off than half of what an unfinished reading would lack.
TEST(GyroCompletion, TakesTheTurnToGoOnAsItCame) {
  constexpr double kFullScale = 2.5, kAcceleration = 8, kMost = 3.5;
  for (const double side : {1.0, -1.0}) {
    const auto rate = [&](int k) { return side * std::min(kMost, 5e-3 * k * kAcceleration); };
    GyroCompletion completion;
    completion.full_scale_radps = kFullScale;
    double missed_rad = 0, read_rad = 0;
    for (int k = 0; k < 120; ++k) {
      ImuInterval imu = clipped_yaw(k, rate(k), rate(k + 1), kFullScale);
      const double truth = 0.5 * (rate(k) + rate(k + 1));
      read_rad += 5e-3 * std::abs(truth - imu.mean_gyro().z());
      completion.complete(imu);
      EXPECT_EQ(imu.gyro_clipped[2], std::abs(rate(k + 1)) >= kFullScale);
      missed_rad += 5e-3 * std::abs(truth - imu.mean_gyro().z());
      EXPECT_EQ(imu.gyro_begin.x(), 0);
    }
    EXPECT_LT(missed_rad, 0.33 * read_rad);
  }
}

// As a vehicle whose rate loop reads the clipped gyro turns: at 12 rad/s^2 to far beyond it and
// back.
TEST(GyroCompletion, FollowsTheEarthsField) {
  constexpr double kFullScale = 2.5;
  const Vec3 field_O(-0.019, 0.375, -0.253);  // gauss
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    RandomStream random(seed, "field");
    const double side = seed % 2 == 0 ? 1 : -1;
    const Vec3 hard_iron = 0.005 * random.normal3();
    const auto rate = [&](int k) {
      const double t = 5e-3 * k;
      return side * std::max(0.0, t < 0.5 ? 12 * t : std::max(3.4, 6 - 8 * (t - 0.5)));
    };
    GyroCompletion completion;
    completion.full_scale_radps = kFullScale;
    completion.field_O = field_O + hard_iron;
    double truth = 0, estimate = 0, worst = 0;
    for (int k = 0; k < 300; ++k) {
      ImuInterval imu = clipped_yaw(k, rate(k), rate(k + 1), kFullScale);
      imu.field_begin =
          so3::from_yaw(truth).transpose() * field_O + hard_iron + 0.004 * random.normal3();
      completion.complete(imu, so3::from_yaw(estimate));
      truth += 2.5e-3 * (rate(k) + rate(k + 1));
      estimate += 5e-3 * imu.mean_gyro().z();
      worst = std::max(worst, std::abs(estimate - truth));
    }
    // Of 2.6 rad that the readings lack. Hard iron alone turns the field by 13 mrad, each 1 sigma.
    EXPECT_LT(worst, 0.09) << seed;
  }
}

TEST(GyroCompletion, ASteadyReadingAtFullScaleLacksNothing) {
  GyroCompletion completion;
  completion.full_scale_radps = 2.5;
  ImuInterval imu;
  imu.gyro_begin = imu.gyro_end = Vec3::Zero();
  imu.end = kPeriod;
  imu.gyro_begin.z() = imu.gyro_end.z() = 2.5;
  completion.complete(imu);
  EXPECT_TRUE(imu.gyro_clipped[2]);
  EXPECT_EQ(imu.mean_gyro().z(), 2.5);
}

TEST(GyroFullScale, IsLearnedFromRepeatedReadingsOnly) {
  GyroFullScale scale(34.9);
  RandomStream random(1, "gyro");
  for (int i = 0; i < 1000; ++i) scale.add(5 * Vec3::UnitZ() + 1e-3 * random.normal3());
  EXPECT_EQ(scale.radps(), 34.9);
  for (int i = 0; i < 1000; ++i) scale.add(Vec3::Zero());  // rest without noise is no full scale
  EXPECT_EQ(scale.radps(), 34.9);
  for (int i = 0; i < 5; ++i) scale.add({0, -4.36, 0.01 * i});
  EXPECT_EQ(scale.radps(), 4.36);
  scale.add({0, 5, 0});  // more than that: it was none
  EXPECT_EQ(scale.radps(), 34.9);
}

TEST(LidarInertialOdometry, BeforeTheStartItSaysSo) {
  LidarInertialOdometry odometry({}, mounting(), kRadius);
  const Odometry first = odometry.add_imu({kPeriod, Vec3::Zero(), Vec3(0, 0, kGravity)});
  EXPECT_EQ(first.status, OdometryStatus::kInitialising);
  EXPECT_EQ(first.stamp, kPeriod);
  EXPECT_EQ(first.X_OB.p, Vec3::Zero().eval());
  auto scan = std::make_shared<LidarScan>();
  scan->end = kFrame;
  EXPECT_EQ(odometry.add_scan(scan).status, OdometryStatus::kInitialising);
}

}  // namespace
}  // namespace arex
