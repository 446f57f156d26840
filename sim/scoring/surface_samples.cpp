#include "scoring/surface_samples.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <unordered_set>

#include "math/random.h"
#include "scoring/map_error.h"

namespace arex::sim {
namespace {

using worlds::Bounds;
using worlds::SurfaceClass;
using worlds::World;
using Corners = std::array<Vec3, 3>;

constexpr double kGroundCell = 0.5;   // m
constexpr double kBelowGround = 0.3;  // roots and kerbs reach this far below their ground, m

bool is_ground(SurfaceClass c) {
  return c == SurfaceClass::kGround || c == SurfaceClass::kFloor || c == SurfaceClass::kRamp;
}

Corners corners_of(const World& world, std::size_t t) {
  Corners v;
  for (std::size_t i = 0; i < 3; ++i) {
    v[i] = world.mesh.vertices[world.mesh.triangles[t][i]].cast<double>();
  }
  return v;
}

/// The heights of the ground near a point; more than one where storeys lie above each other.
class Ground {
 public:
  Ground(const World& world, const Bounds& region) : low_(region.low.head<2>()) {
    const Vec2 cells = (region.high - region.low).head<2>() / kGroundCell;
    width_ = std::max(1, static_cast<int>(std::ceil(cells.x())));
    height_ = std::max(1, static_cast<int>(std::ceil(cells.y())));
    levels_.resize(static_cast<std::size_t>(width_) * static_cast<std::size_t>(height_));
    for (std::size_t t = 0; t < world.mesh.triangles.size(); ++t) {
      if (is_ground(world.class_of_triangle(t))) add(corners_of(world, t));
    }
  }

  [[nodiscard]] bool within(const Vec3& p, double height) const {
    const int x = static_cast<int>(std::floor((p.x() - low_.x()) / kGroundCell));
    const int y = static_cast<int>(std::floor((p.y() - low_.y()) / kGroundCell));
    if (x < 0 || y < 0 || x >= width_ || y >= height_) return false;
    return std::ranges::any_of(levels_[index(x, y)], [&](float level) {
      const double above = p.z() - static_cast<double>(level);
      return above >= -kBelowGround && above <= height;
    });
  }

 private:
  [[nodiscard]] std::size_t index(int x, int y) const {
    return static_cast<std::size_t>(y) * static_cast<std::size_t>(width_) +
           static_cast<std::size_t>(x);
  }

  // To every cell whose middle lies within a cell's side of the triangle, its height there.
  void add(const Corners& v) {
    const Vec3 normal = (v[1] - v[0]).cross(v[2] - v[0]).normalized();
    constexpr double kSteep = 0.3;  // the sides of slabs are no ground
    if (!(std::abs(normal.z()) > kSteep)) return;
    const Vec3 low = v[0].cwiseMin(v[1]).cwiseMin(v[2]);
    const Vec3 high = v[0].cwiseMax(v[1]).cwiseMax(v[2]);
    const auto cell = [&](double value, int axis, double slack) {
      return static_cast<int>(std::floor((value - low_[axis]) / kGroundCell + slack));
    };
    for (int y = std::max(0, cell(low.y(), 1, -1));
         y <= std::min(height_ - 1, cell(high.y(), 1, 1)); ++y) {
      for (int x = std::max(0, cell(low.x(), 0, -1));
           x <= std::min(width_ - 1, cell(high.x(), 0, 1)); ++x) {
        const Vec2 c = low_ + kGroundCell * Vec2(x + 0.5, y + 0.5);
        bool near = true;
        for (std::size_t e = 0; e < 3; ++e) {
          const Vec2 a = v[e].head<2>();
          const Vec2 edge = v[(e + 1) % 3].head<2>() - a;
          const double side = edge.x() * (c.y() - a.y()) - edge.y() * (c.x() - a.x());
          near &= std::copysign(side, side * normal.z()) >= -kGroundCell * edge.norm();
        }
        if (!near) continue;
        const double z = v[0].z() - normal.head<2>().dot(c - v[0].head<2>()) / normal.z();
        const auto level = static_cast<float>(std::clamp(z, low.z(), high.z()));
        auto& levels = levels_[index(x, y)];
        // Coarser than a slab is thick would confuse storeys; finer only costs memory.
        constexpr float kSame = 0.02F;
        if (std::ranges::none_of(levels, [&](float l) { return std::abs(l - level) < kSame; })) {
          levels.push_back(level);
        }
      }
    }
  }

  Vec2 low_;
  int width_ = 0;
  int height_ = 0;
  std::vector<std::vector<float>> levels_;
};

}  // namespace

std::vector<SurfaceSample> sample_surfaces(const World& world, const Bounds& region_W,
                                           const SurfaceSampleConfig& config) {
  const Ground ground(world, region_W);
  std::vector<SurfaceSample> samples;
  RandomStream random(0, "surface_samples");
  double area_before = 0;  // of the triangles so far, in samples
  double next = random.uniform();
  std::size_t stratum = 0;
  for (std::size_t t = 0; t < world.mesh.triangles.size(); ++t) {
    const SurfaceClass surface_class = world.class_of_triangle(t);
    if (!kWithoutFoliage.contains(surface_class)) continue;
    const Corners v = corners_of(world, t);
    const Vec3 cross = (v[1] - v[0]).cross(v[2] - v[0]);
    const double area_after = area_before + 0.5 * cross.norm() / config.sample_area_m2;
    if (next < area_after) {
      const Vec3f normal = cross.normalized().cast<float>();
      double u = random.uniform();
      double w = random.uniform();
      for (; next < area_after; next = static_cast<double>(++stratum) + random.uniform()) {
        // The unit square folded onto the triangle.
        const bool folded = u + w > 1;
        const double a = folded ? 1 - u : u;
        const double b = folded ? 1 - w : w;
        const Vec3 p = v[0] + a * (v[1] - v[0]) + b * (v[2] - v[0]);
        if (region_W.contains(p) && ground.within(p, config.sample_height_m)) {
          samples.push_back({p.cast<float>(), normal, surface_class});
        }
        u += 0.7548776662466927;  // 1 / plastic number
        w += 0.5698402909980532;  // and its square
        u -= std::floor(u);
        w -= std::floor(w);
      }
    }
    area_before = area_after;
  }
  return samples;
}

std::vector<Vec3f> one_per_cube(const std::vector<SurfaceSample>& samples, double edge_m) {
  constexpr int kBits = 21;  // of each coordinate in a key; worlds are smaller than 50 km
  constexpr std::int64_t kMiddle = std::int64_t{1} << (kBits - 1);
  std::unordered_set<std::uint64_t> taken;
  std::vector<Vec3f> points;
  for (const SurfaceSample& sample : samples) {
    std::uint64_t key = 0;
    for (int axis = 0; axis < 3; ++axis) {
      const double cell = std::floor(static_cast<double>(sample.p_W[axis]) / edge_m);
      key = key << kBits | static_cast<std::uint64_t>(static_cast<std::int64_t>(cell) + kMiddle);
    }
    if (taken.insert(key).second) points.push_back(sample.p_W);
  }
  return points;
}

}  // namespace arex::sim
