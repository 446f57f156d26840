#pragma once

#include "math/random.h"
#include "messages/sensors.h"
#include "messages/stereo_image.h"
#include "sensors/fault.h"

/// What a fault does to one reading, for every message that a sensor may deliver.
namespace arex::sim {

/// `held` again, as if measured when `now` was.
[[nodiscard]] ImuSample with_stamps_of(const ImuSample& now, ImuSample held);
[[nodiscard]] MagnetometerSample with_stamps_of(const MagnetometerSample& now,
                                                MagnetometerSample held);
[[nodiscard]] BarometerSample with_stamps_of(const BarometerSample& now, BarometerSample held);
[[nodiscard]] BatterySample with_stamps_of(const BatterySample& now, BatterySample held);
[[nodiscard]] MocapSample with_stamps_of(const MocapSample& now, MocapSample held);
[[nodiscard]] LidarScanPtr with_stamps_of(const LidarScanPtr& now, const LidarScanPtr& held);
[[nodiscard]] DepthImagePtr with_stamps_of(const DepthImagePtr& now, const DepthImagePtr& held);
[[nodiscard]] StereoImagePtr with_stamps_of(const StereoImagePtr& now, const StereoImagePtr& held);

/// A reading with what a noisy, false_returns, jumping or blinded fault does to it; one that its
/// kind does not concern comes back as it is.
[[nodiscard]] ImuSample spoilt(ImuSample reading, const FaultConfig& fault, RandomStream& random);
[[nodiscard]] MagnetometerSample spoilt(MagnetometerSample reading, const FaultConfig& fault,
                                        RandomStream& random);
[[nodiscard]] BarometerSample spoilt(BarometerSample reading, const FaultConfig& fault,
                                     RandomStream& random);
[[nodiscard]] BatterySample spoilt(BatterySample reading, const FaultConfig& fault,
                                   RandomStream& random);
[[nodiscard]] MocapSample spoilt(MocapSample reading, const FaultConfig& fault,
                                 RandomStream& random);
[[nodiscard]] LidarScanPtr spoilt(const LidarScanPtr& reading, const FaultConfig& fault,
                                  RandomStream& random);
[[nodiscard]] DepthImagePtr spoilt(const DepthImagePtr& reading, const FaultConfig& fault,
                                   RandomStream& random);
[[nodiscard]] StereoImagePtr spoilt(const StereoImagePtr& reading, const FaultConfig& fault,
                                    RandomStream& random);

}  // namespace arex::sim
