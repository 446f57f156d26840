#include "physics/triangle_tree.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "worlds/triangle.h"

namespace arex::sim {
namespace {

constexpr std::uint32_t kLeaf = 4;  // triangles
constexpr std::size_t kDeepest = 64;

float squared_distance(const Eigen::AlignedBox3f& box, const Vec3f& p) {
  return (box.min() - p).cwiseMax(p - box.max()).cwiseMax(0.0F).squaredNorm();
}

}  // namespace

TriangleTree::TriangleTree(const worlds::World& world) : mesh_(world.mesh) {
  std::vector<Vec3f> centroids;
  for (std::uint32_t t = 0; t < mesh_.triangles.size(); ++t) {
    if (!world.objects[mesh_.object_of_triangle[t]].felt) continue;
    order_.push_back(t);
  }
  if (order_.empty()) return;
  order_.shrink_to_fit();
  centroids.resize(mesh_.triangles.size());
  for (const std::uint32_t t : order_) centroids[t] = box_of(t).center();
  nodes_.reserve(order_.size());
  nodes_.emplace_back();
  split(0, 0, static_cast<std::uint32_t>(order_.size()), centroids);
  nodes_.shrink_to_fit();
}

Eigen::AlignedBox3f TriangleTree::box_of(std::uint32_t triangle) const {
  Eigen::AlignedBox3f box;
  for (const std::uint32_t corner : mesh_.triangles[triangle]) box.extend(mesh_.vertices[corner]);
  return box;
}

void TriangleTree::split(std::uint32_t node, std::uint32_t first, std::uint32_t last,
                         const std::vector<Vec3f>& centroids) {
  Eigen::AlignedBox3f box, middles;
  for (std::uint32_t i = first; i < last; ++i) {
    box.extend(box_of(order_[i]));
    middles.extend(centroids[order_[i]]);
  }
  nodes_[node].box = box;
  if (last - first <= kLeaf) {
    nodes_[node].first = first;
    nodes_[node].count = last - first;
    return;
  }
  Eigen::Index axis = 0;
  middles.sizes().maxCoeff(&axis);
  const std::uint32_t half = first + (last - first) / 2;
  // Ties fall by index, so that the two halves are the same on every host.
  std::nth_element(order_.begin() + first, order_.begin() + half, order_.begin() + last,
                   [&](std::uint32_t a, std::uint32_t b) {
                     return std::pair(centroids[a][axis], a) < std::pair(centroids[b][axis], b);
                   });
  const auto children = static_cast<std::uint32_t>(nodes_.size());
  nodes_[node].first = children;
  nodes_.emplace_back();
  nodes_.emplace_back();
  split(children, first, half, centroids);
  split(children + 1, half, last, centroids);
}

void TriangleTree::find(const Eigen::AlignedBox3f& box, std::vector<std::uint32_t>& out) const {
  out.clear();
  if (empty()) return;
  std::array<std::uint32_t, kDeepest> open;
  std::size_t count = 0;
  open[count++] = 0;
  while (count > 0) {
    const Node& node = nodes_[open[--count]];
    if (!node.box.intersects(box)) continue;
    if (node.count == 0) {
      open[count++] = node.first;
      open[count++] = node.first + 1;
      continue;
    }
    for (std::uint32_t i = node.first; i < node.first + node.count; ++i) {
      if (box_of(order_[i]).intersects(box)) out.push_back(order_[i]);
    }
  }
}

double TriangleTree::distance(const Vec3& point, double max_m) const {
  if (empty()) return max_m;
  const Vec3f p = point.cast<float>();
  double best = max_m;
  // Boxes are compared in single precision: a little farther, so that none is missed.
  const auto near = [&](std::uint32_t node) {
    const auto reach = static_cast<float>(best * 1.0001 + 1e-4);
    return squared_distance(nodes_[node].box, p) <= reach * reach;
  };
  std::array<std::uint32_t, kDeepest> open;
  std::size_t count = 0;
  open[count++] = 0;
  while (count > 0) {
    const std::uint32_t id = open[--count];
    if (!near(id)) continue;
    const Node& node = nodes_[id];
    if (node.count == 0) {
      const bool second_is_nearer = squared_distance(nodes_[node.first + 1].box, p) <
                                    squared_distance(nodes_[node.first].box, p);
      open[count++] = node.first + (second_is_nearer ? 0 : 1);
      open[count++] = node.first + (second_is_nearer ? 1 : 0);
      continue;
    }
    for (std::uint32_t i = node.first; i < node.first + node.count; ++i) {
      const auto& [a, b, c] = mesh_.triangles[order_[i]];
      const Vec3 nearest = worlds::nearest_on_triangle(point, mesh_.vertices[a].cast<double>(),
                                                       mesh_.vertices[b].cast<double>(),
                                                       mesh_.vertices[c].cast<double>());
      best = std::min(best, (nearest - point).norm());
    }
  }
  return best;
}

}  // namespace arex::sim
