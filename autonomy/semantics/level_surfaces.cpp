#include "semantics/level_surfaces.h"

#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <optional>

namespace arex {
namespace {

constexpr double kColumn = 0.25;     // m
constexpr float kGap = 0.15F;        // m, between groups of a column
constexpr float kFree = 0.45F;       // m, above a floor or below a ceiling: no sparse wall is level
constexpr float kThin = 0.3F;        // m, of a group that may be level: a slope of 45 degrees
constexpr float kNoise = 0.06F;      // m, between neighbours
constexpr int kWiden = 2;            // cells
constexpr int kAcross = 24;          // cells, across half of a hole
constexpr int kUnder = 12;           // cells, of a floor below things: half a bay
constexpr float kMansHeight = 2.1F;  // m, of what stands on a floor
constexpr int kMostOfSquare = 20;    // of the 25 cells of a square of 1.25 m
constexpr double kWideShare = 0.2;   // of the least floor: where such a square fits
constexpr std::array<std::pair<int, int>, 4> kSides{{{1, 0}, {-1, 0}, {0, 1}, {0, -1}}};
constexpr float kOff = 0.35F;  // m, what is nearer belongs to the surface (kerbs, beams)
constexpr float kNaN = std::numeric_limits<float>::quiet_NaN();

struct Piece {
  float z = 0;
  bool taken = false;
};

/// Pieces of level surface, column by column.
class Pieces {
 public:
  explicit Pieces(const ColumnIndex& index, const std::vector<Vec3f>& points)
      : columns_(index.columns()), rows_(index.rows()) {
    start_.push_back(0);
    for (int r = 0; r < rows_; ++r) {
      for (int c = 0; c < columns_; ++c) {
        add_column(index.at(c, r), points);
        start_.push_back(pieces_.size());
      }
    }
  }
  [[nodiscard]] int columns() const { return columns_; }
  [[nodiscard]] int rows() const { return rows_; }
  std::span<Piece> at(int column, int row) {
    const std::size_t i = static_cast<std::size_t>(row) * static_cast<std::size_t>(columns_) +
                          static_cast<std::size_t>(column);
    return {pieces_.data() + start_[i], start_[i + 1] - start_[i]};
  }

 private:
  void add_column(std::span<const std::uint32_t> column, const std::vector<Vec3f>& points) {
    for (std::size_t first = 0, last = 0; first < column.size(); first = last) {
      float sum = 0;
      for (last = first; last < column.size(); ++last) {
        const float z = points[column[last]].z();
        if (last > first && z - points[column[last - 1]].z() > kGap) break;
        sum += z;
      }
      const float low = points[column[first]].z(), high = points[column[last - 1]].z();
      const bool free_below = first == 0 || low - points[column[first - 1]].z() > kFree;
      const bool free_above = last == column.size() || points[column[last]].z() - high > kFree;
      if (last - first >= 2 && high - low < kThin && (free_below || free_above)) {
        pieces_.push_back({sum / static_cast<float>(last - first), false});
      }
    }
  }
  int columns_, rows_;
  std::vector<Piece> pieces_;
  std::vector<std::size_t> start_;
};

/// Grows surfaces from single pieces. A column that a surface has already is left to another one.
class Grower {
 public:
  Grower(Pieces& pieces, const Raster& empty, double max_slope)
      : pieces_(pieces),
        empty_(empty),
        step_(static_cast<float>(kColumn * std::tan(max_slope))),
        owner_(empty.values.size(), 0),
        height_(empty.values.size(), kNaN) {}

  /// The surface that the piece belongs to, if it is large enough.
  std::optional<LevelSurface> grow(int column, int row, Piece& seed, double least_m2) {
    ++surface_;
    std::vector<std::pair<int, int>> cells{{column, row}};
    take(column, row, seed);
    for (std::size_t i = 0; i < cells.size(); ++i) {
      const auto [c, r] = cells[i];
      const float z = height_[empty_.index(c, r)];
      for (int dr = -1; dr <= 1; ++dr) {
        for (int dc = -1; dc <= 1; ++dc) {
          if (!empty_.contains(c + dc, r + dr)) continue;
          if (owner_[empty_.index(c + dc, r + dr)] == surface_) continue;
          const float far = std::hypot(static_cast<float>(dc), static_cast<float>(dr));
          Piece* next = nearest(c + dc, r + dr, z, step_ * far + kNoise);
          if (!next) continue;
          take(c + dc, r + dr, *next);
          cells.emplace_back(c + dc, r + dr);
        }
      }
    }
    const double area = static_cast<double>(cells.size()) * kColumn * kColumn;
    if (area < least_m2) return std::nullopt;
    LevelSurface surface;
    surface.height = empty_;
    surface.area_m2 = area;
    for (const auto& [c, r] : cells) {
      surface.height.values[empty_.index(c, r)] = height_[empty_.index(c, r)];
    }
    return surface;
  }

 private:
  void take(int column, int row, Piece& piece) {
    piece.taken = true;
    owner_[empty_.index(column, row)] = surface_;
    height_[empty_.index(column, row)] = piece.z;
  }
  Piece* nearest(int column, int row, float z, float reach) {
    Piece* best = nullptr;
    for (Piece& piece : pieces_.at(column, row)) {
      if (piece.taken || std::abs(piece.z - z) > reach) continue;
      if (!best || std::abs(piece.z - z) < std::abs(best->z - z)) best = &piece;
    }
    return best;
  }

  Pieces& pieces_;
  const Raster& empty_;
  float step_;
  int surface_ = 0;
  std::vector<int> owner_;     ///< per cell: the surface that took it last
  std::vector<float> height_;  ///< its height there
};

LevelSurface::Kind kind_of(const LevelSurface& surface, const ColumnIndex& index,
                           const std::vector<Vec3f>& points, std::span<const Vec3f> path,
                           double headroom) {
  std::size_t above = 0, below = 0;
  const Raster& height = surface.height;
  // What the vehicle flew over is floor; a lone crossing of a hole's edge proves nothing.
  for (const Vec3f& p : path) {
    const float z =
        height.values[height.cell_of(static_cast<double>(p.x()), static_cast<double>(p.y()))];
    if (std::isnan(z)) continue;
    above += p.z() > z && p.z() - z < 3.0F;
    below += p.z() < z && z - p.z() < 3.0F;
  }
  if (above + below >= 5) {
    return above >= below ? LevelSurface::Kind::kFloor : LevelSurface::Kind::kCeiling;
  }
  above = below = 0;
  const auto far = static_cast<float>(headroom);
  for (int r = 0; r < height.rows; ++r) {
    for (int c = 0; c < height.columns; ++c) {
      const float z = height.values[height.index(c, r)];
      if (std::isnan(z)) continue;
      for (const std::uint32_t i : index.at(c, r)) {
        const float d = points[i].z() - z;
        above += d > kOff && d < far;
        below += d < -kOff && d > -far;
      }
    }
  }
  return above >= below ? LevelSurface::Kind::kFloor : LevelSurface::Kind::kCeiling;
}

/// Widens a surface by the mean of the neighbours, ring by ring, into cells that `wanted` names.
template <class Wanted>
void widen(Raster& height, int rings, const Wanted& wanted) {
  for (int ring = 0; ring < rings; ++ring) {
    std::vector<std::pair<std::size_t, float>> fresh;
    for (int r = 0; r < height.rows; ++r) {
      for (int c = 0; c < height.columns; ++c) {
        if (!std::isnan(height.values[height.index(c, r)])) continue;
        float sum = 0;
        int count = 0;
        for (int dr = -1; dr <= 1; ++dr) {
          for (int dc = -1; dc <= 1; ++dc) {
            if (!height.contains(c + dc, r + dr)) continue;
            const float z = height.values[height.index(c + dc, r + dr)];
            if (std::isnan(z)) continue;
            sum += z;
            ++count;
          }
        }
        const float mean = sum / static_cast<float>(count);
        if (count > 0 && wanted(c, r, mean)) fresh.emplace_back(height.index(c, r), mean);
      }
    }
    for (const auto& [cell, z] : fresh) height.values[cell] = z;
    if (fresh.empty()) return;
  }
}

/// Fills the holes of a surface: cells that have it on three sides at least.
void interpolate_holes(Raster& height) {
  const Raster known = height;
  for (int r = 0; r < height.rows; ++r) {
    for (int c = 0; c < height.columns; ++c) {
      if (!std::isnan(known.values[known.index(c, r)])) continue;
      float sum = 0, weight = 0;
      int sides = 0;
      for (const auto& [dc, dr] : kSides) {
        for (int k = 1; k <= kAcross && known.contains(c + k * dc, r + k * dr); ++k) {
          const float z = known.values[known.index(c + k * dc, r + k * dr)];
          if (std::isnan(z)) continue;
          sum += z / static_cast<float>(k);
          weight += 1 / static_cast<float>(k);
          ++sides;
          break;
        }
      }
      if (sides >= 3) height.values[height.index(c, r)] = sum / weight;
    }
  }
}

void fill(LevelSurface& surface, const ColumnIndex& index, const std::vector<Vec3f>& points) {
  surface.seen.resize(surface.height.values.size());
  for (std::size_t i = 0; i < surface.seen.size(); ++i) {
    surface.seen[i] = !std::isnan(surface.height.values[i]);
  }
  widen(surface.height, kWiden, [](int, int, float) { return true; });
  interpolate_holes(surface.height);
  if (surface.kind != LevelSurface::Kind::kFloor) return;
  // What stands beside a floor stands on it, though it hides where.
  widen(surface.height, kUnder, [&](int c, int r, float z) {
    const auto column = index.at(c, r);
    return std::any_of(column.begin(), column.end(), [&](std::uint32_t i) {
      return points[i].z() > z + kOff && points[i].z() < z + kMansHeight;
    });
  });
}

/// Whether a surface is as wide as a room somewhere, where ducts, trays and beams are not.
bool is_wide(const LevelSurface& surface, double least_m2) {
  const Raster& height = surface.height;
  std::size_t inner = 0;
  for (int r = kWiden; r + kWiden < height.rows; ++r) {
    for (int c = kWiden; c + kWiden < height.columns; ++c) {
      int count = 0;
      for (int dr = -kWiden; dr <= kWiden; ++dr) {
        for (int dc = -kWiden; dc <= kWiden; ++dc) {
          count += std::isnan(height.values[height.index(c + dc, r + dr)]) ? 0 : 1;
        }
      }
      inner += count >= kMostOfSquare;
    }
  }
  return static_cast<double>(inner) * kColumn * kColumn >= least_m2;
}

}  // namespace

std::vector<LevelSurface> find_level_surfaces(const WorkingCloud& cloud,
                                              std::span<const Vec3f> path,
                                              const GarageConfig& config) {
  constexpr std::size_t kMostSurfaces = 64;
  const ColumnIndex index(cloud.points, cloud.low, cloud.high, kColumn);
  Pieces pieces(index, cloud.points);
  Raster empty;
  empty.low = cloud.low.head<2>().cast<double>();
  empty.cell_m = kColumn;
  empty.columns = index.columns();
  empty.rows = index.rows();
  empty.values.assign(
      static_cast<std::size_t>(empty.columns) * static_cast<std::size_t>(empty.rows), kNaN);
  std::vector<LevelSurface> surfaces;
  Grower grower(pieces, empty, to_radians(config.max_slope_deg));
  for (int r = 0; r < pieces.rows(); ++r) {
    for (int c = 0; c < pieces.columns(); ++c) {
      for (Piece& piece : pieces.at(c, r)) {
        if (piece.taken) continue;
        auto surface = grower.grow(c, r, piece, config.min_floor_m2);
        if (!surface || !is_wide(*surface, kWideShare * config.min_floor_m2)) continue;
        surface->kind = kind_of(*surface, index, cloud.points, path, config.headroom_m);
        surfaces.push_back(std::move(*surface));
      }
    }
  }
  std::stable_sort(surfaces.begin(), surfaces.end(),
                   [](const auto& a, const auto& b) { return a.area_m2 > b.area_m2; });
  if (surfaces.size() > kMostSurfaces) surfaces.resize(kMostSurfaces);
  for (LevelSurface& surface : surfaces) fill(surface, index, cloud.points);
  return surfaces;
}

Clearances measure_clearances(const WorkingCloud& cloud,
                              const std::vector<LevelSurface>& surfaces) {
  constexpr float kBelow = 0.12F;  // m, noise of a floor's points
  constexpr float kLeast = 1.5F;   // m, of a room
  Clearances out;
  out.above_floor.assign(cloud.points.size(), kNaN);
  out.room.assign(cloud.points.size(), std::numeric_limits<float>::infinity());
  out.floor_of.assign(cloud.points.size(), -1);
  if (surfaces.empty()) return out;
  for (std::size_t i = 0; i < cloud.points.size(); ++i) {
    const Vec3f& p = cloud.points[i];
    const std::size_t cell =
        surfaces.front().height.cell_of(static_cast<double>(p.x()), static_cast<double>(p.y()));
    float floor = kNaN;
    for (std::size_t k = 0; k < surfaces.size(); ++k) {
      const float z = surfaces[k].height.values[cell];
      if (surfaces[k].kind != LevelSurface::Kind::kFloor || !(z <= p.z() + kBelow)) continue;
      if (z <= floor) continue;
      floor = z;
      out.floor_of[i] = static_cast<std::int16_t>(k);
    }
    if (std::isnan(floor)) continue;
    out.above_floor[i] = p.z() - floor;
    for (const LevelSurface& surface : surfaces) {
      const float z = surface.height.values[cell];
      if (surface.kind == LevelSurface::Kind::kCeiling && z > floor + kLeast) {
        out.room[i] = std::min(out.room[i], z - floor);
      }
    }
  }
  return out;
}

Raster slopes_of(const LevelSurface& surface) {
  constexpr int kReach = 2;    // cells
  constexpr int kFewest = 10;  // of the 25 around
  const Raster& height = surface.height;
  Raster slopes = height;
  for (int r = 0; r < height.rows; ++r) {
    for (int c = 0; c < height.columns; ++c) {
      slopes.values[slopes.index(c, r)] = kNaN;
      if (surface.seen[height.index(c, r)] == 0) continue;
      Mat3 A = Mat3::Zero();
      Vec3 b = Vec3::Zero();
      int count = 0;
      for (int dr = -kReach; dr <= kReach; ++dr) {
        for (int dc = -kReach; dc <= kReach; ++dc) {
          if (!height.contains(c + dc, r + dr)) continue;
          if (surface.seen[height.index(c + dc, r + dr)] == 0) continue;
          const float z = height.values[height.index(c + dc, r + dr)];
          ++count;
          const Vec3 row(1, kColumn * dc, kColumn * dr);
          A += row * row.transpose();
          b += static_cast<double>(z) * row;
        }
      }
      if (count < kFewest) continue;
      A.diagonal() += Vec3(0, 1e-6, 1e-6);
      const Vec3 plane = A.ldlt().solve(b);
      slopes.values[slopes.index(c, r)] = static_cast<float>(std::atan(plane.tail<2>().norm()));
    }
  }
  return slopes;
}

}  // namespace arex
