#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <string_view>
#include <vector>

#include "math/types.h"
#include "semantics/planarity.h"
#include "semantics/raster.h"
#include "semantics/semantic_config.h"

/// What a point cloud shows: labels for its points, and the things that stand in it.
namespace arex {

/// What a point belongs to, and what an object is.
enum class SemanticClass : std::uint8_t {
  kUnlabelled,  ///< not a number, or far from everything else
  kGround,
  kTrunk,
  kCanopy,       ///< leaves, branches
  kUndergrowth,  ///< what grows and lies below the stems' first metre
  kFloor,
  kRamp,
  kWall,
  kCeiling,
  kPillar,
  kCar,
  kDoor,
  kOther,  ///< of a building: pipes, beams, furniture
};
inline constexpr std::array<std::string_view, 13> kSemanticClassNames{
    "unlabelled", "ground",  "trunk",  "canopy", "undergrowth", "floor", "ramp",
    "wall",       "ceiling", "pillar", "car",    "door",        "other"};

/// One thing of the map. Lengths in m, in the cloud's frame, less SemanticMap::origin.
struct SemanticObject {
  SemanticClass kind = SemanticClass::kOther;
  /// Trunk: the axis at breast height. Pillar, car, ramp, door: the middle of its box. Wall: the
  /// middle of its visible face.
  Vec3 position = Vec3::Zero();
  /// Trunk: diameter at breast height, again, height of the tree. Others: length (along `yaw`),
  /// width, height.
  Vec3 size = Vec3::Zero();
  double yaw_rad = 0;          ///< of the length; a trunk's is 0
  double base_z = 0;           ///< of the ground or floor under it
  double canopy_diameter = 0;  ///< of the circle with the area of a tree's crown, as far as seen
  double seen_fraction = 0;    ///< trunk: share of its girth with points; others: 0
  double confidence = 0;       ///< 0..1, growing with the points that speak for it
};

/// The semantic map of one cloud.
struct SemanticMap {
  SceneKind scene = SceneKind::kForest;  ///< as chosen or asked for; never kAuto
  Vec3 origin = Vec3::Zero();            ///< what was taken off the input's coordinates
  std::vector<SemanticClass> labels;     ///< one per input point, in the input's order
  std::vector<SemanticObject> objects;   ///< by class, then by position
  Raster ground;                         ///< height of ground or (lowest) floor, m
  Raster canopy;                         ///< greatest height above it, m; NaN: no point
  Raster density;                        ///< points of the thinned cloud in a cell
  std::size_t points_used = 0;           ///< after thinning and without outliers
  Planarity planarity;                   ///< what the choice of the scene rests on

  [[nodiscard]] std::size_t count(SemanticClass kind) const;
};

/// Builds the semantic map of a cloud, z up. Points may come in any order, more than once, and need
/// not be numbers; the same set of points gives the same map.
/// @param points in m, near the origin (see CloudFile)
/// @param path where the vehicle was, in the same frame; may be empty. What it flew over is floor.
SemanticMap build_semantic_map(std::span<const Vec3f> points, std::span<const Vec3f> path,
                               const SemanticConfig& config);

}  // namespace arex
