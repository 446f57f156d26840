#pragma once

#include <numbers>
#include <span>

#include "files/png.h"
#include "math/pose.h"

/// Clouds and grids as pictures for people, in the style of the paper's figures of its maps: seen
/// obliquely from behind, coloured by height. Needs no graphics library.
namespace arex::sim {

struct CloudView {
  int width = 960;
  int height = 720;
  double field_of_view_rad = 55.0 / 180.0 * std::numbers::pi;  ///< across the width
  Vec3 eye_O = Vec3::Zero();
  Vec3 target_O = Vec3::UnitX();  ///< @pre not straight above or below the eye
  double low_m = -1.5;            ///< z in O of the colours' blue end
  double high_m = 1.5;            ///< z in O of their red end
};

/// The view of the surroundings of a vehicle: from behind and above it, along its heading.
/// @param reach_m how far what is shown lies around it
CloudView view_behind(const Pose& X_OB, double reach_m);

/// A vehicle drawn into a picture: what it fills, and where its nose points.
struct VehicleMark {
  Pose X_OB;
  double radius_m = 0.3;
};

/// A cloud; what is nearer hides what is behind.
RgbImage draw_points(std::span<const Vec3f> points_O, const CloudView& view,
                     const VehicleMark& vehicle);

/// Cubic cells as solid bodies. The vehicle shows through them, paler.
RgbImage draw_cells(std::span<const Vec3f> centres_O, double edge_m, const CloudView& view,
                    const VehicleMark& vehicle);

/// Four pictures of one size as one: two above two, with a rim between.
RgbImage tile_of_four(const RgbImage& upper_left, const RgbImage& upper_right,
                      const RgbImage& lower_left, const RgbImage& lower_right);

}  // namespace arex::sim
