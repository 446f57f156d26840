#include "semantics/ground_model.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <limits>

namespace arex {
namespace {

constexpr double kCoarsest = 8.0;    // m, first grid
constexpr double kSupport = 0.2;     // m, within which a lowest point has company
constexpr std::size_t kCompany = 3;  // points, itself included
constexpr double kThickness = 0.12;  // m, of a layer of ground points
constexpr double kRelief = 0.2;      // unexplained slope that a grid still follows
constexpr double kRough = 0.1;       // m, roughness that every grid follows
constexpr double kStiffness = 0.3;   // lambda
constexpr int kRounds = 5;           // of weights
constexpr int kSweeps = 24;          // of the relaxation, each round

/// Height of a cell's lowest layer from its residuals, or NaN if there is none. Echoes that came by
/// a detour lie below the ground: where there are many, a few of them are as high as each other,
/// but never as many as the points of a surface.
float lowest_layer(std::vector<float>& residuals) {
  constexpr float kWindow = 0.25F;       // m, of height, in which points are counted
  constexpr std::size_t kLeast = 10;     // a tenth of the points of the fullest window
  constexpr std::size_t kAveraged = 64;  // lowest points of the layer
  // The fullest one is looked for in the lower half: what matters is not the crowns.
  const std::size_t half = std::max(residuals.size() / 2, std::min(residuals.size(), kAveraged));
  const auto middle = residuals.begin() + static_cast<std::ptrdiff_t>(half);
  if (middle != residuals.end()) std::nth_element(residuals.begin(), middle, residuals.end());
  std::sort(residuals.begin(), middle);
  std::size_t fullest = 0;
  for (std::size_t i = 0, j = 0; i < half; ++i) {
    while (j < half && residuals[j] - residuals[i] <= kWindow) ++j;
    fullest = std::max(fullest, j - i);
  }
  for (std::size_t i = 0, end = 0; i + kCompany <= half; ++i) {
    while (end < half && residuals[end] - residuals[i] <= kWindow) ++end;
    if (residuals[i + kCompany - 1] - residuals[i] > static_cast<float>(kSupport)) continue;
    if (kLeast * (end - i) < fullest) continue;
    double sum = 0;
    std::size_t count = 0;
    for (std::size_t j = i; j < std::min(half, i + kAveraged) &&
                            residuals[j] - residuals[i] <= static_cast<float>(kThickness);
         ++j) {
      sum += static_cast<double>(residuals[j]);
      ++count;
    }
    return static_cast<float>(sum / static_cast<double>(count));
  }
  return std::numeric_limits<float>::quiet_NaN();
}

/// Residuals of the points against a surface, gathered by the cells of a coarser grid.
template <class Surface>
Raster lowest_layers(const WorkingCloud& cloud, double cell_m, const Surface& surface) {
  Raster out(cloud.low.head<2>().cast<double>(), cloud.high.head<2>().cast<double>(), cell_m,
             std::numeric_limits<float>::quiet_NaN());
  std::vector<std::uint32_t> start(out.values.size() + 1, 0), of_point(cloud.points.size());
  for (std::size_t i = 0; i < cloud.points.size(); ++i) {
    const Vec3f& p = cloud.points[i];
    const std::size_t cell = out.cell_of(static_cast<double>(p.x()), static_cast<double>(p.y()));
    of_point[i] = static_cast<std::uint32_t>(cell);
    ++start[cell + 1];
  }
  for (std::size_t i = 1; i < start.size(); ++i) start[i] += start[i - 1];
  std::vector<std::uint32_t> next(start.begin(), start.end() - 1);
  std::vector<float> all(cloud.points.size());
  for (std::size_t i = 0; i < cloud.points.size(); ++i) {
    const Vec3f& p = cloud.points[i];
    const double height = surface(static_cast<double>(p.x()), static_cast<double>(p.y()));
    all[next[of_point[i]]++] = static_cast<float>(static_cast<double>(p.z()) - height);
  }
  std::vector<float> residuals;
  for (std::size_t cell = 0; cell < out.values.size(); ++cell) {
    residuals.assign(all.begin() + start[cell], all.begin() + start[cell + 1]);
    out.values[cell] = lowest_layer(residuals);
  }
  return out;
}

/// Layers below a coarser surface that nothing of their depth goes on beside are clusters of echoes
/// from below: they are forgotten. A hollow is wider, and so was seen by the coarser grids.
void forget_echoes(Raster& layers) {
  constexpr double kLeastHollow = 4;  // m^2 per metre of the cell, and one cell
  constexpr double kWhole = 4;        // m: in cells of this size the points alone tell
  constexpr double kStep = 0.2;       // m, between cells beside each other
  constexpr double kSlope = 0.3;      // likewise, per metre of the cell
  if (layers.cell_m >= kWhole) return;
  const auto low = static_cast<float>(-(kRough + kRelief * layers.cell_m));
  const auto step = static_cast<float>(kStep + kSlope * layers.cell_m);
  std::vector<std::uint8_t> seen(layers.values.size(), 0);
  std::vector<std::size_t> group;
  for (std::size_t first = 0; first < seen.size(); ++first) {
    if (seen[first] != 0 || !(layers.values[first] < low)) continue;
    seen[first] = 1;
    group.assign(1, first);
    for (std::size_t next = 0; next < group.size(); ++next) {
      const std::size_t i = group[next];
      const auto width = static_cast<std::size_t>(layers.columns);
      const int column = static_cast<int>(i % width), row = static_cast<int>(i / width);
      for (int r = std::max(0, row - 1); r <= std::min(layers.rows - 1, row + 1); ++r) {
        for (int c = std::max(0, column - 1); c <= std::min(layers.columns - 1, column + 1); ++c) {
          const std::size_t j = layers.index(c, r);
          const bool goes_on =
              layers.values[j] < low && std::abs(layers.values[j] - layers.values[i]) <= step;
          if (seen[j] != 0 || !goes_on) continue;
          seen[j] = 1;
          group.push_back(j);
        }
      }
    }
    if (static_cast<double>(group.size() - 1) * layers.cell_m >= kLeastHollow) continue;
    for (const std::size_t i : group) {
      layers.values[i] = std::numeric_limits<float>::quiet_NaN();
    }
  }
}

/// a + b x + c y under the lowest layers of the coarse cells, those above it counting less.
Vec3 skew_plane(const Raster& layers) {
  Vec3 plane = Vec3::Zero();
  const Vec2 middle = layers.centre(layers.columns / 2, layers.rows / 2);
  for (int round = 0; round < 10; ++round) {
    Mat3 A = Mat3::Zero();
    Vec3 b = Vec3::Zero();
    for (int row = 0; row < layers.rows; ++row) {
      for (int column = 0; column < layers.columns; ++column) {
        const auto z = static_cast<double>(layers.values[layers.index(column, row)]);
        if (!std::isfinite(z)) continue;
        const Vec2 at = layers.centre(column, row) - middle;
        const Vec3 basis(1, at.x(), at.y());
        const double above = z - plane.dot(basis);
        const double weight = round == 0 || above < 0.3 ? 1 : std::pow(0.3 / above, 2);
        A += weight * basis * basis.transpose();
        b += weight * z * basis;
      }
    }
    A.diagonal() += Vec3(1e-9, 1.0, 1.0);  // level unless the points say otherwise
    plane = A.ldlt().solve(b);
  }
  plane[0] -= plane.tail<2>().dot(middle);
  return plane;
}

/// The correction that the layers ask for (see the header), relaxed in place.
Raster relax(const Raster& layers) {
  const double tolerance = kRough + kRelief * layers.cell_m;
  const auto n = static_cast<std::ptrdiff_t>(layers.values.size());
  const int columns = layers.columns, rows = layers.rows;
  Raster correction = layers;
  // Start from below: the least of the neighbourhood.
  for (int row = 0; row < rows; ++row) {
    for (int column = 0; column < columns; ++column) {
      float least = std::numeric_limits<float>::infinity();
      for (int r = std::max(0, row - 1); r <= std::min(rows - 1, row + 1); ++r) {
        for (int c = std::max(0, column - 1); c <= std::min(columns - 1, column + 1); ++c) {
          const float value = layers.values[layers.index(c, r)];
          if (value < least) least = value;
        }
      }
      correction.values[layers.index(column, row)] = std::isfinite(least) ? least : 0;
    }
  }
  std::vector<float> weights(static_cast<std::size_t>(n));
  for (int round = 0; round < kRounds; ++round) {
    for (std::size_t i = 0; i < weights.size(); ++i) {
      const double above = static_cast<double>(layers.values[i] - correction.values[i]);
      weights[i] = !std::isfinite(above) ? 0
                   : above < tolerance   ? 1
                                         : static_cast<float>(std::pow(tolerance / above, 6));
    }
    for (int sweep = 0; sweep < kSweeps; ++sweep) {
      for (int row = 0; row < rows; ++row) {
        for (int column = 0; column < columns; ++column) {
          const std::size_t i = layers.index(column, row);
          double sum = 0, weight = 1e-6;  // towards the coarser surface where nothing is known
          const auto add = [&](int c, int r) {
            if (!layers.contains(c, r)) return;
            sum += kStiffness * static_cast<double>(correction.values[layers.index(c, r)]);
            weight += kStiffness;
          };
          add(column - 1, row);
          add(column + 1, row);
          add(column, row - 1);
          add(column, row + 1);
          const auto w = static_cast<double>(weights[i]);
          if (w > 0) sum += w * static_cast<double>(layers.values[i]);
          correction.values[i] = static_cast<float>(sum / (weight + w));
        }
      }
    }
  }
  return correction;
}

}  // namespace

Raster fit_ground(const WorkingCloud& cloud, double cell_m) {
  const Vec2 low = cloud.low.head<2>().cast<double>(), high = cloud.high.head<2>().cast<double>();
  const Vec3 plane = skew_plane(lowest_layers(cloud, 4.0, [](double, double) { return 0.0; }));
  const auto on_plane = [&](double x, double y) { return plane.dot(Vec3(1, x, y)); };
  Raster surface;
  for (double cell = std::max(kCoarsest, cell_m);; cell = std::max(cell / 2, cell_m)) {
    Raster layers = surface.values.empty() ? lowest_layers(cloud, cell, on_plane)
                                           : lowest_layers(cloud, cell, [&](double x, double y) {
                                               return surface.interpolate(x, y);
                                             });
    forget_echoes(layers);
    const Raster correction = relax(layers);
    Raster finer(low, high, cell, 0);
    for (int row = 0; row < finer.rows; ++row) {
      for (int column = 0; column < finer.columns; ++column) {
        const Vec2 at = finer.centre(column, row);
        const double before =
            surface.values.empty() ? on_plane(at.x(), at.y()) : surface.interpolate(at.x(), at.y());
        const std::size_t i = finer.index(column, row);
        finer.values[i] = static_cast<float>(before) + correction.values[i];
      }
    }
    surface = std::move(finer);
    if (cell <= cell_m) return surface;
  }
}

std::vector<float> heights_above(const std::vector<Vec3f>& points, const Raster& ground) {
  std::vector<float> heights(points.size());
  for (std::size_t i = 0; i < points.size(); ++i) {
    const Vec3f& p = points[i];
    heights[i] = p.z() - static_cast<float>(ground.interpolate(static_cast<double>(p.x()),
                                                               static_cast<double>(p.y())));
  }
  return heights;
}

}  // namespace arex
