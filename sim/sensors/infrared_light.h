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
    const auto row = static_cast<std::size_t>(count_[0]);
    const std::size_t layer = row * static_cast<std::size_t>(count_[1]);
    const Float8* node = &faces_[z * layer + y * row + x];
    const auto along_x = [fx = fx](const Float8* n) { return n[0] + fx * (n[1] - n[0]); };
    const auto along_y = [&, fy = fy](const Float8* n) {
      const Float8 near = along_x(n);
      return near + fy * (along_x(n + row) - near);
    };
    const Float8 low = along_y(node);
    return low + fz * (along_y(node + layer) - low);
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
