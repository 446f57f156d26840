#include "worlds/file_voxels.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <unordered_map>

#include "config/config.h"

namespace arex::worlds {
namespace {

using Cell = Eigen::Vector3i;

constexpr double kMostCells = 4e8;

/// Occupied cells in a dense box, one byte each, with an empty rim of one cell.
struct VoxelBox {
  Cell first = Cell::Zero();  ///< of the box, in cells of the lattice
  Cell size = Cell::Zero();
  std::vector<std::uint8_t> occupied;

  [[nodiscard]] std::size_t index(const Cell& c) const {
    return (static_cast<std::size_t>(c.z()) * static_cast<std::size_t>(size.y()) +
            static_cast<std::size_t>(c.y())) *
               static_cast<std::size_t>(size.x()) +
           static_cast<std::size_t>(c.x());
  }
};

VoxelBox box_around(const Eigen::Matrix<std::int64_t, 3, 1>& low,
                    const Eigen::Matrix<std::int64_t, 3, 1>& high, double voxel_m) {
  const Eigen::Matrix<std::int64_t, 3, 1> size =
      (high - low).array() + std::int64_t{2};  // high is behind the last cell; the rim
  const double cells = size.cast<double>().prod();
  if (!(cells <= kMostCells)) {
    throw ConfigError(fmt::format(
        "spans {:.1e} cells of {:g} m, expected at most {:.0e}; see file.voxel_m, file.scale",
        cells, voxel_m, kMostCells));
  }
  VoxelBox box;
  box.first = (low.array() - std::int64_t{1}).cast<int>();
  box.size = size.cast<int>();
  box.occupied.assign(static_cast<std::size_t>(cells), 0);
  return box;
}

VoxelBox fill_from_octree(const FileScene& scene) {
  Eigen::Matrix<std::int64_t, 3, 1> low, high;
  low.setConstant(std::numeric_limits<std::int64_t>::max());
  high.setConstant(std::numeric_limits<std::int64_t>::min());
  for (const auto& [x, y, z, side] : scene.voxels) {
    const Eigen::Matrix<std::int64_t, 3, 1> corner(x, y, z);
    low = low.cwiseMin(corner);
    high = high.cwiseMax((corner.array() + std::int64_t{side}).matrix());
  }
  VoxelBox box = box_around(low, high, scene.voxel_m);
  for (const auto& [x, y, z, side] : scene.voxels) {
    const Cell corner = Cell(x, y, z) - box.first;
    for (int k = 0; k < side; ++k) {
      for (int j = 0; j < side; ++j) {
        const std::size_t row = box.index(corner + Cell(0, j, k));
        std::fill_n(box.occupied.begin() + static_cast<std::ptrdiff_t>(row), side, std::uint8_t{1});
      }
    }
  }
  return box;
}

VoxelBox fill_from_cloud(const FileScene& scene, double voxel_m, int least_points) {
  Vec3 low = scene.points.front(), high = low;
  for (const Vec3& p : scene.points) {
    low = low.cwiseMin(p);
    high = high.cwiseMax(p);
  }
  const auto cell_of = [&](const Vec3& p) -> Vec3 { return (p / voxel_m).array().floor(); };
  if (!(cell_of(low).cwiseAbs().maxCoeff() < 1e9 && cell_of(high).cwiseAbs().maxCoeff() < 1e9)) {
    throw ConfigError("has points farther away than any world reaches");
  }
  VoxelBox box = box_around(cell_of(low).cast<std::int64_t>(),
                            (cell_of(high).array() + 1).cast<std::int64_t>(), voxel_m);
  for (const Vec3& p : scene.points) {
    std::uint8_t& count = box.occupied[box.index(cell_of(p).cast<int>() - box.first)];
    if (count < 255) ++count;
  }
  for (std::uint8_t& count : box.occupied) count = count >= least_points;
  return box;
}

/// Covers the faces of one direction, slice by slice.
class FaceMesher {
 public:
  FaceMesher(const VoxelBox& box, double voxel_m, FileScene& scene)
      : box_(box), voxel_m_(voxel_m), scene_(scene) {}

  /// @param up whether the faces are those towards greater coordinates
  void cover(int axis, bool up, std::uint32_t group) {
    axis_ = axis;
    group_ = group;
    u_ = (axis + 1) % 3;
    v_ = (axis + 2) % 3;
    const int nu = box_.size[u_], nv = box_.size[v_];
    mask_.assign(static_cast<std::size_t>(nu) * static_cast<std::size_t>(nv), 0);
    const int step = up ? 1 : -1;
    for (int slice = 1; slice + 1 < box_.size[axis]; ++slice) {
      if (mark(slice, step)) sweep(slice + (up ? 1 : 0));
    }
  }

 private:
  [[nodiscard]] std::uint8_t& at(int u, int v) {
    return mask_[static_cast<std::size_t>(v) * static_cast<std::size_t>(box_.size[u_]) +
                 static_cast<std::size_t>(u)];
  }

  bool mark(int slice, int step) {
    bool any = false;
    Cell c;
    c[axis_] = slice;
    for (int v = 0; v < box_.size[v_]; ++v) {
      c[v_] = v;
      for (int u = 0; u < box_.size[u_]; ++u) {
        c[u_] = u;
        Cell beyond = c;
        beyond[axis_] += step;
        const bool face = box_.occupied[box_.index(c)] && !box_.occupied[box_.index(beyond)];
        at(u, v) = face;
        any |= face;
      }
    }
    return any;
  }

  void sweep(int plane) {
    for (int v = 0; v < box_.size[v_]; ++v) {
      for (int u = 0; u < box_.size[u_]; ++u) {
        if (!at(u, v)) continue;
        int width = 1, height = 1;
        while (u + width < box_.size[u_] && at(u + width, v)) ++width;
        const auto whole = [&](int row) {
          for (int k = 0; k < width; ++k) {
            if (!at(u + k, row)) return false;
          }
          return true;
        };
        while (v + height < box_.size[v_] && whole(v + height)) ++height;
        for (int row = v; row < v + height; ++row) {
          for (int k = 0; k < width; ++k) at(u + k, row) = 0;
        }
        add(plane, {u, v}, {u + width, v + height});
      }
    }
  }

  void add(int plane, const Eigen::Vector2i& low, const Eigen::Vector2i& high) {
    const auto first = static_cast<std::uint32_t>(scene_.vertices.size());
    for (const auto& [u, v] : {std::pair(low.x(), low.y()), std::pair(high.x(), low.y()),
                               std::pair(high.x(), high.y()), std::pair(low.x(), high.y())}) {
      Cell corner;
      corner[axis_] = plane;
      corner[u_] = u;
      corner[v_] = v;
      scene_.vertices.push_back(voxel_m_ * (corner + box_.first).cast<double>());
    }
    scene_.triangles.push_back({first, first + 1, first + 2});
    scene_.triangles.push_back({first, first + 2, first + 3});
    scene_.group_of_triangle.insert(scene_.group_of_triangle.end(), 2, group_);
  }

  const VoxelBox& box_;
  double voxel_m_;
  FileScene& scene_;
  int axis_ = 0, u_ = 0, v_ = 0;
  std::uint32_t group_ = 0;
  std::vector<std::uint8_t> mask_;
};

}  // namespace

void mesh_voxels(FileScene& scene, double voxel_m, int least_points) {
  if (scene.voxels.empty() && scene.points.empty()) return;
  const bool octree = !scene.voxels.empty();
  const double side = octree ? scene.voxel_m : voxel_m;
  const VoxelBox box =
      octree ? fill_from_octree(scene) : fill_from_cloud(scene, voxel_m, least_points);
  scene.voxels = {};
  scene.points = {};
  scene.voxel_m = side;
  const FileGroup group =
      scene.groups.empty() ? FileGroup{"voxels", "", "voxels"} : scene.groups[0];
  scene.groups.assign(1, group);
  FaceMesher mesher(box, side, scene);
  for (int axis = 0; axis < 3; ++axis) {
    mesher.cover(axis, true, 0);
    mesher.cover(axis, false, 0);
  }
}

}  // namespace arex::worlds
