#include "semantics/working_cloud.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <string>
#include <tuple>

#include "config/config.h"

namespace arex {
namespace {

/// A point with the voxel that it lies in.
struct Keyed {
  std::uint64_t key;
  std::uint32_t input;
};

bool usable(const Vec3f& p) {
  constexpr float kFurthest = 1e6F;  // single precision says nothing there
  return p.allFinite() && p.cwiseAbs().maxCoeff() < kFurthest;
}

double cells_of(const Vec3f& low, const Vec3f& high) {
  return (static_cast<double>(high.x() - low.x()) / WorkingCloud::kCell + 1) *
         (static_cast<double>(high.y() - low.y()) / WorkingCloud::kCell + 1);
}

/// The box around all usable points; where a few of them lie far off, around nearly all, and 10 m.
std::pair<Vec3f, Vec3f> extent_of(std::span<const Vec3f> input, double voxel_m) {
  constexpr double kTail = 5e-4, kMargin = 10, kDeepest = 2e6;
  std::array<std::vector<float>, 3> values;
  for (const Vec3f& p : input) {
    if (!usable(p)) continue;
    for (std::size_t i = 0; i < 3; ++i) values[i].push_back(p[static_cast<Eigen::Index>(i)]);
  }
  Vec3f low = Vec3f::Zero(), high = Vec3f::Zero();
  if (values[0].empty()) return {low, high};
  for (std::size_t i = 0; i < 3; ++i) {
    const auto [least, most] = std::minmax_element(values[i].begin(), values[i].end());
    low[static_cast<Eigen::Index>(i)] = *least;
    high[static_cast<Eigen::Index>(i)] = *most;
  }
  // A picture of which hardly a cell is known costs as much as any.
  const double most_cells =
      std::min(WorkingCloud::kMostCells, 1e6 + 100 * static_cast<double>(values[0].size()));
  const auto fits = [&] {
    return cells_of(low, high) <= most_cells &&
           static_cast<double>((high - low).maxCoeff()) / voxel_m < kDeepest;
  };
  if (fits()) return {low, high};
  for (std::size_t i = 0; i < 3; ++i) {
    const auto axis = static_cast<Eigen::Index>(i);
    const auto tail = static_cast<std::ptrdiff_t>(kTail * static_cast<double>(values[i].size()));
    const auto quantile = [&](std::ptrdiff_t rank) {
      std::nth_element(values[i].begin(), values[i].begin() + rank, values[i].end());
      return values[i][static_cast<std::size_t>(rank)];
    };
    low[axis] = std::max(low[axis], quantile(tail) - static_cast<float>(kMargin));
    const auto last = static_cast<std::ptrdiff_t>(values[i].size()) - 1;
    high[axis] = std::min(high[axis], quantile(last - tail) + static_cast<float>(kMargin));
  }
  if (!fits()) {
    throw ConfigError(
        "the cloud spans " + std::to_string(std::lround(high.x() - low.x())) + " x " +
        std::to_string(std::lround(high.y() - low.y())) + " x " +
        std::to_string(std::lround(high.z() - low.z())) + " m, expected at most " +
        std::to_string(std::lround(most_cells * WorkingCloud::kCell * WorkingCloud::kCell)) +
        " m^2 from above for so many points, and 20 km along an axis");
  }
  return {low, high};
}

}  // namespace

WorkingCloud::WorkingCloud(std::span<const Vec3f> input, double voxel_m)
    : of_input(input.size(), kNone) {
  std::tie(low, high) = extent_of(input, voxel_m);
  std::vector<Keyed> keyed;
  keyed.reserve(input.size());
  const auto cell = static_cast<float>(voxel_m);
  for (std::size_t i = 0; i < input.size(); ++i) {
    const Vec3f& p = input[i];
    if (!usable(p) || (p.array() < low.array()).any() || (p.array() > high.array()).any()) continue;
    const Eigen::Array<std::int64_t, 3, 1> c =
        ((p - low) / cell).array().floor().cast<std::int64_t>();
    const auto key = static_cast<std::uint64_t>((c[1] << 42) | (c[0] << 21) | c[2]);
    keyed.push_back({key, static_cast<std::uint32_t>(i)});
  }
  // Within a voxel by value, so that the mean does not depend on the order of the input, and
  // copies of a point stand side by side.
  const auto less = [&](const Vec3f& a, const Vec3f& b) {
    return std::tuple(a.x(), a.y(), a.z()) < std::tuple(b.x(), b.y(), b.z());
  };
  std::sort(keyed.begin(), keyed.end(), [&](const Keyed& a, const Keyed& b) {
    return a.key != b.key ? a.key < b.key : less(input[a.input], input[b.input]);
  });
  for (std::size_t first = 0, last = 0; first < keyed.size(); first = last) {
    Vec3 sum = Vec3::Zero();
    int count = 0;
    for (last = first; last < keyed.size() && keyed[last].key == keyed[first].key; ++last) {
      const Vec3f& p = input[keyed[last].input];
      of_input[keyed[last].input] = static_cast<std::uint32_t>(points.size());
      if (last > first && p == input[keyed[last - 1].input]) continue;
      sum += p.cast<double>();
      ++count;
    }
    points.push_back((sum / count).cast<float>());
  }
}

ColumnIndex::ColumnIndex(const std::vector<Vec3f>& points, const Vec3f& low, const Vec3f& high,
                         double cell_m)
    : points_(&points),
      low_(low),
      cell_(static_cast<float>(cell_m)),
      columns_(1 + static_cast<int>((high.x() - low.x()) / cell_)),
      rows_(1 + static_cast<int>((high.y() - low.y()) / cell_)),
      start_(static_cast<std::size_t>(columns_) * static_cast<std::size_t>(rows_) + 1, 0),
      order_(points.size()) {
  const auto cell_of = [&](const Vec3f& p) {
    return static_cast<std::size_t>(row_of(p.y())) * static_cast<std::size_t>(columns_) +
           static_cast<std::size_t>(column_of(p.x()));
  };
  for (const Vec3f& p : points) ++start_[cell_of(p) + 1];
  for (std::size_t i = 1; i < start_.size(); ++i) start_[i] += start_[i - 1];
  std::vector<std::uint32_t> next(start_.begin(), start_.end() - 1);
  for (std::size_t i = 0; i < points.size(); ++i) {
    order_[next[cell_of(points[i])]++] = static_cast<std::uint32_t>(i);
  }
  for (std::size_t i = 0; i + 1 < start_.size(); ++i) {
    std::sort(order_.begin() + start_[i], order_.begin() + start_[i + 1],
              [&](std::uint32_t a, std::uint32_t b) {
                return std::pair(points[a].z(), a) < std::pair(points[b].z(), b);
              });
  }
}

}  // namespace arex
