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
/// Rays stand at angles so close that the farthest patch is not missed; each is walked through
/// every column that it touches. The walks are worked out once, for all places.
class SightMap {
 public:
  /// One bit for each patch of the box around the area, set only where there is area.
  using Bits = std::vector<std::uint64_t>;

  /// @param area_cells_W middles of the area's cells, z where sight is asked for, m; not empty
  /// @param range_m how far one sees; @param slab_m height of the slab that blocks
  SightMap(const worlds::World& world, std::span<const Vec3f> area_cells_W, double range_m,
           double slab_m);

  /// All patches of the area.
  [[nodiscard]] const Bits& area() const { return area_; }
  /// Those seen from a place inside the box around the area; from outside nothing is.
  [[nodiscard]] Bits seen_from(const Vec2& p_W) const;

  /// Where the rays of a place start: the middle of the first column of its patch.
  [[nodiscard]] Vec2 origin_W(const Vec2& p_W) const;
  /// Outside the box everything is.
  [[nodiscard]] bool is_opaque(const Vec2& p_W) const;
  /// The bit of the patch that holds a place. @pre the place is in the box
  [[nodiscard]] std::size_t patch(const Vec2& p_W) const;

  static constexpr double kColumn_m = 0.1;  ///< side of a column: the exploration map's resolution
  static constexpr int kPatch = 2;          ///< columns along a patch's side

 private:
  /// Of a ray, from the column that it starts in.
  struct Step {
    std::int32_t column;  ///< how much further its index is
    std::int32_t patch;   ///< and that of its patch
  };
  void place(std::span<const Vec3f> area_cells_W, double range_m);
  [[nodiscard]] std::vector<float> heights(std::span<const Vec3f> area_cells_W) const;
  void find_opaque(const worlds::World& world, const std::vector<float>& heights, double slab_m);
  void lay_rays(double range_m);
  [[nodiscard]] Eigen::Vector2i column_of(const Vec2& p_W) const;
  [[nodiscard]] bool in_box(const Eigen::Vector2i& column) const;
  [[nodiscard]] std::size_t column_index(const Eigen::Vector2i& column) const;
  [[nodiscard]] std::size_t patch_index(const Eigen::Vector2i& column) const;

  Vec2 low_;                          ///< of column (0, 0), on multiples of a patch
  Eigen::Vector2i size_;              ///< columns of the box around the area, whole patches
  int rim_ = 0;                       ///< opaque columns around it: no ray leaves the table
  std::vector<std::uint8_t> opaque_;  ///< columns, the rim included; x runs fastest
  Bits area_;
  std::vector<Step> steps_;            ///< ray by ray
  std::vector<std::size_t> ray_ends_;  ///< one past each ray's last step
};

/// How many patches there are in `bits`, and how many that are not in `known`.
[[nodiscard]] std::size_t count_bits(const SightMap::Bits& bits);
[[nodiscard]] std::size_t count_new(const SightMap::Bits& known, const SightMap::Bits& bits);
/// Adds those of `bits` to `known`.
void add_bits(SightMap::Bits& known, const SightMap::Bits& bits);
[[nodiscard]] bool has_bit(const SightMap::Bits& bits, std::size_t patch);

}  // namespace arex::sim
