#pragma once

#include "math/types.h"

namespace arex {

/// What an odometry believes of its IMU.
struct ImuNoiseConfig {
  double delay_s = 0.002;                   ///< of the readings behind their stamps
  double delay_std_s = 0.001;               ///< 1 sigma of that before take-off
  double unknown_delay_std_s = 0.03;        ///< 1 sigma once it turns out to be another
  double delay_walk_density = 2e-4;         ///< s/sqrt(s)
  double gyro_scale_std = 0.02;             ///< 1 sigma of the scale's error before take-off
  double gyro_noise_density = 1.5e-4;       ///< rad/s/sqrt(Hz)
  double gyro_scale_noise_density = 5e-3;   ///< share of the rate, 1/sqrt(Hz)
  double accel_noise_density = 0.03;        ///< m/s^2/sqrt(Hz)
  double gyro_walk_density = 2e-5;          ///< rad/s^2/sqrt(Hz)
  double accel_walk_density = 1e-3;         ///< m/s^3/sqrt(Hz)
  double gyro_range_radps = 34.9;           ///< readings beyond this may be clipped
  double clipped_gyro_noise_density = 0.3;  ///< of an axis at its limit, rad/s/sqrt(Hz)

  void fields(auto& f) {
    f("delay_s", delay_s,
      "how far the readings lie behind their stamps: each is the mean of five samples, of which "
      "the middle one is 2 ms old; a known offset of its clock is added. Estimated from there on");
    f("delay_std_s", delay_std_s,
      "1 sigma of the delay before take-off. A looser one lets the first second in the air, whose "
      "few "
      "scans hardly tell it, draw it by as much and tilt the map. 0 takes it as known");
    f("unknown_delay_std_s", unknown_delay_std_s,
      "1 sigma of a delay that scans have drawn further than delay_std_s explains: clocks that "
      "nobody synchronised");
    f("delay_walk_density", delay_walk_density,
      "s/sqrt(s), walk of the delay: what was learned of it while it was far off is forgotten in "
      "some ten seconds");
    f("gyro_scale_std", gyro_scale_std,
      "1 sigma of the gyro's scale error before take-off (ICM-42688-P: 0.5 %; its mounting and "
      "worse devices more); 0 takes the scale as known");
    f("gyro_noise_density", gyro_noise_density,
      "rad/s/sqrt(Hz): half as much again as the white noise of the sensor, 1e-4, for aliased "
      "vibration; more lets scans of a small scene tilt a vehicle that stands still. A "
      "start that measures more noise than this raises it and the walk's by the same factor");
    f("gyro_scale_noise_density", gyro_scale_noise_density,
      "1/sqrt(Hz), times the rate: errors of scale and alignment");
    f("accel_noise_density", accel_noise_density,
      "m/s^2/sqrt(Hz): the sensor's 1.4e-3 and aliased vibration");
    f("gyro_walk_density", gyro_walk_density, "rad/s^2/sqrt(Hz): the sensor's");
    f("accel_walk_density", accel_walk_density, "m/s^3/sqrt(Hz): the sensor's");
    f("gyro_range_radps", gyro_range_radps,
      "full scale of the gyro, 2000 deg/s; a lower one is noticed");
    f("clipped_gyro_noise_density", clipped_gyro_noise_density,
      "rad/s/sqrt(Hz) while an axis reads its full scale");
    f.check(delay_s > -0.1 && delay_s < 0.1, "-0.1 < delay_s < 0.1");
    f.check(gyro_noise_density > 0 && accel_noise_density > 0,
            "gyro_noise_density > 0, accel_noise_density > 0");
    f.check(delay_std_s >= 0 && delay_std_s <= 0.2, "0 <= delay_std_s <= 0.2");
    f.check(unknown_delay_std_s >= 0 && unknown_delay_std_s <= 0.2,
            "0 <= unknown_delay_std_s <= 0.2");
    f.check(delay_walk_density >= 0 && gyro_scale_std >= 0 && gyro_scale_std <= 0.5,
            "delay_walk_density >= 0, 0 <= gyro_scale_std <= 0.5");
    f.check(gyro_walk_density >= 0 && accel_walk_density >= 0,
            "gyro_walk_density >= 0, accel_walk_density >= 0");
  }
};

/// Standing still before take-off: gravity, gyro bias, scale of the accelerometer.
struct StaticInitialiserConfig {
  double window_s = 1.0;
  double max_gyro_std_radps = 0.02;
  double max_accel_std_mps2 = 0.3;
  double max_gyro_mean_radps = 0.1;
  double still_rate_radps = 0.005;
  double still_force_mps2 = 0.1;
  double still_sigma = 4;
  double gyro_bias_std_radps = 1e-4;
  double accel_bias_std_mps2 = 0.05;
  double gravity_std_mps2 = 0.005;

  void fields(auto& f) {
    f("window_s", window_s, "standstill that is averaged");
    f("max_gyro_std_radps", max_gyro_std_radps, "a window of a larger deviation starts again");
    f("max_accel_std_mps2", max_accel_std_mps2, "a window of a larger deviation starts again");
    f("max_gyro_mean_radps", max_gyro_mean_radps, "a window that turns faster starts again");
    f("still_rate_radps", still_rate_radps,
      "after the start, a scan's mean rate below this is still standstill, as far as force allows");
    f("still_force_mps2", still_force_mps2,
      "and its mean specific force changed by less than this");
    f("still_sigma", still_sigma, "beside so many sigma of the white noise in these means");
    f("gyro_bias_std_radps", gyro_bias_std_radps,
      "1 sigma of what changes it later, beside the noise of the mean");
    f("accel_bias_std_mps2", accel_bias_std_mps2,
      "turn-on bias of the accelerometer, 1 sigma (ICM-42688-P: 20 mg at most)");
    f("gravity_std_mps2", gravity_std_mps2,
      "1 sigma of the standard gravity's magnitude: what latitude and height leave open after "
      "scaling");
    f.check(window_s >= 0.05 && window_s <= 60, "0.05 <= window_s <= 60");
    f.check(gyro_bias_std_radps > 0 && accel_bias_std_mps2 > 0 && gravity_std_mps2 > 0,
            "gyro_bias_std_radps, accel_bias_std_mps2, gravity_std_mps2 > 0");
  }
};

}  // namespace arex
