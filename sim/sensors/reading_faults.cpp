#include "sensors/reading_faults.h"

#include <algorithm>
#include <cstdint>
#include <memory>
#include <vector>

namespace arex::sim {
namespace {

constexpr float kFarthestFalse_m = 40;  // the MID-360's range at 10 % reflectivity
constexpr float kNearestFalse_m = 0.1F;
constexpr int kGlareBlock_px = 16;  // light blinds an area, not a pixel

/// `held` with another stamp: what most messages need.
template <class Sample>
Sample restamped(Stamp stamp, Sample held) {
  held.stamp = stamp;
  return held;
}

void move_point(LidarPoint& point, float range_m) {
  const float now_m = point.p_L.norm();
  if (now_m > 0) point.p_L *= std::max(range_m, kNearestFalse_m) / now_m;
}

void spoil(LidarPoint& point, const FaultConfig& fault, RandomStream& random) {
  const float range_m = point.p_L.norm();
  switch (fault.kind) {
    case FaultKind::kNoisy:
      move_point(point, range_m + static_cast<float>(fault.range_noise_m * random.normal()));
      break;
    case FaultKind::kFalseReturns:
      if (random.uniform() >= fault.share) break;
      move_point(point, static_cast<float>(random.uniform(kNearestFalse_m, kFarthestFalse_m)));
      break;
    case FaultKind::kJumping:
      if (range_m > fault.jump_within_m || random.uniform() >= fault.share) break;
      move_point(point, range_m - static_cast<float>(fault.jump_m));
      break;
    default:
      break;
  }
}

/// Blocks of an image that the light has drowned: each with the fault's share as its chance.
/// @param pixels row by row
template <class Pixel>
void blind(std::vector<Pixel>& pixels, int width, int height, Pixel drowned, double share,
           RandomStream& random) {
  for (int v0 = 0; v0 < height; v0 += kGlareBlock_px) {
    for (int u0 = 0; u0 < width; u0 += kGlareBlock_px) {
      if (random.uniform() >= share) continue;
      for (int v = v0; v < std::min(v0 + kGlareBlock_px, height); ++v) {
        const auto row = pixels.begin() + static_cast<std::ptrdiff_t>(v) * width;
        std::fill(row + u0, row + std::min(u0 + kGlareBlock_px, width), drowned);
      }
    }
  }
}

}  // namespace

ImuSample with_stamps_of(const ImuSample& now, ImuSample held) {
  return restamped(now.stamp, held);
}
MagnetometerSample with_stamps_of(const MagnetometerSample& now, MagnetometerSample held) {
  return restamped(now.stamp, held);
}
BarometerSample with_stamps_of(const BarometerSample& now, BarometerSample held) {
  return restamped(now.stamp, held);
}
BatterySample with_stamps_of(const BatterySample& now, BatterySample held) {
  return restamped(now.stamp, held);
}
MocapSample with_stamps_of(const MocapSample& now, MocapSample held) {
  return restamped(now.stamp, held);
}

LidarScanPtr with_stamps_of(const LidarScanPtr& now, const LidarScanPtr& held) {
  auto scan = std::make_shared<LidarScan>(*held);
  scan->stamp = now->stamp;
  scan->end = now->end;
  return scan;
}

DepthImagePtr with_stamps_of(const DepthImagePtr& now, const DepthImagePtr& held) {
  auto image = std::make_shared<DepthImage>(*held);
  image->stamp = now->stamp;
  return image;
}

StereoImagePtr with_stamps_of(const StereoImagePtr& now, const StereoImagePtr& held) {
  auto image = std::make_shared<StereoImage>(*held);
  image->time_ns = now->time_ns;
  return image;
}

ImuSample spoilt(ImuSample reading, const FaultConfig& fault, RandomStream& random) {
  if (fault.kind != FaultKind::kNoisy) return reading;
  reading.gyro_radps += fault.gyro_noise_radps * random.normal3();
  reading.accel_mps2 += fault.accel_noise_mps2 * random.normal3();
  return reading;
}

MagnetometerSample spoilt(MagnetometerSample reading, const FaultConfig& fault,
                          RandomStream& random) {
  if (fault.kind == FaultKind::kNoisy) {
    reading.field_gauss += fault.field_noise_gauss * random.normal3();
  }
  return reading;
}

BarometerSample spoilt(BarometerSample reading, const FaultConfig& fault, RandomStream& random) {
  if (fault.kind == FaultKind::kNoisy) {
    reading.pressure_pa += fault.pressure_noise_pa * random.normal();
  }
  return reading;
}

BatterySample spoilt(BatterySample reading, const FaultConfig& fault, RandomStream& random) {
  if (fault.kind == FaultKind::kNoisy) {
    reading.voltage_v = std::max(0.0, reading.voltage_v + fault.voltage_noise_v * random.normal());
  }
  return reading;
}

MocapSample spoilt(MocapSample reading, const FaultConfig& fault, RandomStream& random) {
  if (fault.kind == FaultKind::kNoisy) {
    reading.X_OB.p += fault.position_noise_m * random.normal3();
  }
  return reading;
}

LidarScanPtr spoilt(const LidarScanPtr& reading, const FaultConfig& fault, RandomStream& random) {
  auto scan = std::make_shared<LidarScan>(*reading);
  for (LidarPoint& point : scan->points) spoil(point, fault, random);
  return scan;
}

DepthImagePtr spoilt(const DepthImagePtr& reading, const FaultConfig& fault, RandomStream& random) {
  auto image = std::make_shared<DepthImage>(*reading);
  if (fault.kind == FaultKind::kBlinded) {
    blind(image->depth_m, image->camera.width, image->camera.height, 0.0F, fault.share, random);
  }
  if (fault.kind != FaultKind::kNoisy) return image;
  for (float& depth : image->depth_m) {
    if (depth == 0) continue;
    const double factor = 1 + fault.depth_noise_fraction * random.normal();
    depth = static_cast<float>(depth * std::max(factor, 0.0));
  }
  return image;
}

StereoImagePtr spoilt(const StereoImagePtr& reading, const FaultConfig& fault,
                      RandomStream& random) {
  constexpr std::uint8_t kWhite = 255;
  auto image = std::make_shared<StereoImage>(*reading);
  for (std::vector<std::uint8_t>* eye : {&image->left, &image->right}) {
    if (eye->empty()) continue;
    if (fault.kind == FaultKind::kBlinded) {
      blind(*eye, image->width, image->height, kWhite, fault.share, random);
    }
    if (fault.kind != FaultKind::kNoisy) continue;
    for (std::uint8_t& level : *eye) {
      const double noisy = level + fault.image_noise_levels * random.normal();
      level = static_cast<std::uint8_t>(std::clamp(noisy + 0.5, 0.0, 255.0));
    }
  }
  return image;
}

}  // namespace arex::sim
