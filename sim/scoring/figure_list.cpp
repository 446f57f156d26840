#include "planning/plan_status.h"
#include "scoring/figures.h"
#include "worlds/world.h"

namespace arex::sim {
namespace {

using enum Better;
using Kind = FigureInfo::Kind;

// Each: key, label, unit, better, main, meaning[, kind[, of the host]].

std::vector<FigureInfo> run_figures() {
  return {
      {"outcome", "outcome", "", kNeither, true,
       "succeeded, collided, stuck, lost, timed_out or interrupted", Kind::kText},
      {"reason", "reason", "", kNeither, true,
       "why the run ended so; of one that failed with the first fault that had been told and not "
       "been "
       "said to be over: hit trunk 40 at 2.47 m/s after motor 2 weak",
       Kind::kText},
      {"scenario", "scenario", "", kNeither, false, "its name: --name, or the file's", Kind::kText},
      {"seed", "seed", "", kNeither, false, "of everything random"},
      {"sim_time_s", "flight time", "s", kLess, true,
       "simulated, from the start of the run to its end"},
      {"wall_time_s", "host's time", "s", kNeither, false, "by the wall clock", Kind::kNumber,
       true},
      {"cpu_time_s", "host's processor time", "s", kNeither, false, "of all threads", Kind::kNumber,
       true},
      {"real_time_factor", "speed of the simulation", "", kNeither, false,
       "sim_time_s over wall_time_s", Kind::kNumber, true},
      {"trajectory_hash", "trajectory hash", "", kNeither, false,
       "of the true state at every tick and every command", Kind::kText},
      {"sensor_hash", "sensor hash", "", kNeither, false, "of every scan and frame delivered",
       Kind::kText},
      {"device_hashes.lidar", "LiDAR's hash", "", kNeither, false, "of its scans", Kind::kText},
      {"device_hashes.depth", "depth camera's hash", "", kNeither, false,
       "of its frames; null: no frame was read", Kind::kText},
      {"device_hashes.infrared", "infrared pair's hash", "", kNeither, false,
       "of its images; null: none was read", Kind::kText},
      {"device_hashes.imu", "IMU's hash", "", kNeither, false,
       "of all that the autopilot's sensors delivered", Kind::kText},
      {"device_hashes.NAME", "hash of a further device", "", kNeither, false,
       "of its frames; NAME as under devices", Kind::kText},
      {"lidar.firings", "LiDAR's firings", "", kNeither, false, "of the scans delivered"},
      {"lidar.misses", "LiDAR's firings without a return", "", kNeither, false,
       "of these; a driver writes them as zeros"},
      {"distance_m", "distance flown", "m", kLess, true, "length of the true path"},
      {"targets", "targets reached by the mission", "", kNeither, false,
       "places that the mission reached, the way home included, with the time of each",
       Kind::kList},
  };
}

std::vector<FigureInfo> fault_figures() {
  return {
      {"faults.events", "faults told", "", kNeither, false,
       "events sensor_fault, vehicle_fault and vibration, those that say that it is over included"},
      {"faults.told", "first told of the faults", "", kNeither, false,
       "the first typed event after the first of the scenario's faults began: its kind and detail; "
       "null: none, or nothing was to go wrong",
       Kind::kText},
      {"faults.told_after_s", "time until then", "s", kLess, false, "since the first fault began"},
  };
}

std::vector<FigureInfo> coverage_figures() {
  std::vector<FigureInfo> list{
      {"coverage.area_fraction", "area covered", "1", kMore, true,
       "share of the reachable free area, in the 2D map's height band, that the 2D map knows; "
       "explorations only"},
      {"coverage.surface_fraction", "surface covered", "1", kMore, true,
       "share of the visible true surface samples that have a map point near"},
      {"coverage.volume_m3", "free volume mapped", "m^3", kNeither, false,
       "of the 3D map's free cells"},
      {"coverage.t50_s", "time to 50 % of the area", "s", kLess, false,
       "null: it never got so far"},
      {"coverage.t90_s", "time to 90 % of the area", "s", kLess, false,
       "null: it never got so far"},
      {"coverage.t95_s", "time to 95 % of the area", "s", kLess, true, "null: it never got so far"},
      {"coverage.revisit_ratio", "share of the path flown again", "1", kLess, false,
       "path inside cells that were mapped, visited and left before; null without a path"},
      {"coverage.heading_change_radpm", "heading change", "rad/m", kLess, false,
       "sum of the course's changes over the path's length; null without a path"},
      {"coverage.area_m2_per_m", "area covered per metre flown", "m^2/m", kMore, false,
       "of the reachable area, up to the last score; null without a path"},
      {"coverage.area_m2_per_s", "area covered per second", "m^2/s", kMore, false,
       "the same over the time from the start of the run"},
      {"coverage.volume_m3_per_m", "free volume mapped per metre flown", "m^3/m", kMore, false,
       "of the 3D map's free cells, up to the last score; null without a path"},
      {"coverage.volume_m3_per_s", "free volume mapped per second", "m^3/s", kMore, false,
       "the same over the time from the start of the run"},
      {"coverage.reachable_area_m2", "reachable area", "m^2", kNeither, false,
       "what area_fraction is a share of"},
      {"coverage.surface_samples", "visible surface samples", "", kNeither, false,
       "what surface_fraction is a share of"},
  };
  for (const std::string_view name : worlds::kSurfaceClassNames) {
    list.push_back({"coverage.surface_fraction_by_class." + std::string(name),
                    "surface covered: " + std::string(name), "1", kMore, false,
                    "of the samples of this class; null if none can be seen"});
  }
  return list;
}

std::vector<FigureInfo> exploration_figures() {
  return {
      {"exploration.decisions", "decisions of the explorer", "", kNeither, false,
       "of explorations; null if it was never asked"},
      {"exploration.targets", "targets issued (older name)", "", kNeither, false,
       "the same as exploration.targets_issued"},
      {"exploration.targets_issued", "targets issued", "", kNeither, false,
       "by the explorer: decisions for a new one"},
      {"exploration.targets_seen", "targets seen on the way", "", kNeither, false,
       "dropped because their unknown area became known from afar"},
      {"exploration.targets_reached", "targets reached", "", kNeither, false,
       "that the vehicle flew to; target_reached in events.csv while it explores"},
      {"exploration.targets_given_up", "targets given up", "", kLess, false,
       "that proved unreachable or were cut off; reaching one at the moment it is seen counts in "
       "both"},
      {"exploration.exhaustive", "targets of the exhaustive search", "", kNeither, false,
       "of the issued, those that the trees did not have"},
      {"exploration.directed", "decided by the direction", "", kNeither, false,
       "of the targets issued, those that R alone, without f_D and case C, would not have chosen"},
      {"exploration.stop", "why the exploration stopped", "", kNeither, true,
       "null: it did not stop by itself", Kind::kText},
      {"exploration.open_frontier_m2", "largest frontier left", "m^2", kLess, false,
       "unknown area at the largest frontier that the exhaustive search still reaches at the "
       "stop; null unless it stopped for want of candidates"},
      {"exploration.omniscient_ratio", "path over the omniscient tour's", "1", kLess, false,
       "the same as tour.path_ratio"},
      {"exploration.median_ms", "time of a decision, median", "ms", kNeither, false, "of the host",
       Kind::kNumber, true},
      {"exploration.p99_ms", "time of a decision, 99th percentile", "ms", kNeither, false,
       "of the host", Kind::kNumber, true},
  };
}

// What was possible, and how hard the world is; of explorations.
std::vector<FigureInfo> tour_figures() {
  return {
      {"tour.path_ratio", "path over the omniscient tour's", "1", kLess, true,
       "distance_m over tour.path_m; null unless the flight succeeded and there is a tour"},
      {"tour.time_ratio", "time over the omniscient tour's", "1", kLess, true,
       "sim_time_s over tour.time_s; likewise"},
      {"tour.path_m", "omniscient tour's path", "m", kNeither, false,
       "on which whoever knows the world sees scoring.tour.area_share of what can be covered, from "
       "take-off to landing; a good one, not proven shortest; null: scoring.tour.enabled is false, "
       "or the area above scoring.tour.max_area_m2"},
      {"tour.time_s", "omniscient tour's time", "s", kNeither, false,
       "along it at the planner's limits of speed and acceleration"},
      {"tour.viewpoints", "omniscient tour's viewpoints", "", kNeither, false,
       "places that it is led through"},
      {"tour.area_fraction", "area that the omniscient tour covers", "1", kNeither, false,
       "by line of sight, in the way of coverage.area_fraction"},
      {"world.stems_per_m2", "stems per square metre", "1/m^2", kNeither, false,
       "trunks that stand inside the exploration's bounds; null in a world without any"},
      {"world.mean_free_path_m", "mean free path", "m", kNeither, false,
       "of horizontal lines of sight in the area: their length over the number that met "
       "something; null if none did"},
      {"world.traversability", "traversability", "", kNeither, false,
       "mean straight flight in the area until the vehicle fits no more, in radii of the vehicle"},
  };
}

std::vector<FigureInfo> map_figures() {
  return {
      {"map.points", "map points", "", kNeither, false, "of the global point cloud"},
      {"map.median_m", "map error, median", "m", kLess, true,
       "distance of a map point from the nearest true surface, placed by the best fit of the "
       "trajectory"},
      {"map.p95_m", "map error, 95th percentile", "m", kLess, false, "of the same distances"},
      {"map.outlier_fraction", "map outliers", "1", kLess, false,
       "share of the points further off than scoring.map.outlier_m"},
      {"map.scored", "map points scored", "", kNeither, false, "that were measured"},
      {"map.foliage", "map points on foliage", "", kNeither, false, "left out of the score"},
  };
}

std::vector<FigureInfo> odometry_source_figures() {
  return {
      {"odometry.source", "odometry", "", kNeither, false, "the source that flew", Kind::kText}};
}

/// @param section of the summary, with a dot
std::vector<FigureInfo> odometry_figures(const std::string& section, bool flies) {
  return {
      {section + "ate_rmse_m", "odometry error, RMS", "m", kLess, flies,
       "absolute position error, aligned at the first pose; null if there never was an "
       "estimate"},
      {section + "ate_max_m", "odometry error, largest", "m", kLess, false, "of the same"},
      {section + "ate_se3_rmse_m", "odometry error, RMS, best fit", "m", kLess, false,
       "after the best rigid alignment of the whole run"},
      {section + "yaw_error_max_deg", "heading error, largest", "deg", kLess, false,
       "aligned at the first pose"},
      {section + "start_tilt_deg", "tilt of the odometry's frame", "deg", kLess, false,
       "between its z axis and the vertical, at the start"},
      {section + "rpe_1m_m", "relative error over 1 m", "m", kLess, false,
       "RMS over all parts of the path of that length; null if it is shorter"},
      {section + "rpe_10m_m", "relative error over 10 m", "m", kLess, false,
       "RMS over all parts of the path of that length; null if it is shorter"},
      {section + "end_error_m", "odometry error at the end", "m", kLess, false,
       "of the last position, aligned at the first pose"},
      {section + "drift_percent", "odometry drift", "%", kLess, false,
       "the error at the end, of the path's length; null without a path"},
      {section + "nees_rotation", "consistency of the attitude (NEES)", "", kNeither, false,
       "mean of e^T P^-1 e / 3: 1 if the errors are as large as the odometry believes, more if "
       "larger; null of one that gives no covariance"},
      {section + "nees_position", "consistency of the position (NEES)", "", kNeither, false,
       "the same of the position"},
      {section + "lost_s", "time without odometry", "s", kLess, false,
       "status lost; null if there never was an estimate"},
      {section + "tracked_mean", "landmarks in an image, mean", "", kNeither, false,
       "of known depth, outliers left out; null of an odometry that sees no images"},
      {section + "keyframes", "keyframes", "", kNeither, false,
       "of a visual odometry; null likewise"},
  };
}

std::vector<FigureInfo> flight_figures() {
  std::vector<FigureInfo> list{
      {"planner.replans", "plans", "", kNeither, false, "of missions that are planned"},
      {"planner.median_ms", "planning time, median", "ms", kNeither, false, "of the host",
       Kind::kNumber, true},
      {"planner.p99_ms", "planning time, 99th percentile", "ms", kNeither, false, "of the host",
       Kind::kNumber, true},
      {"planner.failures", "plans failed", "", kLess, true, "that found no way"},
      {"planner.retimed", "plans timed anew", "", kNeither, false, "to hold the limits"},
      {"planner.slowed", "plans slowed", "", kNeither, false, "for unknown space ahead"},
      {"planner.emergency_stops", "emergency stops", "", kLess, false,
       "for what no plan could still avoid"},
      {"planner.own_cell_blocked_fraction", "time in the inflation", "1", kLess, false,
       "share of the way, at 20 Hz, on which the vehicle's own cell was inflated or occupied in "
       "its local grid; null without a grid"},
      {"tracking.rmse_m", "tracking error, RMS", "m", kLess, true,
       "true position against the setpoint from take-off until it begins to land; null if it "
       "never flew"},
      {"tracking.landing_error_m", "landing error", "m", kLess, false,
       "horizontal, resting place against the last target reached; null unless it landed "
       "there"},
      {"yaw.turned_rad", "turned about the vertical", "rad", kNeither, false,
       "sum of the true heading's changes"},
      {"yaw.fastest_radps", "fastest turn", "rad/s", kNeither, false, "about the vertical"},
      {"yaw.spins", "spins", "", kNeither, false,
       "turns about the vertical faster than 2.25 rad/s, which planned headings never are"},
      {"clearance.min_m", "least clearance", "m", kMore, true,
       "airframe to the nearest surface on the way, leaves left out; 5 m stand for 5 m and "
       "more"},
      {"clearance.p05_m", "clearance, 5th percentile", "m", kMore, false, "of the same, at 20 Hz"},
      {"landing.on_floor", "landed on the floor", "", kMore, false,
       "1: it stands on ground, floor or ramp; 0: on something else; null unless it came down and "
       "disarmed"},
      {"landing.clearance_m", "clearance where it landed", "m", kMore, false,
       "airframe to the nearest surface that is no ground, floor or ramp, leaves left out; 5 m "
       "stand for 5 m and more"},
      {"thin.branches", "thin branches passed", "", kNeither, false,
       "within scoring.thin.corridor_m; worlds that have some"},
      {"thin.seen_in_time", "thin branches seen in time", "", kNeither, false,
       "an occupied cell showed them before the vehicle was within its stopping distance"},
      {"thin.seen_in_time_fraction", "share of thin branches seen in time", "1", kMore, false,
       "of those passed"},
      {"thin.in_grid_fraction", "share of thin branches still in the grid", "1", kMore, false,
       "at that moment"},
      {"collisions", "collisions", "", kLess, true, "with anything solid; the first ends the run"},
      {"battery.used_wh", "battery used", "Wh", kLess, true, "drawn from it"},
      {"battery.remaining_fraction", "battery left", "1", kMore, true,
       "true state of charge at the end"},
      {"renderer", "renderer of the depth frames", "", kNeither, false, "null: no frame was read",
       Kind::kText},
      {"build.version", "build", "", kNeither, false, "version and commit", Kind::kText},
      {"build.compiler", "compiler", "", kNeither, false, "and its version", Kind::kText},
  };
  for (std::size_t stage = 1; stage < kPlanStageNames.size(); ++stage) {
    const std::string name(kPlanStageNames[stage]);
    list.push_back(
        {"planner.stages." + name, "plans: " + name, "", kNeither, false,
         "that this rung of the planner's ladder made (autonomy/planning/plan_status.h)"});
  }
  return list;
}

// The classes of scoring/semantic_score.h.
std::vector<FigureInfo> semantic_figures() {
  std::vector<FigureInfo> list;
  for (const std::string name : {"trunk", "pillar", "car", "wall", "ramp", "door"}) {
    const bool main = name == "trunk" || name == "pillar" || name == "car";
    const std::string key = "semantic." + name + ".";
    list.push_back({key + "precision", name + "s: precision", "", kMore, false,
                    "of those that the semantic map names, the share that is there"});
    list.push_back({key + "recall", name + "s: recall", "", kMore, false,
                    "of those that were mapped, the share that the semantic map names"});
    list.push_back({key + "f1", name + "s found, F1", "", kMore, main,
                    "harmonic mean of precision and recall; null if none was mapped"});
    list.push_back({key + "position_median_m", name + "s: position error, median", "m", kLess,
                    false, "of those found rightly, horizontal"});
    list.push_back({key + "size_median_m", name + "s: size error, median", "m", kLess, false,
                    name == "trunk"  ? "diameter at breast height, where half of it was mapped"
                    : name == "wall" ? "walls have no size that is compared: null"
                                     : "longer side from above, where half of it was mapped"});
  }
  return list;
}

// Each: file, column, unit, meaning.

std::vector<ColumnInfo> flight_columns() {
  return {
      {"summary.json: targets", "x", "m",
       "of the target, in O: origin where it stood at start-up, z up"},
      {"summary.json: targets", "y", "m", "likewise"},
      {"summary.json: targets", "z", "m", "likewise"},
      {"summary.json: targets", "time_s", "s", "when the mission said that it is there"},
      {"summary.json: targets", "miss_m", "m", "true distance from it at that moment"},
      {"truth.tum", "time_s", "s", "since the start of the run"},
      {"truth.tum", "x_m", "m", "position of the vehicle in O"},
      {"truth.tum", "y_m", "m", "likewise"},
      {"truth.tum", "z_m", "m", "likewise"},
      {"truth.tum", "qx", "", "attitude of the vehicle in O, a unit quaternion"},
      {"truth.tum", "qy", "", "likewise"},
      {"truth.tum", "qz", "", "likewise"},
      {"truth.tum", "qw", "", "its real part"},
      {"estimate.tum", "time_s", "s", "since the start of the run"},
      {"estimate.tum", "x_m", "m", "position of the vehicle in O"},
      {"estimate.tum", "y_m", "m", "likewise"},
      {"estimate.tum", "z_m", "m", "likewise"},
      {"estimate.tum", "qx", "", "attitude of the vehicle in O, a unit quaternion"},
      {"estimate.tum", "qy", "", "likewise"},
      {"estimate.tum", "qz", "", "likewise"},
      {"estimate.tum", "qw", "", "its real part"},
      {"events.csv", "time_s", "s", "when it happened"},
      {"events.csv", "kind", "", "what happened"},
      {"events.csv", "detail", "", "more of it; places are x y z in O, m"},
      {"flight.csv", "time_s", "s", "rows at 20 Hz"},
      {"flight.csv", "speed_mps", "m/s", "true"},
      {"flight.csv", "tracking_error_m", "m",
       "true position against the setpoint; empty on the ground, while landing and while lost"},
      {"flight.csv", "odometry_error_m", "m",
       "estimated against true position, aligned at the start"},
      {"flight.csv", "odometry_yaw_error_rad", "rad", "the same of the heading"},
      {"flight.csv", "clearance_m", "m",
       "airframe to the nearest surface; empty where it is not on the way; 5 m stand for 5 m and "
       "more"},
      {"flight.csv", "height_m", "m", "true, above the start"},
      {"flight.csv", "battery_voltage_v", "V", "at its terminals"},
      {"flight.csv", "battery_power_w", "W", "drawn"},
      {"flight.csv", "battery_fraction", "1", "true state of charge"},
  };
}

std::vector<ColumnInfo> map_and_decision_columns() {
  return {
      {"decisions.csv", "time_s", "s", "of the decision"},
      {"decisions.csv", "decision", "", "its number"},
      {"decisions.csv", "kind", "", "new_target, keep_target, stop, wait or go_back"},
      {"decisions.csv", "source", "",
       "where its candidates come from: trees, exhaustive or forgiving"},
      {"decisions.csv", "previous_end", "", "how the target before it ended"},
      {"decisions.csv", "stop_reason", "", "why it stops, or none"},
      {"decisions.csv", "candidate", "", "number of the candidate; a row each"},
      {"decisions.csv", "winner", "", "1: it is flown to"},
      {"decisions.csv", "x_m", "m", "of the frontier point in O"},
      {"decisions.csv", "y_m", "m", "likewise"},
      {"decisions.csv", "verdict", "", "kept, or why not"},
      {"decisions.csv", "information_m2", "m^2", "unknown area to be seen there, f_I"},
      {"decisions.csv", "distance_m", "m",
       "way to it, f_N; empty: dropped before it was worked out"},
      {"decisions.csv", "angle_rad", "rad",
       "off the direction of exploration, A; empty: there is none"},
      {"decisions.csv", "direction", "", "its term in the revenue; empty: dropped before"},
      {"decisions.csv", "revenue", "",
       "what the candidates are compared by; empty: dropped before"},
      {"coverage.csv", "time_s", "s", "of the score"},
      {"coverage.csv", "distance_m", "m", "flown so far"},
      {"coverage.csv", "area_fraction", "1", "of the reachable area, known to the 2D map"},
      {"coverage.csv", "surface_fraction", "1",
       "of the visible surface samples, with a map point near"},
      {"coverage.csv", "volume_m3", "m^3", "free, in the 3D map"},
      {"timing.csv", "module", "", "what ran"},
      {"timing.csv", "calls", "", "how often"},
      {"timing.csv", "median_ms", "ms", "of the host, a call; empty without one"},
      {"timing.csv", "p99_ms", "ms", "99th percentile of the same"},
      {"timing.csv", "total_s", "s", "of the host, all calls"},
      {"odometry_error.csv", "time_s", "s", "rows at 20 Hz"},
      {"odometry_error.csv", "x_m", "m", "estimate minus truth in W, aligned at the first pose"},
      {"odometry_error.csv", "y_m", "m", "likewise"},
      {"odometry_error.csv", "z_m", "m", "likewise"},
      {"odometry_error.csv", "roll_rad", "rad",
       "rotation vector from the true to the estimated attitude, in W"},
      {"odometry_error.csv", "pitch_rad", "rad", "likewise"},
      {"odometry_error.csv", "yaw_rad", "rad", "likewise"},
      {"cloud_growth.csv", "time_s", "s", "when it was counted"},
      {"cloud_growth.csv", "points", "", "of cloud.pcd that were there by then: its first ones"},
      {"vio_features.csv", "time_s", "s",
       "stamp of the exposure; the file is there with "
       "odometry.visual_inertial.report_features"},
      {"vio_features.csv", "id", "", "the same for one feature"},
      {"vio_features.csv", "u", "", "column in the left image, px"},
      {"vio_features.csv", "v", "", "row, px"},
      {"vio_features.csv", "age", "", "exposures that have seen it"},
      {"infrared.csv", "time_s", "s", "true middle of the exposure"},
      {"infrared.csv", "exposure_s", "s", "how long the shutter was open"},
      {"infrared.csv", "gain", "", "of the amplifier"},
      {"infrared.csv", "mean_grey", "", "of the left image's middle, 0 to 255"},
      {"infrared.csv", "right", "", "1: the right eye was read, too"},
      {"infrared.csv", "x_m", "m", "where the vehicle truly was then, B in the world W"},
      {"infrared.csv", "y_m", "m", "the same along y"},
      {"infrared.csv", "z_m", "m", "the same along z"},
      {"infrared.csv", "qx", "", "its attitude, a quaternion: of B in W"},
      {"infrared.csv", "qy", "", "the same"},
      {"infrared.csv", "qz", "", "the same"},
      {"infrared.csv", "qw", "", "the same, its scalar part"},
      {"infrared.csv", "vx_mps", "m/s", "its velocity in W"},
      {"infrared.csv", "vy_mps", "m/s", "the same along y"},
      {"infrared.csv", "vz_mps", "m/s", "the same along z"},
      {"infrared.csv", "wx_radps", "rad/s", "its rate in B"},
      {"infrared.csv", "wy_radps", "rad/s", "the same about y"},
      {"infrared.csv", "wz_radps", "rad/s", "the same about z"},
  };
}

std::vector<ColumnInfo> semantic_columns() {
  return {
      {"objects.csv", "class", "", "trunk, pillar, car, wall, ramp or door"},
      {"objects.csv", "x_m", "m",
       "of its middle (a trunk's at breast height) in the cloud's frame"},
      {"objects.csv", "y_m", "m", "likewise"},
      {"objects.csv", "z_m", "m", "likewise"},
      {"objects.csv", "length_m", "m", "a trunk's diameter at breast height"},
      {"objects.csv", "width_m", "m", "a trunk's diameter again"},
      {"objects.csv", "height_m", "m", "of the tree or thing above its base"},
      {"objects.csv", "yaw_rad", "rad", "direction of its length"},
      {"objects.csv", "base_z_m", "m", "height of the ground or floor under it"},
      {"objects.csv", "canopy_diameter_m", "m", "of a circle with the area of a tree's crown"},
      {"objects.csv", "seen_fraction", "1", "share of a trunk's girth that shows bark"},
      {"objects.csv", "confidence", "", "0 to 1"},
      {"semantic_score.csv", "class", "", "as objects.csv has it"},
      {"semantic_score.csv", "precision", "", "0 to 1, as the figures semantic.CLASS.*"},
      {"semantic_score.csv", "recall", "", "likewise"},
      {"semantic_score.csv", "f1", "", "likewise"},
      {"semantic_score.csv", "position_median_m", "m", "likewise"},
      {"semantic_score.csv", "size_median_m", "m", "likewise"},
      {"semantic_score.csv", "found", "", "named by the map; less those that do not count"},
      {"semantic_score.csv", "right", "", "of these, those that are there"},
      {"semantic_score.csv", "mapped", "", "true ones that were mapped"},
      {"semantic_score.csv", "sized", "", "right ones whose size was compared"},
  };
}

std::vector<ColumnInfo> sweep_columns() {
  return {
      {"sweep.csv", "run", "", "folder of the run"},
      {"sweep.csv", "scenario", "", "the base's name"},
      {"sweep.csv", "variant", "", "its name in 'list'; only with one"},
      {"sweep.csv", "KEY", "",
       "value of each parameter that is varied; unit and meaning: arex params"},
      {"sweep.csv", "seed", "", "of everything random"},
      {"sweep.csv", "repeat", "", "number of the repetition; only with 'repeats'"},
      {"sweep.csv", "failure", "", "why the run is not there; empty: it is"},
      {"sweep.csv", "detail", "", "more of it"},
      {"sweep.csv", "FIGURE", "", "every figure of the summary that is not a time of the host"},
      {"sweep_host.csv", "run", "", "folder of the run"},
      {"sweep_host.csv", "scenario", "", "the base's name"},
      {"sweep_host.csv", "variant", "", "its name in 'list'; only with one"},
      {"sweep_host.csv", "KEY", "",
       "value of each parameter that is varied; unit and meaning: arex params"},
      {"sweep_host.csv", "seed", "", "of everything random"},
      {"sweep_host.csv", "repeat", "", "number of the repetition; only with 'repeats'"},
      {"sweep_host.csv", "host", "", "where it was flown"},
      {"sweep_host.csv", "attempt", "", "which try it was"},
      {"sweep_host.csv", "wall_s", "s", "of the whole process"},
      {"sweep_host.csv", "cpu_s", "s", "of the whole process"},
      {"sweep_host.csv", "max_rss_mb", "MB", "most memory that it held"},
      {"sweep_host.csv", "FIGURE", "", "the figures of the summary that are times of the host"},
      {"log.csv", "time", "", "UTC"},
      {"log.csv", "host", "", "where it happened"},
      {"log.csv", "pid", "", "process of the supervisor"},
      {"log.csv", "event", "", "what happened to a run"},
      {"log.csv", "run", "", "its ID"},
      {"log.csv", "attempt", "", "which try it was"},
      {"log.csv", "detail", "", "more of it"},
      {"arex pattern", "time_s", "s", "of the firing, since the first"},
      {"arex pattern", "line", "", "of the four that fire together"},
      {"arex pattern", "azimuth_deg", "deg", "of the beam, about the sensor's axis"},
      {"arex pattern", "elevation_deg", "deg", "above the sensor's horizon"},
  };
}

template <class T>
std::vector<T> joined(std::initializer_list<std::vector<T>> parts) {
  std::vector<T> all;
  for (const auto& part : parts) all.insert(all.end(), part.begin(), part.end());
  return all;
}

}  // namespace

const std::vector<FigureInfo>& figure_list() {
  static const auto list = joined<FigureInfo>(
      {run_figures(), fault_figures(), coverage_figures(), exploration_figures(), tour_figures(),
       map_figures(), odometry_source_figures(), odometry_figures("odometry.", true),
       odometry_figures("odometries.NAME.", false), semantic_figures(), flight_figures()});
  return list;
}

const std::vector<ColumnInfo>& column_list() {
  static const auto list = joined<ColumnInfo>(
      {flight_columns(), map_and_decision_columns(), semantic_columns(), sweep_columns()});
  return list;
}

}  // namespace arex::sim
