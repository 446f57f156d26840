#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "math/types.h"

namespace arex::sim {

enum class FaultKind : std::uint8_t {
  kSilent,        ///< delivers nothing
  kStuck,         ///< delivers its last reading again and again, with new stamps
  kDelayed,       ///< delivers late, with the stamps of the measurement
  kNoisy,         ///< white noise upon each reading
  kDropping,      ///< loses a share of its messages
  kFalseReturns,  ///< LiDAR: a share of its points lies anywhere along their beams
  kJumping,       ///< LiDAR: a share of what is near seems nearer, as at the edges of objects
  kBlinded,       ///< camera: light drowns a share of its image: no depth, or white
  kWeak,          ///< motor: less thrust than commanded; battery: one cell is worn
  kStop,          ///< speed controller: its motor gets no current
};
inline constexpr std::array<std::string_view, 10> kFaultKindNames{
    "silent",        "stuck",   "delayed", "noisy", "dropping",
    "false_returns", "jumping", "blinded", "weak",  "stop"};
constexpr const std::array<std::string_view, 10>& enum_names(FaultKind /*kind*/) {
  return kFaultKindNames;
}

/// Which of a scenario's devices a fault may befall, by what they deliver.
enum class FaultyPart : std::uint8_t {
  kLidar,
  kDepth,
  kInfrared,
  kBoard,  ///< a sensor of the autopilot's board, or motion capture
  kMotor,
  kEsc,
  kBattery,
  kFurther,  ///< one of `devices`: a LiDAR or a camera
};
[[nodiscard]] FaultyPart faulty_part(std::string_view device);
[[nodiscard]] bool is_possible(FaultyPart part, FaultKind kind);
/// The kinds that a part may have, for messages: "silent, stuck, ...".
[[nodiscard]] std::string possible_kinds(FaultyPart part);

/// One thing that goes wrong with one device for a while. The amounts that its kind does not name
/// have no effect.
struct FaultConfig {
  std::string device;
  FaultKind kind = FaultKind::kSilent;
  double from_s = 0;
  double to_s = 1e9;
  double delay_s = 0.2;            ///< [E] a full queue of a 10 Hz driver: two frames
  double share = 0.2;              ///< [E]
  double gyro_noise_radps = 0.8;   ///< [E] five times what a typical airframe shakes
  double accel_noise_mps2 = 10;    ///< [E] likewise
  double field_noise_gauss = 0.2;  ///< [E] half of the Earth's field: a power line nearby
  double pressure_noise_pa = 30;   ///< [E] 2.5 m of height: an open case in the propellers' wash
  double range_noise_m = 0.1;      ///< [E] five times the MID-360's datasheet
  double depth_noise_fraction = 0.05;  ///< [E] of the depth: five times the D430 at 2 m
  double image_noise_levels = 20;      ///< [E] of 256: a tenth of a bright surface
  double position_noise_m = 0.05;      ///< [E]
  double voltage_noise_v = 0.5;        ///< [E]
  double jump_m = 0.3;         ///< [E] half of what two echoes of one beam merge over (0.75 m)
  double jump_within_m = 3.0;  ///< [E]
  int number = 1;
  double loss_fraction = 0.3;
  double added_resistance_ohm = 0.05;  ///< [E] a worn cell: ten times a sound one's 5 mohm
  double lost_voltage_v = 0.3;         ///< [E] and empty before the others

  [[nodiscard]] bool holds(Stamp now) const {
    return now >= from_seconds(from_s) && now < from_seconds(to_s);
  }

  void fields(auto& f) {
    f("device", device,
      "imu, magnetometer, barometer, power, lidar, depth, infrared, mocap, a name under devices; "
      "motor, esc, "
      "battery");
    f("kind", kind, "what goes wrong");
    f("from_s", from_s, "of the run, from then on");
    f("to_s", to_s, "until then");
    f("delay_s", delay_s, "delayed: measurement to delivery, beyond the usual");
    f("share", share, "dropping, false_returns, jumping, blinded: of messages, points, image");
    f("gyro_noise_radps", gyro_noise_radps, "noisy imu: RMS of each reading and axis");
    f("accel_noise_mps2", accel_noise_mps2, "noisy imu: likewise");
    f("field_noise_gauss", field_noise_gauss, "noisy magnetometer: RMS of each axis");
    f("pressure_noise_pa", pressure_noise_pa, "noisy barometer: RMS");
    f("range_noise_m", range_noise_m, "noisy LiDAR: RMS along the beam");
    f("depth_noise_fraction", depth_noise_fraction, "noisy depth camera: RMS, of the depth");
    f("image_noise_levels", image_noise_levels, "noisy infrared pair: RMS of each pixel, of 256");
    f("position_noise_m", position_noise_m, "noisy mocap: RMS of each axis");
    f("voltage_noise_v", voltage_noise_v, "noisy power: RMS");
    f("jump_m", jump_m, "jumping: points seem nearer by this");
    f("jump_within_m", jump_within_m, "jumping: points nearer than this");
    f("number", number, "motor, esc: 1 front right, 2 rear left, 3 front left, 4 rear right");
    f("loss_fraction", loss_fraction, "weak motor: of its thrust, at any throttle");
    f("added_resistance_ohm", added_resistance_ohm, "weak battery: inner resistance");
    f("lost_voltage_v", lost_voltage_v, "weak battery: of its open-circuit voltage");
    f.check(!device.empty(), "device: which one, such as lidar, imu or motor");
    const FaultyPart part = faulty_part(device);
    f.check(is_possible(part, kind), "kind of " + device + ": one of " + possible_kinds(part));
    f.check(from_s >= 0, "from_s >= 0");
    f.check(to_s > from_s, "to_s > from_s");
    f.check(delay_s >= 0 && delay_s <= 10, "0 <= delay_s <= 10");
    f.check(share >= 0 && share <= 1, "0 <= share <= 1");
    f.check(gyro_noise_radps >= 0, "gyro_noise_radps >= 0");
    f.check(accel_noise_mps2 >= 0, "accel_noise_mps2 >= 0");
    f.check(field_noise_gauss >= 0, "field_noise_gauss >= 0");
    f.check(pressure_noise_pa >= 0, "pressure_noise_pa >= 0");
    f.check(range_noise_m >= 0, "range_noise_m >= 0");
    f.check(depth_noise_fraction >= 0 && depth_noise_fraction <= 1,
            "0 <= depth_noise_fraction <= 1");
    f.check(image_noise_levels >= 0 && image_noise_levels <= 256, "0 <= image_noise_levels <= 256");
    f.check(position_noise_m >= 0, "position_noise_m >= 0");
    f.check(voltage_noise_v >= 0, "voltage_noise_v >= 0");
    f.check(jump_m >= 0, "jump_m >= 0");
    f.check(jump_within_m >= 0, "jump_within_m >= 0");
    f.check(number >= 1 && number <= 4, "1 <= number <= 4");
    f.check(loss_fraction >= 0 && loss_fraction <= 1, "0 <= loss_fraction <= 1");
    f.check(added_resistance_ohm >= 0 && added_resistance_ohm <= 1,
            "0 <= added_resistance_ohm <= 1");
    f.check(lost_voltage_v >= 0 && lost_voltage_v <= 4, "0 <= lost_voltage_v <= 4");
  }
};

}  // namespace arex::sim
