#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "math/types.h"

namespace arex::sim {

/// How the MID-360 measures what a beam meets.
struct EchoConfig {
  double range_noise_m = 0.0034;               ///< measured unit
  double range_noise_per_m = 0.00073;          ///< measured unit
  double range_noise_exponent = 0.78;          ///< of 1 / cos(incidence), measured unit
  double range_noise_floor_m = 0;              ///< stress case: 0.02 (datasheet limit at 10 m)
  double angle_noise_deg = 0.10;               ///< each tangential axis; datasheet < 0.15
  double blind_m = 0.1;                        ///< datasheet
  double max_range_m = 70;                     ///< datasheet, at 80 % reflectivity
  double range_at_tenth_m = 40;                ///< datasheet, at 10 % reflectivity
  double range_reflectivity_exponent = 0.269;  ///< [E] through both datasheet points
  double dropout_probability = 0.005;          ///< [E]
  double false_alarm_probability = 1e-4;       ///< datasheet < 0.01 %
  std::vector<double> return_incidence_deg{78, 79.5, 82.5, 85, 88, 90};  ///< measured unit
  std::vector<double> return_probability{1, 0.76, 0.5, 0.22, 0.08, 0};   ///< measured unit

  void fields(auto& f) {
    f("range_noise_m", range_noise_m, "range sigma at zero range, measured unit");
    f("range_noise_per_m", range_noise_per_m, "range sigma per metre (hypot), measured unit");
    f("range_noise_exponent", range_noise_exponent, "growth with 1/cos(incidence)");
    f("range_noise_floor_m", range_noise_floor_m, "least range sigma; stress case 0.02");
    f("angle_noise_deg", angle_noise_deg, "sigma of each tangential axis (datasheet < 0.15)");
    f("blind_m", blind_m, "nearer surfaces return nothing (datasheet)");
    f("max_range_m", max_range_m, "at 80 % reflectivity (datasheet)");
    f("range_at_tenth_m", range_at_tenth_m, "maximum range at 10 % reflectivity (datasheet)");
    f("range_reflectivity_exponent", range_reflectivity_exponent,
      "maximum range over reflectivity [E]");
    f("dropout_probability", dropout_probability, "returns lost for no visible reason [E]");
    f("false_alarm_probability", false_alarm_probability, "per firing (datasheet < 0.01 %)");
    f("return_incidence_deg", return_incidence_deg, "knots of the return probability");
    f("return_probability", return_probability, "at those angles, 1 below the first");
    f.check(range_noise_m >= 0, "range_noise_m >= 0");
    f.check(range_noise_per_m >= 0, "range_noise_per_m >= 0");
    f.check(range_noise_floor_m >= 0, "range_noise_floor_m >= 0");
    f.check(angle_noise_deg >= 0, "angle_noise_deg >= 0");
    f.check(blind_m > 0, "blind_m > 0");
    f.check(max_range_m > blind_m && max_range_m <= 2000, "blind_m < max_range_m <= 2000");
    f.check(range_at_tenth_m > 0, "range_at_tenth_m > 0");
    f.check(range_reflectivity_exponent > 0, "range_reflectivity_exponent > 0");
    f.check(dropout_probability >= 0 && dropout_probability <= 1, "0 <= dropout_probability <= 1");
    f.check(false_alarm_probability >= 0 && false_alarm_probability <= 1,
            "0 <= false_alarm_probability <= 1");
    f.check(
        return_incidence_deg.size() == return_probability.size() && !return_incidence_deg.empty(),
        "return_incidence_deg as long as return_probability");
  }
};

/// The closed forms of EchoConfig, tabulated for 200,000 firings a second.
class EchoModel {
 public:
  explicit EchoModel(const EchoConfig& config);

  // What the tables hold, from the formulas.
  [[nodiscard]] double range_sigma(double range_m, double cos_incidence) const;
  [[nodiscard]] double return_probability(double cos_incidence) const;
  [[nodiscard]] double max_range(double reflectivity, double cos_incidence) const;

  /// Range sigma by table, m.
  [[nodiscard]] float fast_range_sigma(float range_m, float cos_incidence) const;
  /// Return probability by table, dropouts included.
  [[nodiscard]] float fast_return_probability(float cos_incidence) const;
  /// Whether enough light returns: reflectivity * cos(incidence) against the range's need.
  [[nodiscard]] bool bright_enough(float range_m, float reflectivity, float cos_incidence) const;
  /// By how much more light returns than the least that is detected. @pre bright_enough
  [[nodiscard]] float margin(float range_m, float reflectivity, float cos_incidence) const;
  /// As the device reports it, range compensated: 0..150 for a diffuse surface of 0..100 %,
  /// 151..255 for a retro-reflector that returns 1 to 1000 times as much as a perfect diffuse one,
  /// logarithmic [E].
  [[nodiscard]] static float intensity(float reflectivity, float cos_incidence);

  [[nodiscard]] const EchoConfig& config() const { return config_; }

 private:
  static constexpr int kSteps = 2048;
  using LookupTable = std::array<float, kSteps + 2>;
  static float look_up(const LookupTable& table, float fraction);

  EchoConfig config_;
  LookupTable sigma_factor_{};  ///< over cos(incidence), 0..1
  LookupTable probability_{};   ///< over cos(incidence), 0..1
  LookupTable needed_{};        ///< reflectivity * cos over range / max_range, 0..1
};

inline float EchoModel::look_up(const LookupTable& table, float fraction) {
  const float position = fraction * kSteps;
  const auto index = static_cast<std::size_t>(position);
  const float rest = position - static_cast<float>(index);
  return table[index] + rest * (table[index + 1] - table[index]);
}

}  // namespace arex::sim
