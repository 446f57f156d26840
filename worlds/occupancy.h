#pragma once

#include <cstdint>
#include <vector>

#include "worlds/world.h"

namespace arex::worlds {

/// A set of surface classes.
class ClassSet {
 public:
  static constexpr ClassSet all() { return ClassSet(~std::uint32_t{0}); }
  [[nodiscard]] constexpr ClassSet without(SurfaceClass c) const {
    return ClassSet(bits_ & ~bit(c));
  }
  [[nodiscard]] constexpr bool contains(SurfaceClass c) const { return (bits_ & bit(c)) != 0; }

 private:
  explicit constexpr ClassSet(std::uint32_t bits) : bits_(bits) {}
  static constexpr std::uint32_t bit(SurfaceClass c) {
    return std::uint32_t{1} << static_cast<unsigned>(c);
  }
  std::uint32_t bits_;
};

/// A dense grid of cubic cells in W; cell (i, j, k) spans origin + resolution * [i, i + 1) and so
/// on. x runs fastest in memory.
struct GridGeometry {
  Vec3 origin = Vec3::Zero();
  double resolution_m = 0;
  Eigen::Vector3i size = Eigen::Vector3i::Zero();

  [[nodiscard]] std::size_t cells() const {
    return static_cast<std::size_t>(size.x()) * static_cast<std::size_t>(size.y()) *
           static_cast<std::size_t>(size.z());
  }
  [[nodiscard]] std::size_t index(const Eigen::Vector3i& cell) const {
    return (static_cast<std::size_t>(cell.z()) * static_cast<std::size_t>(size.y()) +
            static_cast<std::size_t>(cell.y())) *
               static_cast<std::size_t>(size.x()) +
           static_cast<std::size_t>(cell.x());
  }
  [[nodiscard]] bool contains(const Eigen::Vector3i& cell) const {
    return (cell.array() >= 0).all() && (cell.array() < size.array()).all();
  }
  /// The cell that holds a point; may lie outside the grid.
  [[nodiscard]] Eigen::Vector3i cell_of(const Vec3& p) const {
    return ((p - origin) / resolution_m).array().floor().cast<int>();
  }
  [[nodiscard]] Vec3 centre(const Eigen::Vector3i& cell) const {
    return origin + resolution_m * (cell.cast<double>() + Vec3::Constant(0.5));
  }
};

/// The least grid that covers `bounds`, its cells on multiples of the resolution.
GridGeometry make_grid(const Bounds& bounds, double resolution_m);

struct OccupancyGrid {
  GridGeometry grid;
  std::vector<std::uint8_t> occupied;  ///< 1 where a surface passes through the cell

  [[nodiscard]] bool at(const Eigen::Vector3i& cell) const {
    return occupied[grid.index(cell)] != 0;
  }
};

/// Conservative: a cell is occupied if and only if a triangle of one of the classes touches it
/// (touching included, to within a micrometre). Solids are hollow, and tight: no 6-connected path
/// crosses a surface.
/// Source: Schwarz and Seidel, Fast parallel surface and solid voxelization on GPUs, 2010,
/// section 3.
OccupancyGrid voxelize(const World& world, const GridGeometry& grid, ClassSet classes);

/// Squared distance of every cell's centre to the nearest occupied cell's centre, in cells, exact;
/// infinite where nothing is occupied.
/// Source: Felzenszwalb and Huttenlocher, Distance transforms of sampled functions, 2012.
std::vector<float> squared_distances(const OccupancyGrid& occupancy);

/// Where a sphere's centre can go from a start without touching anything.
struct FreeSpace {
  GridGeometry grid;
  std::vector<std::uint8_t> passable;   ///< 1 where the sphere fits
  std::vector<std::uint8_t> reachable;  ///< 1 where, besides, its centre can get to from the start

  [[nodiscard]] bool at(const Vec3& p) const {
    const Eigen::Vector3i cell = grid.cell_of(p);
    return grid.contains(cell) && reachable[grid.index(cell)] != 0;
  }
};

/// Marks what can be reached over face neighbours from a passable cell, besides what is marked
/// already. @return the number of cells that were added
std::size_t flood(FreeSpace& space, const Eigen::Vector3i& start);

/// Flood fill over face neighbours. The sphere fits where the cell's centre is further than
/// `radius_m` from the centre of every occupied cell: half a cell of tolerance either way on
/// average. Nothing is reachable if it does not fit at the start.
FreeSpace flood_free_space(const OccupancyGrid& occupancy, const Vec3& start, double radius_m);

}  // namespace arex::worlds
