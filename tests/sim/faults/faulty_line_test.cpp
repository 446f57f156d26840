#include "sensors/faulty_line.h"

#include <gtest/gtest.h>

#include <cmath>
#include <memory>
#include <vector>

namespace arex::sim {
namespace {

constexpr Stamp kTick = kNanosecondsPerTick;

FaultConfig fault_of(const std::string& device, FaultKind kind, double from_s = 1,
                     double to_s = 2) {
  FaultConfig fault;
  fault.device = device;
  fault.kind = kind;
  fault.from_s = from_s;
  fault.to_s = to_s;
  return fault;
}

struct Arrived {
  Stamp at = 0;
  BarometerSample sample;
};

/// Three seconds of a barometer at 50 Hz that counts its readings.
std::vector<Arrived> count(const std::vector<FaultConfig>& faults, std::uint64_t seed = 1) {
  FaultyLine<BarometerSample> line(faults, seed, "barometer");
  std::vector<Arrived> arrived;
  for (Stamp now = 0; now < 3 * kNanosecondsPerSecond; now += kTick) {
    std::optional<BarometerSample> reading;
    if (now % (20 * kTick) == 0)
      reading = {now, 100000.0 + static_cast<double>(now / (20 * kTick))};
    line.pass(now, reading, [&](const BarometerSample& sample) {
      arrived.push_back({now, sample});
    });
  }
  return arrived;
}

bool in_fault(const Arrived& arrived) {
  return arrived.sample.stamp >= kNanosecondsPerSecond &&
         arrived.sample.stamp < 2 * kNanosecondsPerSecond;
}

TEST(FaultyLine, WithoutAFaultOfItsOwnItHandsOnWhatItIsGiven) {
  for (const auto& arrived : count({fault_of("magnetometer", FaultKind::kSilent)})) {
    EXPECT_EQ(arrived.at, arrived.sample.stamp);
    EXPECT_EQ(arrived.sample.pressure_pa,
              100000.0 + static_cast<double>(arrived.at / (20 * kTick)));
  }
}

TEST(FaultyLine, ASilentOneDeliversNothingWhileItLasts) {
  const auto arrived = count({fault_of("barometer", FaultKind::kSilent)});
  EXPECT_EQ(arrived.size(), 100U);
  for (const Arrived& one : arrived) EXPECT_FALSE(in_fault(one));
}

TEST(FaultyLine, AStuckOneRepeatsItsLastReadingWithNewStamps) {
  const auto arrived = count({fault_of("barometer", FaultKind::kStuck)});
  ASSERT_EQ(arrived.size(), 150U);
  for (const Arrived& one : arrived) {
    const double expected = in_fault(one) ? 49 : static_cast<double>(one.at / (20 * kTick));
    EXPECT_EQ(one.sample.pressure_pa - 100000, expected);
    EXPECT_EQ(one.sample.stamp, one.at);
  }
  // From the first on there is nothing else to repeat.
  for (const Arrived& one : count({fault_of("barometer", FaultKind::kStuck, 0, 1e9)})) {
    EXPECT_EQ(one.sample.pressure_pa, 100000);
  }
}

TEST(FaultyLine, ADelayedOneIsLateInOrderAndCatchesUp) {
  FaultConfig fault = fault_of("barometer", FaultKind::kDelayed);
  fault.delay_s = 0.25;
  const auto arrived = count({fault});
  ASSERT_EQ(arrived.size(), 150U);
  for (std::size_t i = 0; i < arrived.size(); ++i) {
    EXPECT_EQ(arrived[i].sample.stamp, static_cast<Stamp>(i) * 20 * kTick) << "in order";
    if (in_fault(arrived[i])) {
      EXPECT_EQ(arrived[i].at - arrived[i].sample.stamp, 250 * kTick);
    }
    if (arrived[i].sample.stamp > from_seconds(2.25)) {
      EXPECT_EQ(arrived[i].at, arrived[i].sample.stamp);
    }
  }
}

TEST(FaultyLine, LosesItsShareAndAddsItsNoise) {
  std::size_t kept = 0;
  double squares = 0;
  for (std::uint64_t seed = 1; seed <= 40; ++seed) {
    FaultConfig dropping = fault_of("barometer", FaultKind::kDropping);
    dropping.share = 0.3;
    kept += count({dropping}, seed).size() - 100;
    for (const Arrived& one : count({fault_of("barometer", FaultKind::kNoisy)}, seed)) {
      const double error =
          one.sample.pressure_pa - 100000 - static_cast<double>(one.at / (20 * kTick));
      if (in_fault(one)) squares += error * error / 2000;
      if (!in_fault(one)) {
        EXPECT_EQ(error, 0);
      }
    }
  }
  EXPECT_NEAR(static_cast<double>(kept) / 2000, 0.7, 0.04);  // 4 sigma
  EXPECT_NEAR(std::sqrt(squares), 30, 2);
}

TEST(FaultyLine, IsTheSameForASeedAndAnotherForAnother) {
  const auto first = [](std::uint64_t seed) {
    return count({fault_of("barometer", FaultKind::kNoisy)}, seed)[60].sample.pressure_pa;
  };
  EXPECT_EQ(first(7), first(7));
  EXPECT_NE(first(7), first(8));
}

LidarScanPtr ring(float range_m) {
  auto scan = std::make_shared<LidarScan>();
  for (int i = 0; i < 20000; ++i) {
    LidarPoint point;
    const float angle = 0.0003F * static_cast<float>(i);
    point.p_L = range_m * Vec3f(std::cos(angle), std::sin(angle), 0);
    scan->points.push_back(point);
  }
  return scan;
}

TEST(ReadingFaults, ALidarsPointsMoveAlongTheirBeamsOnly) {
  RandomStream random(1, "test");
  for (const FaultKind kind : {FaultKind::kNoisy, FaultKind::kFalseReturns, FaultKind::kJumping}) {
    const LidarScanPtr sound = ring(2);
    const LidarScanPtr faulty = spoilt(sound, fault_of("lidar", kind), random);
    ASSERT_EQ(faulty->points.size(), sound->points.size());
    int moved = 0;
    double squares = 0;
    for (std::size_t i = 0; i < sound->points.size(); ++i) {
      const Vec3f &a = sound->points[i].p_L, &b = faulty->points[i].p_L;
      ASSERT_LT(a.cross(b).norm(), 1e-4F * b.norm());
      const double change = b.norm() - a.norm();
      moved += std::abs(change) > 1e-3;
      squares += change * change / 20000;
      if (kind == FaultKind::kJumping && std::abs(change) > 1e-3) {
        EXPECT_NEAR(change, -0.3, 1e-4);
      }
    }
    EXPECT_EQ(ring(2)->points[5].p_L, sound->points[5].p_L) << "what is shared stays as it is";
    if (kind == FaultKind::kNoisy) {
      EXPECT_NEAR(std::sqrt(squares), 0.1, 0.003);
    } else {
      EXPECT_NEAR(moved / 20000.0, 0.2, 0.015);
    }
  }
  // What is far has no edges that matter.
  const LidarScanPtr far = ring(8);
  EXPECT_EQ(spoilt(far, fault_of("lidar", FaultKind::kJumping), random)->points[9].p_L,
            far->points[9].p_L);
}

TEST(ReadingFaults, LightBlindsItsShareOfAnImage) {
  RandomStream random(3, "test");
  auto image = std::make_shared<DepthImage>();
  image->camera = {320, 240, 160, 160, 160, 120};
  image->depth_m.assign(320 * 240, 2.0F);
  FaultConfig fault = fault_of("depth", FaultKind::kBlinded);
  for (const double share : {0.0, 0.5, 1.0}) {
    fault.share = share;
    const DepthImagePtr blind = spoilt(DepthImagePtr(image), fault, random);
    int lost = 0;
    for (const float depth : blind->depth_m) lost += depth == 0;
    EXPECT_NEAR(lost / (320.0 * 240.0), share, share == 0.5 ? 0.12 : 1e-9);
  }
}

TEST(ReadingFaults, LightDrownsBlocksOfAnEyeAndNoiseScattersItsPixels) {
  auto image = std::make_shared<StereoImage>();
  image->width = 320;
  image->height = 240;
  image->left.assign(320 * 240, 100);
  RandomStream random(1, "eye");
  FaultConfig fault = fault_of("infrared", FaultKind::kBlinded);
  fault.share = 0.3;
  double white = 0;
  for (int i = 0; i < 20; ++i) {
    const StereoImagePtr blind = spoilt(StereoImagePtr(image), fault, random);
    EXPECT_TRUE(blind->right.empty());  // as it was
    for (const std::uint8_t level : blind->left) white += level == 255;
  }
  EXPECT_NEAR(white / (20.0 * 320 * 240), 0.3, 0.03);  // of 300 blocks, 20 times

  fault = fault_of("infrared", FaultKind::kNoisy);
  const StereoImagePtr noisy = spoilt(StereoImagePtr(image), fault, random);
  double sum = 0, squares = 0;
  for (const std::uint8_t level : noisy->left) {
    sum += level - 100.0;
    squares += std::pow(level - 100.0, 2);
  }
  const double n = 320 * 240;
  EXPECT_NEAR(sum / n, 0, 0.4);
  EXPECT_NEAR(std::sqrt(squares / n), fault.image_noise_levels, 0.3);

  auto later = std::make_shared<StereoImage>();
  later->time_ns = 7;
  const StereoImagePtr stuck = with_stamps_of(StereoImagePtr(later), StereoImagePtr(image));
  EXPECT_EQ(stuck->time_ns, 7);
  EXPECT_EQ(stuck->left, image->left);
}

}  // namespace
}  // namespace arex::sim
