#pragma once

#include <cstdint>
#include <vector>

#include "mapping/brick.h"

namespace arex {

/// What the rays of one frame say about the voxels of one brick.
struct BrickRays {
  Cell brick = Cell::Zero();              ///< cell / 8, rounded down
  const std::uint64_t* hit = nullptr;     ///< 512 bits: a point lies in the voxel
  const std::uint64_t* passed = nullptr;  ///< 512 bits: a ray crosses it; a hit overrides
};

/// Casts the rays of one frame through a voxel lattice. Each voxel is reported once per frame, as
/// hit or as passed, however many rays meet it; as OctoMap's computeUpdate, the voxel that holds a
/// ray's end does not count as passed.
///
/// Rays walk along their longest axis from one cell boundary to the next in fixed point (2^-55 of a
/// cell); between two boundaries they cross at most one boundary of each other axis, so that three
/// marks, of which some may coincide, cover the step without a branch. Four steps are taken at a
/// time, inside the words' four cells along that axis, where they meet four words at most. The
/// marks are bits of a window of 512^3 cells that is addressed modulo its size and cleared by
/// touched bricks only.
class RayCaster {
 public:
  explicit RayCaster(double resolution_m);

  [[nodiscard]] double resolution_m() const { return resolution_m_; }
  [[nodiscard]] Cell cell_of(const Vec3& p) const {
    return (p * inverse_resolution_).array().floor().cast<int>();
  }

  /// Starts a frame. Voxels outside `clip`, or further than kReach cells from `centre` along an
  /// axis, need not be exact: they may be left out or reported partly.
  void begin(const Vec3& centre, const CellBox& clip);
  /// A ray from the sensor to a measured point, or (`hit` false) through free space to `to`.
  void add(const Vec3& from, const Vec3& to, bool hit);
  /// A measured point whose ray is left out.
  void add_point(const Vec3& point);
  /// Ends the frame. @return the bricks that were met; valid until begin().
  const std::vector<BrickRays>& finish();
  [[nodiscard]] const std::vector<BrickRays>& bricks() const { return bricks_; }
  [[nodiscard]] const CellBox& clip() const { return clip_; }

  static constexpr int kReach = 244;  ///< cells; twice this and the margins fit the window

 private:
  void mark_hit(const Cell& cell);
  void walk(const Vec3& p, const Vec3& d, double length, const Cell& end);

  double resolution_m_;
  double inverse_resolution_;
  Cell centre_ = Cell::Zero();
  CellBox clip_;
  std::vector<std::uint64_t> passed_;
  std::vector<std::uint64_t> hit_;
  std::vector<std::uint8_t> touched_;  ///< per brick of the window
  std::vector<BrickRays> bricks_;
};

}  // namespace arex
