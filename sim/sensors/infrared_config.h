#pragma once

#include <cmath>
#include <numbers>

#include "math/types.h"

namespace arex::sim {

/// What lights a world, in lux: infrared counts as it comes with daylight and with lamps.
struct InfraredLightConfig {
  bool sun = true;
  double sun_elevation_rad = 40.0 / 180.0 * std::numbers::pi;
  double sun_azimuth_rad = 2.2;  ///< across the start's heading: shadows lie athwart the view
  double sun_lx = 3e4;           ///< a hazy day; a clear one has 1e5
  double sky_lx = 8e3;           ///< from all of the sky together, on level ground
  double sky_darkness = 0.5;     ///< the sky's near infrared over its light [E]: less is scattered
  bool lamps = true;
  double lamp_flux_lm = 1800;        ///< of a strip of 1.5 m: 75 lx on the aisle, 15 in the bays
  bool projector = false;            ///< the device's own; odometry wants it off
  double projector_power_w = 0.360;  ///< datasheet
  double draw_range_m = 45;          ///< further things are the backdrop's
  double least_leaf_px = 4;          ///< [E] far leaves are merged to this, the side of a square
  double least_width_px = 0.35;      ///< [E] solids thinner than this are not drawn: far twigs
  double grid_m = 0.8;               ///< least spacing of the nodes that hold the indirect light

  void fields(auto& f) {
    f("sun", sun, "it shines; off, an overcast sky is left");
    f("sun_elevation_rad", sun_elevation_rad, "of the sun above the horizon");
    f("sun_azimuth_rad", sun_azimuth_rad, "of the sun, from the world's x towards its y");
    f("sun_lx", sun_lx, "its light on a surface square to it");
    f("sky_lx", sky_lx, "light of the whole sky on level ground");
    f("sky_darkness", sky_darkness,
      "how much of the sky's light an infrared camera sees of it [E]");
    f("lamps", lamps, "lamps under ceilings are lit");
    f("lamp_flux_lm", lamp_flux_lm, "luminous flux of each");
    f("projector", projector, "the depth camera's dots are projected");
    f("projector_power_w", projector_power_w, "optical power of the projector, on average");
    f("draw_range_m", draw_range_m, "what lies further is not drawn");
    f("least_leaf_px", least_leaf_px, "smaller leaves are merged into larger ones; 0: never");
    f("least_width_px", least_width_px, "thinner solids are not drawn; 0: all are");
    f("grid_m", grid_m, "least spacing of the grid of light from sky, lamps and surfaces");
    f.check(sun_elevation_rad > 0 && sun_elevation_rad <= std::numbers::pi / 2,
            "0 < sun_elevation_rad <= pi/2");
    f.check(std::abs(sun_azimuth_rad) <= 10, "-10 <= sun_azimuth_rad <= 10");
    f.check(sun_lx >= 0 && sun_lx <= 2e5, "0 <= sun_lx <= 2e5");
    f.check(sky_lx >= 0 && sky_lx <= 1e5, "0 <= sky_lx <= 1e5");
    f.check(sky_darkness >= 0 && sky_darkness <= 1, "0 <= sky_darkness <= 1");
    f.check(lamp_flux_lm >= 0 && lamp_flux_lm <= 1e5, "0 <= lamp_flux_lm <= 1e5");
    f.check(projector_power_w > 0 && projector_power_w <= 10, "0 < projector_power_w <= 10");
    f.check(draw_range_m >= 1 && draw_range_m <= 2000, "1 <= draw_range_m <= 2000");
    f.check(least_leaf_px >= 0 && least_leaf_px <= 20, "0 <= least_leaf_px <= 20");
    f.check(least_width_px >= 0 && least_width_px <= 5, "0 <= least_width_px <= 5");
    f.check(grid_m >= 0.2 && grid_m <= 20, "0.2 <= grid_m <= 20");
  }
};

/// The imagers, OV9282: global shutter, 3 um pixels.
struct InfraredSensorConfig {
  bool auto_exposure = true;
  double exposure_s = 0.0085;        ///< the D430's default; with auto_exposure the first frame's
  double gain = 1;                   ///< of the amplifier; with auto_exposure the first frame's
  double min_exposure_s = 2e-5;      ///< [E]
  double exposure_limit_s = 0.0085;  ///< indoors the device would use the whole frame time
  double gain_limit = 15.5;          ///< 248 in the device's units, of which 16 are 1
  double mean_target = 96;           ///< the device's setpoint 1536 of 4096, in grey values
  double exposure_gain = 0.8;        ///< of the loop, in log exposure; 1: all of the error at once
  double sensitivity_e_per_lx_s = 4200;  ///< [E] a white surface: 50 lx and 33 ms fill a third
  double full_well_e = 6300;             ///< OV9282; gives grey value 255 at gain 1
  double read_noise_e = 2.5;             ///< [U]
  double vignetting = 0.30;              ///< loss in the corners
  double blur_kernel = 0.12;             ///< of the optics: weight of each neighbour, per axis [E]
  bool noise_free = false;
  bool motion_blur = true;

  void fields(auto& f) {
    f("auto_exposure", auto_exposure, "exposure and gain follow the image before");
    f("exposure_s", exposure_s, "of the first frame; without auto_exposure of all");
    f("gain", gain, "of the first frame; without auto_exposure of all");
    f("min_exposure_s", min_exposure_s, "shortest exposure [E]");
    f("exposure_limit_s", exposure_limit_s, "longest exposure; beyond it gain is used");
    f("gain_limit", gain_limit, "greatest gain");
    f("mean_target", mean_target, "mean grey value that auto exposure holds, middle of the image");
    f("exposure_gain", exposure_gain, "share of the exposure's error taken back in each frame");
    f("sensitivity_e_per_lx_s", sensitivity_e_per_lx_s,
      "electrons of a pixel that sees a white surface, per lux and second [E]");
    f("full_well_e", full_well_e, "electrons of grey value 255 at gain 1 (OV9282)");
    f("read_noise_e", read_noise_e, "1 sigma, electrons");
    f("vignetting", vignetting, "share of the light lost in the corners");
    f("blur_kernel", blur_kernel, "of the optics: weight of either neighbour, along each axis [E]");
    f("noise_free", noise_free, "no shot and read noise, for tests");
    f("motion_blur", motion_blur, "images are smeared by what moves while the shutter is open");
    f.check(min_exposure_s >= 1e-6, "min_exposure_s >= 1e-6");
    f.check(exposure_limit_s >= min_exposure_s, "exposure_limit_s >= min_exposure_s");
    f.check(exposure_s >= min_exposure_s && exposure_s <= exposure_limit_s,
            "min_exposure_s <= exposure_s <= exposure_limit_s");
    f.check(gain_limit >= 1 && gain_limit <= 1000, "1 <= gain_limit <= 1000");
    f.check(gain >= 1 && gain <= gain_limit, "1 <= gain <= gain_limit");
    f.check(mean_target >= 1 && mean_target <= 250, "1 <= mean_target <= 250");
    f.check(exposure_gain > 0 && exposure_gain <= 1, "0 < exposure_gain <= 1");
    f.check(sensitivity_e_per_lx_s > 0, "sensitivity_e_per_lx_s > 0");
    f.check(full_well_e >= 100, "full_well_e >= 100");
    f.check(read_noise_e >= 0, "read_noise_e >= 0");
    f.check(vignetting >= 0 && vignetting < 1, "0 <= vignetting < 1");
    f.check(blur_kernel >= 0 && blur_kernel <= 0.25, "0 <= blur_kernel <= 0.25");
  }
};

/// The D430's infrared pair. Its geometry, resolution and focal length are the depth camera's,
/// whose left imager it shares; the projector is off unless `light.projector` says otherwise.
struct InfraredConfig {
  bool enabled = false;
  int rate_hz = 10;
  int right_every = 2;       ///< stereo on every 4th frame was as good as on all for the odometry
  double latency_s = 0.030;  ///< as the depth camera's (estimate)
  double clock_offset_s = 0;
  Vec3 mount_error_rad = Vec3::Zero();
  InfraredLightConfig light;
  InfraredSensorConfig sensor;  ///< its keys stand directly under `infrared`

  void fields(auto& f) {
    f("enabled", enabled, "take images; off, none is drawn unless an odometry reads them");
    f("rate_hz", rate_hz, "frames per second");
    f("right_every", right_every, "the right eye is read in each so many frames, the first on");
    f("latency_s", latency_s, "end of the exposure to the image's delivery");
    f("clock_offset_s", clock_offset_s, "stamps are later than the truth by this");
    f("mount_error_rad", mount_error_rad, "rotation of the true camera in the one of the drawings");
    f("light", light, "sun, sky, lamps and projector");
    sensor.fields(f);
    f.check(rate_hz > 0 && rate_hz <= 300, "0 < rate_hz <= 300");
    f.check(right_every >= 1, "right_every >= 1");
    f.check(latency_s >= 0 && latency_s <= 60, "0 <= latency_s <= 60");
    f.check(clock_offset_s >= -1 && clock_offset_s <= 1, "-1 <= clock_offset_s <= 1");
    f.check(mount_error_rad.norm() <= 0.5, "norm of mount_error_rad <= 0.5");
    f.check(rate_hz * sensor.exposure_limit_s <= 1, "exposure_limit_s <= 1 / rate_hz");
  }
};

}  // namespace arex::sim
