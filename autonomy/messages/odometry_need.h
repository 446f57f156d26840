#pragma once

#include <array>
#include <string_view>

namespace arex {

/// What an odometry source that is not ok lacks, the first of it.
enum class OdometryNeed {
  kNothing,
  kImu,             ///< no IMU sample, or too few without a gap
  kGyroBias,        ///< the gyro's mean at rest is beyond any bias: off, or the vehicle turns
  kGyroNoise,       ///< the gyro's readings scatter: noise, or the vehicle is shaken
  kAccelNoise,      ///< so do the accelerometer's
  kAccelMagnitude,  ///< the specific force is not gravity's
  kScan,            ///< no returns
  kReference,       ///< returns, but too few surfaces to register against
  kMocap,           ///< nothing from the tracking system
  kImages,          ///< no image, or none with anything in it
  kFeatures,        ///< images, but too little in them to follow
};
inline constexpr std::array<std::string_view, 11> kOdometryNeedNames{
    "nothing",     "no_imu",          "gyro_bias",        "gyro_noise",
    "accel_noise", "accel_magnitude", "no_scan",          "nothing_to_register",
    "no_mocap",    "no_images",       "nothing_to_follow"};

}  // namespace arex
