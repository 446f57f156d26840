#pragma once

#include <array>
#include <cstdint>
#include <string_view>

#include "exploration/consumption_model.h"

namespace arex {

/// Why an exploration ends (paper, Stop Criteria; and the battery, which its text asks to save).
enum class StopReason : std::uint8_t {
  kNone,
  kNoCandidates,  ///< none left, and the exhaustive search agrees
  kLittleLeft,    ///< the unknown area of the best candidates, or of all, is below its threshold
  kBattery,       ///< what is left is needed for the way home and the reserve
};
inline constexpr std::array<std::string_view, 4> kStopReasonNames{"none", "no_candidates",
                                                                  "little_left", "battery"};

struct StopConfig {
  double min_area_m2 = 0.3;
  double left_fraction = 0.001;
  bool exhaustive = true;
  double reserve_fraction = 0.2;       ///< 80 % discharge (models/arex/README.md)
  double return_speed_fraction = 0.5;  ///< it brakes and turns on the way
  bool return_home = true;             ///< handed down from mission.land_at_start, where it is true
  double return_speed_mps = 1.0;  ///< handed down: the fraction of planning.local's speed limit
  double landing_s = 20;
  double landing_clearance_m = 1.0;  ///< the vehicle's 0.3 m and a drift of twice that
  double energy_margin = 1.15;
  double detour_factor = 2.0;

  void fields(auto& f) {
    f("min_area_m2", min_area_m2, "stop when no candidate has more unknown area than this");
    f("left_fraction", left_fraction,
      "stop when what is unknown and might be flown to, in all, is less than this part of what can "
      "be flown to, and no candidate's unknown fills the disc of f_I; 0: not for that");
    f("exhaustive", exhaustive,
      "before it ends for want of candidates: search the whole map for frontiers, and fly back to "
      "what cannot be reached any more; false: the trees' word ends it (paper)");
    f("reserve_fraction", reserve_fraction, "of the battery's energy, not to be touched");
    f("return_speed_fraction", return_speed_fraction,
      "mean speed on the way home, part of planning.local.max_speed_mps");
    f("landing_s", landing_s, "time to turn round, hover and land");
    f("landing_clearance_m", landing_clearance_m,
      "of the place from obstacles where it does not land at home: the nearest such one");
    f("energy_margin", energy_margin, "factor on the energy home: wind, replanning");
    f("detour_factor", detour_factor, "on the straight distance, where no known path leads home");
    f.check(min_area_m2 >= 0, "min_area_m2 >= 0");
    f.check(left_fraction >= 0 && left_fraction < 1, "left_fraction in [0, 1)");
    f.check(reserve_fraction >= 0 && reserve_fraction < 1, "reserve_fraction in [0, 1)");
    f.check(return_speed_fraction > 0 && return_speed_fraction <= 1,
            "0 < return_speed_fraction <= 1");
    f.check(landing_s >= 0, "landing_s >= 0");
    f.check(landing_clearance_m >= 0, "landing_clearance_m >= 0");
    f.check(energy_margin >= 1, "energy_margin >= 1");
    f.check(detour_factor >= 1, "detour_factor >= 1");
  }
};

/// The energy balance behind a battery stop, Wh.
struct EnergyBalance {
  double left_wh = 0;     ///< believed to be in the battery
  double needed_wh = 0;   ///< way home and landing, with the margin
  double reserve_wh = 0;  ///< to be left after landing
  double home_wh = 0;     ///< way home and landing, with the margin, whether it lands there or not

  [[nodiscard]] bool must_stop() const { return left_wh - reserve_wh <= needed_wh; }
  [[nodiscard]] bool reaches_home() const { return left_wh - reserve_wh > home_wh; }
  /// Whether even without the reserve it would not get home: land instead.
  [[nodiscard]] bool out_of_reach() const { return left_wh < needed_wh; }
};

/// E = margin (P(v) d / v + P(0) t_landing), d the way home (m), without it where it lands.
[[nodiscard]] EnergyBalance balance_energy(const ConsumptionModel& model, double home_distance_m,
                                           const StopConfig& config);

}  // namespace arex
