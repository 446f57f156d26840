#include "semantics/doors.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <numbers>

namespace arex {
namespace {

constexpr double kBin = 0.1;                            // m along the wall
constexpr double kLow = 0.4, kHead = 1.75;              // m above the floor, within every door
constexpr double kLintelLow = 2.3, kLintelHigh = 2.75;  // m above the floor
constexpr double kDoorLayer = 0.15;                     // m
constexpr double kLeastOff = 0.025, kMostOff = 0.18;    // m, of a leaf from the wall's face
constexpr double kLeastWidth = 0.75, kMostWidth = 3.0;  // m
constexpr double kBehind = 1.5;                         // m, what is seen through an opening

/// What stands in one bin of a wall's length.
struct Slice {
  double offset_sum = 0;  ///< of the points near the face
  int near = 0;
  std::uint32_t layers = 0;    ///< with points near the face
  int lintel = 0;              ///< points on the face above the doors' heads
  int behind = 0, before = 0;  ///< points beyond, on either side
  [[nodiscard]] double offset() const { return near > 0 ? offset_sum / near : 0; }
};

enum class Look : std::uint8_t { kWall, kOut, kIn, kOpen, kUnknown };

Look look_of(const Slice& slice) {
  const int all = static_cast<int>((kHead - kLow) / kDoorLayer);
  const int filled = std::popcount(slice.layers);
  if (filled <= all / 6 && slice.behind + slice.before >= 3) return Look::kOpen;
  if (filled < all / 2) return Look::kUnknown;
  const double offset = slice.offset();
  if (std::abs(offset) < kLeastOff) return Look::kWall;
  return offset > 0 ? Look::kOut : Look::kIn;
}

std::vector<Slice> slices_of(const WallFace& wall, const WorkingCloud& cloud,
                             const ColumnIndex& index, const Clearances& clearances) {
  std::vector<Slice> slices(static_cast<std::size_t>(wall.length() / kBin) + 1);
  const Vec2 u = wall.along(), n = wall.normal();
  const int steps = std::max(1, static_cast<int>(std::ceil(wall.length() / kBin)));
  for (int k = 0; k < steps; ++k) {
    const Vec2 middle = wall.a + (k + 0.5) * kBin * u;
    index.within(
        static_cast<float>(middle.x()), static_cast<float>(middle.y()), static_cast<float>(kBehind),
        [&](std::uint32_t i) {
          const Vec2 d = cloud.points[i].head<2>().cast<double>() - wall.a;
          const double t = d.dot(u);
          if (t < k * kBin || t >= (k + 1) * kBin) return;
          const auto z = static_cast<double>(cloud.points[i].z());
          const double h = z - wall.base_z;
          if (h > kLintelLow && h < kLintelHigh) {
            slices[static_cast<std::size_t>(k)].lintel +=
                std::abs(d.dot(n)) < kLeastOff + 0.02 ? 1 : 0;
          }
          if (h < kLow || h > kHead) return;
          if (std::abs(z - static_cast<double>(clearances.above_floor[i]) - wall.base_z) > 0.5)
            return;
          Slice& slice = slices[static_cast<std::size_t>(k)];
          const double offset = d.dot(n);
          if (std::abs(offset) < kMostOff) {
            slice.offset_sum += offset;
            ++slice.near;
            slice.layers |= 1U << static_cast<unsigned>((h - kLow) / kDoorLayer);
          } else {
            ++(offset > 0 ? slice.before : slice.behind);
          }
        });
  }
  return slices;
}

}  // namespace

std::vector<Door> find_doors(const WorkingCloud& cloud, const Clearances& clearances,
                             const UprightStructure& structure) {
  const ColumnIndex index(cloud.points, cloud.low, cloud.high, WorkingCloud::kCell);
  std::vector<Door> doors;
  for (const WallFace& wall : structure.walls) {
    const std::vector<Slice> slices = slices_of(wall, cloud, index, clearances);
    std::vector<Look> looks(slices.size());
    std::transform(slices.begin(), slices.end(), looks.begin(), look_of);
    for (std::size_t first = 0, last = 0; first < looks.size(); first = last) {
      for (last = first + 1; last < looks.size() && looks[last] == looks[first]; ++last) {
      }
      const Look look = looks[first];
      if (look == Look::kWall || look == Look::kUnknown) continue;
      const double width = static_cast<double>(last - first) * kBin;
      if (width < kLeastWidth || width > kMostWidth) continue;
      // Below a lintel; what sticks out all the way up is a pillar.
      std::size_t below = 0;
      for (std::size_t i = first; i < last; ++i) below += slices[i].lintel >= 2 ? 1 : 0;
      if (2 * below < last - first) continue;
      // Wall on at least one side, so that it is a door in it; on both if it is open.
      const bool before = first > 0 && looks[first - 1] != Look::kUnknown;
      const bool after = last < looks.size() && looks[last] != Look::kUnknown;
      if (!(look == Look::kOpen ? before && after : before || after)) continue;
      Door door;
      const double middle = 0.5 * static_cast<double>(first + last) * kBin;
      door.centre = wall.a + middle * wall.along();
      door.width = width;
      door.height = 2.1;
      door.yaw_rad = std::fmod(
          std::atan2(wall.along().y(), wall.along().x()) + 2 * std::numbers::pi, std::numbers::pi);
      door.base_z = wall.base_z;
      door.open = look == Look::kOpen;
      const bool twin = std::any_of(doors.begin(), doors.end(), [&](const Door& other) {
        return (other.centre - door.centre).norm() < 0.6 &&
               std::abs(other.base_z - door.base_z) < 1;
      });
      const bool pillar =
          std::any_of(structure.pillars.begin(), structure.pillars.end(), [&](const Pillar& other) {
            return (other.box.centre - door.centre).norm() <
                       0.5 * (other.box.length + door.width) &&
                   std::abs(other.base_z - door.base_z) < 1;
          });
      if (!twin && !pillar) doors.push_back(door);
    }
  }
  return doors;
}

}  // namespace arex
