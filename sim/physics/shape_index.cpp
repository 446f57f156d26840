#include "physics/shape_index.h"

#include <algorithm>
#include <cmath>

namespace arex::sim {
namespace {

using worlds::CollisionShape;

constexpr int kMaxCellsPerAxis = 1024;

/// Half extents of the shape's bounding box in W.
Vec3 half_extents(const CollisionShape& shape) {
  const Vec3 axis = shape.X_WS.R.col(2).cwiseAbs();
  switch (shape.kind) {
    case CollisionShape::Kind::kBox:
      return shape.X_WS.R.cwiseAbs() * shape.size;
    case CollisionShape::Kind::kCapsule:
      return Vec3::Constant(shape.size.x()) + shape.size.y() * axis;
    case CollisionShape::Kind::kCylinder:
      break;
  }
  return shape.size.y() * axis +
         shape.size.x() * (1 - axis.array().square()).max(0.0).sqrt().matrix();
}

}  // namespace

double distance_to(const CollisionShape& shape, const Vec3& point) {
  const Vec3 p = shape.X_WS.R.transpose() * (point - shape.X_WS.p);
  if (shape.kind == CollisionShape::Kind::kBox) {
    return (p.cwiseAbs() - shape.size).cwiseMax(0.0).norm();
  }
  const double radius = shape.size.x();
  const double beyond_end = std::max(std::abs(p.z()) - shape.size.y(), 0.0);
  const double radial = p.head<2>().norm();
  if (shape.kind == CollisionShape::Kind::kCapsule) {
    return std::max(std::hypot(radial, beyond_end) - radius, 0.0);
  }
  return std::hypot(std::max(radial - radius, 0.0), beyond_end);
}

double reach_from(const CollisionShape& shape, const Vec3& point) {
  const Vec3 p = (shape.X_WS.R.transpose() * (point - shape.X_WS.p)).cwiseAbs();
  if (shape.kind == CollisionShape::Kind::kBox) return (p + shape.size).norm();
  const double radial = p.head<2>().norm();
  const double axial = p.z() + shape.size.y();
  if (shape.kind == CollisionShape::Kind::kCapsule) {
    return std::hypot(radial, axial) + shape.size.x();
  }
  return std::hypot(radial + shape.size.x(), axial);
}

ShapeIndex::ShapeIndex(const std::vector<CollisionShape>& shapes) : shapes_(shapes) {
  if (shapes.empty()) return;
  Eigen::AlignedBox2d bounds;
  for (const CollisionShape& shape : shapes) {
    const Vec2 half = half_extents(shape).head<2>();
    bounds.extend(Vec2(shape.X_WS.p.head<2>() - half));
    bounds.extend(Vec2(shape.X_WS.p.head<2>() + half));
  }
  origin_ = bounds.min();
  cell_m_ = std::max(cell_m_, bounds.sizes().maxCoeff() / kMaxCellsPerAxis);
  columns_ = 1 + static_cast<int>(bounds.sizes().x() / cell_m_);
  rows_ = 1 + static_cast<int>(bounds.sizes().y() / cell_m_);

  // Two passes: count, then place.
  const auto each_cell = [&](const CollisionShape& shape, auto&& visit) {
    const Vec2 half = half_extents(shape).head<2>(), centre = shape.X_WS.p.head<2>();
    const Range range = cells_of(centre - half, centre + half);
    for (int row = range.first_row; row <= range.last_row; ++row) {
      for (int column = range.first_column; column <= range.last_column; ++column) {
        visit(static_cast<std::size_t>(row * columns_ + column));
      }
    }
  };
  cell_start_.assign(static_cast<std::size_t>(columns_ * rows_) + 1, 0);
  for (const CollisionShape& shape : shapes) {
    each_cell(shape, [&](std::size_t cell) { ++cell_start_[cell + 1]; });
  }
  for (std::size_t i = 1; i < cell_start_.size(); ++i) cell_start_[i] += cell_start_[i - 1];
  members_.resize(cell_start_.back());
  std::vector<std::uint32_t> next(cell_start_.begin(), cell_start_.end() - 1);
  for (std::uint32_t i = 0; i < shapes.size(); ++i) {
    each_cell(shapes[i], [&](std::size_t cell) { members_[next[cell]++] = i; });
  }
}

ShapeIndex::Range ShapeIndex::cells_of(const Vec2& low, const Vec2& high) const {
  const auto cell = [this](double offset, int count) {
    return static_cast<int>(
        std::clamp(std::floor(offset / cell_m_), 0.0, static_cast<double>(count - 1)));
  };
  return {cell(low.x() - origin_.x(), columns_), cell(high.x() - origin_.x(), columns_),
          cell(low.y() - origin_.y(), rows_), cell(high.y() - origin_.y(), rows_)};
}

void ShapeIndex::find(const Vec3& point, double radius_m, std::vector<Neighbour>& out) const {
  out.clear();
  if (shapes_.empty()) return;
  const Vec2 reach = Vec2::Constant(radius_m);
  const Range range = cells_of(point.head<2>() - reach, point.head<2>() + reach);
  for (int row = range.first_row; row <= range.last_row; ++row) {
    for (int column = range.first_column; column <= range.last_column; ++column) {
      const auto cell = static_cast<std::size_t>(row * columns_ + column);
      for (std::uint32_t i = cell_start_[cell]; i < cell_start_[cell + 1]; ++i) {
        const double distance = distance_to(shapes_[members_[i]], point);
        if (distance <= radius_m) out.push_back({members_[i], distance});
      }
    }
  }
  std::sort(out.begin(), out.end(), [](const Neighbour& a, const Neighbour& b) {
    return a.distance_m != b.distance_m ? a.distance_m < b.distance_m : a.shape < b.shape;
  });
  // A shape that spans cells was found once in each.
  out.erase(std::unique(out.begin(), out.end(),
                        [](const Neighbour& a, const Neighbour& b) { return a.shape == b.shape; }),
            out.end());
}

}  // namespace arex::sim
