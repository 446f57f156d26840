#include "physics/mesh_contact.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <optional>

#include "worlds/triangle.h"

namespace arex::sim {
namespace {

using worlds::CollisionShape;

constexpr double kRounding = 0.004;  // of edges and rims, m
constexpr int kRimPoints = 16;
constexpr double kSame = 1e-6;        // m: one place
constexpr double kOneContact = 1e-3;  // m: two places of a shape that one contact stands for
constexpr double kBack = 1e-6;        // share of the way that the middle keeps off a triangle
constexpr double kNone = std::numeric_limits<double>::infinity();

/// Where along the segment from a to b it passes through a triangle, as a share of its length;
/// kNone where it does not. Edges belong to the triangle.
double crossing(const Vec3& a, const Vec3& b, const std::array<Vec3, 3>& v, const Vec3& normal) {
  const double from = normal.dot(a - v[0]), to = normal.dot(b - v[0]);
  if ((from > 0) == (to > 0) || from == to) return kNone;
  const double share = from / (from - to);
  const Vec3 p = a + share * (b - a);
  for (std::size_t i = 0; i < 3; ++i) {
    const Vec3 edge = v[(i + 1) % 3] - v[i];
    if (normal.dot(edge.cross(p - v[i])) < -1e-9 * edge.norm()) return kNone;
  }
  return share;
}

/// Shares along two segments at their nearest points.
/// Source: Ericson, Real-Time Collision Detection, 2005, section 5.1.9.
std::array<double, 2> nearest_shares(const Vec3& p1, const Vec3& q1, const Vec3& p2,
                                     const Vec3& q2) {
  const Vec3 d1 = q1 - p1, d2 = q2 - p2, r = p1 - p2;
  const double a = d1.squaredNorm(), e = d2.squaredNorm(), f = d2.dot(r), c = d1.dot(r);
  const double b = d1.dot(d2), denominator = a * e - b * b;
  double s = denominator > 0 ? std::clamp((b * f - c * e) / denominator, 0.0, 1.0) : 0.0;
  double t = (b * s + f) / e;
  if (t < 0 || t > 1) {
    t = std::clamp(t, 0.0, 1.0);
    s = std::clamp((b * t - c) / a, 0.0, 1.0);
  }
  return {s, t};
}

void add_rim(std::vector<Vec3>& points, std::vector<std::array<std::uint32_t, 2>>& edges,
             const Pose& X_BS, double radius, double z) {
  const auto first = static_cast<std::uint32_t>(points.size());
  for (std::uint32_t i = 0; i < kRimPoints; ++i) {
    const double angle = 2 * std::numbers::pi * i / kRimPoints;
    points.push_back(X_BS * Vec3(radius * std::cos(angle), radius * std::sin(angle), z));
    edges.push_back({first + i, first + (i + 1) % kRimPoints});
  }
}

}  // namespace

MeshContacts::MeshContacts(const worlds::World& world, const std::vector<CollisionShape>& airframe)
    : world_(world), airframe_(airframe), tree_(world) {
  for (const CollisionShape& shape : airframe) skeletons_.push_back(skeleton_of(shape));
}

MeshContacts::Skeleton MeshContacts::skeleton_of(const CollisionShape& shape) {
  Skeleton out;
  out.centre_B = shape.X_WS.p;
  out.axis_B = shape.X_WS.R.col(2);
  out.root_B = shape.X_WS.p;
  const double radius = shape.size.x(), half = shape.size.y();
  switch (shape.kind) {
    case CollisionShape::Kind::kCapsule:
      out.radius_m = radius;
      out.points_B = {shape.X_WS * Vec3(0, 0, -half), shape.X_WS * Vec3(0, 0, half)};
      out.edges = {{0, 1}};
      out.root_B = out.points_B[out.points_B[0].norm() < out.points_B[1].norm() ? 0 : 1];
      break;
    case CollisionShape::Kind::kBox: {
      out.radius_m = std::min(kRounding, 0.5 * shape.size.minCoeff());
      const Vec3 core = shape.size.array() - out.radius_m;
      for (std::uint32_t i = 0; i < 8; ++i) {
        const Vec3 corner(i & 1 ? core.x() : -core.x(), i & 2 ? core.y() : -core.y(),
                          i & 4 ? core.z() : -core.z());
        out.points_B.push_back(shape.X_WS * corner);
        for (const std::uint32_t bit : {1U, 2U, 4U}) {
          if ((i & bit) == 0) out.edges.push_back({i, i | bit});
        }
      }
      break;
    }
    case CollisionShape::Kind::kCylinder:
      out.radius_m = std::min(kRounding, half);
      out.is_disc = true;
      out.rim_m = radius - out.radius_m;
      out.half_m = half - out.radius_m;
      if (out.half_m > 0.5 * kRounding) {
        add_rim(out.points_B, out.edges, shape.X_WS, out.rim_m, -out.half_m);
        add_rim(out.points_B, out.edges, shape.X_WS, out.rim_m, out.half_m);
      } else {
        out.radius_m = half;
        out.rim_m = radius - half;
        out.half_m = 0;
        add_rim(out.points_B, out.edges, shape.X_WS, out.rim_m, 0);
      }
      break;
  }
  return out;
}

std::span<const MeshTouch> MeshContacts::find(const Pose& X_WB) {
  touches_.clear();
  if (tree_.empty()) return {};
  follow_middle(X_WB.p);
  for (std::uint32_t shape = 0; shape < skeletons_.size(); ++shape) touch(shape, X_WB);
  keep_deepest();
  return touches_;
}

// Up to the first triangle in its way, and no further until the vehicle comes back.
void MeshContacts::follow_middle(const Vec3& p_WB) {
  Eigen::AlignedBox3d box(middle_);
  box.extend(p_WB);
  gather(box);
  double first = kNone;
  for (const Face& face : faces_) {
    first = std::min(first, crossing(middle_, p_WB, face.corners, face.normal));
  }
  held_ = first != kNone;
  if (!held_) {
    middle_ = p_WB;
  } else {
    const double length = (p_WB - middle_).norm();
    middle_ += std::max(0.0, first - kBack / std::max(length, kBack)) * (p_WB - middle_);
  }
}

void MeshContacts::gather(const Eigen::AlignedBox3d& box) {
  const Vec3f slack = Vec3f::Constant(1e-4F);
  tree_.find({box.min().cast<float>() - slack, box.max().cast<float>() + slack}, found_);
  faces_.resize(found_.size());
  for (std::size_t i = 0; i < found_.size(); ++i) {
    Face& face = faces_[i];
    face.triangle = found_[i];
    const auto& corners = world_.mesh.triangles[found_[i]];
    face.box.setEmpty();
    for (std::size_t k = 0; k < 3; ++k) {
      face.corners[k] = world_.mesh.vertices[corners[k]].cast<double>();
      face.box.extend(face.corners[k]);
    }
    face.normal =
        (face.corners[1] - face.corners[0]).cross(face.corners[2] - face.corners[0]).normalized();
  }
}

void MeshContacts::touch(std::uint32_t shape, const Pose& X_WB) {
  const Skeleton& skeleton = skeletons_[shape];
  Eigen::AlignedBox3d box(middle_);
  points_W_.clear();
  for (const Vec3& p_B : skeleton.points_B) {
    points_W_.push_back(X_WB * p_B);
    box.extend(points_W_.back());
  }
  const double bulge =
      skeleton.radius_m + skeleton.rim_m * (1 - std::cos(std::numbers::pi / kRimPoints));
  box.min().array() -= bulge;
  box.max().array() += bulge;
  gather(box);
  if (faces_.empty()) return;
  first_of_shape_ = touches_.size();
  root_W_ = X_WB * skeleton.root_B;
  wall_of_root_ = first_between(middle_, root_W_);
  behind_.resize(points_W_.size());
  for (std::size_t i = 0; i < points_W_.size(); ++i) {
    behind_[i] = touch_point(shape, points_W_[i]);
  }
  if (skeleton.is_disc) touch_rim(shape, X_WB);
  for (const auto& [a, b] : skeleton.edges) {
    // Beyond a surface the nearest points tell the wrong side; its ends hold it back already.
    if (!behind_[a] && !behind_[b]) touch_edge(shape, points_W_[a], points_W_[b]);
  }
  if (touches_.size() == first_of_shape_) touch_corners(shape, X_WB);
}

const MeshContacts::Face* MeshContacts::first_between(const Vec3& a, const Vec3& b) const {
  double first = kNone;
  const Face* found = nullptr;
  for (const Face& face : faces_) {
    const double share = crossing(a, b, face.corners, face.normal);
    if (share >= first) continue;
    first = share;
    found = &face;
  }
  return found;
}

bool MeshContacts::touch_point(std::uint32_t shape, const Vec3& p) {
  const double radius = skeletons_[shape].radius_m;
  // Behind a wall already, a root holds nothing back itself.
  const bool root_is_behind = wall_of_root_ != nullptr;
  const Face* wall = root_is_behind ? wall_of_root_ : first_between(root_W_, p);
  if (wall != nullptr) {
    const Vec3& before = root_is_behind ? middle_ : root_W_;
    const double side = wall->normal.dot(before - wall->corners[0]);
    const Vec3 normal = side > 0 ? wall->normal : Vec3(-wall->normal);
    const double below = -normal.dot(p - wall->corners[0]);
    if (below > -radius) {
      add({shape, wall->triangle, p + 0.5 * (below - radius) * normal, normal, radius + below});
    }
    return true;
  }
  for (const Face& face : faces_) {
    if (((face.box.min() - p).array() > radius).any() ||
        ((p - face.box.max()).array() > radius).any()) {
      continue;
    }
    const Vec3 q =
        worlds::nearest_on_triangle(p, face.corners[0], face.corners[1], face.corners[2]);
    const double distance = (p - q).norm();
    if (!(distance < radius) || distance == 0) continue;
    if (!is_nearest(p, q, distance)) continue;
    const Vec3 normal = (p - q) / distance;
    add({shape, face.triangle, q + 0.5 * (distance - radius) * normal, normal, radius - distance});
  }
  return false;
}

// The rim's point that lies deepest behind a triangle is seldom one of the polygon's.
void MeshContacts::touch_rim(std::uint32_t shape, const Pose& X_WB) {
  const Skeleton& skeleton = skeletons_[shape];
  const Vec3 axis = X_WB.R * skeleton.axis_B;
  const Vec3& before = wall_of_root_ != nullptr ? middle_ : root_W_;
  for (const Face& face : faces_) {
    const double side = face.normal.dot(before - face.corners[0]);
    const Vec3 into = side > 0 ? Vec3(-face.normal) : face.normal;
    const Vec3 radial = into - into.dot(axis) * axis;
    if (radial.norm() < 1e-3) continue;  // lies flat on it: the polygon will do
    const Vec3 p = X_WB * skeleton.centre_B + skeleton.rim_m * radial.normalized() +
                   std::copysign(skeleton.half_m, into.dot(axis)) * axis;
    if (into.dot(p - face.corners[0]) > -skeleton.radius_m) touch_point(shape, p);
  }
}

void MeshContacts::touch_edge(std::uint32_t shape, const Vec3& a, const Vec3& b) {
  const double radius = skeletons_[shape].radius_m;
  const Vec3 low = a.cwiseMin(b).array() - radius, high = a.cwiseMax(b).array() + radius;
  for (const Face& face : faces_) {
    if ((face.box.min().array() > high.array()).any() ||
        (face.box.max().array() < low.array()).any()) {
      continue;
    }
    for (std::size_t i = 0; i < 3; ++i) {
      const Vec3 &c = face.corners[i], &d = face.corners[(i + 1) % 3];
      const auto [s, t] = nearest_shares(a, b, c, d);
      if (s <= 0 || s >= 1) continue;  // its ends are points of the skeleton
      const Vec3 p = a + s * (b - a), q = c + t * (d - c);
      const double distance = (p - q).norm();
      if (!(distance < radius) || distance == 0) continue;
      if (!is_nearest(p, q, distance)) continue;
      const double depth = radius - distance;
      const Vec3 normal = (p - q) / distance;
      add({shape, face.triangle, q - 0.5 * depth * normal, normal, depth});
    }
  }
}

// A spike that goes into a box or a disc between its edges.
void MeshContacts::touch_corners(std::uint32_t shape, const Pose& X_WB) {
  const CollisionShape& solid = airframe_[shape];
  if (solid.kind == CollisionShape::Kind::kCapsule) return;
  const Pose X_WS = X_WB * solid.X_WS;
  for (const Face& face : faces_) {
    for (const Vec3& corner : face.corners) {
      const Vec3 p = X_WS.R.transpose() * (corner - X_WS.p);
      Vec3 beyond;  // how far within each pair of sides
      Vec3 out;
      if (solid.kind == CollisionShape::Kind::kBox) {
        beyond = solid.size - p.cwiseAbs();
        if (beyond.minCoeff() <= 0) continue;
        Eigen::Index axis = 0;
        beyond.minCoeff(&axis);
        out = Vec3::Zero();
        out[axis] = std::copysign(1.0, p[axis]);
      } else {
        const double radial = solid.size.x() - p.head<2>().norm();
        const double axial = solid.size.y() - std::abs(p.z());
        if (radial <= 0 || axial <= 0) continue;
        beyond = Vec3::Constant(std::min(radial, axial));
        out = radial < axial ? Vec3(p.x(), p.y(), 0).normalized()
                             : Vec3(0, 0, std::copysign(1.0, p.z()));
      }
      const Vec3 normal = -(X_WS.R * out);
      add({shape, face.triangle, corner - 0.5 * beyond.minCoeff() * normal, normal,
           beyond.minCoeff()});
    }
  }
}

// Not nearest: another triangle that holds the same place comes closer elsewhere. So the edges
// within a surface, flat or hollow, are left to the triangles beside them.
bool MeshContacts::is_nearest(const Vec3& on_skeleton, const Vec3& on_face, double distance) const {
  const Vec3 slack = Vec3::Constant(kSame);
  for (const Face& face : faces_) {
    if (!face.box.intersects({on_face - slack, on_face + slack})) continue;
    const auto& [a, b, c] = face.corners;
    if ((worlds::nearest_on_triangle(on_face, a, b, c) - on_face).norm() > kSame) continue;
    const Vec3 nearer = worlds::nearest_on_triangle(on_skeleton, a, b, c);
    if ((nearer - on_skeleton).norm() < distance - kSame) return false;
  }
  return true;
}

// Two triangles that share the place, or the rim's deepest point beside a point of the polygon.
void MeshContacts::add(const MeshTouch& touch) {
  for (std::size_t i = first_of_shape_; i < touches_.size(); ++i) {
    MeshTouch& other = touches_[i];
    if ((other.p_W - touch.p_W).norm() < kOneContact &&
        other.normal_W.dot(touch.normal_W) > 0.999) {
      if (touch.depth_m > other.depth_m) other = touch;
      return;
    }
  }
  touches_.push_back(touch);
}

void MeshContacts::keep_deepest() {
  if (touches_.size() <= kMost) return;
  std::stable_sort(touches_.begin(), touches_.end(),
                   [](const MeshTouch& a, const MeshTouch& b) { return a.depth_m > b.depth_m; });
  touches_.resize(kMost);
  std::stable_sort(touches_.begin(), touches_.end(),
                   [](const MeshTouch& a, const MeshTouch& b) { return a.shape < b.shape; });
}

}  // namespace arex::sim
