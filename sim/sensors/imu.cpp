#include "sensors/imu.h"

#include <cmath>
#include <numbers>

namespace arex::sim {
namespace {

// Scale height of the standard atmosphere near the ground: R T / (M g), 288.15 K.
constexpr double kScaleHeight_m = 8.314462618 * 288.15 / (0.0289644 * kGravity);

bool due(Stamp stamp, int rate_hz) { return stamp % (kNanosecondsPerSecond / rate_hz) == 0; }

}  // namespace

ImuModel::Triad ImuModel::make_triad(const ImuConfig& config, bool gyro, std::uint64_t seed) {
  const double root_rate = std::sqrt(1 / kSecondsPerTick), root_tick = std::sqrt(kSecondsPerTick);
  Triad triad{
      .white_sigma = (gyro ? config.gyro_noise_density : config.accel_noise_density) * root_rate,
      .walk_sigma = (gyro ? config.gyro_walk_density : config.accel_walk_density) * root_tick,
      .range = gyro ? config.gyro_range_radps : config.accel_range_mps2,
      .stream = RandomStream(seed, gyro ? "imu.gyro" : "imu.accel")};
  const double bias_sigma = gyro ? config.gyro_bias_sigma_radps : config.accel_bias_sigma_mps2;
  const double scale_sigma =
      gyro ? config.gyro_scale_sigma_fraction : config.accel_scale_sigma_fraction;
  triad.bias = bias_sigma * triad.stream.normal3();
  triad.scale += scale_sigma * triad.stream.normal3();
  return triad;
}

ImuModel::ImuModel(const ImuConfig& config, std::uint64_t seed)
    : config_(config),
      gyro_(make_triad(config, true, seed)),
      accel_(make_triad(config, false, seed)),
      vibration_(config.vibration, seed),
      magnetometer_stream_(seed, "imu.magnetometer"),
      barometer_stream_(seed, "imu.barometer") {
  if (config.output_cutoff_hz > 0) {
    gyro_filter_.emplace(config.output_cutoff_hz);
    accel_filter_.emplace(config.output_cutoff_hz);
  }
  hard_iron_gauss_ = config.magnetometer_bias_sigma_gauss * magnetometer_stream_.normal3();
}

ImuSample ImuModel::sample(const Truth& truth) {
  ImuSample raw;
  raw.stamp = truth.stamp + from_seconds(config_.clock_offset_s);
  raw.gyro_radps = truth.w_WB_B;
  raw.accel_mps2 = truth.X_WB.R.transpose() * (truth.a_WB + Vec3(0, 0, kGravity));
  if (!config_.noise_free) {
    const VibrationModel::Shake shake = vibration_.step(truth.rotor_radps);
    raw.gyro_radps = gyro_.measure(raw.gyro_radps + shake.gyro_radps);
    raw.accel_mps2 = accel_.measure(raw.accel_mps2 + shake.accel_mps2);
  }
  sample_field(truth, raw.stamp);
  sample_pressure(truth, raw.stamp);
  raw.field_gauss = field_gauss_;
  gyro_mean_.add(gyro_filter_ ? gyro_filter_->filter(raw.gyro_radps) : raw.gyro_radps);
  accel_mean_.add(accel_filter_ ? accel_filter_->filter(raw.accel_mps2) : raw.accel_mps2);
  output_.reset();
  if (due(truth.stamp, config_.output_rate_hz)) {
    const ImuSample mean{raw.stamp, gyro_mean_.take(), accel_mean_.take(), field_gauss_};
    // Without noise the delay of the mean would be the only error left.
    output_ = config_.noise_free ? raw : mean;
  }
  return raw;
}

void ImuModel::sample_field(const Truth& truth, Stamp stamp) {
  magnetometer_.reset();
  if (!due(truth.stamp, config_.magnetometer_rate_hz)) return;
  magnetometer_ = {stamp, truth.X_WB.R.transpose() * config_.earth_field_gauss};
  if (!config_.noise_free) {
    const double sigma = config_.magnetometer_noise_density *
                         std::sqrt(static_cast<double>(config_.magnetometer_rate_hz));
    magnetometer_->field_gauss += hard_iron_gauss_ + sigma * magnetometer_stream_.normal3();
  }
  field_gauss_ = magnetometer_->field_gauss;
}

void ImuModel::sample_pressure(const Truth& truth, Stamp stamp) {
  barometer_.reset();
  if (!due(truth.stamp, config_.barometer_rate_hz)) return;
  barometer_ = {stamp,
                config_.sea_level_pressure_pa * std::exp(-truth.X_WB.p.z() / kScaleHeight_m)};
  if (config_.noise_free) return;
  barometer_->pressure_pa += config_.barometer_noise_pa * barometer_stream_.normal();
}

Vec3 ImuModel::Triad::measure(const Vec3& value) {
  bias += walk_sigma * stream.normal3();
  const Vec3 sensed = scale.cwiseProduct(value) + bias + white_sigma * stream.normal3();
  return sensed.cwiseMax(-range).cwiseMin(range);
}

void ImuModel::Mean::add(const Vec3& value) {
  sum += value;
  ++count;
}

Vec3 ImuModel::Mean::take() {
  const Vec3 mean = sum / count;
  *this = {};
  return mean;
}

// Bilinear transform of 1 / (s^2 + sqrt(2) s + 1), pre-warped to the cut-off.
ImuModel::LowPass::LowPass(double cutoff_hz) {
  const double k = std::tan(std::numbers::pi * cutoff_hz * kSecondsPerTick);
  const double norm = 1 / (1 + std::numbers::sqrt2 * k + k * k);
  b0 = k * k * norm;
  a1 = 2 * (k * k - 1) * norm;
  a2 = (1 - std::numbers::sqrt2 * k + k * k) * norm;
}

Vec3 ImuModel::LowPass::filter(const Vec3& value) {
  if (!primed) x1 = x2 = y1 = y2 = value;
  primed = true;
  const Vec3 y = b0 * (value + 2 * x1 + x2) - a1 * y1 - a2 * y2;
  x2 = x1;
  x1 = value;
  y2 = y1;
  y1 = y;
  return y;
}

}  // namespace arex::sim
