#pragma once

#include <array>
#include <string_view>

namespace arex {

enum class SceneKind { kAuto, kForest, kGarage };
constexpr std::array<std::string_view, 3> enum_names(SceneKind) {
  return {"auto", "forest", "garage"};
}

/// Stems: forest, pine, orchard.
struct StemConfig {
  double band_low_m = 0.4;
  double band_high_m = 3.0;
  double min_run_m = 0.9;
  double max_gap_m = 0.3;
  double max_start_m = 1.6;
  double min_diameter_m = 0.05;
  double max_diameter_m = 1.6;
  double residual_m = 0.03;
  double min_confidence = 0.35;

  void fields(auto& f) {
    f("band_low_m", band_low_m, "stems are fitted from this height above the ground");
    f("band_high_m", band_high_m, "up to this height");
    f("min_run_m", min_run_m, "height over which a stem shows points without a gap");
    f("max_gap_m", max_gap_m, "lesser heights without a point are no gap");
    f("max_start_m", max_start_m, "a stem's lowest points are below this");
    f("min_diameter_m", min_diameter_m, "thinner stems are not looked for");
    f("max_diameter_m", max_diameter_m, "nor thicker ones");
    f("residual_m", residual_m, "greatest median distance of a stem's points from its surface");
    f("min_confidence", min_confidence, "0 to 1, of what is called a stem");
    f.check(min_confidence >= 0 && min_confidence <= 1, "0 <= min_confidence <= 1");
    f.check(band_low_m >= 0.1 && band_low_m < 1.3, "0.1 <= band_low_m < 1.3");
    f.check(band_high_m > 1.3 && band_high_m <= 6, "1.3 < band_high_m <= 6");
    f.check(min_run_m >= 0.3 && min_run_m <= band_high_m - band_low_m,
            "0.3 <= min_run_m <= band_high_m - band_low_m");
    f.check(max_gap_m >= 0 && max_gap_m <= 1, "0 <= max_gap_m <= 1");
    f.check(max_start_m > 0 && max_start_m <= 5, "0 < max_start_m <= 5");
    f.check(min_diameter_m > 0 && min_diameter_m < max_diameter_m,
            "0 < min_diameter_m < max_diameter_m");
    f.check(max_diameter_m <= 5, "max_diameter_m <= 5");
    f.check(residual_m > 0 && residual_m <= 0.2, "0 < residual_m <= 0.2");
  }
};

/// A building's storeys: floors, walls, pillars, parked cars, doors.
struct GarageConfig {
  double max_slope_deg = 35;
  double ramp_slope_deg = 6;
  double min_floor_m2 = 12;
  double headroom_m = 1.9;
  double pillar_min_m = 0.2;
  double pillar_max_m = 1.5;
  double car_min_length_m = 3.0;
  double car_max_length_m = 6.0;
  double car_max_width_m = 2.3;

  void fields(auto& f) {
    f("max_slope_deg", max_slope_deg, "steeper surfaces are no floor");
    f("ramp_slope_deg", ramp_slope_deg, "steeper floors are ramps");
    f("min_floor_m2", min_floor_m2, "smaller level surfaces are no floor");
    f("headroom_m", headroom_m, "of what is free above a floor");
    f("pillar_min_m", pillar_min_m, "thinner things that reach up are pipes");
    f("pillar_max_m", pillar_max_m, "thicker ones are walls");
    f("car_min_length_m", car_min_length_m, "of a car that is seen whole");
    f("car_max_length_m", car_max_length_m, "likewise");
    f("car_max_width_m", car_max_width_m, "likewise");
    f.check(max_slope_deg > 0 && max_slope_deg <= 45, "0 < max_slope_deg <= 45");
    f.check(ramp_slope_deg > 0 && ramp_slope_deg < max_slope_deg,
            "0 < ramp_slope_deg < max_slope_deg");
    f.check(min_floor_m2 > 0, "min_floor_m2 > 0");
    f.check(headroom_m >= 1 && headroom_m <= 10, "1 <= headroom_m <= 10");
    f.check(pillar_min_m > 0 && pillar_min_m < pillar_max_m, "0 < pillar_min_m < pillar_max_m");
    f.check(car_min_length_m > 0 && car_min_length_m < car_max_length_m,
            "0 < car_min_length_m < car_max_length_m");
    f.check(car_max_width_m > 1 && car_max_width_m < car_max_length_m,
            "1 < car_max_width_m < car_max_length_m");
  }
};

/// How a cloud is read as a map of things.
struct SemanticConfig {
  SceneKind scene = SceneKind::kAuto;
  double voxel_m = 0.04;
  double ground_cell_m = 0.5;
  double planar_fraction = 0.05;
  double roofed_fraction = 0.1;
  StemConfig stem;
  GarageConfig garage;

  void fields(auto& f) {
    f("scene", scene, "auto: chosen from the cloud; forest (orchards, too) or garage");
    f("voxel_m", voxel_m, "the cloud is thinned to one mean per such cell");
    f("ground_cell_m", ground_cell_m, "of the ground model's grid");
    f("planar_fraction", planar_fraction,
      "auto: a garage if at least this share of what is no level ground is plane");
    f("roofed_fraction", roofed_fraction,
      "and if above at least this share of the ground there is a ceiling");
    f("stem", stem, "how stems are found");
    f("garage", garage, "how the parts of a garage are found");
    f.check(voxel_m >= 0.005 && voxel_m <= 0.2, "0.005 <= voxel_m <= 0.2");
    f.check(ground_cell_m >= 0.2 && ground_cell_m <= 5, "0.2 <= ground_cell_m <= 5");
    f.check(planar_fraction > 0 && planar_fraction < 1, "0 < planar_fraction < 1");
    f.check(roofed_fraction >= 0 && roofed_fraction < 1, "0 <= roofed_fraction < 1");
  }
};

}  // namespace arex
