#include "sensors/mid360_airframe.h"

#include <algorithm>
#include <cmath>

namespace arex::sim {
namespace {

using Kind = worlds::CollisionShape::Kind;
constexpr double kMiss = std::numeric_limits<double>::infinity();

/// Distance at which a ray enters the box |p| <= half; kMiss if it does not.
double enter_box(const Vec3& half, const Vec3& origin, const Vec3& direction) {
  double enter = 0, leave = kMiss;
  for (int i = 0; i < 3; ++i) {
    if (std::abs(direction[i]) < 1e-15) {
      if (std::abs(origin[i]) > half[i]) return kMiss;
      continue;
    }
    const double a = (-half[i] - origin[i]) / direction[i];
    const double b = (half[i] - origin[i]) / direction[i];
    enter = std::max(enter, std::min(a, b));
    leave = std::min(leave, std::max(a, b));
  }
  return enter <= leave && enter > 0 ? enter : kMiss;
}

/// The smaller root of |o + t d|^2 = r^2 in the given dimensions, if it lies ahead.
template <int N>
double enter_round(const Eigen::Matrix<double, N, 1>& o, const Eigen::Matrix<double, N, 1>& d,
                   double radius) {
  const double a = d.squaredNorm(), b = o.dot(d), c = o.squaredNorm() - radius * radius;
  const double discriminant = b * b - a * c;
  if (discriminant < 0 || a < 1e-15) return kMiss;
  const double t = (-b - std::sqrt(discriminant)) / a;
  return t > 0 ? t : kMiss;
}

double enter_capped(Kind kind, double radius, double half_length, const Vec3& o, const Vec3& d) {
  double best = enter_round<2>(o.head<2>(), d.head<2>(), radius);
  if (best != kMiss && std::abs(o.z() + best * d.z()) > half_length) best = kMiss;
  for (const double end : {-half_length, half_length}) {
    if (kind == Kind::kCapsule) {
      best = std::min(best, enter_round<3>(o - Vec3(0, 0, end), d, radius));
    } else if (std::abs(d.z()) > 1e-15) {
      const double t = (end - o.z()) / d.z();
      if (t > 0 && (o + t * d).head<2>().norm() <= radius) best = std::min(best, t);
    }
  }
  return best;
}

double enter_shape(Kind kind, const Vec3& size, const Vec3& o, const Vec3& d) {
  return kind == Kind::kBox ? enter_box(size, o, d) : enter_capped(kind, size.x(), size.y(), o, d);
}

/// Outward normal at a point of the surface.
Vec3 normal_of(Kind kind, const Vec3& size, const Vec3& p) {
  if (kind == Kind::kBox) {
    Eigen::Index axis = 0;
    p.cwiseAbs().cwiseQuotient(size).maxCoeff(&axis);
    return Vec3::Unit(axis) * (p[axis] < 0 ? -1 : 1);
  }
  if (kind == Kind::kCapsule) {
    return (p - Vec3(0, 0, std::clamp(p.z(), -size.y(), size.y()))).normalized();
  }
  const bool cap = std::abs(p.z()) / size.y() > p.head<2>().norm() / size.x();
  return cap ? Vec3(0, 0, p.z() < 0 ? -1 : 1) : Vec3(p.x(), p.y(), 0).normalized();
}

bool contains(Kind kind, const Vec3& size, const Vec3& p) {
  if (kind == Kind::kBox) return (p.array().abs() <= size.array()).all();
  if (kind == Kind::kCapsule) {
    return (p - Vec3(0, 0, std::clamp(p.z(), -size.y(), size.y()))).norm() <= size.x();
  }
  return std::abs(p.z()) <= size.y() && p.head<2>().norm() <= size.x();
}

double bounding_radius(Kind kind, const Vec3& size) {
  if (kind == Kind::kBox) return size.norm();
  return kind == Kind::kCapsule ? size.x() + size.y() : std::hypot(size.x(), size.y());
}

/// Direction of a point of the unfolded octahedron, u and v in [-1, 1].
Vec3 octahedral_direction(double u, double v) {
  Vec3 d(u, v, 1 - std::abs(u) - std::abs(v));
  if (d.z() < 0) {
    d.x() = (1 - std::abs(v)) * (u < 0 ? -1 : 1);
    d.y() = (1 - std::abs(u)) * (v < 0 ? -1 : 1);
  }
  return d.normalized();
}

}  // namespace

AirframeMask::AirframeMask(const std::vector<worlds::CollisionShape>& airframe_B, const Pose& X_BL)
    : near_(static_cast<std::size_t>(kCells) * kCells, 0) {
  for (const worlds::CollisionShape& shape : airframe_B) {
    const Pose X_SL = shape.X_WS.inverse() * X_BL;
    if (!contains(shape.kind, shape.size, X_SL.p))
      shapes_.push_back({shape.kind, X_SL, shape.size});
  }
  // A cell is near a shape if its central ray meets the shape grown by the cell's half-width at the
  // shape's far side.
  constexpr double kStep = 2.0 / kCells;
  for (int row = 0; row < kCells; ++row) {
    for (int column = 0; column < kCells; ++column) {
      const double u = -1 + (column + 0.5) * kStep, v = -1 + (row + 0.5) * kStep;
      const Vec3 centre = octahedral_direction(u, v);
      double half_width = 0;
      for (const double du : {-0.51 * kStep, 0.51 * kStep}) {
        for (const double dv : {-0.51 * kStep, 0.51 * kStep}) {
          const Vec3 corner =
              octahedral_direction(std::clamp(u + du, -1.0, 1.0), std::clamp(v + dv, -1.0, 1.0));
          half_width = std::max(half_width, (corner - centre).norm());
        }
      }
      const bool near = std::any_of(shapes_.begin(), shapes_.end(), [&](const Shape& s) {
        const double reach = s.X_SL.p.norm() + bounding_radius(s.kind, s.size);
        const Vec3 grown = s.size + Vec3::Constant(1.1 * half_width * reach);
        return contains(s.kind, grown, s.X_SL.p) ||
               enter_shape(s.kind, grown, s.X_SL.p, s.X_SL.R * centre) != kMiss;
      });
      near_[cell_of(static_cast<float>(centre.x()), static_cast<float>(centre.y()),
                    static_cast<float>(centre.z()))] = near ? 1 : 0;
    }
  }
}

AirframeMask::BodyHit AirframeMask::cast(const Vec3& direction_L) const {
  BodyHit hit;
  for (const Shape& shape : shapes_) {
    const Vec3 direction = shape.X_SL.R * direction_L;
    const double t = enter_shape(shape.kind, shape.size, shape.X_SL.p, direction);
    if (t >= hit.distance_m) continue;
    hit.distance_m = t;
    hit.normal_L =
        shape.X_SL.R.transpose() * normal_of(shape.kind, shape.size, shape.X_SL.p + t * direction);
  }
  return hit;
}

}  // namespace arex::sim
