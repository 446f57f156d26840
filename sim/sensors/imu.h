#pragma once

#include <cstdint>
#include <optional>

#include "math/random.h"
#include "messages/sensors.h"
#include "physics/truth.h"
#include "sensors/imu_vibration.h"

namespace arex::sim {

/// The autopilot's sensors: gyro and accelerometer (1 kHz raw, 200 Hz out), magnetometer,
/// barometer.
struct ImuConfig {
  bool noise_free = false;
  double gyro_noise_density = 1.0e-4;            ///< rad/s/sqrt(Hz), 2x ICM-42688-P datasheet
  double gyro_walk_density = 2.0e-6;             ///< rad/s^2/sqrt(Hz), 2x a Pixhawk 6C at rest
  double gyro_bias_sigma_radps = 0.002;          ///< [E] 0.1 deg/s left after start-up calibration
  double gyro_scale_sigma_fraction = 0.002;      ///< [E] datasheet 0.5 % worst case
  double gyro_range_radps = 34.906585039886591;  ///< 2000 deg/s
  double accel_noise_density = 1.4e-3;           ///< m/s^2/sqrt(Hz), 2x ICM-42688-P datasheet
  double accel_walk_density = 5.0e-5;            ///< m/s^3/sqrt(Hz), 2x a Pixhawk 6C at rest
  double accel_bias_sigma_mps2 = 0.03;        ///< [E] 3 mg left after calibration; datasheet 20 mg
  double accel_scale_sigma_fraction = 0.001;  ///< [E] datasheet 0.5 % worst case
  double accel_range_mps2 = 16 * kGravity;    ///< 16 g
  double clock_offset_s = 0;                  ///< the device's clock minus true time
  int output_rate_hz = 200;                   ///< paper, II-A
  double output_cutoff_hz = 0;                ///< low-pass of the raw samples; 0: none
  VibrationConfig vibration;
  int magnetometer_rate_hz = 200;                 ///< paper, III-A: nine axes at 200 Hz
  Vec3 earth_field_gauss{-0.019, 0.375, -0.253};  ///< IGRF near Guangzhou, W as east-north-up
  double magnetometer_noise_density = 4.0e-4;     ///< gauss/sqrt(Hz)
  double magnetometer_bias_sigma_gauss = 0.005;   ///< [E] hard iron left after calibration
  int barometer_rate_hz = 50;                     ///< [E]
  double barometer_noise_pa = 1.0;                ///< RMS
  double sea_level_pressure_pa = 101325;          ///< at W's z = 0, standard atmosphere

  void fields(auto& f) {
    f("noise_free", noise_free, "exact samples of all four sensors, no vibration");
    f("gyro_noise_density", gyro_noise_density, "rad/s/sqrt(Hz), 2x ICM-42688-P datasheet");
    f("gyro_walk_density", gyro_walk_density,
      "bias walk, rad/s^2/sqrt(Hz), 2x a Pixhawk 6C at rest");
    f("gyro_bias_sigma_radps", gyro_bias_sigma_radps, "initial bias of each axis [E]");
    f("gyro_scale_sigma_fraction", gyro_scale_sigma_fraction, "scale error of each axis [E]");
    f("gyro_range_radps", gyro_range_radps, "clipped beyond: 2000 deg/s");
    f("accel_noise_density", accel_noise_density, "m/s^2/sqrt(Hz), 2x ICM-42688-P datasheet");
    f("accel_walk_density", accel_walk_density,
      "bias walk, m/s^3/sqrt(Hz), 2x a Pixhawk 6C at rest");
    f("accel_bias_sigma_mps2", accel_bias_sigma_mps2, "initial bias of each axis [E]");
    f("accel_scale_sigma_fraction", accel_scale_sigma_fraction, "scale error of each axis [E]");
    f("accel_range_mps2", accel_range_mps2, "clipped beyond: 16 g");
    f("clock_offset_s", clock_offset_s, "the device's clock minus true time");
    f("output_rate_hz", output_rate_hz, "samples to the stack (paper, II-A)");
    f("output_cutoff_hz", output_cutoff_hz,
      "second-order low-pass before samples are integrated over an output's interval; 0: none");
    f("vibration", vibration, "what the rotors shake into it");
    f("magnetometer_rate_hz", magnetometer_rate_hz, "samples (paper, III-A)");
    f("earth_field_gauss", earth_field_gauss, "in W, taken as east-north-up: near Guangzhou");
    f("magnetometer_noise_density", magnetometer_noise_density, "gauss/sqrt(Hz)");
    f("magnetometer_bias_sigma_gauss", magnetometer_bias_sigma_gauss, "hard iron left [E]");
    f("barometer_rate_hz", barometer_rate_hz, "samples [E]");
    f("barometer_noise_pa", barometer_noise_pa, "RMS");
    f("sea_level_pressure_pa", sea_level_pressure_pa, "at W's z = 0, standard atmosphere");
    f.check(gyro_noise_density >= 0, "gyro_noise_density >= 0");
    f.check(gyro_walk_density >= 0, "gyro_walk_density >= 0");
    f.check(gyro_bias_sigma_radps >= 0, "gyro_bias_sigma_radps >= 0");
    f.check(gyro_scale_sigma_fraction >= 0, "gyro_scale_sigma_fraction >= 0");
    f.check(gyro_range_radps > 0, "gyro_range_radps > 0");
    f.check(accel_noise_density >= 0, "accel_noise_density >= 0");
    f.check(accel_walk_density >= 0, "accel_walk_density >= 0");
    f.check(accel_bias_sigma_mps2 >= 0, "accel_bias_sigma_mps2 >= 0");
    f.check(accel_scale_sigma_fraction >= 0, "accel_scale_sigma_fraction >= 0");
    f.check(accel_range_mps2 > kGravity, "accel_range_mps2 > 9.80665");
    f.check(divides_kilohertz(output_rate_hz), "output_rate_hz divides 1000");
    f.check(output_cutoff_hz >= 0 && output_cutoff_hz < 500, "0 <= output_cutoff_hz < 500");
    f.check(divides_kilohertz(magnetometer_rate_hz), "magnetometer_rate_hz divides 1000");
    f.check(magnetometer_noise_density >= 0, "magnetometer_noise_density >= 0");
    f.check(magnetometer_bias_sigma_gauss >= 0, "magnetometer_bias_sigma_gauss >= 0");
    f.check(divides_kilohertz(barometer_rate_hz), "barometer_rate_hz divides 1000");
    f.check(barometer_noise_pa >= 0, "barometer_noise_pa >= 0");
    f.check(sea_level_pressure_pa > 0, "sea_level_pressure_pa > 0");
  }

  static bool divides_kilohertz(int rate_hz) { return rate_hz > 0 && 1000 % rate_hz == 0; }
};

/// Sampled once a tick, in order. B is the IMU's frame, so that there is no lever arm.
class ImuModel {
 public:
  ImuModel(const ImuConfig& config, std::uint64_t seed);

  /// The raw sample of this tick, as the autopilot reads it.
  ImuSample sample(const Truth& truth);

  // What else fell due at the newest tick.
  /// The mean of the raw samples since the output before, as an autopilot hands on what it has
  /// integrated: the turn that the outputs add up to is the raw samples' own. Vibration above half
  /// the output rate aliases, but for multiples of that rate, which would be taken for a standing
  /// turn. With the newest sample of the magnetometer.
  ///
  /// Source: PX4's vehicle_imu integrates the gyro's samples (Integrator.hpp) before it publishes.
  [[nodiscard]] const std::optional<ImuSample>& output() const { return output_; }
  [[nodiscard]] const std::optional<MagnetometerSample>& magnetometer() const {
    return magnetometer_;
  }
  [[nodiscard]] const std::optional<BarometerSample>& barometer() const { return barometer_; }

  // The hidden truth, for tests and scores.
  [[nodiscard]] const Vec3& gyro_bias() const { return gyro_.bias; }
  [[nodiscard]] const Vec3& accel_bias() const { return accel_.bias; }

 private:
  /// The errors of a three-axis sensor.
  struct Triad {
    double white_sigma = 0, walk_sigma = 0, range = 0;
    Vec3 bias = Vec3::Zero(), scale = Vec3::Ones();
    RandomStream stream;
    Vec3 measure(const Vec3& value);
  };
  /// Second-order Butterworth low-pass at 1 kHz, direct form I.
  struct LowPass {
    explicit LowPass(double cutoff_hz);
    Vec3 filter(const Vec3& value);
    double b0, a1, a2;
    bool primed = false;
    Vec3 x1 = Vec3::Zero(), x2 = Vec3::Zero(), y1 = Vec3::Zero(), y2 = Vec3::Zero();
  };
  /// Of the samples since it was last taken.
  struct Mean {
    void add(const Vec3& value);
    Vec3 take();
    Vec3 sum = Vec3::Zero();
    int count = 0;
  };
  static Triad make_triad(const ImuConfig& config, bool gyro, std::uint64_t seed);
  void sample_field(const Truth& truth, Stamp stamp);
  void sample_pressure(const Truth& truth, Stamp stamp);

  ImuConfig config_;
  Triad gyro_, accel_;
  VibrationModel vibration_;
  std::optional<LowPass> gyro_filter_, accel_filter_;
  Mean gyro_mean_, accel_mean_;
  RandomStream magnetometer_stream_, barometer_stream_;
  Vec3 hard_iron_gauss_ = Vec3::Zero();
  Vec3 field_gauss_ = Vec3::Zero();  ///< newest sample
  std::optional<ImuSample> output_;
  std::optional<MagnetometerSample> magnetometer_;
  std::optional<BarometerSample> barometer_;
};

}  // namespace arex::sim
