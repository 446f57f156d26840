#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "math/types.h"
#include "worlds/world.h"

namespace arex::sim {

/// What of the area can be seen from where, by the truth, in two dimensions as the exploration's
/// map has it.
///
/// Line of sight runs at the height of the area's cells, from column to column: a column blocks it
/// where surfaces (leaves left out) fill at least half of the slab around that height; what is
/// lower, such as a car, is looked over. Columns that are no part of the area take the height of
/// the nearest that is. The area is counted in square patches with cells of it; a patch is seen
/// when a ray passes through it, which makes it known to the exploration's 2D map as free.
///
/// Rays stand at angles so close that the farthest patch is not missed; each is walked in steps of
/// a column's side, which no closed surface lets through, for voxels of a surface share faces.
class SightMap {
 public:
  /// One bit for each patch of the area.
  using Bits = std::vector<std::uint64_t>;

  /// @param area_cells_W middles of the area's cells, z where sight is asked for, m; not empty
  /// @param range_m how far one sees; @param slab_m height of the slab that blocks
  SightMap(const worlds::World& world, std::span<const Vec3f> area_cells_W, double range_m,
           double slab_m);

  [[nodiscard]] std::size_t patches() const { return patches_; }
  /// The patches seen from a place inside the box around the area; from outside nothing is.
  [[nodiscard]] Bits seen_from(const Vec2& p_W) const;
  /// What stands at a place: a patch's number, kNoPatch or kOpaque; kOpaque outside the box.
  [[nodiscard]] std::int32_t at(const Vec2& p_W) const;
  /// The middle of the column that holds a place.
  [[nodiscard]] Vec2 middle_W(const Vec2& p_W) const;

  static constexpr std::int32_t kNoPatch = -1;
  static constexpr std::int32_t kOpaque = -2;

  static constexpr double kColumn_m = 0.1;  ///< side of a column: the exploration map's resolution
  static constexpr int kPatch = 2;          ///< columns along a patch's side

 private:
  void place(std::span<const Vec3f> area_cells_W, double range_m);
  [[nodiscard]] std::vector<float> heights(std::span<const Vec3f> area_cells_W) const;
  void find_opaque(const worlds::World& world, const std::vector<float>& heights, double slab_m);
  void number_patches(std::span<const Vec3f> area_cells_W);
  void lay_rays(double range_m);
  [[nodiscard]] Eigen::Vector2i column_of(const Vec2& p_W) const;
  [[nodiscard]] bool in_box(const Eigen::Vector2i& column) const;
  [[nodiscard]] std::size_t index(const Eigen::Vector2i& column) const;

  Vec2 low_;              ///< of column (0, 0)
  Eigen::Vector2i size_;  ///< columns of the box around the area
  int rim_ = 0;           ///< opaque columns around it, so that no ray leaves the tables
  std::vector<std::int32_t> column_;  ///< its patch, kNoPatch or kOpaque
  std::size_t patches_ = 0;
  std::size_t steps_ = 0;           ///< of a ray
  std::vector<std::int32_t> rays_;  ///< steps_ each: offset of the index from where it starts
};

/// How many patches there are in `bits`, and how many that are not in `known`.
[[nodiscard]] std::size_t count_bits(const SightMap::Bits& bits);
[[nodiscard]] std::size_t count_new(const SightMap::Bits& known, const SightMap::Bits& bits);
/// Adds those of `bits` to `known`.
void add_bits(SightMap::Bits& known, const SightMap::Bits& bits);

}  // namespace arex::sim
