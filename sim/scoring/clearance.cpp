#include "scoring/clearance.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace arex::sim {
namespace {

using worlds::CollisionShape;

constexpr double kRounding = 1e-4;  ///< far above that of the search, m

// Points on a shape's hull in its own frame: corners of boxes, two rims of cylinders and capsules.
std::vector<Vec3> hull_points(const CollisionShape& shape) {
  constexpr int kRimPoints = 12;
  std::vector<Vec3> points;
  if (shape.kind == CollisionShape::Kind::kBox) {
    for (int corner = 0; corner < 8; ++corner) {
      points.emplace_back(corner & 1 ? shape.size.x() : -shape.size.x(),
                          corner & 2 ? shape.size.y() : -shape.size.y(),
                          corner & 4 ? shape.size.z() : -shape.size.z());
    }
    return points;
  }
  const double radius = shape.size.x();
  for (const double z : {-shape.size.y(), shape.size.y()}) {
    for (int i = 0; i < kRimPoints; ++i) {
      const double angle = 2 * std::numbers::pi * i / kRimPoints;
      points.emplace_back(radius * std::cos(angle), radius * std::sin(angle), z);
    }
    if (shape.kind == CollisionShape::Kind::kCapsule) {
      points.emplace_back(0, 0, z + std::copysign(radius, z));
    }
  }
  return points;
}

}  // namespace

ClearanceMeter::ClearanceMeter(const Scene& scene, const Airframe& airframe) : scene_(scene) {
  for (const CollisionShape& shape : airframe.shapes) {
    for (const Vec3& p : hull_points(shape)) points_B_.push_back(shape.X_WS * p);
  }
}

double ClearanceMeter::measure(const Truth& truth, double max_m) {
  // It grows by no more than the points have moved: that bounds the search.
  double clearance = max_m;
  if (!samples_.empty() && samples_.back() < max_m) {
    double moved2 = 0;
    for (const Vec3& p_B : points_B_) {
      moved2 = std::max(moved2, (truth.X_WB * p_B - X_WB_ * p_B).squaredNorm());
    }
    clearance = std::min(max_m, samples_.back() + std::sqrt(moved2) + kRounding);
  }
  for (const Vec3& p_B : points_B_) {
    clearance = scene_.distance_to_surface(truth.X_WB * p_B, clearance);
  }
  X_WB_ = truth.X_WB;
  samples_.push_back(clearance);
  return clearance;
}

double ClearanceMeter::distance(const Pose& X_WB, worlds::ClassSet classes, double max_m) const {
  for (const Vec3& p_B : points_B_) max_m = scene_.distance_to_surface(X_WB * p_B, max_m, classes);
  return max_m;
}

ClearanceMeter::Statistics ClearanceMeter::statistics() const {
  if (samples_.empty()) return {};
  std::vector<double> sorted = samples_;
  const auto p05 = sorted.begin() + static_cast<std::ptrdiff_t>(sorted.size() / 20);
  std::nth_element(sorted.begin(), p05, sorted.end());
  return {*std::min_element(sorted.begin(), p05 + 1), *p05, samples_.size()};
}

void add_figures(const ClearanceMeter::Statistics& clearance, Figures& figures) {
  figures.set("clearance.min_m", clearance.min_m);
  figures.set("clearance.p05_m", clearance.p05_m);
}

}  // namespace arex::sim
