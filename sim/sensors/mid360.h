#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "math/pose.h"
#include "math/random.h"
#include "messages/sensors.h"
#include "physics/truth.h"
#include "sensors/lidar_model.h"
#include "sensors/mid360_airframe.h"
#include "sensors/mid360_echo.h"
#include "sensors/mid360_pattern.h"
#include "sensors/scene.h"

namespace arex::sim {

struct Mid360Config {
  double rate_hz = 10;  ///< frames (datasheet); a whole number of ticks each
  PatternMode pattern = PatternMode::kDevice;
  bool noise_free = false;
  EchoConfig echo;
  double beam_half_angle_deg = 0.1;    ///< [E] half of 0.28 x 0.03 deg FWHM of the maker's siblings
                                       ///< (HAP, Mid-70), taken round
  double echo_separation_m = 0.75;     ///< [E] c/2 * 5 ns pulse
  double merged_share = 0.15;          ///< [E] most receivers lock onto the stronger echo
  double edge_step_m = 0.02;           ///< [E] smaller steps are surface, not edge
  double airframe_reflectivity = 0.1;  ///< [E] carbon plate, black propellers
  double rotor_solidity = 0.11;        ///< [E] two 2 cm blades in a 9-inch disc
  Vec3 extrinsic_position_error_m = Vec3::Zero();
  Vec3 extrinsic_rotation_error_rad = Vec3::Zero();
  double fault_dropout_fraction = 0;
  double fault_silent_from_s = 0;
  double fault_silent_for_s = 0;
  double fault_false_burst_from_s = 0;
  double fault_false_burst_for_s = 0;
  double fault_false_burst_fraction = 0.1;

  [[nodiscard]] Stamp period() const { return from_seconds(1 / rate_hz); }  ///< of a frame

  void fields(auto& f) {
    f("rate_hz", rate_hz, "frames (datasheet)");
    f("pattern", pattern, "device: a measured unit; table: the maker's table");
    f("noise_free", noise_free, "exact ranges and angles, every surface in range returns");
    f("echo", echo, "how a beam measures what it meets");
    f("beam_half_angle_deg", beam_half_angle_deg, "half-width of the beam [E]");
    f("echo_separation_m", echo_separation_m, "nearer echoes of one beam merge into one [E]");
    f("merged_share", merged_share, "share of beams on an edge that report a range between [E]");
    f("edge_step_m", edge_step_m, "depth step that counts as an edge [E]");
    f("airframe_reflectivity", airframe_reflectivity, "of the vehicle's own parts [E]");
    f("rotor_solidity", rotor_solidity, "share of beams that a turning rotor stops [E]");
    f("extrinsic_position_error_m", extrinsic_position_error_m,
      "true mounting in the nominal LiDAR frame");
    f("extrinsic_rotation_error_rad", extrinsic_rotation_error_rad,
      "true mounting in the nominal LiDAR frame, rotation vector");
    f("fault_dropout_fraction", fault_dropout_fraction, "share of returns lost throughout");
    f("fault_silent_from_s", fault_silent_from_s, "start of a window without any return");
    f("fault_silent_for_s", fault_silent_for_s, "length of that window");
    f("fault_false_burst_from_s", fault_false_burst_from_s, "start of a burst of false returns");
    f("fault_false_burst_for_s", fault_false_burst_for_s, "length of that burst");
    f("fault_false_burst_fraction", fault_false_burst_fraction, "share of false returns in it");
    f.check(rate_hz >= 1 && rate_hz <= 1000, "1 <= rate_hz <= 1000");
    f.check(!(rate_hz > 0) || period() % kNanosecondsPerTick == 0,
            "1 / rate_hz a whole number of milliseconds");
    f.check(beam_half_angle_deg >= 0 && beam_half_angle_deg < 5, "0 <= beam_half_angle_deg < 5");
    f.check(echo_separation_m >= 0, "echo_separation_m >= 0");
    f.check(merged_share >= 0 && merged_share <= 1, "0 <= merged_share <= 1");
    f.check(edge_step_m > 0, "edge_step_m > 0");
    f.check(airframe_reflectivity >= 0 && airframe_reflectivity <= 1,
            "0 <= airframe_reflectivity <= 1");
    f.check(rotor_solidity >= 0 && rotor_solidity <= 1, "0 <= rotor_solidity <= 1");
    f.check(fault_dropout_fraction >= 0 && fault_dropout_fraction <= 1,
            "0 <= fault_dropout_fraction <= 1");
    f.check(fault_silent_for_s >= 0, "fault_silent_for_s >= 0");
    f.check(fault_false_burst_for_s >= 0, "fault_false_burst_for_s >= 0");
    f.check(fault_false_burst_fraction >= 0 && fault_false_burst_fraction <= 1,
            "0 <= fault_false_burst_fraction <= 1");
  }
};

/// Livox MID-360: 200,000 firings a second, each cast from the vehicle's pose at its own time.
///
/// Firing i draws from its own stream, so that no beam's noise depends on another's.
class Mid360 : public LidarModel {
 public:
  /// @param airframe_B the vehicle's solids in B (X_WS is the pose in B, object the AirframePart).
  Mid360(const Mid360Config& config, const Scene& scene, const Pose& X_BL,
         const std::vector<worlds::CollisionShape>& airframe_B, std::uint64_t seed);

  [[nodiscard]] Stamp period() const override { return config_.period(); }
  /// @throws std::invalid_argument unless the stamps are consecutive ticks.
  [[nodiscard]] LidarScan scan(std::span<const Truth> ticks) const override;

  /// The beams of a frame in firing order, as the scan casts them; for tests and benchmarks.
  [[nodiscard]] std::vector<Ray> beams(std::span<const Truth> ticks) const;

 private:
  struct Tick;  ///< the 200 beams of one tick and what they meet
  void aim(const Truth& from, const Truth& to, Tick& tick) const;
  void meet_airframe(Tick& tick) const;
  void split_beams(Tick& tick) const;
  void receive(const Tick& tick, Stamp scan_stamp, std::vector<LidarPoint>& points) const;

  Mid360Config config_;
  const Scene& scene_;
  Pose X_BL_;  ///< true mounting
  Mid360Pattern pattern_;
  EchoModel echo_;
  AirframeMask body_;
  AirframeMask rotors_;
  RandomStream stream_;        ///< returns, noise, false alarms
  RandomStream beam_stream_;   ///< the second ray of each beam
  RandomStream rotor_stream_;  ///< whether a blade stands in the way
};

}  // namespace arex::sim
