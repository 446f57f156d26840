#pragma once

#include <cstdint>
#include <numbers>
#include <vector>

#include "messages/sensors.h"

namespace arex::sim {

/// The depth camera: an Intel RealSense D430 in its 848 x 480 mode.
struct D430Config {
  bool noise_free = false;  ///< exact depths; only the range limits stay. For tests
  int rate_hz = 30;         ///< paper, II-A
  int width_px = 848;
  int height_px = 480;
  double focal_px = 446.8;    ///< 87 deg across (datasheet)
  double baseline_m = 0.050;  ///< datasheet
  double min_range_m = 0.177;
  double max_range_m = 10.0;
  double draw_range_m = 12.0;        ///< further than max_range_m by what the noise may bring back
  double disparity_sigma_px = 0.08;  ///< RMS subpixel error: 14 mm at 2 m, 57 mm at 4 m
  int noise_kernel_px = 5;           ///< 3, 5 or 7: correlation 2.7, 4.1 or 5.6 px wide
  double disparity_step_px = 1.0 / 32;  ///< the device's subpixel resolution
  double edge_step_px = 0.5;            ///< a disparity step above this is a depth edge
  int edge_loss_min_px = 1;             ///< on each side: 2 to 4 px in all
  int edge_loss_max_px = 2;
  double max_incidence_rad = 75.0 / 180.0 * std::numbers::pi;

  void fields(auto& f) {
    f("noise_free", noise_free, "exact depths within the range limits, for tests");
    f("rate_hz", rate_hz, "frames per second (paper, II-A)");
    f("width_px", width_px, "image columns");
    f("height_px", height_px, "image rows");
    f("focal_px", focal_px, "focal length (datasheet: 87 deg across 848 px)");
    f("baseline_m", baseline_m, "distance of the two imagers (datasheet)");
    f("min_range_m", min_range_m, "smallest depth delivered (datasheet)");
    f("max_range_m", max_range_m, "largest depth delivered");
    f("draw_range_m", draw_range_m, "surfaces up to here are drawn: noise may bring them in range");
    f("disparity_sigma_px", disparity_sigma_px, "RMS disparity error; depth error z^2 s/(f B)");
    f("noise_kernel_px", noise_kernel_px, "odd support of the kernel that correlates the noise");
    f("disparity_step_px", disparity_step_px, "disparity quantisation");
    f("edge_step_px", edge_step_px, "disparity step between neighbours that makes a depth edge");
    f("edge_loss_min_px", edge_loss_min_px, "pixels lost on each side of a depth edge, least");
    f("edge_loss_max_px", edge_loss_max_px, "pixels lost on each side of a depth edge, most");
    f("max_incidence_rad", max_incidence_rad, "surfaces seen more obliquely are lost");
    f.check(rate_hz > 0 && rate_hz <= 1000, "0 < rate_hz <= 1000");
    f.check(width_px >= 8 && width_px <= 4096, "8 <= width_px <= 4096");
    f.check(height_px >= 8 && height_px <= 4096, "8 <= height_px <= 4096");
    f.check(width_px * static_cast<double>(height_px) <= 4e6, "width_px height_px <= 4e6");
    f.check(focal_px >= 1 && focal_px <= 1e5, "1 <= focal_px <= 1e5");
    f.check(baseline_m > 0 && baseline_m <= 10, "0 < baseline_m <= 10");
    f.check(min_range_m >= 0.01, "min_range_m >= 0.01");
    f.check(max_range_m > min_range_m, "max_range_m > min_range_m");
    f.check(draw_range_m >= max_range_m && draw_range_m <= 2000,
            "max_range_m <= draw_range_m <= 2000");
    f.check(disparity_sigma_px >= 0, "disparity_sigma_px >= 0");
    f.check(noise_kernel_px == 3 || noise_kernel_px == 5 || noise_kernel_px == 7,
            "noise_kernel_px is 3, 5 or 7");
    f.check(disparity_step_px >= 1e-4, "disparity_step_px >= 1e-4");
    f.check(edge_step_px > 0, "edge_step_px > 0");
    f.check(edge_loss_min_px >= 0, "edge_loss_min_px >= 0");
    f.check(edge_loss_max_px >= edge_loss_min_px && edge_loss_max_px <= 16,
            "edge_loss_min_px <= edge_loss_max_px <= 16");
    f.check(max_incidence_rad > 0 && max_incidence_rad <= std::numbers::pi / 2,
            "0 < max_incidence_rad <= pi/2");
  }

  /// Intrinsics of the left imager, which the depth image belongs to.
  [[nodiscard]] PinholeCamera camera() const {
    return {width_px, height_px, focal_px, focal_px, (width_px - 1) / 2.0, (height_px - 1) / 2.0};
  }
};

/// What stereo matching makes of a scene: from exact depths to those the device delivers.
///
/// In disparity d = f B / z (px): Gaussian noise correlated over a few pixels, then quantisation,
/// so that sigma_z = z^2 s / (f B). Lost are: pixels whose match lies outside the right image (a
/// band of f B / z px on the left) or behind something nearer (the half-occluded strip left of
/// every foreground object); 2 to 4 px at depth edges; surfaces seen too obliquely; depths out of
/// range. Source: models/arex/README.md.
class StereoModel {
 public:
  explicit StereoModel(const D430Config& config);

  /// `inverse_depth`: width * height values 1/z (1/m), rows from the top, 0 for nothing. Writes
  /// z-depths (m), 0 for no measurement. A pure function of its arguments: the noise is that of
  /// `frame_seed` alone. The object only lends its memory.
  void measure(const std::vector<float>& inverse_depth, std::uint64_t frame_seed,
               std::vector<float>& depth_m);

 private:
  void measure_exactly(const std::vector<float>& inverse_depth, std::vector<float>& depth_m) const;
  void find_edges();
  void find_lost_at_edges(std::uint64_t seed);
  void find_occluded();
  void find_oblique(const std::vector<float>& inverse_depth);
  void draw_noise(std::uint64_t seed);
  void finish(std::vector<float>& depth_m) const;

  D430Config config_;
  int width_, height_;
  std::vector<float> disparity_;         ///< px
  std::vector<std::uint8_t> lost_;       ///< 1: no measurement
  std::vector<std::uint8_t> edge_;       ///< 1: within the current distance of a depth edge
  std::vector<std::uint8_t> widened_;    ///< scratch of the dilation
  std::vector<std::uint8_t> near_edge_;  ///< how many of the distances 1..max reach this pixel
  std::vector<std::int8_t> white_;       ///< uniform bytes, padded by the kernel's half width
  std::vector<std::int16_t> smooth_;     ///< white_ smoothed along the rows
  std::vector<std::int16_t> noise_;      ///< smoothed both ways; RMS is noise_rms_
  double noise_rms_ = 1;
};

}  // namespace arex::sim
