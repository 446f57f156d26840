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
constexpr double kLeastOff = 0.02, kMostOff = 0.18;     // m, of a leaf from the wall's face
constexpr double kLeastWidth = 0.75, kMostWidth = 3.0;  // m
constexpr double kAlong = 2.5;      // m to each side, of the wall that a leaf is compared with
constexpr double kFloorNear = 0.1;  // m, above and below the floor: its points
constexpr double kSillLow = 0.03;   // m from the face, of the floor in a doorway: more than drift
constexpr double kSillHigh = 0.17;  // likewise: less than a wall's thickness

/// What stands in one bin of a wall's length.
struct Slice {
  std::vector<double> offsets;                      ///< of the points near the face
  std::vector<double> lintel;                       ///< likewise, above the doors' heads
  std::uint32_t layers = 0;                         ///< with points near the face
  bool floor_before = false, floor_behind = false;  ///< at the face, on either side
  double offset = 0;                                ///< median
  double wall = 0;                                  ///< median offset of the wall around
  [[nodiscard]] bool below_lintel() const {
    constexpr double kOnLintel = 0.045;  // m
    return std::count_if(lintel.begin(), lintel.end(),
                         [&](double at) { return std::abs(at - wall) < kOnLintel; }) >= 2;
  }
};

enum class Look : std::uint8_t { kWall, kOut, kIn, kOpen, kUnknown };

constexpr int kDoorLayers = static_cast<int>((kHead - kLow) / kDoorLayer);

bool is_filled(const Slice& slice) { return std::popcount(slice.layers) >= kDoorLayers / 2; }

double median_of(std::vector<double> values) {
  const auto mid = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), mid, values.end());
  return *mid;
}

/// Median offset of the filled slices up to `reach` away.
double offset_around(const std::vector<Slice>& slices, std::size_t i, std::size_t reach) {
  std::vector<double> around;
  for (std::size_t k = i - std::min(i, reach); k < std::min(slices.size(), i + reach + 1); ++k) {
    if (is_filled(slices[k])) around.push_back(slices[k].offset);
  }
  return around.empty() ? 0 : median_of(std::move(around));
}

/// Each slice against the wall around it: a face's line rests on what was seen higher up, another
/// time, and the map's drift lies between. @param slices get the wall's offset
std::vector<Look> looks_of(std::vector<Slice>& slices) {
  constexpr auto kReach = static_cast<std::size_t>(kAlong / kBin);
  std::vector<Look> looks;
  for (std::size_t i = 0; i < slices.size(); ++i) {
    slices[i].wall = offset_around(slices, i, kReach);
    if (std::popcount(slices[i].layers) <= kDoorLayers / 6) {
      looks.push_back(Look::kOpen);
      continue;
    }
    const double off = offset_around(slices, i, 1) - slices[i].wall;
    looks.push_back(!is_filled(slices[i])       ? Look::kUnknown
                    : std::abs(off) < kLeastOff ? Look::kWall
                    : off > 0                   ? Look::kOut
                                                : Look::kIn);
  }
  return looks;
}

std::vector<Slice> slices_of(const WallFace& wall, const WorkingCloud& cloud,
                             const ColumnIndex& index, const Clearances& clearances) {
  std::vector<Slice> slices(static_cast<std::size_t>(wall.length() / kBin) + 1);
  const Vec2 u = wall.along(), n = wall.normal();
  for (std::size_t k = 0; k < slices.size(); ++k) {
    Slice& slice = slices[k];
    const Vec2 middle = wall.a + (static_cast<double>(k) + 0.5) * kBin * u;
    index.within(static_cast<float>(middle.x()), static_cast<float>(middle.y()),
                 static_cast<float>(kMostOff + 0.5 * kBin), [&](std::uint32_t i) {
                   const Vec2 d = flat(cloud.points[i]) - wall.a;
                   const double t = d.dot(u) / kBin - static_cast<double>(k), offset = d.dot(n);
                   if (t < 0 || t >= 1 || std::abs(offset) > kMostOff) return;
                   const auto z = static_cast<double>(cloud.points[i].z());
                   const double h = z - wall.base_z;
                   if (h > kLintelLow && h < kLintelHigh) slice.lintel.push_back(offset);
                   const auto above = static_cast<double>(clearances.above_floor[i]);
                   if (!(std::abs(z - above - wall.base_z) < 0.5)) return;
                   if (std::abs(above) < kFloorNear && std::abs(offset) > kSillLow &&
                       std::abs(offset) < kSillHigh) {
                     (offset > 0 ? slice.floor_before : slice.floor_behind) = true;
                   }
                   if (h < kLow || h > kHead) return;
                   slice.offsets.push_back(offset);
                   slice.layers |= 1U << static_cast<unsigned>((h - kLow) / kDoorLayer);
                 });
    if (!slice.offsets.empty()) slice.offset = median_of(slice.offsets);
  }
  return slices;
}

}  // namespace

std::vector<Door> find_doors(const WorkingCloud& cloud, const Clearances& clearances,
                             const UprightStructure& structure) {
  const ColumnIndex index(cloud.points, cloud.low, cloud.high, WorkingCloud::kCell);
  std::vector<Door> doors;
  for (const WallFace& wall : structure.walls) {
    std::vector<Slice> slices = slices_of(wall, cloud, index, clearances);
    const std::vector<Look> looks = looks_of(slices);
    for (std::size_t first = 0, last = 0; first < looks.size(); first = last) {
      for (last = first + 1; last < looks.size() && looks[last] == looks[first]; ++last) {
      }
      const Look look = looks[first];
      if (look == Look::kWall || look == Look::kUnknown) continue;
      const double width = static_cast<double>(last - first) * kBin;
      if (width < kLeastWidth || width > kMostWidth) continue;
      // Below a lintel; what sticks out all the way up is a pillar.
      std::size_t below = 0, on_sill = 0;
      for (std::size_t i = first; i < last; ++i) {
        below += slices[i].below_lintel();
        on_sill += slices[i].floor_before && slices[i].floor_behind;
      }
      if (5 * below < 4 * (last - first)) continue;
      // The floor goes through an open doorway. Of a wall that something hides none is seen.
      if (look == Look::kOpen && 2 * on_sill < last - first) continue;
      // A door is in a wall: what differs from it up to its end is another thing.
      const bool before = first > 0 && looks[first - 1] != Look::kUnknown;
      const bool after = last < looks.size() && looks[last] != Look::kUnknown;
      if (!before || !after) continue;
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
