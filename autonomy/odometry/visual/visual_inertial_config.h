#pragma once

#include "odometry/inertial/inertial_config.h"

/// Parameters of the visual-inertial odometry. Sources named in the comments: VINS-Fusion (Qin et
/// al., T-RO 2018, its EuRoC settings), Basalt (Usenko et al., RA-L 2020).
namespace arex {

/// What the estimator believes of the pair beside what each image says of it. Where the left eye
/// sits stands under `vehicle`.
struct StereoCalibrationConfig {
  double clock_offset_s = 0;
  double clock_offset_std_s = 0.01;
  double mount_rotation_std_rad = 0.01;
  double mount_position_std_m = 0.003;

  void fields(auto& f) {
    f("clock_offset_s", clock_offset_s,
      "the camera's clock minus the IMU's at the start; estimated from there on");
    f("clock_offset_std_s", clock_offset_std_s,
      "1 sigma of that: a driver that stamps on arrival; 0 takes it as known");
    f("mount_rotation_std_rad", mount_rotation_std_rad,
      "1 sigma of the camera's mounting, each axis; estimated; 0 takes it as known");
    f("mount_position_std_m", mount_position_std_m,
      "1 sigma of the camera's mounting, each axis; 0 takes it as known");
    f.check(clock_offset_s > -0.2 && clock_offset_s < 0.2, "-0.2 < clock_offset_s < 0.2");
    f.check(clock_offset_std_s >= 0 && clock_offset_std_s <= 0.2, "0 <= clock_offset_std_s <= 0.2");
    f.check(mount_rotation_std_rad >= 0 && mount_rotation_std_rad <= 0.5,
            "0 <= mount_rotation_std_rad <= 0.5");
    f.check(mount_position_std_m >= 0 && mount_position_std_m <= 0.5,
            "0 <= mount_position_std_m <= 0.5");
  }
};

/// The front end: corners found per cell, followed by pyramidal Lucas-Kanade.
struct FeatureTrackerConfig {
  int max_features = 150;
  int cell_px = 60;
  double min_distance_px = 20;
  double least_corner = 60;
  int patch_px = 11;
  int pyramid_levels = 4;
  int iterations = 20;
  double back_check_px = 0.5;
  double stereo_rows_px = 2;
  double least_disparity_px = -1;
  double ransac_px = 1.0;
  double epipolar_px = 0.3;
  int ransac_trials = 60;
  int border_px = 8;

  void fields(auto& f) {
    f("max_features", max_features, "followed at a time (VINS-Fusion)");
    f("cell_px", cell_px, "edge of the cells that share the features evenly");
    f("min_distance_px", min_distance_px, "between two features (VINS-Fusion: 30 at 752 columns)");
    f("least_corner", least_corner,
      "smaller eigenvalue of the mean gradient's square, grey values^2/px^2, that is a corner");
    f("patch_px", patch_px,
      "edge of the patch that is followed (VINS-Fusion: 21): a larger one shows near and far at "
      "once");
    f("pyramid_levels", pyramid_levels,
      "halvings of the image (VINS-Fusion: 3, of larger patches)");
    f("iterations", iterations, "of one patch on one level");
    f("back_check_px", back_check_px, "followed there and back it misses by less (VINS-Fusion)");
    f("stereo_rows_px", stereo_rows_px, "rows that the eyes may differ by");
    f("least_disparity_px", least_disparity_px, "a point behind infinity by more is a mismatch");
    f("ransac_px", ransac_px,
      "distance from the epipolar line that two features and the gyro make: an outlier's");
    f("epipolar_px", epipolar_px,
      "and from the one that all features make: of a patch that shows near and far at once");
    f("ransac_trials", ransac_trials, "pairs drawn");
    f("border_px", border_px, "nothing is followed nearer to the image's edge");
    f.check(max_features >= 20 && max_features <= 1000, "20 <= max_features <= 1000");
    f.check(cell_px >= 10 && cell_px <= 1000, "10 <= cell_px <= 1000");
    f.check(min_distance_px >= 1 && min_distance_px <= cell_px, "1 <= min_distance_px <= cell_px");
    f.check(patch_px >= 5 && patch_px <= 61 && patch_px % 2 == 1, "patch_px odd, 5 to 61");
    f.check(pyramid_levels >= 0 && pyramid_levels <= 6, "0 <= pyramid_levels <= 6");
    f.check(iterations >= 1 && iterations <= 100, "1 <= iterations <= 100");
    f.check(ransac_trials >= 1 && ransac_trials <= 10000, "1 <= ransac_trials <= 10000");
    f.check(back_check_px > 0 && ransac_px > 0 && epipolar_px > 0 && least_corner > 0,
            "back_check_px, ransac_px, epipolar_px, least_corner > 0");
    f.check(border_px >= 1 && border_px <= 100, "1 <= border_px <= 100");
  }
};

/// The back end: keyframes, robust factors, iterations.
struct SlidingWindowConfig {
  int keyframes = 10;
  double pixel_std = 0.5;
  double disparity_std = 0.15;
  double huber_sigma = 1.0;
  int least_observations = 3;
  double outlier_px = 1.5;
  int iterations = 4;
  double converged = 0.02;
  int keyframe_tracked = 40;
  double keyframe_parallax_rad = 10.0 / 460;
  int keyframe_wait = 1;
  bool first_estimates = true;

  void fields(auto& f) {
    f("keyframes", keyframes, "kept beside the newest frame (VINS-Fusion)");
    f("pixel_std", pixel_std,
      "noise of a tracked feature, px, 1 sigma, with what is alike among neighbours and frames "
      "(VINS-Fusion: 1.5)");
    f("disparity_std", disparity_std,
      "noise of what the eyes differ by, px, 1 sigma: what a track has drifted by both eyes share");
    f("huber_sigma", huber_sigma, "residuals beyond count linearly (VINS-Fusion)");
    f("least_observations", least_observations,
      "images of either eye that a landmark needs to count");
    f("outlier_px", outlier_px, "a landmark whose residuals' mean is larger goes (VINS-Fusion: 3)");
    f("iterations", iterations, "of an optimisation (3 do as well as 8)");
    f("converged", converged,
      "a step below this many sigma, RMS over the unknowns, ends the iterations");
    f("keyframe_tracked", keyframe_tracked,
      "a frame with fewer landmarks of the window is a keyframe (VINS-Fusion)");
    f("keyframe_parallax_rad", keyframe_parallax_rad,
      "so is one whose features have moved by this since the last, the turn taken out "
      "(VINS-Fusion: 10 px at 460)");
    f("keyframe_wait", keyframe_wait, "frames that a keyframe waits for one that both eyes saw");
    f("first_estimates", first_estimates,
      "Jacobians where the prior was linearised: keeps yaw and position unobservable");
    f.check(keyframes >= 3 && keyframes <= 40, "3 <= keyframes <= 40");
    f.check(pixel_std > 0 && disparity_std > 0 && huber_sigma > 0 && outlier_px > 0,
            "pixel_std, disparity_std, huber_sigma, outlier_px > 0");
    f.check(least_observations >= 2 && least_observations <= 20, "2 <= least_observations <= 20");
    f.check(iterations >= 1 && iterations <= 100, "1 <= iterations <= 100");
    f.check(keyframe_parallax_rad > 0 && keyframe_wait >= 0,
            "keyframe_parallax_rad > 0, keyframe_wait >= 0");
  }
};

/// When the estimate is called degenerate or lost, and how it begins anew.
struct VisualHealthConfig {
  int few_tracks = 12;
  double degenerate_silence_s = 0.45;
  double lost_silence_s = 8;
  double large_innovation_px = 10;
  int lost_innovations = 5;
  double jump_m = 0.5;
  double most_gyro_bias_radps = 0.2;
  double most_accel_bias_mps2 = 1.5;
  int restart_tracks = 30;
  int restart_confirmations = 5;
  double restart_position_std_m = 0.5;
  double restart_velocity_std_mps = 0.7;
  double restart_tilt_std_rad = 0.03;
  double clock_s = 0.004;
  double mount_rad = 0.009;
  double sure_sigma = 4;

  void fields(auto& f) {
    f("few_tracks", few_tracks, "landmarks in an image; fewer are no correction");
    f("degenerate_silence_s", degenerate_silence_s, "without a correction: degenerate");
    f("lost_silence_s", lost_silence_s,
      "without a correction: lost. The IMU alone holds 0.3 m for 5 s");
    f("large_innovation_px", large_innovation_px,
      "median by which landmarks lie beside where the IMU puts them: degenerate");
    f("lost_innovations", lost_innovations, "of these in a row: lost");
    f("jump_m", jump_m, "a correction of the newest position by more is a failure: lost");
    f("most_gyro_bias_radps", most_gyro_bias_radps, "beyond any bias: lost");
    f("most_accel_bias_mps2", most_accel_bias_mps2, "beyond any bias: lost");
    f("restart_tracks", restart_tracks, "features seen by both eyes that begin it anew in flight");
    f("restart_confirmations", restart_confirmations, "sound frames before that is called ok");
    f("restart_position_std_m", restart_position_std_m, "1 sigma that a new begin starts with");
    f("restart_velocity_std_mps", restart_velocity_std_mps, "1 sigma of the velocity likewise");
    f("restart_tilt_std_rad", restart_tilt_std_rad, "1 sigma of the tilt likewise");
    f("clock_s", clock_s, "a camera's clock further off than configured is told");
    f("mount_rad", mount_rad, "so is a mounting turned by more");
    f("sure_sigma", sure_sigma, "once the estimate is so many sigma beyond that");
    f.check(few_tracks >= 4 && restart_tracks >= few_tracks, "4 <= few_tracks <= restart_tracks");
    f.check(degenerate_silence_s > 0 && lost_silence_s >= degenerate_silence_s,
            "0 < degenerate_silence_s <= lost_silence_s");
    f.check(large_innovation_px > 0 && lost_innovations >= 1 && jump_m > 0,
            "large_innovation_px > 0, lost_innovations >= 1, jump_m > 0");
    f.check(restart_confirmations >= 0, "restart_confirmations >= 0");
    f.check(restart_position_std_m > 0 && restart_velocity_std_mps > 0 && restart_tilt_std_rad > 0,
            "restart deviations > 0");
  }
};

struct VisualInertialConfig {
  ImuNoiseConfig imu;
  StaticInitialiserConfig initialiser;
  StereoCalibrationConfig camera;
  FeatureTrackerConfig tracker;
  SlidingWindowConfig window;
  VisualHealthConfig health;
  double latency_s = 0.030;
  bool report_features = false;

  void fields(auto& f) {
    f("imu", imu, "noise of the IMU");
    f("initialiser", initialiser, "standstill before take-off");
    f("camera", camera, "the infrared pair");
    f("tracker", tracker, "front end");
    f("window", window, "back end");
    f("health", health, "when it is lost");
    f("latency_s", latency_s,
      "modelled compute time of a pair of images; a further source's own latency_s goes before it");
    f("report_features", report_features,
      "tells onlookers what it follows in each image: vio_features.csv");
    f.check(latency_s >= 0 && latency_s <= 60, "0 <= latency_s <= 60");
  }
};

}  // namespace arex
