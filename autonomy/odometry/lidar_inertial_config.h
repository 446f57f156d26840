#pragma once

#include "odometry/inertial/imu_watch.h"
#include "odometry/inertial/inertial_config.h"

namespace arex {

/// How the LiDAR errs, as its datasheet and a measured unit say (models/arex/README.md).
struct LidarNoiseConfig {
  double range_std_m = 0.0034;
  double range_std_per_m = 0.00073;
  double angle_std_rad = 0.9e-3;
  double blind_m = 0.5;
  double max_range_m = 60.0;

  /// Variance along the beam, m^2.
  [[nodiscard]] double range_variance(double range_m) const {
    return range_std_m * range_std_m + range_std_per_m * range_std_per_m * range_m * range_m;
  }
  /// Variance across the beam, each axis, m^2.
  [[nodiscard]] double lateral_variance(double range_m) const {
    return angle_std_rad * angle_std_rad * range_m * range_m;
  }

  void fields(auto& f) {
    f("range_std_m", range_std_m, "range noise at zero range (measured unit)");
    f("range_std_per_m", range_std_per_m, "growth of the range noise per metre (measured unit)");
    f("angle_std_rad", angle_std_rad,
      "angle noise; half of the device's 0.10 deg, so that far surfaces tell more of turns");
    f("blind_m", blind_m, "nearer returns are dropped (FAST-LIO)");
    f("max_range_m", max_range_m, "further returns are dropped");
    f.check(range_std_m > 0 && angle_std_rad > 0, "range_std_m > 0, angle_std_rad > 0");
    f.check(max_range_m > blind_m && blind_m >= 0, "max_range_m > blind_m >= 0");
  }
};

/// The map that scans are matched against.
struct SurfelMapConfig {
  double finest_edge_m = 0.25;
  int levels = 3;
  int capacity = 250000;
  int min_points = 6;
  double saturation_weight = 300;
  double max_thickness_ratio = 0.25;
  double refresh_growth = 1.2;

  void fields(auto& f) {
    f("finest_edge_m", finest_edge_m, "edge of the finest cells; each level doubles it");
    f("levels", levels, "resolutions");
    f("capacity", capacity, "cells kept per level; the longest unseen make room");
    f("min_points", min_points, "points that make a surfel");
    f("saturation_weight", saturation_weight,
      "a cell that holds this many points' worth of information at 1 cm noise takes no more");
    f("max_thickness_ratio", max_thickness_ratio,
      "a surfel thicker (1 sigma) than this share of its edge is no surface");
    f("refresh_growth", refresh_growth, "a surfel is fitted anew when its points grew by this");
    f.check(finest_edge_m >= 0.02 && finest_edge_m <= 10, "0.02 <= finest_edge_m <= 10");
    f.check(levels >= 1 && levels <= 4, "1 <= levels <= 4");
    f.check(capacity >= 1000 && capacity <= 4000000, "1000 <= capacity <= 4000000");
    f.check(min_points >= 4, "min_points >= 4");
    f.check(refresh_growth >= 1 && refresh_growth <= 100, "1 <= refresh_growth <= 100");
  }
};

/// Matching of one scan.
struct RegistrationConfig {
  double scan_voxel_m = 0.1;
  int max_points = 6000;
  int max_iterations = 4;
  double converged_rad = 1e-4;
  double converged_m = 1e-3;
  double gate_sigma = 4.0;
  double robust_sigma = 2.0;
  double variance_inflation = 4.0;
  double surface_std_m = 0.02;

  void fields(auto& f) {
    f("scan_voxel_m", scan_voxel_m, "one point per such cell of the scan is matched");
    f("max_points", max_points, "matched at most");
    f("max_iterations", max_iterations, "of the iterated update (FAST-LIO)");
    f("converged_rad", converged_rad, "a smaller step of attitude ends the iterations");
    f("converged_m", converged_m, "a smaller step of position ends the iterations");
    f("gate_sigma", gate_sigma, "residuals beyond this many sigma of their innovation are refused");
    f("robust_sigma", robust_sigma, "scale of the Cauchy weight, in sigma");
    f("variance_inflation", variance_inflation,
      "on the residuals' variance: what surfels side by side have in common");
    f("surface_std_m", surface_std_m,
      "1 sigma by which a surfel, a plane, departs from its surface where its points are met "
      "again");
    f.check(scan_voxel_m >= 0.005 && scan_voxel_m <= 10, "0.005 <= scan_voxel_m <= 10");
    f.check(max_points >= 1 && max_points <= 1000000, "1 <= max_points <= 1000000");
    f.check(max_iterations >= 1 && max_iterations <= 1000, "1 <= max_iterations <= 1000");
    f.check(gate_sigma > 0 && robust_sigma > 0 && variance_inflation > 0,
            "gate_sigma, robust_sigma, variance_inflation > 0");
    f.check(surface_std_m >= 0, "surface_std_m >= 0");
  }
};

/// When the estimate is called degenerate or lost, and how it is found again.
struct OdometryHealthConfig {
  ImuWatchConfig imu;
  int min_matches = 150;
  double min_match_fraction = 0.25;
  double degenerate_position_std_m = 0.02;
  double degenerate_rotation_std_rad = 0.005;
  double lost_position_std_m = 0.5;
  double lost_rotation_std_rad = 0.2;
  double degenerate_silence_s = 0.35;
  double lost_silence_s = 3.0;
  int lost_scans = 5;
  double noticed_innovation = 1.5;
  double doubtful_innovation = 4.0;
  int recovery_points = 300;
  int recovery_yaw_steps = 36;
  double recovery_radius_m = 2.0;
  double recovery_step_m = 1.0;
  double recovery_fraction = 0.5;
  double recovery_margin = 1.15;
  int recovery_confirmations = 3;

  void fields(auto& f) {
    f("imu", imu, "what of the IMU is told as a fault");
    f("min_matches", min_matches, "fewer matched points are no correction");
    f("min_match_fraction", min_match_fraction, "a smaller share of the points is no correction");
    f("degenerate_position_std_m", degenerate_position_std_m,
      "worst direction of one scan's own information");
    f("degenerate_rotation_std_rad", degenerate_rotation_std_rad,
      "worst direction of one scan's own information");
    f("lost_position_std_m", lost_position_std_m, "the filter's own deviation at which it is lost");
    f("lost_rotation_std_rad", lost_rotation_std_rad,
      "the filter's own deviation at which it is lost");
    f("degenerate_silence_s", degenerate_silence_s, "without a correction: degenerate");
    f("lost_silence_s", lost_silence_s, "without a correction: lost");
    f("lost_scans", lost_scans, "refused scans in a row: lost");
    f("noticed_innovation", noticed_innovation,
      "a scan that corrects the prediction by this many sigma, RMS over the pose, is degenerate: "
      "the IMU errs (sound: below 1; 5 % of gyro scale in a spin: 3)");
    f("doubtful_innovation", doubtful_innovation,
      "a scan that corrects the prediction by this many sigma contradicts the IMU: degenerate, and "
      "kept out of the map; lost_scans of them in a row: lost");
    f("recovery_points", recovery_points, "of a scan scored at each guess of a recovery");
    f("recovery_yaw_steps", recovery_yaw_steps, "guesses around the vertical");
    f("recovery_radius_m", recovery_radius_m, "guesses reach this far to each side");
    f("recovery_step_m", recovery_step_m, "spacing of the guesses");
    f("recovery_fraction", recovery_fraction, "matched share that accepts a recovery");
    f("recovery_margin", recovery_margin,
      "a found pose has this many times the matches of any that fits elsewhere");
    f("recovery_confirmations", recovery_confirmations,
      "good scans in a row before a found pose is called ok");
    f.check(min_matches > 0 && lost_scans > 0, "min_matches > 0, lost_scans > 0");
    f.check(recovery_points >= 1 && recovery_points <= 1000000, "1 <= recovery_points <= 1000000");
    f.check(recovery_confirmations >= 0, "recovery_confirmations >= 0");
    f.check(recovery_yaw_steps >= 1 && recovery_yaw_steps <= 3600,
            "1 <= recovery_yaw_steps <= 3600");
    f.check(recovery_radius_m >= 0 && recovery_radius_m <= 30 * recovery_step_m,
            "0 <= recovery_radius_m <= 30 recovery_step_m");
    f.check(recovery_step_m > 0, "recovery_step_m > 0");
  }
};

struct LidarInertialConfig {
  ImuNoiseConfig imu;
  StaticInitialiserConfig initialiser;
  LidarNoiseConfig lidar;
  SurfelMapConfig map;
  RegistrationConfig registration;
  OdometryHealthConfig health;
  bool scale_accel = true;
  bool estimate_extrinsics = false;
  double extrinsic_rotation_std_rad = 0.02;
  double extrinsic_position_std_m = 0.01;

  void fields(auto& f) {
    f("imu", imu, "noise of the IMU");
    f("initialiser", initialiser, "standstill before take-off");
    f("lidar", lidar, "noise of the LiDAR");
    f("map", map, "surfel map");
    f("registration", registration, "matching of a scan");
    f("health", health, "when it is lost");
    f("scale_accel", scale_accel,
      "scale by G / |mean static a| (paper, II-B.2, with the magnitude kept)");
    f("estimate_extrinsics", estimate_extrinsics, "X_BL is part of the state");
    f("extrinsic_rotation_std_rad", extrinsic_rotation_std_rad,
      "1 sigma of the mounting, each axis");
    f("extrinsic_position_std_m", extrinsic_position_std_m, "1 sigma of the mounting, each axis");
    f.check(extrinsic_rotation_std_rad > 0 && extrinsic_position_std_m > 0,
            "extrinsic deviations > 0");
  }
};

}  // namespace arex
