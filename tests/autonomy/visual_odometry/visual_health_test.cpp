#include <gtest/gtest.h>

#include <algorithm>
#include <functional>
#include <map>
#include <memory>

#include "math/random.h"
#include "synthetic_flight.h"

namespace arex::test {
namespace {

const SyntheticFlight& flight() {
  static const SyntheticFlight one = [] {
    SyntheticConfig config;
    config.pixel_std = 0.3;
    config.seed = 3;
    config.imu = SensorNoise{};
    config.imu.vibration = 0;
    return synthesise(config);
  }();
  return one;
}

VisualInertialConfig config() {
  VisualInertialConfig config = synthetic_defaults();
  config.window.disparity_std = 0.5;  // each eye's noise of 0.3 px by itself
  return config;
}

TamperFrame dark(double from_s, double to_s) {
  return [=](FeatureFrame& frame) {
    if (frame.stamp >= from_seconds(from_s) && frame.stamp < from_seconds(to_s)) {
      frame.features.clear();
    }
  };
}

bool told(const SyntheticRun& run, const std::string& what) {
  return std::any_of(run.faults.begin(), run.faults.end(), [&](const std::string& fault) {
    return fault.find(what) != std::string::npos;
  });
}

int count(const SyntheticRun& run, OdometryStatus status) {
  return static_cast<int>(std::count_if(run.fast.begin(), run.fast.end(),
                                        [&](const Odometry& o) { return o.status == status; }));
}

TEST(VisualHealth, OutlivesABlackoutWithoutBeingLost) {
  for (const double dark_s : {2.0, 5.0}) {
    const SyntheticRun run = fly(flight(), config(), dark(20, 20 + dark_s));
    EXPECT_EQ(count(run, OdometryStatus::kLost), 0) << dark_s;
    EXPECT_GT(count(run, OdometryStatus::kDegenerate), 200) << dark_s;
    EXPECT_EQ(run.fast.back().status, OdometryStatus::kOk) << dark_s;
    EXPECT_LT(100 * run.ate_m / flight().path_m, 0.6) << dark_s;
    EXPECT_TRUE(told(run, "few tracks")) << dark_s;
  }
}

TEST(VisualHealth, IsDegenerateThenLostInTheDarkAndBeginsAnewInTheLight) {
  const SyntheticRun run = fly(flight(), config(), dark(20, 32));
  const auto first = [&](OdometryStatus status) {
    return std::find_if(
               run.fast.begin(), run.fast.end(),
               [&](const Odometry& o) { return o.stamp > from_seconds(20) && o.status == status; })
        ->stamp;
  };
  EXPECT_LT(first(OdometryStatus::kDegenerate), from_seconds(21));
  EXPECT_LT(first(OdometryStatus::kLost), from_seconds(29));
  EXPECT_GT(first(OdometryStatus::kLost), from_seconds(27));
  EXPECT_TRUE(told(run, "visual odometry lost: too few tracks for too long"));
  EXPECT_TRUE(told(run, "visual odometry begins anew"));
  EXPECT_EQ(run.fast.back().status, OdometryStatus::kOk);
  // Where it is now, it knows by twelve seconds of the IMU; how it moves, by its eyes again.
  const Vec3 v = flight().motion.at(to_seconds(run.fast.back().stamp)).v_OB;
  EXPECT_LT((run.fast.back().v_OB - v).norm(), 0.1);
  EXPECT_LT(run.largest_step_m, 0.5);
}

// A wall without texture: a handful of features for three seconds.
TEST(VisualHealth, DoesNotJumpWhereThereIsTooLittleToFollow) {
  const SyntheticRun run = fly(flight(), config(), [](FeatureFrame& frame) {
    if (frame.stamp >= from_seconds(15) && frame.stamp < from_seconds(18)) {
      frame.features.resize(std::min<std::size_t>(frame.features.size(), 5));
    }
  });
  EXPECT_GT(count(run, OdometryStatus::kDegenerate), 300);
  EXPECT_EQ(count(run, OdometryStatus::kLost), 0);
  EXPECT_LT(run.largest_step_m, 0.15);
  EXPECT_LT(run.worst_m, 0.4);
}

// Leaves in the wind: a third of the features move by themselves.
TEST(VisualHealth, DriftsMoreAmongWhatMovesButIsNotLost) {
  RandomStream random(9, "leaves");
  const auto sway = [&](FeatureFrame& frame) {
    const double phase = 2 * to_seconds(frame.stamp);
    for (TrackedFeature& feature : frame.features) {
      if (feature.id % 3 != 0) continue;
      const Vec2 off = 0.02 * Vec2(std::sin(phase + static_cast<double>(feature.id)),
                                   std::cos(1.3 * phase + static_cast<double>(feature.id)));
      feature.left += off;
      if (feature.right) *feature.right += off;
    }
  };
  const SyntheticRun still = fly(flight(), config()), swaying = fly(flight(), config(), sway);
  std::size_t dropped = 0;
  for (const VisualUpdate& update : swaying.updates) dropped += update.window.outliers.size();
  EXPECT_GT(dropped, 100U);
  EXPECT_EQ(count(swaying, OdometryStatus::kLost), 0);
  EXPECT_LT(100 * swaying.ate_m / flight().path_m, 1.5);
}

/// The projector's dots: features `stuck` says of stay where they were in the image when they were
/// first seen after from_s.
TamperFrame dots(double from_s, double to_s, const std::function<bool(std::int64_t)>& stuck) {
  auto first = std::make_shared<std::map<std::int64_t, Vec2>>();
  return [=](FeatureFrame& frame) {
    if (frame.stamp < from_seconds(from_s) || frame.stamp >= from_seconds(to_s)) return;
    for (TrackedFeature& feature : frame.features) {
      if (!stuck(feature.id)) continue;
      const Vec2 at = first->emplace(feature.id, feature.left).first->second;
      if (feature.right) *feature.right += at - feature.left;
      feature.left = at;
    }
  };
}

TEST(VisualHealth, DropsSomeDotsThatFlyAlongAndNoticesThatAllDo) {
  const SyntheticRun some =
      fly(flight(), config(), dots(5, 1000, [](std::int64_t id) { return id % 4 == 0; }));
  std::size_t dropped = 0;
  for (const VisualUpdate& update : some.updates) dropped += update.window.outliers.size();
  EXPECT_GT(dropped, 100U);
  EXPECT_EQ(count(some, OdometryStatus::kLost), 0);
  EXPECT_LT(100 * some.ate_m / flight().path_m, 1.5);

  const SyntheticRun all = fly(flight(), config(), dots(15, 18, [](std::int64_t) { return true; }));
  EXPECT_TRUE(told(all, "large innovation"));
  EXPECT_EQ(all.fast.back().status, OdometryStatus::kOk);
}

// A camera that hangs says again what it said last, with new stamps.
TEST(VisualHealth, TakesAPictureOnceMoreForNoExposure) {
  StereoImage image;
  image.width = 4;
  image.height = 1;
  image.left = image.right = {10, 20, 30, 40};
  const auto taken = [&](Stamp stamp, std::vector<std::uint8_t> left) {
    image.time_ns = stamp;
    image.left = std::move(left);
    return std::make_shared<const StereoImage>(image);
  };
  VisualInertialOdometry odometry(config(), Pose(), 1);
  ImuSample imu;
  imu.stamp = 1;
  odometry.add_imu(imu);
  const auto first = odometry.prepare(taken(1, {10, 20, 30, 40}));
  ASSERT_TRUE(first);
  EXPECT_EQ(first->imu.size(), 1U);
  imu.stamp = 2;
  odometry.add_imu(imu);
  EXPECT_FALSE(odometry.prepare(taken(2, {10, 20, 30, 40})));
  imu.stamp = 3;
  odometry.add_imu(imu);
  const auto other = odometry.prepare(taken(3, {10, 20, 30, 41}));  // the noise of one pixel
  ASSERT_TRUE(other);
  EXPECT_EQ(other->imu.size(), 2U);  // the repeated one has taken none
  for (const std::uint8_t grey : {std::uint8_t{0}, std::uint8_t{255}}) {
    EXPECT_TRUE(odometry.prepare(taken(4, std::vector<std::uint8_t>(4, grey)))) << int{grey};
    EXPECT_TRUE(odometry.prepare(taken(5, std::vector<std::uint8_t>(4, grey)))) << int{grey};
  }
}

TEST(VisualHealth, TellsABiasThatIsNone) {
  SyntheticFlight spoilt = flight();
  for (ImuSample& sample : spoilt.imu) {
    if (sample.stamp > from_seconds(15)) sample.gyro_radps.z() += 0.5;
  }
  const SyntheticRun run = fly(spoilt, config());
  EXPECT_GT(count(run, OdometryStatus::kLost) + count(run, OdometryStatus::kDegenerate), 20);
  EXPECT_TRUE(told(run, "visual odometry lost") || told(run, "large innovation"));
}

TEST(VisualHealth, NamesWhatItWaitsForBeforeTheStart) {
  const auto need_after = [&](const TamperFrame& tamper, double gyro_bias) {
    VisualInertialOdometry odometry(config(), camera_mount(), 1);
    std::vector<ImuSample> imu;
    for (ImuSample sample : flight().imu) {
      if (sample.stamp > from_seconds(2)) break;
      sample.gyro_radps.x() += gyro_bias;
      odometry.add_imu(sample);
      imu.push_back(sample);
    }
    if (tamper) {
      FeatureFrame frame = flight().frames[18];
      tamper(frame);
      odometry.apply(odometry.correct(frame, imu));
    }
    EXPECT_EQ(odometry.odometry().status, OdometryStatus::kInitialising);
    return odometry.need();
  };
  EXPECT_EQ(need_after({}, 0), OdometryNeed::kImages);
  EXPECT_EQ(need_after([](FeatureFrame& frame) { frame.features.clear(); }, 0),
            OdometryNeed::kImages);
  EXPECT_EQ(need_after([](FeatureFrame& frame) { frame.features.resize(10); }, 0),
            OdometryNeed::kFeatures);
  EXPECT_EQ(need_after([](FeatureFrame&) {}, 0.3), OdometryNeed::kGyroBias);
}

}  // namespace
}  // namespace arex::test
