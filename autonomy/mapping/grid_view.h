#pragma once

#include <cmath>
#include <cstdint>

#include "math/types.h"

namespace arex {

/// What the planner sees of the local grid: a dense box of cells in O, read only.
/// One byte per cell: bit 0 occupied, bit 1 inside the inflation, bit 2 known (seen free or
/// occupied), bit 3 barred (above the flight's ceiling or below its floor; inflated, too). Index as
/// the paper's Id_i: (h * num_w + w) * num_l + l with l along y, w along x, h along z (paper,
/// eqs. (11)-(12)).
struct GridView {
  static constexpr std::uint8_t kOccupied = 1;
  static constexpr std::uint8_t kInflated = 2;
  static constexpr std::uint8_t kBlocked = kOccupied | kInflated;
  static constexpr std::uint8_t kKnown = 4;
  static constexpr std::uint8_t kBarred = 8;

  const std::uint8_t* cells = nullptr;
  Vec3 low = Vec3::Zero();  ///< lower corner of cell (0, 0, 0), m
  double resolution_m = 0.1;
  Eigen::Vector3i size = Eigen::Vector3i::Zero();  ///< cells along x, y, z

  [[nodiscard]] Eigen::Vector3i cell_of(const Vec3& p) const {
    return ((p - low) / resolution_m).array().floor().cast<int>();
  }
  [[nodiscard]] Vec3 centre_of(const Eigen::Vector3i& cell) const {
    return low + resolution_m * (cell.cast<double>().array() + 0.5).matrix();
  }
  [[nodiscard]] bool contains(const Eigen::Vector3i& cell) const {
    return (cell.array() >= 0).all() && (cell.array() < size.array()).all();
  }
  [[nodiscard]] std::size_t index(const Eigen::Vector3i& cell) const {
    return (static_cast<std::size_t>(cell.z()) * static_cast<std::size_t>(size.x()) +
            static_cast<std::size_t>(cell.x())) *
               static_cast<std::size_t>(size.y()) +
           static_cast<std::size_t>(cell.y());
  }
  /// Flags of the cell that holds p; outside the box 0 (unknown, not occupied).
  [[nodiscard]] std::uint8_t at(const Vec3& p) const {
    const Eigen::Vector3i cell = cell_of(p);
    return contains(cell) ? cells[index(cell)] : std::uint8_t{0};
  }
  [[nodiscard]] bool inflated(const Vec3& p) const { return (at(p) & kBlocked) != 0; }
  [[nodiscard]] bool known(const Vec3& p) const { return (at(p) & kKnown) != 0; }
};

}  // namespace arex
