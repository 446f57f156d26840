#include "scoring/reachable_space.h"

#include <array>
#include <cmath>
#include <stdexcept>

namespace arex::sim {
namespace {

using worlds::Bounds;
using worlds::ClassSet;
using worlds::GridGeometry;
using worlds::World;

constexpr std::uint8_t kPassable = 1;
constexpr std::uint8_t kReachable = 2;

// The box in W around the bounds, cut to the world.
Bounds box_in_W(const World& world, const Pose& X_WO, const Bounds& bounds_O) {
  Eigen::AlignedBox3d box;
  for (int corner = 0; corner < 8; ++corner) {
    const Vec3 p_O(corner & 1 ? bounds_O.high.x() : bounds_O.low.x(),
                   corner & 2 ? bounds_O.high.y() : bounds_O.low.y(),
                   corner & 4 ? bounds_O.high.z() : bounds_O.low.z());
    box.extend(X_WO * p_O);
  }
  return {box.min().cwiseMax(world.bounds.low), box.max().cwiseMin(world.bounds.high)};
}

// Marks the cells where the sphere fits and that lie inside the bounds. Far from the box's rim
// the answer is that of the distance field; the padding makes it so at the rim as well.
std::vector<std::uint8_t> passable_cells(const World& world, const GridGeometry& grid,
                                         const Bounds& box, const Pose& X_WO,
                                         const ExplorationBounds& bounds, double radius_m) {
  std::vector<float> distance;
  {
    const auto occupancy =
        voxelize(world, grid, ClassSet::all().without(worlds::SurfaceClass::kLeaf));
    distance = squared_distances(occupancy);
  }
  const auto limit = static_cast<float>(std::pow(radius_m / grid.resolution_m, 2));
  const Pose X_OW = X_WO.inverse();
  std::vector<std::uint8_t> cells(grid.cells(), 0);
  for (int j = 0; j < grid.size.y(); ++j) {
    for (int i = 0; i < grid.size.x(); ++i) {
      // O is level: whether a column lies inside the bounds does not depend on the height.
      const Vec3 c = grid.centre({i, j, 0});
      if (!bounds.contains((X_OW * c).head<2>()) ||
          (c.head<2>().array() < box.low.head<2>().array()).any() ||
          (c.head<2>().array() > box.high.head<2>().array()).any()) {
        continue;
      }
      cells[grid.index({i, j, 0})] = 1;
    }
  }
  const std::size_t layer = grid.cells() / static_cast<std::size_t>(grid.size.z());
  const std::vector<std::uint8_t> column(cells.begin(),
                                         cells.begin() + static_cast<std::ptrdiff_t>(layer));
  for (int k = 0; k < grid.size.z(); ++k) {
    const double z = grid.centre({0, 0, k}).z();
    const bool inside = z >= box.low.z() && z <= box.high.z();
    const std::size_t first = static_cast<std::size_t>(k) * layer;
    for (std::size_t c = 0; c < layer; ++c) {
      cells[first + c] = inside && column[c] && distance[first + c] > limit ? kPassable : 0;
    }
  }
  return cells;
}

std::size_t flood(std::vector<std::uint8_t>& cells, const GridGeometry& grid, std::size_t start) {
  // No cell of the grid's outermost layer is passable, so that no neighbour lies outside.
  const auto row = static_cast<std::ptrdiff_t>(grid.size.x());
  const std::ptrdiff_t layer = row * grid.size.y();
  const std::array<std::ptrdiff_t, 6> steps{1, -1, row, -row, layer, -layer};
  std::vector<std::uint32_t> open{static_cast<std::uint32_t>(start)};
  cells[start] = kReachable;
  std::size_t count = 1;
  while (!open.empty()) {
    const auto cell = static_cast<std::ptrdiff_t>(open.back());
    open.pop_back();
    for (const std::ptrdiff_t step : steps) {
      const auto next = static_cast<std::size_t>(cell + step);
      if (cells[next] != kPassable) continue;
      cells[next] = kReachable;
      ++count;
      open.push_back(static_cast<std::uint32_t>(next));
    }
  }
  return count;
}

}  // namespace

ReachableSpace find_reachable_space(const World& world, const Pose& X_WO,
                                    const ScoredRegion& region, double vehicle_radius_m,
                                    const ReachableSpaceConfig& config) {
  const Bounds box = box_in_W(world, X_WO, region.extent());
  const Vec3 pad =
      Vec3::Constant(std::max(vehicle_radius_m, config.margin_m) + 2 * config.resolution_m);
  ReachableSpace space;
  space.grid = worlds::make_grid({box.low - pad, box.high + pad}, config.resolution_m);
  if (space.grid.cells() > UINT32_MAX) {
    throw std::invalid_argument("coverage: the exploration bounds hold too many cells");
  }
  space.reachable = passable_cells(world, space.grid, box, X_WO, region.bounds, vehicle_radius_m);
  for (double rise = 0; rise <= config.start_search_m; rise += config.resolution_m) {
    const Eigen::Vector3i cell = space.grid.cell_of(X_WO * region.start_O + rise * Vec3::UnitZ());
    if (!space.grid.contains(cell) || space.reachable[space.grid.index(cell)] != kPassable)
      continue;
    space.count = flood(space.reachable, space.grid, space.grid.index(cell));
    for (std::uint8_t& state : space.reachable) state = state == kReachable;
    return space;
  }
  throw std::invalid_argument(
      "coverage: the vehicle does not fit at its start inside the exploration bounds");
}

}  // namespace arex::sim
