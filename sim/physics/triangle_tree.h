#pragma once

#include <cstdint>
#include <vector>

#include "worlds/world.h"

namespace arex::sim {

/// Which of a mesh's felt triangles are near: a tree of boxes over them, the same on every host.
class TriangleTree {
 public:
  /// @param world must outlive this object
  explicit TriangleTree(const worlds::World& world);

  [[nodiscard]] bool empty() const { return order_.empty(); }

  /// The triangles whose boxes touch this one, in no particular order but always the same.
  void find(const Eigen::AlignedBox3f& box, std::vector<std::uint32_t>& out) const;

  /// Distance from a point to the nearest triangle, m; `max_m` where none is nearer.
  [[nodiscard]] double distance(const Vec3& point, double max_m) const;

 private:
  /// A leaf holds order_[first, first + count); an inner node (count 0) has its children at `first`
  /// and `first` + 1.
  struct Node {
    Eigen::AlignedBox3f box;
    std::uint32_t first = 0;
    std::uint32_t count = 0;
  };

  void split(std::uint32_t node, std::uint32_t first, std::uint32_t last,
             const std::vector<Vec3f>& centroids);
  [[nodiscard]] Eigen::AlignedBox3f box_of(std::uint32_t triangle) const;

  const worlds::Mesh& mesh_;
  std::vector<Node> nodes_;
  std::vector<std::uint32_t> order_;
};

}  // namespace arex::sim
