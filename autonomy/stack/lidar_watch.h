#pragma once

#include <cstdint>
#include <optional>
#include <string_view>
#include <vector>

#include "messages/sensors.h"

namespace arex {

struct LidarWatchConfig {
  double silent_after_s = 0.25;
  int least_points = 500;
  double firing_period_s = 5e-6;
  int lines = 4;
  double same_surface_fraction = 0.03;
  double spike_fraction = 0.2;
  double missing_share = 0.15;
  double false_share = 0.05;
  double refused_fraction = 0.75;
  double noise_factor = 2.5;
  double noise_m = 0.03;
  double memory_scans = 20;
  int false_scans = 3;
  int sound_scans = 3;
  double relapse_s = 10;

  void fields(auto& f) {
    f("silent_after_s", silent_after_s, "without a scan for longer: silent");
    f("least_points", least_points, "a scan of fewer returns is none");
    f("firing_period_s", firing_period_s, "between firings (MID-360: 200,000 a second)");
    f("lines", lines, "laser lines, fired in turn (MID-360)");
    f("same_surface_fraction", same_surface_fraction,
      "a line's firings before and after one lie on one surface if their ranges differ by less");
    f("spike_fraction", spike_fraction, "and the one is a spike if its range differs by more");
    f("missing_share", missing_share,
      "more of the firings between returns of one surface without a return: returns are missing "
      "(forest 0.04-0.10, garage 0.01-0.04; a fifth lost: above 0.18)");
    f("false_share", false_share,
      "share of spikes above the usual one: returns are false (sound, above usual: 0.03; a tenth "
      "false: 0.07), more where fewer firings than usual lie between returns of one surface");
    f("refused_fraction", refused_fraction,
      "less than this share of the usual matched share: returns are false");
    f("noise_factor", noise_factor,
      "firings between returns of one surface that lie this much further off it than usual: noisy");
    f("noise_m", noise_m, "and further than this in the mean (sound: 0.01 to 0.02)");
    f("memory_scans", memory_scans, "over which the usual shares are averaged");
    f("false_scans", false_scans,
      "in a row before returns are called false, missing or noisy: a turn among shrubs makes one "
      "or two look so");
    f("sound_scans", sound_scans,
      "in a row before it is called sound again; after each relapse within relapse_s twice as "
      "many");
    f("relapse_s", relapse_s, "a fault within this of the last one's end is a relapse");
    f.check(silent_after_s > 0 && memory_scans >= 1, "silent_after_s > 0, memory_scans >= 1");
    f.check(refused_fraction > 0 && refused_fraction < 1, "0 < refused_fraction < 1");
    f.check(relapse_s >= 0, "relapse_s >= 0");
    f.check(false_scans >= 1 && sound_scans >= 1, "false_scans >= 1, sound_scans >= 1");
    f.check(firing_period_s >= 1e-7 && firing_period_s <= 1e-3, "1e-7 <= firing_period_s <= 1e-3");
    f.check(noise_factor > 1 && noise_m > 0, "noise_factor > 1, noise_m > 0");
    f.check(lines >= 1 && lines <= 1000, "1 <= lines <= 1000");
    f.check(least_points >= 1, "least_points >= 1");
  }
};

/// Says when the LiDAR fails and when it is sound again, whatever the scene: two firings of one
/// line that hit one surface tell what the firing between them should have met. A share of them
/// without a return, or with one elsewhere, is the device's doing.
class LidarWatch {
 public:
  explicit LidarWatch(const LidarWatchConfig& config)
      : config_(config), patience_(config.sound_scans) {}

  /// What the firings between returns of one surface did.
  struct Survey {
    int between = 0;
    int missing = 0;     ///< no return
    int spikes = 0;      ///< a return elsewhere
    double noise_m = 0;  ///< mean deviation of the others from the surface
  };
  [[nodiscard]] Survey survey(const LidarScan& scan) const;

  /// Scans are to come from now on: a LiDAR that has been dead from the start is silent, too.
  void expect(Stamp now) {
    if (last_scan_ < 0) last_scan_ = now;
  }
  void add_scan(Stamp now, const LidarScan& scan);
  /// What share of a scan's points the odometry matched to its map; nothing where that says more
  /// of something else, such as an IMU that fails.
  void add_matched_share(std::optional<double> share);
  /// @return what changed since the last call, for an event.
  std::optional<std::string_view> update(Stamp now);
  /// How long there has been no scan; 0 before any is expected.
  [[nodiscard]] double silent_s(Stamp now) const {
    return last_scan_ < 0 ? 0 : to_seconds(now - last_scan_);
  }

 private:
  enum class State : std::uint8_t { kSound, kSilent, kMissing, kFalse, kNoisy };

  [[nodiscard]] State newest(Stamp now) const;

  LidarWatchConfig config_;
  Stamp last_scan_ = -1;       ///< with returns, or when the first was expected; none yet: -1
  double usual_spikes_ = -1;   ///< share; none yet: -1
  double usual_between_ = -1;  ///< firings; none yet: -1
  double usual_noise_m_ = -1;  ///< of the ranges; none yet: -1
  double usual_matched_ = -1;  ///< share of the scan's points; none yet: -1
  int missing_in_a_row_ = 0;   ///< scans
  int spikes_in_a_row_ = 0;    ///< scans
  int noisy_in_a_row_ = 0;     ///< scans
  int refused_in_a_row_ = 0;   ///< scans
  bool matches_tell_ = true;   ///< the newest scan's
  int sound_in_a_row_ = 0;
  int patience_;                 ///< scans in a row before it is called sound again, this time
  Stamp called_sound_ = -1;      ///< when it last was; never: -1
  State state_ = State::kSound;  ///< as told
};

}  // namespace arex
