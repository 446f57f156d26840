#include "odometry/visual/feature_tracker.h"

#include <gtest/gtest.h>

#include <cmath>
#include <map>

#include "math/so3.h"
#include "odometry/visual/translation_ransac.h"

namespace arex {
namespace {

/// A texture without end: smooth noise in three octaves, the same at the same place.
double texture(double x, double y) {
  const auto lattice = [](std::int64_t i, std::int64_t j, std::int64_t octave) {
    RandomStream random(11, "texture");
    return random.fork(static_cast<std::uint64_t>((i * 7919 + j) * 31 + octave)).uniform();
  };
  double grey = 128;
  double wave = 24, height = 70;
  for (int octave = 0; octave < 3; ++octave, wave /= 2.2, height /= 1.6) {
    const double u = x / wave, v = y / wave;
    const double i = std::floor(u), j = std::floor(v);
    const auto smooth = [](double t) { return t * t * (3 - 2 * t); };
    const double a = smooth(u - i), b = smooth(v - j);
    const auto at = [&](int di, int dj) {
      return lattice(static_cast<std::int64_t>(i) + di, static_cast<std::int64_t>(j) + dj, octave);
    };
    const double value =
        (1 - b) * ((1 - a) * at(0, 0) + a * at(1, 0)) + b * ((1 - a) * at(0, 1) + a * at(1, 1));
    grey += height * (value - 0.5) * 2;
  }
  return grey;
}

constexpr int kWidth = 320, kHeight = 200;

StereoCamera small_camera() {
  StereoCamera camera;
  camera.width = kWidth;
  camera.height = kHeight;
  camera.f_px = 200;
  camera.cx = 159.5;
  camera.cy = 99.5;
  return camera;
}

/// What a mapping from pixels to places of the texture shows.
template <class Place>
std::vector<std::uint8_t> picture(const Place& place) {
  std::vector<std::uint8_t> grey;
  for (int v = 0; v < kHeight; ++v) {
    for (int u = 0; u < kWidth; ++u) {
      const Vec2 at = place(Vec2(u, v));
      grey.push_back(static_cast<std::uint8_t>(
          std::lround(std::min(255.0, std::max(0.0, texture(at.x(), at.y()))))));
    }
  }
  return grey;
}

/// A poster square to the view, moved by `shift` pixels, with that disparity.
StereoImage poster(std::int64_t time_ns, const Vec2& shift, double disparity_px) {
  StereoImage image;
  image.time_ns = time_ns;
  image.width = kWidth;
  image.height = kHeight;
  image.camera = small_camera();
  image.left = picture([&](const Vec2& px) { return Vec2(px - shift); });
  image.right = picture([&](const Vec2& px) { return Vec2(px - shift + Vec2(disparity_px, 0)); });
  return image;
}

FeatureTrackerConfig small_cells() {
  FeatureTrackerConfig config;
  config.max_features = 60;
  config.cell_px = 40;
  config.min_distance_px = 12;
  return config;
}

TEST(FeatureTracker, FollowsAShiftAndFindsItsDisparity) {
  FeatureTracker tracker(small_cells(), 1);
  const FeatureFrame first = tracker.track(poster(0, {0, 0}, 6), Mat3::Identity());
  ASSERT_GT(first.features.size(), 30U);
  std::map<std::int64_t, Vec2> before;
  int right = 0;
  for (const ImageFeature& f : tracker.features()) {
    before[f.id] = f.left_px;
    if (!f.right_px) continue;
    ++right;
    EXPECT_NEAR(f.left_px.x() - f.right_px->x(), 6, 0.15);
    EXPECT_NEAR(f.left_px.y(), f.right_px->y(), 0.15);
  }
  EXPECT_GT(right, 25);
  const Vec2 shift(5.3, -3.6);
  const FeatureFrame second = tracker.track(poster(100, shift, 6), Mat3::Identity());
  int followed = 0;
  for (const ImageFeature& f : tracker.features()) {
    if (f.age < 2) continue;
    ++followed;
    EXPECT_LT((f.left_px - before.at(f.id) - shift).norm(), 0.15);
  }
  EXPECT_GT(followed, 25);
  for (std::size_t i = 1; i < second.features.size(); ++i) {
    EXPECT_LT(second.features[i - 1].id, second.features[i].id);
  }
}

TEST(FeatureTracker, IsHeldInAFastTurnByTheGyro) {
  // 3.49 rad/s at 15 Hz: a quarter of this image's width.
  const Mat3 turn = so3::Exp({0, 3.49 / 15, 0});
  const StereoCamera camera = small_camera();
  const auto turned = [&] {
    StereoImage image = poster(100, {0, 0}, 6);
    const auto place = [&](const Vec2& px) {
      const Vec3 ray =
          turn * Vec3((px.x() - camera.cx) / camera.f_px, (px.y() - camera.cy) / camera.f_px, 1);
      return Vec2(camera.f_px * ray.x() / ray.z() + camera.cx,
                  camera.f_px * ray.y() / ray.z() + camera.cy);
    };
    image.left = picture(place);
    image.right.clear();
    return image;
  }();
  const auto held = [&](const Mat3& told) {
    FeatureTracker tracker(small_cells(), 1);
    static_cast<void>(tracker.track(poster(0, {0, 0}, 6), Mat3::Identity()));
    std::map<std::int64_t, Vec2> before;
    for (const ImageFeature& f : tracker.features()) before[f.id] = f.left_px;
    static_cast<void>(tracker.track(turned, told));
    int right_place = 0;
    for (const ImageFeature& f : tracker.features()) {
      if (f.age < 2) continue;
      const Vec2& p = before.at(f.id);
      const Vec3 ray = turn.transpose() * Vec3((p.x() - camera.cx) / camera.f_px,
                                               (p.y() - camera.cy) / camera.f_px, 1);
      const Vec2 expected(camera.f_px * ray.x() / ray.z() + camera.cx,
                          camera.f_px * ray.y() / ray.z() + camera.cy);
      right_place += (f.left_px - expected).norm() < 1;
    }
    return right_place;
  };
  const int with = held(turn), without = held(Mat3::Identity());
  EXPECT_GT(with, 15);
  EXPECT_GT(with, 3 * without);
}

// Auto exposure on the way out of the light: twice the exposure from one image to the next, and
// back.
TEST(FeatureTracker, FollowsThroughAStepOfTheExposure) {
  const auto shot = [](std::int64_t time_ns, const Vec2& shift, double exposure_s) {
    StereoImage image = poster(time_ns, shift, 6);
    for (std::uint8_t& grey : image.left) {
      grey = static_cast<std::uint8_t>(std::lround(std::min(255.0, grey * exposure_s / 0.004)));
    }
    image.right.clear();
    return image;
  };
  FeatureTracker tracker(small_cells(), 1);
  const Vec2 step(2.3, -1.6);
  std::map<std::int64_t, Vec2> before;
  int number = 0;
  for (const double exposure_s : {0.002, 0.004, 0.004, 0.002}) {
    static_cast<void>(
        tracker.track(shot(100 * number, number * step, exposure_s), Mat3::Identity()));
    int followed = 0;
    for (const ImageFeature& f : tracker.features()) {
      const auto was = before.find(f.id);
      if (was == before.end()) continue;
      ++followed;
      EXPECT_LT((f.left_px - was->second - step).norm(), 0.2) << number;
    }
    EXPECT_GE(followed, 0.8 * static_cast<double>(before.size())) << number;
    before.clear();
    for (const ImageFeature& f : tracker.features()) before[f.id] = f.left_px;
    ++number;
  }
}

TEST(FeatureTracker, SeesNothingInAGreyImage) {
  FeatureTracker tracker(small_cells(), 1);
  StereoImage grey = poster(0, {0, 0}, 6);
  std::fill(grey.left.begin(), grey.left.end(), std::uint8_t{90});
  grey.right = grey.left;
  EXPECT_TRUE(tracker.track(grey, Mat3::Identity()).features.empty());
  // It begins again where there is something to see.
  EXPECT_GT(tracker.track(poster(100, {0, 0}, 6), Mat3::Identity()).features.size(), 30U);
}

TEST(FeatureTracker, DrawsTheSameEachTime) {
  const auto run = [] {
    FeatureTracker tracker(small_cells(), 3);
    std::vector<Vec2> all;
    for (int i = 0; i < 4; ++i) {
      static_cast<void>(
          tracker.track(poster(100 * i, Vec2(1.7 * i, 0.9 * i), 5), Mat3::Identity()));
      for (const ImageFeature& f : tracker.features()) all.push_back(f.left_px);
    }
    return all;
  };
  EXPECT_EQ(run(), run());
}

constexpr double kFocal_px = 400;
constexpr MotionFit kOff{1.0 / kFocal_px, 0.3 / kFocal_px};

TEST(TranslationRansac, TellsWhatMovesOtherwise) {
  RandomStream random(4, "rays");
  const Vec3 t(0.1, 0.02, 0.3);
  std::vector<Vec3> before, after;
  constexpr int kPoints = 80, kWrong = 20;
  for (int i = 0; i < kPoints; ++i) {
    const Vec3 p(random.uniform(-4, 4), random.uniform(-2, 2), random.uniform(4, 12));
    const Vec3 q = p - t;
    before.push_back(p / p.z());
    after.push_back(q / q.z());
    if (i < kWrong) after.back() += Vec3(0.02 * random.normal(), 0.05 + 0.02 * random.normal(), 0);
  }
  const auto fits = fit_translation(before, after, kOff, 60, RandomStream(1, "draws"));
  int kept_wrong = 0;
  for (int i = 0; i < kPoints; ++i) {
    if (i < kWrong) {
      kept_wrong += fits[static_cast<std::size_t>(i)];
    } else {
      EXPECT_TRUE(fits[static_cast<std::size_t>(i)]) << i;
    }
  }
  EXPECT_LE(kept_wrong, 4);
}

// At the edge of a trunk a patch moves sideways with the trunk and downwards with the ground
// behind.
TEST(TranslationRansac, TellsWhatMissesItsLineByLessThanTheGyroIsWrong) {
  RandomStream random(6, "rays");
  const Vec3 t(0.02, 0.01, 0.16);
  const Mat3 lacking = so3::Exp({2.5e-3, -1.5e-3, 1e-3});  // 1 px
  std::vector<Vec3> before, after;
  std::vector<double> beside_px;
  constexpr int kPoints = 120, kAtEdges = 40;
  for (int i = 0; i < kPoints; ++i) {
    const Vec3 p(random.uniform(-5, 5), random.uniform(-1, 3), random.uniform(4, 9));
    const Vec3 q = p - t, behind = 2.5 * p - t;
    Vec3 seen = q / q.z();
    if (i < kAtEdges) seen.y() = behind.y() / behind.z();
    const Vec3 line = t.cross(p);
    beside_px.push_back(kFocal_px * std::abs(line.dot(seen)) / line.head<2>().norm());
    seen.head<2>() += 0.05 / kFocal_px * Vec2(random.normal(), random.normal());
    before.push_back(p / p.z());
    after.push_back((lacking * seen).hnormalized().homogeneous());
  }
  const auto fits = fit_translation(before, after, kOff, 60, RandomStream(1, "draws"));
  int told = 0;
  for (std::size_t i = 0; i < before.size(); ++i) {
    if (beside_px[i] >= 0.1 && beside_px[i] < 0.5) continue;
    EXPECT_EQ(fits[i], beside_px[i] < 0.1) << i << ": " << beside_px[i] << " px";
    told += !fits[i] && beside_px[i] < 1;
  }
  EXPECT_GE(told, 8);
}

TEST(TranslationRansac, KeepsEverythingWhileNothingMoves) {
  const std::vector<Vec3> rays{{0, 0, 1}, {0.1, 0, 1}, {0, 0.1, 1}, {0.3, -0.1, 1}};
  for (const bool fits : fit_translation(rays, rays, kOff, 60, RandomStream(1, "draws"))) {
    EXPECT_TRUE(fits);
  }
}

}  // namespace
}  // namespace arex
