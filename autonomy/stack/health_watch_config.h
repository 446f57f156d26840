#pragma once

#include "math/vibration_config.h"

namespace arex {

/// What the stack calls wrong with its sensors and its flight.
struct HealthWatchConfig {
  VibrationWatchConfig vibration;
  double blind_share = 0.4;         ///< of the usual valid pixels; sound flights stay above 0.6
  double holes_share = 0.12;        ///< beyond the usual; sound flights stay below 0.08
  double field_step_gauss = 0.05;   ///< as the autopilot's
  double rough_factor = 2;          ///< of the usual roughness of a depth image
  double rough_fraction = 0.03;     ///< and this, of the depth: five times a D430's at 1.5 m
  int frames = 5;                   ///< in a row
  double sound_s = 1;               ///< [E] of ten frames that are as likely noisy as not, none
  double attitude_limit_rad = 0.2;  ///< a tenth of it is what two sound estimates differ by
  double off_path_m = 0.8;          ///< sound flights stay below 0.3
  double lasting_s = 0.2;           ///< of the two above

  void fields(auto& f) {
    f("vibration", vibration, "when the airframe is called shaking, by the IMU's output");
    f("blind_share", blind_share,
      "a depth image with less than this part of the usual pixels, and of what the LiDAR meets in "
      "its view, is blinded");
    f("holes_share", holes_share,
      "one in which this part more of the surfaces than usual has no depth is blinded in part");
    f("field_step_gauss", field_step_gauss,
      "RMS change between readings of the IMU's magnetometer that is called noise");
    f("rough_factor", rough_factor, "one that is this much rougher than usual is noisy");
    f("rough_fraction", rough_fraction,
      "if its pixels lie further than this, of their depth, off their neighbours' mean");
    f("frames", frames, "in a row");
    f("sound_s", sound_s, "for so long nothing of the kind, and it is over");
    f("attitude_limit_rad", attitude_limit_rad,
      "autopilot and odometry contradict each other if their verticals differ by more");
    f("off_path_m", off_path_m, "the vehicle is off its path if it is further from its setpoint");
    f("lasting_s", lasting_s, "for so long");
    f.check(blind_share > 0 && blind_share < 1, "0 < blind_share < 1");
    f.check(holes_share > 0 && holes_share < 1, "0 < holes_share < 1");
    f.check(field_step_gauss > 0, "field_step_gauss > 0");
    f.check(rough_factor > 1 && rough_fraction > 0, "rough_factor > 1, rough_fraction > 0");
    f.check(sound_s >= 0, "sound_s >= 0");
    f.check(frames >= 1 && frames <= 1000, "1 <= frames <= 1000");
    f.check(attitude_limit_rad > 0 && off_path_m > 0 && lasting_s >= 0,
            "attitude_limit_rad, off_path_m > 0, lasting_s >= 0");
  }
};

}  // namespace arex
