#include "sensors/infrared_lamps.h"

#include <algorithm>
#include <cmath>
#include <optional>

namespace arex::sim {
namespace {

using worlds::SurfaceClass;

// The strip lamps of worlds/garage_services.cpp, m.
constexpr float kLong = 1.5F, kWide = 0.2F, kTall = 0.08F, kHighest = 1.5F;
constexpr float kTolerance = 0.02F;

// Where the world draws none: places are looked at every kStep, and lit from a lamp in sight within
// kApart, which leaves no floor much below the 15 lx that DIN 67528 wants of a large car park.
constexpr double kStep = 2.5, kApart = 6.0;  // m
constexpr double kBelow = 0.1;               // they hang under the ceiling, m
constexpr double kSight = 1.5;               // below it beams do not hide a lamp, m
constexpr int kMostStoreys = 16;
constexpr std::size_t kMostLamps = 4000;

std::vector<Eigen::AlignedBox3f> boxes_of_objects(const worlds::World& world) {
  std::vector<Eigen::AlignedBox3f> boxes(world.objects.size());
  for (std::size_t i = 0; i < world.mesh.triangles.size(); ++i) {
    Eigen::AlignedBox3f& box = boxes[world.mesh.object_of_triangle[i]];
    for (const std::uint32_t vertex : world.mesh.triangles[i]) {
      box.extend(world.mesh.vertices[vertex]);
    }
  }
  return boxes;
}

bool is_strip(const Eigen::AlignedBox3f& box) {
  if (box.isEmpty()) return false;
  const Vec3f size = box.sizes();
  const float longer = std::max(size.x(), size.y()), wider = std::min(size.x(), size.y());
  return std::abs(longer - kLong) < kTolerance && std::abs(wider - kWide) < kTolerance &&
         size.z() < kHighest;
}

std::vector<Lamp> drawn_lamps(const worlds::World& world) {
  std::vector<Lamp> lamps;
  const std::vector<Eigen::AlignedBox3f> boxes = boxes_of_objects(world);
  for (std::uint32_t i = 0; i < boxes.size(); ++i) {
    if (world.objects[i].surface_class != SurfaceClass::kPipe || !is_strip(boxes[i])) continue;
    Vec3 centre = boxes[i].center().cast<double>();
    centre.z() = static_cast<double>(boxes[i].min().z());
    lamps.push_back({centre, i, boxes[i].min().z() + kTall + 0.5F * kTolerance});
  }
  return lamps;
}

bool has_ceiling(const worlds::World& world) {
  return std::any_of(world.objects.begin(), world.objects.end(), [](const worlds::Object& object) {
    return object.surface_class == SurfaceClass::kCeiling;
  });
}

/// Whether a lamp is missing at a place under a ceiling: none of `lamps` lights it, and it would
/// not hang right above a duct.
bool wants_lamp(const Scene& scene, const Vec3& under_ceiling, const std::vector<Lamp>& lamps) {
  if (scene.cast(under_ceiling, -Vec3::UnitZ(), kSight).valid()) return false;
  const Vec3 from = under_ceiling - kSight * Vec3::UnitZ();
  return std::none_of(lamps.begin(), lamps.end(), [&](const Lamp& lamp) {
    if ((lamp.centre_W - under_ceiling).norm() > kApart) return false;
    constexpr double kOwn = 0.2;  // its own box is not in its way, m
    const Vec3 to = lamp.centre_W - from;
    const double distance = to.norm();
    return distance < kOwn || !scene.cast(from, to / distance, distance - kOwn).valid();
  });
}

/// One below every ceiling over (x, y) that wants it.
void add_lamps_over(const worlds::World& world, const Scene& scene, double x, double y,
                    std::vector<Lamp>& lamps) {
  Vec3 from(x, y, world.bounds.low.z() - 1);
  for (int i = 0; i < kMostStoreys; ++i) {
    const Hit hit = scene.cast(from, Vec3::UnitZ(), world.bounds.high.z() - from.z() + 1);
    if (!hit.valid()) return;
    from.z() += hit.distance_m;
    if (world.objects[hit.object].surface_class == SurfaceClass::kCeiling) {
      const Vec3 place = from - kBelow * Vec3::UnitZ();
      if (wants_lamp(scene, place, lamps)) lamps.push_back({place, Hit::kNone, 0});
      from.z() += 0.5;  // the slab's upper face
    }
    from.z() += 0.02;
  }
}

}  // namespace

std::vector<Lamp> find_lamps(const worlds::World& world, const Scene& scene) {
  std::vector<Lamp> lamps = drawn_lamps(world);
  if (!has_ceiling(world)) return lamps;
  const Vec3 low = world.bounds.low, high = world.bounds.high;
  for (double y = low.y() + 0.5 * kStep; y < high.y(); y += kStep) {
    for (double x = low.x() + 0.5 * kStep; x < high.x(); x += kStep) {
      if (lamps.size() < kMostLamps) add_lamps_over(world, scene, x, y, lamps);
    }
  }
  return lamps;
}

}  // namespace arex::sim
