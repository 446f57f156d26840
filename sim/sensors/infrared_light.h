#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "sensors/eight.h"
#include "sensors/infrared_config.h"
#include "sensors/infrared_lamps.h"
#include "sensors/infrared_sun.h"
#include "sensors/scene.h"
#include "worlds/world.h"

namespace arex::sim {

/// The light that does not come straight from the sun: sky, lamps, and what surfaces send on. Held
/// at the nodes of a grid as the illuminance of six small surfaces that face along the axes,
/// computed once by rays.
/// Source of the six faces: McTaggart, Half-Life 2 / Valve Source Shading, GDC 2004 (ambient cube).
class LightGrid {
 public:
  /// @param lamps those that are lit
  LightGrid(const InfraredLightConfig& light, const worlds::World& world, const Scene& scene,
            const SunMap& sun, const std::vector<Lamp>& lamps);

  /// How much each face counts for a surface of unit normal n: +x, -x, +y, -y, +z, -z, 0, 0.
  static Float8 weights(const Vec3f& n) {
    const auto up = [](float c) { return c > 0 ? c * c : 0.0F; };
    return Float8{up(n.x()), up(-n.x()), up(n.y()), up(-n.y()), up(n.z()), up(-n.z()), 0, 0};
  }
  /// Illuminance of the six faces at a point in W, lx; between nodes linear along each axis,
  /// outside of the grid that of its border.
  [[nodiscard]] Float8 at(const Vec3f& p_W) const {
    const auto [x, fx] = cell(p_W.x(), 0);
    const auto [y, fy] = cell(p_W.y(), 1);
    const auto [z, fz] = cell(p_W.z(), 2);
    return between((z * rows() + y) * row() + x, fx, fy, fz);
  }
  /// Of a surface and of its other side, lx.
  template <class Number>
  struct Sides {
    Number near, far;
  };
  /// That of unit normal n at p: sums of at() by the weights() of n and of -n.
  [[nodiscard]] Sides<float> sides(const Vec3f& p_W, const Vec3f& n) const {
    const Float8 faces = at(p_W);
    // One face of each axis counts, the other one on the other side.
    const int x = n.x() > 0 ? 0 : 1, y = n.y() > 0 ? 2 : 3, z = n.z() > 0 ? 4 : 5;
    const Vec3f w = n.cwiseProduct(n);
    return {(w.x() * faces[x] + w.y() * faces[y]) + w.z() * faces[z],
            (w.x() * faces[x ^ 1] + w.y() * faces[y ^ 1]) + w.z() * faces[z ^ 1]};
  }
  /// The same of eight surfaces, by their coordinates. @param with_far otherwise it is 0
  [[nodiscard]] Sides<Float8> sides(const std::array<Float8, 3>& p_W,
                                    const std::array<Float8, 3>& n, bool with_far) const {
    const auto [x, fx] = cells(p_W[0], 0);
    const auto [y, fy] = cells(p_W[1], 1);
    const auto [z, fz] = cells(p_W[2], 2);
    const Int8 node = (z * count_[1] + y) * count_[0] + x;
    std::array<Float8, 8> faces;
    for (int i = 0; i < 8; ++i) {
      faces[static_cast<std::size_t>(i)] =
          between(static_cast<std::size_t>(node[i]), fx[i], fy[i], fz[i]);
    }
    const Int8 of_lane{0, 8, 16, 24, 32, 40, 48, 56};
    const auto* from = reinterpret_cast<const float*>(faces.data());
    std::array<Int8, 3> side;
    std::array<Float8, 3> weight;
    for (std::size_t i = 0; i < 3; ++i) {
      side[i] = n[i] > 0 ? Int8{} : Int8{} + 1;
      weight[i] = n[i] * n[i];
    }
    const auto sum_of = [&](std::int32_t turned) {
      std::array<Float8, 3> part;
      for (std::size_t i = 0; i < 3; ++i) {
        const Int8 first = of_lane + static_cast<std::int32_t>(2 * i);
        part[i] = weight[i] * gather(from, first + (side[i] ^ turned));
      }
      return (part[0] + part[1]) + part[2];
    };
    return {sum_of(0), with_far ? sum_of(1) : Float8{}};
  }
  /// Of a surface: illuminance, lx.
  static float sum(const Float8& faces, const Float8& surface) {
    const Float8 p = faces * surface;
    return ((p[0] + p[1]) + (p[2] + p[3])) + (p[4] + p[5]);
  }
  [[nodiscard]] double spacing_m() const { return spacing_; }
  [[nodiscard]] std::size_t nodes() const { return faces_.size(); }

 private:
  struct Cell {
    std::size_t index;
    float fraction;
  };
  [[nodiscard]] Cell cell(float p, std::size_t axis) const {
    const float most = static_cast<float>(count_[axis]) - 1.001F;
    const float x = std::min(most, std::max(0.0F, (p - origin_[axis]) * per_m_));
    const auto index = static_cast<std::size_t>(static_cast<int>(x));
    return {index, x - static_cast<float>(index)};
  }
  struct Cells {
    Int8 index;
    Float8 fraction;
  };
  [[nodiscard]] Cells cells(const Float8& p, std::size_t axis) const {
    const Float8 zero{}, most = zero + (static_cast<float>(count_[axis]) - 1.001F);
    const Float8 from_origin = (p - origin_[axis]) * per_m_;
    const Float8 inside = zero < from_origin ? from_origin : zero;
    const Float8 x = inside < most ? inside : most;
    const Int8 index = __builtin_convertvector(x, Int8);
    return {index, x - __builtin_convertvector(index, Float8)};
  }
  [[nodiscard]] std::size_t row() const { return static_cast<std::size_t>(count_[0]); }
  [[nodiscard]] std::size_t rows() const { return static_cast<std::size_t>(count_[1]); }
  /// Between the eight nodes from number `index` on, at fractions of a cell.
  [[nodiscard]] Float8 between(std::size_t index, float fx, float fy, float fz) const {
    const Float8* node = &faces_[index];
    const std::size_t layer = row() * rows();
    const auto along_x = [fx](const Float8* n) { return n[0] + fx * (n[1] - n[0]); };
    const auto along_y = [&](const Float8* n) {
      const Float8 near = along_x(n);
      return near + fy * (along_x(n + row()) - near);
    };
    const Float8 low = along_y(node);
    return low + fz * (along_y(node + layer) - low);
  }
  void place_nodes(const InfraredLightConfig& light, const worlds::World& world);
  [[nodiscard]] Vec3 node(std::size_t index) const;
  /// Which nodes light gets to from the start, from node to node.
  [[nodiscard]] std::vector<std::uint8_t> find_open(const worlds::World& world,
                                                    const Scene& scene) const;
  void fill(std::vector<std::uint8_t>& open);

  std::array<int, 3> count_{2, 2, 2};
  std::array<float, 3> origin_{};
  float per_m_ = 1;
  double spacing_ = 1;
  std::vector<Float8> faces_;
};

}  // namespace arex::sim
