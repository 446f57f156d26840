#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <vector>

#include "planning/curve_check.h"

namespace arex::support {

/// Whether a moving start among upright obstacles is beyond help: proof that every motion from
/// position `p` and level velocity `v` whose acceleration's norm stays below `a` meets a blocked
/// cell. Where this is false there may or may not be a way out.
///
/// The proof encloses the positions R_k that are reachable at t_k = k h without meeting anything:
///
///     R_0 = {p},  R_k+1 = free ∩ B(p + v t, a t^2 / 2) ∩ (R_k + v h + B(0, a t_k h + a h^2 / 2))
///
/// at t = t_k+1, with B(c, r) the disc. Both discs hold of every double integrator: the first from
/// the start, the second because the velocity at t_k differs from v by a t_k at most. If some R_k
/// is empty, every motion has met an obstacle by then. Sets are unions of small cells, of which
/// those count that are partly free, and radii grow by their diagonal, so each step errs on the
/// side of "there may be a way". The height does not help: obstacles are as high as the grid (and
/// climbing would cost acceleration).
[[nodiscard]] inline bool is_collision_unavoidable(const GridView& grid, const Vec3& p,
                                                   const Vec3& v, double a) {
  constexpr double kCell = 0.005;  // m
  constexpr double kStep = 0.02;   // s
  const double speed = v.head<2>().norm();
  if (speed < 1e-6) return false;
  const Vec3 ahead = Vec3(v.x(), v.y(), 0.0) / speed, left = Vec3::UnitZ().cross(ahead);
  const double diagonal = kCell * std::sqrt(2.0);
  // Once it could stand, a motion that is still free has found its way.
  const double horizon = speed / a;
  const int half = static_cast<int>(std::ceil(0.5 * a * horizon * horizon / kCell)) + 2;
  const int behind = 2, length = static_cast<int>(std::ceil(speed * horizon / kCell)) + half;
  const int width = 2 * half + 1;
  const auto index = [&](int i, int j) {
    return static_cast<std::size_t>(i) * static_cast<std::size_t>(width) +
           static_cast<std::size_t>(j);
  };
  const auto forward = [&](int i) { return (i - behind) * kCell; };
  const auto sideways = [&](int j) { return (j - half) * kCell; };
  const auto partly_free = [&](int i, int j) {
    for (const double x : {-0.5, 0.0, 0.5}) {
      for (const double y : {-0.5, 0.0, 0.5}) {
        if (!is_blocked(grid,
                        p + (forward(i) + x * kCell) * ahead + (sideways(j) + y * kCell) * left)) {
          return true;
        }
      }
    }
    return false;
  };

  struct CellIndex {
    int i, j;
  };
  std::vector<CellIndex> reached{{behind, half}};
  std::vector<char> is_seen(index(length, 0));
  for (int k = 0; (k + 1) * kStep <= horizon; ++k) {
    const double t0 = k * kStep, t1 = t0 + kStep;
    const double disc = 0.5 * a * t1 * t1 + diagonal;
    const double move = a * t0 * kStep + 0.5 * a * kStep * kStep + diagonal;
    const int reach = static_cast<int>(std::ceil(move / kCell));
    const int shift = static_cast<int>(std::lround(speed * kStep / kCell));
    std::fill(is_seen.begin(), is_seen.end(), 0);
    std::vector<CellIndex> next;
    for (const CellIndex& from : reached) {
      for (int i = from.i + shift - reach; i <= from.i + shift + reach; ++i) {
        for (int j = from.j - reach; j <= from.j + reach; ++j) {
          if (i < 0 || j < 0 || i >= length || j >= width || is_seen[index(i, j)]) continue;
          const double dx = forward(i) - forward(from.i) - speed * kStep;
          const double dy = sideways(j) - sideways(from.j);
          if (std::hypot(dx, dy) > move ||
              std::hypot(forward(i) - speed * t1, sideways(j)) > disc) {
            continue;
          }
          is_seen[index(i, j)] = 1;
          if (partly_free(i, j)) next.push_back({i, j});
        }
      }
    }
    if (next.empty()) return true;
    reached = std::move(next);
  }
  return false;
}

}  // namespace arex::support
