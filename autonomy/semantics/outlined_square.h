#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <numbers>
#include <optional>
#include <utility>
#include <vector>

#include "semantics/plan_shapes.h"

namespace arex {

struct FittedSquare {
  Rectangle box;
  double gain = 0;  ///< m of outline that is filled, less what is not
};

/// The square whose outline the band's points around a piece of a pillar fill.
///
/// Where walls meet at a pillar, each of the corners between them shows a piece of it, and no piece
/// shows its width. A piece's outer edges are the pillar's, though: of the squares that have one of
/// the piece's corners, the one that gains most from what of its outline is filled, by walls'
/// points or others. What is filled half and empty inside is a pillar: walls end at its sides.
class OutlinedSquare {
 public:
  /// @param around the band's points within kReach of the piece; @param yaw_rad of the walls
  OutlinedSquare(const std::vector<Vec2>& piece, const std::vector<Vec2>& around, double yaw_rad)
      : piece_(rectangle_around(piece, yaw_rad, kTail)),
        u_(std::cos(yaw_rad), std::sin(yaw_rad)),
        v_(-u_.y(), u_.x()),
        filled_(kCells * kCells, 0),
        inside_((kCells + 1) * (kCells + 1), 0) {
    std::vector<int> count(kCells * kCells, 0);
    for (const Vec2& p : around) {
      const int c = cell((p - piece_.centre).dot(u_)), r = cell((p - piece_.centre).dot(v_));
      if (!within(c, r)) continue;
      ++count[index(c, r)];
      for (int dr = -kOff; dr <= kOff; ++dr) {
        for (int dc = -kOff; dc <= kOff; ++dc) {
          if (within(c + dc, r + dr)) filled_[index(c + dc, r + dr)] = 1;
        }
      }
    }
    for (int r = 0; r < kCells; ++r) {
      for (int c = 0; c < kCells; ++c) {
        sum(c + 1, r + 1) = sum(c, r + 1) + sum(c + 1, r) - sum(c, r) + count[index(c, r)];
      }
    }
  }

  static constexpr double kReach = 1.8;  ///< m

  /// Nothing if no square of such sides fits.
  [[nodiscard]] std::optional<FittedSquare> fit(double least, double most) const {
    constexpr double kStep = 0.02, kEmpty = 0.1;  // m, of the points within the outline
    const Vec2 half = half_sizes();
    std::optional<FittedSquare> best;
    for (double side = std::max(least, 2 * half.maxCoeff()); side <= most; side += kStep) {
      for (const double x : {-1.0, 1.0}) {
        for (const double y : {-1.0, 1.0}) {
          // The square's corner at the piece's, the rest of it behind.
          const Vec2 middle(x * (half.x() - 0.5 * side), y * (half.y() - 0.5 * side));
          const auto [covered, all] = outline(middle, 0.5 * side);
          const double gain = covered - kMissing * (all - covered);
          if ((best && gain <= best->gain) || covered < kCovered * all) continue;
          const int inner = count_of(middle, 0.5 * side - kMargin);
          if (inner > kEmpty * count_of(middle, 0.5 * side + kMargin)) continue;
          const Vec2 centre = piece_.centre + middle.x() * u_ + middle.y() * v_;
          best = FittedSquare{{centre, side, side, yaw()}, gain};
        }
      }
    }
    return best;
  }

 private:
  static constexpr double kTail = 0.04;     // of the points: edges throw some off
  static constexpr double kCell = 0.02;     // m
  static constexpr int kOff = 2;            // cells, of points from an outline
  static constexpr double kMargin = 0.08;   // m: noise and drift of what is on an outline
  static constexpr double kCovered = 0.5;   // of an outline
  static constexpr double kMissing = 0.75;  // of the gain: what an empty metre of outline costs
  static constexpr int kCells = 2 * static_cast<int>(kReach / kCell);

  [[nodiscard]] double yaw() const {
    return std::fmod(std::atan2(u_.y(), u_.x()) + 2 * std::numbers::pi, std::numbers::pi);
  }
  /// Of the piece, along u and v.
  [[nodiscard]] Vec2 half_sizes() const {
    const bool along = std::abs(piece_.along().dot(u_)) > std::numbers::sqrt2 / 2;
    return 0.5 * (along ? Vec2(piece_.length, piece_.width) : Vec2(piece_.width, piece_.length));
  }
  static int cell(double offset) { return static_cast<int>(std::floor((offset + kReach) / kCell)); }
  static bool within(int c, int r) { return c >= 0 && r >= 0 && c < kCells && r < kCells; }
  static std::size_t index(int c, int r) {
    return static_cast<std::size_t>(r) * kCells + static_cast<std::size_t>(c);
  }
  int& sum(int c, int r) {
    return inside_[static_cast<std::size_t>(r) * (kCells + 1) + static_cast<std::size_t>(c)];
  }
  /// Points in a square.
  [[nodiscard]] int count_of(const Vec2& middle, double half) const {
    if (half <= 0) return 0;
    const auto at = [&](int c, int r) {
      return inside_[static_cast<std::size_t>(std::clamp(r, 0, kCells)) * (kCells + 1) +
                     static_cast<std::size_t>(std::clamp(c, 0, kCells))];
    };
    const int c0 = cell(middle.x() - half), c1 = cell(middle.x() + half) + 1;
    const int r0 = cell(middle.y() - half), r1 = cell(middle.y() + half) + 1;
    return at(c1, r1) - at(c0, r1) - at(c1, r0) + at(c0, r0);
  }
  /// Steps of a square's outline with points, and all of them, m.
  [[nodiscard]] std::pair<double, double> outline(const Vec2& middle, double half) const {
    constexpr double kStep = 0.04;  // m
    const int steps = std::max(1, static_cast<int>(std::lround(2 * half / kStep)));
    int covered = 0;
    for (int i = 0; i < steps; ++i) {
      const double t = -half + (i + 0.5) / steps * 2 * half;
      for (const double side : {-half, half}) {
        for (const Vec2& p : {Vec2(t, side), Vec2(side, t)}) {
          const int c = cell(middle.x() + p.x()), r = cell(middle.y() + p.y());
          covered += within(c, r) && filled_[index(c, r)] != 0;
        }
      }
    }
    const double length = 2 * half / steps;
    return {covered * length, 4 * steps * length};
  }

  Rectangle piece_;
  Vec2 u_, v_;
  std::vector<std::uint8_t> filled_;  ///< cells near a point
  std::vector<int> inside_;           ///< points below and left of each cell's corner
};

}  // namespace arex
