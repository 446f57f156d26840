#pragma once

#include <cmath>
#include <cstdint>
#include <limits>
#include <vector>

#include "math/types.h"

namespace arex {

/// Heights of the ground, m in O, in square tiles; row-major, x fastest. NaN where none was seen
/// nearby. Where the tiles have rises the height is that of their middle.
struct GroundHeights {
  Vec2 origin = Vec2::Zero();  ///< lower corner of tile (0, 0), m
  double tile_m = 0.8;         ///< edge of a tile
  int width = 0;               ///< tiles along x
  std::vector<float> heights;
  std::vector<Eigen::Vector2f> rises;  ///< slopes of the tiles along x and y; empty: level ones

  /// NaN where none was seen nearby, and outside.
  [[nodiscard]] double at(const Vec2& p) const {
    const Eigen::Vector2i tile = ((p - origin) / tile_m).array().floor().cast<int>();
    const auto count = static_cast<int>(heights.size());
    if (tile.minCoeff() < 0 || tile.x() >= width || tile.y() * width >= count) {
      return std::numeric_limits<double>::quiet_NaN();
    }
    const auto i = static_cast<std::size_t>(tile.y() * width + tile.x());
    if (rises.empty()) return heights[i];
    const Vec2 middle = origin + tile_m * (tile.cast<double>().array() + 0.5).matrix();
    return heights[i] + rises[i].cast<double>().dot(p - middle);
  }
};

/// The floor under each column of a 2D map, and what hangs over it, as the 3D map knows them; in
/// layers of the map's resolution above O's origin. What landing asks for. Same cells as the map.
struct FloorMap {
  static constexpr std::int16_t kUnknown = -32768;  ///< the air over the ground is not wholly known
  static constexpr std::int16_t kUnseen = -32767;   ///< the air is known free, no return from below
  static constexpr std::int16_t kNothing = 32767;   ///< overhead: nothing seen

  std::vector<std::int16_t> top;       ///< highest layer of the floor
  std::vector<std::int16_t> overhead;  ///< lowest occupied layer above the floor's relief
};

/// The 2D occupancy map of the exploration in O: -1 unknown, 0 free, 1 occupied (paper,
/// Environmental Modelling). Row-major, x fastest: cells[iy * width + ix].
struct OccupancyMap2D {
  static constexpr std::int8_t kUnknown = -1;
  static constexpr std::int8_t kFree = 0;
  static constexpr std::int8_t kOccupied = 1;

  Vec2 origin = Vec2::Zero();  ///< lower corner of cell (0, 0), m
  double resolution = 0.1;     ///< m per cell
  int width = 0;               ///< cells along x
  int height = 0;              ///< cells along y
  std::vector<std::int8_t> cells;
  /// Indices of the cells that the vehicle's centre flew through under the planner, each sharing a
  /// side with one before. Whatever the height band says about them: there is a way.
  std::vector<std::uint32_t> flown;
  std::vector<float> flown_height_m;  ///< how high it was there, in O
  GroundHeights ground;  ///< empty where the map's height band does not stand on the ground
  FloorMap floor;

  [[nodiscard]] Eigen::Vector2i cell_of(const Vec2& p) const {
    return ((p - origin) / resolution).array().floor().cast<int>();
  }
  [[nodiscard]] Vec2 centre_of(const Eigen::Vector2i& cell) const {
    return origin + resolution * (cell.cast<double>().array() + 0.5).matrix();
  }
  [[nodiscard]] bool contains(const Eigen::Vector2i& cell) const {
    return cell.x() >= 0 && cell.y() >= 0 && cell.x() < width && cell.y() < height;
  }
  [[nodiscard]] std::size_t index(const Eigen::Vector2i& cell) const {
    return static_cast<std::size_t>(cell.y()) * static_cast<std::size_t>(width) +
           static_cast<std::size_t>(cell.x());
  }
  /// State of a cell; outside the map unknown.
  [[nodiscard]] std::int8_t at(const Eigen::Vector2i& cell) const {
    return contains(cell) ? cells[index(cell)] : kUnknown;
  }
};

}  // namespace arex
