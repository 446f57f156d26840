#include "sensors/infrared_light.h"

#include <cmath>
#include <numbers>
#include <utility>

namespace arex::sim {
namespace {

constexpr int kRays = 32;                   // from each node
constexpr double kReach = 60;               // of a ray, m
constexpr std::size_t kMostNodes = 40'000;  // a second or two of rays
constexpr double kLeastSide = 1;            // of a world, m
constexpr int kMostAlong = 400;             // an axis
constexpr double kLeastLamp = 0.05;         // less of one lamp is not followed, lx
constexpr double kLampNearest = 1.0;        // a strip is no point: nearer counts as this, m
constexpr double kLampUp = 0.05;            // its intensity upwards, of that straight down
constexpr double kLampLevel = 0.25;         // and just below the level
constexpr double kMostSent = 0.8;           // retro-reflectors send little anywhere else
constexpr double kFurtherBounces = 1.35;  // 1 / (1 - albedo): light is followed for one bounce only
constexpr double kOutsideAlbedo = 0.25;   // of what lies outside of the world
constexpr double kPi = std::numbers::pi;

using Faces = std::array<double, 6>;

/// Evenly spread on the unit sphere, up and down alternating.
std::array<Vec3, kRays> sphere_directions() {
  std::array<Vec3, kRays> directions;
  const double golden = kPi * (3 - std::sqrt(5.0));
  for (int i = 0; i < kRays; ++i) {
    const double z = 1 - (2 * i + 1.0) / kRays, r = std::sqrt(1 - z * z);
    directions[static_cast<std::size_t>(i)] = {r * std::cos(golden * i), r * std::sin(golden * i),
                                               z};
  }
  return directions;
}

/// Light of `lux` from a direction, on the six faces.
void add_from(const Vec3& direction, double lux, Faces& faces) {
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const double c = direction[static_cast<Eigen::Index>(axis)];
    faces[2 * axis + (c > 0 ? 0 : 1)] += lux * std::abs(c);
  }
}

Float8 packed(const Faces& faces) {
  Float8 out{};
  for (int i = 0; i < 6; ++i) out[i] = static_cast<float>(faces[static_cast<std::size_t>(i)]);
  return out;
}

Eigen::AlignedBox3d bounds_of(const worlds::World& world) {
  Eigen::AlignedBox3d box;
  for (const Vec3f& vertex : world.mesh.vertices) box.extend(vertex.cast<double>());
  if (box.isEmpty()) box = Eigen::AlignedBox3d(Vec3::Zero(), Vec3::Zero());
  return {box.min(), box.min() + box.sizes().cwiseMax(kLeastSide)};
}

/// What the rays of one node met.
struct Surroundings {
  std::array<RayHit, kRays> hits;

  void look(const Scene& scene, const Vec3& from, const std::array<Vec3, kRays>& directions) {
    std::array<Ray, kRays> rays;
    for (std::size_t i = 0; i < kRays; ++i) {
      rays[i] = {from.cast<float>(), directions[i].cast<float>(), 0, static_cast<float>(kReach)};
    }
    scene.cast(rays, hits);
  }
};

/// Makes the light of the nodes of one grid.
class Baker {
 public:
  Baker(const InfraredLightConfig& light, const Scene& scene, const SunMap& sun,
        const std::vector<Lamp>& lamps)
      : scene_(scene), sun_(sun), lamps_(lamps), directions_(sphere_directions()) {
    sun_lx_ = light.sun ? light.sun_lx : 0;
    sky_ = light.sky_lx / kPi;  // a face that sees all of it gets sky_lx
    ground_ = kOutsideAlbedo * (light.sky_lx + sun_lx_ * std::sin(light.sun_elevation_rad)) / kPi;
    // Of flux F, over both half spaces: 2 pi (up + level + (1 - level) / 2) I = F.
    intensity_ = light.lamp_flux_lm / (kPi * (2 * kLampUp + 1 + kLampLevel));
  }

  /// From sky and lamps.
  void direct(const Vec3& p, Faces& faces) {
    around_.look(scene_, p, directions_);
    for (std::size_t i = 0; i < kRays; ++i) {
      if (around_.hits[i].valid()) continue;
      add_from(directions_[i], (directions_[i].z() > 0 ? sky_ : ground_) * kSolidAngle, faces);
    }
    for (const Lamp& lamp : lamps_) add_lamp(lamp, p, faces);
  }
  /// What the surfaces around send on of it, and of the sun.
  void indirect(const Vec3& p, const LightGrid& grid, Faces& faces) {
    around_.look(scene_, p, directions_);
    for (std::size_t i = 0; i < kRays; ++i) {
      const RayHit& hit = around_.hits[i];
      if (!hit.valid()) continue;
      const double albedo = std::min(static_cast<double>(hit.reflectivity), kMostSent);
      const double lux = illuminance(hit, p.cast<float>(), directions_[i].cast<float>(), grid);
      add_from(directions_[i], kFurtherBounces * albedo * lux / kPi * kSolidAngle, faces);
    }
  }

 private:
  static constexpr double kSolidAngle = 4 * kPi / kRays;

  void add_lamp(const Lamp& lamp, const Vec3& p, Faces& faces) const {
    const Vec3 to = lamp.centre_W - p;
    const double distance = to.norm();
    if (distance < 1e-3) return;
    const Vec3 direction = to / distance;
    const double down = direction.z();
    const double towards = down > 0 ? kLampLevel + (1 - kLampLevel) * down : kLampUp;
    const double far = std::max(distance, kLampNearest);
    const double lux = intensity_ * towards / (far * far);
    if (lux < kLeastLamp) return;
    // Its own box is not in its way.
    constexpr double kOwn = 0.2;
    if (distance > kOwn && scene_.cast(p, direction, distance - kOwn).valid()) return;
    add_from(direction, lux, faces);
  }
  [[nodiscard]] double illuminance(const RayHit& hit, const Vec3f& from, const Vec3f& direction,
                                   const LightGrid& grid) const {
    const Vec3f n = hit.normal_W.dot(direction) > 0 ? Vec3f(-hit.normal_W) : hit.normal_W;
    const Vec3f p = from + hit.distance_m * direction;
    const auto off = static_cast<float>(0.5 * grid.spacing_m());
    double lux = static_cast<double>(LightGrid::sum(grid.at(p + off * n), LightGrid::weights(n)));
    const float facing = n.dot(sun_.direction_W());
    if (facing > 0 && sun_lx_ > 0) {
      lux += sun_lx_ * static_cast<double>(facing * sun_.visible(p));
    }
    return lux;
  }

  const Scene& scene_;
  const SunMap& sun_;
  const std::vector<Lamp>& lamps_;
  std::array<Vec3, kRays> directions_;
  Surroundings around_;
  double sun_lx_ = 0, sky_ = 0, ground_ = 0, intensity_ = 0;
};

}  // namespace

void LightGrid::place_nodes(const InfraredLightConfig& light, const worlds::World& world) {
  const Eigen::AlignedBox3d box = bounds_of(world);
  const Vec3 size = box.sizes();
  const auto counts = [&](double spacing) {
    std::array<int, 3> count{};
    std::size_t nodes = 1;
    for (std::size_t i = 0; i < 3; ++i) {
      count[i] = static_cast<int>(std::ceil(size[static_cast<Eigen::Index>(i)] / spacing)) + 1;
      nodes *= static_cast<std::size_t>(count[i]);
    }
    return std::pair(count, nodes);
  };
  spacing_ = std::max(light.grid_m, size.maxCoeff() / kMostAlong);
  while (counts(spacing_).second > kMostNodes) spacing_ *= 1.05;
  count_ = counts(spacing_).first;
  per_m_ = static_cast<float>(1 / spacing_);
  for (std::size_t i = 0; i < 3; ++i) {
    origin_[i] = static_cast<float>(box.min()[static_cast<Eigen::Index>(i)]);
  }
  faces_.assign(counts(spacing_).second, Float8{});
}

Vec3 LightGrid::node(std::size_t index) const {
  const auto columns = static_cast<std::size_t>(count_[0]);
  const auto rows = static_cast<std::size_t>(count_[1]);
  const std::array<std::size_t, 3> at{index % columns, index / columns % rows,
                                      index / columns / rows};
  Vec3 p;
  for (std::size_t i = 0; i < 3; ++i) {
    // A little off the regular places, where the planes of man-made worlds lie.
    p[static_cast<Eigen::Index>(i)] =
        static_cast<double>(origin_[i]) + spacing_ * static_cast<double>(at[i]) + 0.013;
  }
  return p;
}

/// A node inside of a slab, or in the void under the ground, is dark or light for reasons that no
/// surface in sight shares.
std::vector<std::uint8_t> LightGrid::find_open(const worlds::World& world,
                                               const Scene& scene) const {
  const std::array<std::size_t, 3> stride{
      1, static_cast<std::size_t>(count_[0]),
      static_cast<std::size_t>(count_[0]) * static_cast<std::size_t>(count_[1])};
  const auto sees = [&](const Vec3& from, const Vec3& to) {
    const Vec3 way = to - from;
    const double length = way.norm();
    return length < 1e-6 || !scene.cast(from, way / length, length).valid();
  };
  // Nor is there a way round the world's edge, under its ground.
  const Eigen::AlignedBox3d box = bounds_of(world);
  const auto beside = [&](const Vec3& p) {
    return (p.head<2>().array() <= box.min().head<2>().array()).any() ||
           (p.head<2>().array() >= box.max().head<2>().array()).any();
  };
  std::vector<std::uint8_t> open(faces_.size(), 0);
  std::vector<std::size_t> reached;
  const Vec3 start = world.X_WS * Vec3(0, 0, 1);
  for (std::size_t i = 0; i < faces_.size(); ++i) {
    const Vec3 p = node(i);
    if ((p - start).norm() > 2 * spacing_ || beside(p) || !sees(start, p)) continue;
    open[i] = 1;
    reached.push_back(i);
  }
  for (std::size_t k = 0; k < reached.size(); ++k) {
    const std::size_t i = reached[k];
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const auto count = static_cast<std::size_t>(count_[axis]);
      const std::size_t place = i / stride[axis] % count;
      for (const bool up : {false, true}) {
        if (up ? place + 1 == count : place == 0) continue;
        const std::size_t next = up ? i + stride[axis] : i - stride[axis];
        if (open[next] || beside(node(next)) || !sees(node(i), node(next))) continue;
        open[next] = 1;
        reached.push_back(next);
      }
    }
  }
  return open;
}

/// Nodes inside of something take the mean of their neighbours, so that none of their darkness
/// shows on the surfaces beside them.
void LightGrid::fill(std::vector<std::uint8_t>& open) {
  const std::array<std::ptrdiff_t, 3> step{1, count_[0],
                                           static_cast<std::ptrdiff_t>(count_[0]) * count_[1]};
  constexpr int kRounds = 3;
  for (int round = 0; round < kRounds; ++round) {
    const std::vector<std::uint8_t> before = open;
    for (std::size_t i = 0; i < faces_.size(); ++i) {
      if (before[i]) continue;
      Float8 total{};
      float found = 0;
      for (std::size_t axis = 0; axis < 3; ++axis) {
        const auto stride = static_cast<std::size_t>(step[axis]);
        const std::size_t place = i / stride % static_cast<std::size_t>(count_[axis]);
        const bool has_lower = place > 0 && before[i - stride];
        const bool has_upper =
            place + 1 < static_cast<std::size_t>(count_[axis]) && before[i + stride];
        if (has_lower) total += faces_[i - stride];
        if (has_upper) total += faces_[i + stride];
        found += static_cast<float>(has_lower) + static_cast<float>(has_upper);
      }
      if (found == 0) continue;
      faces_[i] = total / found;
      open[i] = 1;
    }
  }
}

LightGrid::LightGrid(const InfraredLightConfig& light, const worlds::World& world,
                     const Scene& scene, const SunMap& sun, const std::vector<Lamp>& lamps) {
  place_nodes(light, world);
  Baker baker(light, scene, sun, lamps);
  std::vector<std::uint8_t> open = find_open(world, scene);
  std::vector<Faces> light_of(faces_.size(), Faces{});
  for (std::size_t i = 0; i < faces_.size(); ++i) {
    if (open[i]) baker.direct(node(i), light_of[i]);
    faces_[i] = packed(light_of[i]);
  }
  std::vector<std::uint8_t> filled = open;
  fill(filled);
  std::vector<Float8> with_bounce(faces_.size(), Float8{});
  for (std::size_t i = 0; i < faces_.size(); ++i) {
    if (open[i]) baker.indirect(node(i), *this, light_of[i]);
    with_bounce[i] = packed(light_of[i]);
  }
  faces_ = std::move(with_bounce);
  fill(open);
}

}  // namespace arex::sim
