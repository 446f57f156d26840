#include "sensors/imu_vibration.h"

#include <cmath>
#include <numbers>

namespace arex::sim {
namespace {

constexpr double kPi = std::numbers::pi;
// Seen from above, in MotorCommand's order.
constexpr std::array<double, 4> kTurningSense{1, 1, -1, -1};

// Below this nothing that stays in its place can shake much: 0.1 m/s^2/sqrt(Hz) is 3 mm there.
constexpr double kWashFrom_hz = 3;
struct Mode {
  double frequency_hz, damping;
};
// Arms and landing gear, the stack of plates, the sensor's mount. Broad, since each stands for
// several.
constexpr std::array<Mode, AxisVibration::kModes> kModes{{{10, 0.5}, {45, 0.35}, {75, 0.2}}};

// Fitted by non-negative least squares to the spectra (Welch, 200 Hz) of the recordings, aliases
// included, with rotors about 114 Hz as this vehicle's. The fit was made behind a second-order
// low-pass at 90 Hz; lines are as much less (0.93, 0.85) as the output's mean now lets through
// more. RMS above 5 Hz and what the fits leave: models/arex/README.md.
constexpr VibrationSpectrum kNone{};
constexpr VibrationSpectrum kSmooth{{{0.062, {0.061, 0, 0.111}, 1.78, 0.90},
                                     {0.019, {0.007, 0, 0.061}, 0.75, 2.35},
                                     {0.052, {0, 0, 0.084}, 1.41, 0.17},
                                     {0.0003, {0.0040, 0, 0.0008}, 0.020, 0.134},
                                     {0.0003, {0.0087, 0, 0.0031}, 0.090, 0.009},
                                     {0.0003, {0.0086, 0, 0.0008}, 0.049, 0.009}}};
constexpr VibrationSpectrum kTypical{{{0.112, {0.052, 0.209, 0.047}, 2.08, 0.26},
                                      {0.029, {0, 0.142, 0.175}, 0.56, 1.62},
                                      {0.04, {0.110, 0, 0.325}, 2.94, 0.26},
                                      {0.0024, {0.0066, 0, 0.0051}, 0.090, 0.110},
                                      {0.001, {0.0136, 0, 0.0104}, 0.194, 0.017},
                                      {0.001, {0.0134, 0, 0.0084}, 0.040, 0.017}}};
constexpr VibrationSpectrum kRough{{{0.03, {0.062, 0.230, 0}, 1.00, 0.26},
                                    {0.03, {0, 0.380, 0.302}, 0.28, 0.26},
                                    {0.03, {0.042, 0, 0.465}, 4.04, 0.26},
                                    {0.001, {0.0066, 0, 0.0210}, 0.274, 0.026},
                                    {0.001, {0.0068, 0, 0.0142}, 0.203, 0.026},
                                    {0.001, {0.0117, 0.0115, 0.0143}, 0.019, 0.026}}};

}  // namespace

const VibrationSpectrum& vibration_spectrum(VibrationLevel level) {
  switch (level) {
    case VibrationLevel::kSmooth:
      return kSmooth;
    case VibrationLevel::kTypical:
      return kTypical;
    case VibrationLevel::kRough:
      return kRough;
    case VibrationLevel::kNone:
      break;
  }
  return kNone;
}

VibrationModel::VibrationModel(const VibrationConfig& config, std::uint64_t seed)
    : config_(config), spectrum_(vibration_spectrum(config.level)), stream_(seed, "imu.vibration") {
  double squares = 0;
  for (std::size_t i = 0; i < kRotors; ++i) {
    angle_rad_[i] = stream_.uniform(0, 2 * kPi);
    unbalance_[i] = stream_.uniform(0.6, 1.4);
    squares += unbalance_[i] * unbalance_[i];
    for (auto& phase : phase_[i]) {
      const double angle = stream_.uniform(0, 2 * kPi);
      phase = {std::cos(angle), std::sin(angle)};
    }
    // The force of an unbalance turns with the rotor: y a quarter turn behind or before x.
    const auto [c, s] = phase_[i][0];
    phase_[i][1] = {kTurningSense[i] * s, -kTurningSense[i] * c};
  }
  for (double& unbalance : unbalance_) unbalance /= std::sqrt(squares);

  // White noise of variance 1 at 1 kHz has a one-sided density of sqrt(2 / 1000).
  const double white = std::sqrt(0.5 / kSecondsPerTick) * config.scale;
  shapers_[0] = wash_shaper();
  for (std::size_t m = 0; m < kModes.size(); ++m) {
    shapers_[m + 1] = mode_shaper(kModes[m].frequency_hz, kModes[m].damping);
  }
  for (std::size_t axis = 0; axis < kAxes; ++axis) {
    const auto row = static_cast<Eigen::Index>(axis);
    shapers_[0].gain[row] = white * spectrum_[axis].wash;
    for (std::size_t m = 0; m < kModes.size(); ++m) {
      shapers_[m + 1].gain[row] = white * spectrum_[axis].modes[m];
    }
  }
}

// Bilinear transforms, pre-warped to the frequency: s^2 / (s^2 + sqrt(2) s + 1) ...
VibrationModel::Shaper VibrationModel::wash_shaper() {
  const double k = std::tan(kPi * kWashFrom_hz * kSecondsPerTick);
  const double norm = 1 / (1 + std::numbers::sqrt2 * k + k * k);
  Shaper shaper;
  shaper.b0 = shaper.b2 = norm;
  shaper.b1 = -2 * norm;
  shaper.a1 = 2 * (k * k - 1) * norm;
  shaper.a2 = (1 - std::numbers::sqrt2 * k + k * k) * norm;
  return shaper;
}

// ... and 2 z s / (s^2 + 2 z s + 1), which is 1 at its middle.
VibrationModel::Shaper VibrationModel::mode_shaper(double frequency_hz, double damping) {
  const double k = std::tan(kPi * frequency_hz * kSecondsPerTick);
  const double norm = 1 / (1 + 2 * damping * k + k * k);
  Shaper shaper;
  shaper.b0 = 2 * damping * k * norm;
  shaper.b2 = -shaper.b0;
  shaper.a1 = 2 * (k * k - 1) * norm;
  shaper.a2 = (1 - 2 * damping * k + k * k) * norm;
  return shaper;
}

VibrationModel::Six VibrationModel::Shaper::filter(const Six& force) {
  const Six x = gain.cwiseProduct(force);
  const Six y = b0 * x + b1 * x1 + b2 * x2 - a1 * y1 - a2 * y2;
  x2 = x1;
  x1 = x;
  y2 = y1;
  y1 = y;
  return y;
}

VibrationModel::Shake VibrationModel::step(const std::array<double, 4>& rotor_radps) {
  Shake shake;
  if (config_.level == VibrationLevel::kNone) return shake;
  double thrust = 0;  // over that at the reference speed
  for (const double speed : rotor_radps) {
    const double ratio = speed / config_.reference_speed_radps;
    thrust += ratio * ratio / static_cast<double>(kRotors);
  }
  const Six value = broadband(thrust) + lines(rotor_radps);
  shake.accel_mps2 = value.head<3>();
  shake.gyro_radps = value.tail<3>();
  return shake;
}

// What shakes grows with thrust, not what it does to the structure: rates that were scaled as the
// rotors spin up would add up to an angle that never comes back.
VibrationModel::Six VibrationModel::broadband(double thrust) {
  Six sum = Six::Zero();
  for (Shaper& shaper : shapers_) {
    Six force = Six::Zero();
    if (thrust > 0) {
      for (double& value : force) value = thrust * stream_.normal();
    }
    sum += shaper.filter(force);
  }
  return sum;
}

VibrationModel::Six VibrationModel::lines(const std::array<double, kRotors>& rotor_radps) {
  Six lines = Six::Zero();
  for (std::size_t i = 0; i < kRotors; ++i) {
    const double speed = rotor_radps[i], ratio = speed / config_.reference_speed_radps;
    angle_rad_[i] = std::fmod(angle_rad_[i] + speed * kSecondsPerTick, 2 * kPi);
    const double growth = config_.scale * unbalance_[i] * ratio * ratio;
    const double turned_c = std::cos(angle_rad_[i]), turned_s = std::sin(angle_rad_[i]);
    for (std::size_t axis = 0; axis < kAxes; ++axis) {
      const AxisVibration& of = spectrum_[axis];
      const auto [phase_c, phase_s] = phase_[i][axis];
      const double c = turned_c * phase_c - turned_s * phase_s;
      const double s = turned_s * phase_c + turned_c * phase_s;
      lines[static_cast<Eigen::Index>(axis)] +=
          growth * (of.once_per_rev * c + of.twice_per_rev * (c * c - s * s));
    }
  }
  return lines;
}

}  // namespace arex::sim
