#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "math/types.h"

/// Voxels of one lattice in O (cell = floor(p / resolution)), in bricks of 8 x 8 x 8. Inside a
/// brick they lie in Morton order, x lowest: 512 bits are one cache line, a 64-bit word is a cube
/// of 4, a byte a cube of 2. That is OctoMap's order of children too.
namespace arex {

using Cell = Eigen::Vector3i;
inline constexpr int kBrickCells = 8;
inline constexpr int kBrickVoxels = 512;
using BrickMask = std::array<std::uint64_t, 8>;

/// Cells low <= cell < high.
struct CellBox {
  Cell low = Cell::Zero();
  Cell high = Cell::Zero();
  [[nodiscard]] bool contains(const Cell& cell) const {
    return (cell.array() >= low.array()).all() && (cell.array() < high.array()).all();
  }
  [[nodiscard]] Cell size() const { return high - low; }
};

/// A brick in which voxels changed their state (unknown, free, occupied).
struct BrickChange {
  Cell brick = Cell::Zero();
  const BrickMask* known = nullptr;
  const BrickMask* occupied = nullptr;  ///< within known
  BrickMask changed{};
};

/// Spreads the bits of v: bit i goes to bit 3 i.
constexpr std::uint64_t spread_bits(std::uint64_t v) {
  std::uint64_t out = 0;
  for (int i = 0; i < 21; ++i) out |= ((v >> i) & 1U) << (3 * i);
  return out;
}
constexpr std::uint64_t morton(std::uint64_t x, std::uint64_t y, std::uint64_t z) {
  return spread_bits(x) | spread_bits(y) << 1 | spread_bits(z) << 2;
}

/// Coordinates inside the brick of each of its voxels.
struct BrickCoordinates {
  std::array<std::array<std::uint8_t, 3>, kBrickVoxels> of{};
  constexpr BrickCoordinates() {
    for (unsigned z = 0; z < 8; ++z) {
      for (unsigned y = 0; y < 8; ++y) {
        for (unsigned x = 0; x < 8; ++x) {
          of[morton(x, y, z)] = {static_cast<std::uint8_t>(x), static_cast<std::uint8_t>(y),
                                 static_cast<std::uint8_t>(z)};
        }
      }
    }
  }
};
inline constexpr BrickCoordinates kBrickCoordinates;

/// The voxels of a brick whose coordinate along one axis is c: slice[axis][c].
struct BrickSlices {
  std::array<std::array<BrickMask, 8>, 3> slice{};
  constexpr BrickSlices() {
    for (std::size_t i = 0; i < kBrickVoxels; ++i) {
      for (std::size_t axis = 0; axis < 3; ++axis) {
        slice[axis][kBrickCoordinates.of[i][axis]][i / 64] |= std::uint64_t{1} << (i % 64);
      }
    }
  }
};
inline constexpr BrickSlices kBrickSlices;

/// The voxels of brick `brick` that lie in the box.
inline BrickMask mask_inside(const Cell& brick, const CellBox& box) {
  BrickMask mask;
  mask.fill(~std::uint64_t{0});
  for (int axis = 0; axis < 3; ++axis) {
    const int low = box.low[axis] - brick[axis] * kBrickCells;
    const int high = box.high[axis] - brick[axis] * kBrickCells;
    if (low <= 0 && high >= kBrickCells) continue;
    BrickMask band{};
    for (int c = low > 0 ? low : 0; c < kBrickCells && c < high; ++c) {
      const BrickMask& slice =
          kBrickSlices.slice[static_cast<std::size_t>(axis)][static_cast<std::size_t>(c)];
      for (std::size_t w = 0; w < 8; ++w) band[w] |= slice[w];
    }
    for (std::size_t w = 0; w < 8; ++w) mask[w] &= band[w];
  }
  return mask;
}

}  // namespace arex
