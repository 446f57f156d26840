#include "semantics/parked_cars.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <optional>

#include "semantics/pcl_models.h"

namespace arex {
namespace {

constexpr double kCoreLow = 0.25, kCoreHigh = 1.0;  // m above the floor: above kerbs, below mirrors
constexpr double kRoof = 2.1;                       // m above the floor
constexpr double kOffWall = 0.12, kOffPillar = 0.12;     // m
constexpr double kUsualLength = 4.5, kUsualWidth = 1.8;  // m
constexpr double kCabin = 1.5;                           // m above the floor: windows
constexpr double kLeastHeight = 1.15;                    // m: parapets are lower
constexpr double kLeastPart = 1.2;                       // m, of what a cut leaves
constexpr int kFewestOfCar = 40;                         // points

bool at_structure(const Vec3f& p, const UprightStructure& structure) {
  const auto z = static_cast<double>(p.z());
  const Vec2 q = flat(p);
  for (const WallFace& wall : structure.walls) {
    if (z > wall.base_z - 0.3 && z < wall.high && wall.distance(q) < kOffWall) return true;
  }
  return std::any_of(structure.pillars.begin(), structure.pillars.end(), [&](const Pillar& pillar) {
    return z > pillar.base_z - 0.3 && z < pillar.top_z && pillar.box.reaches(q, kOffPillar);
  });
}

using Group = std::vector<std::uint32_t>;

struct Cut {
  Group first, second;
  double untidiness = 0;  ///< of both parts
};

/// Cuts a group across an axis where it is thin, each cut leaving two sensible parts. Where a car's
/// sides are hidden it may be thinner than where it touches the next.
std::vector<Cut> cuts_of(const std::vector<Vec3f>& points, const Group& group, const Vec2& axis,
                         double least) {
  constexpr double kBin = 0.1, kApart = 0.5;  // m
  constexpr std::size_t kMost = 4;
  std::vector<double> at;
  for (const std::uint32_t i : group) at.push_back(flat(points[i]).dot(axis));
  const auto [low, high] = std::minmax_element(at.begin(), at.end());
  const double from = *low;
  std::vector<int> bins(static_cast<std::size_t>((*high - from) / kBin) + 1, 0);
  for (const double t : at) ++bins[static_cast<std::size_t>((t - from) / kBin)];
  const auto margin = static_cast<std::size_t>(least / kBin);
  if (bins.size() < 2 * margin + 1) return {};
  std::vector<std::size_t> thin;
  for (std::size_t i = margin; i + margin < bins.size(); ++i) thin.push_back(i);
  std::stable_sort(thin.begin(), thin.end(),
                   [&](std::size_t i, std::size_t j) { return bins[i] < bins[j]; });
  std::vector<double> places;
  std::vector<Cut> cuts;
  for (const std::size_t bin : thin) {
    const double where = from + (static_cast<double>(bin) + 0.5) * kBin;
    const bool known = std::any_of(places.begin(), places.end(),
                                   [&](double other) { return std::abs(where - other) < kApart; });
    if (known || places.size() == kMost) continue;
    places.push_back(where);
    Cut parts;
    for (std::size_t k = 0; k < group.size(); ++k) {
      (at[k] < where ? parts.first : parts.second).push_back(group[k]);
    }
    if (!parts.first.empty() && !parts.second.empty()) cuts.push_back(std::move(parts));
  }
  return cuts;
}

/// How little a group looks like one car: the sum of the distances of its points from its best
/// rectangle's sides, and three times that if the rectangle has no car's size.
double untidiness(const std::vector<Vec3f>& points, const Group& group,
                  const GarageConfig& config) {
  constexpr double kFar = 0.4, kTail = 0.01, kShort = 2.5, kNarrow = 1.2;  // m, share, m, m
  std::vector<Vec2> plan;
  for (const std::uint32_t i : group) plan.push_back(flat(points[i]));
  const Rectangle box = fit_rectangle(plan, kTail);
  const bool one_car = box.length > kShort && box.length < config.car_max_length_m &&
                       box.width > kNarrow && box.width < config.car_max_width_m;
  return outline_distance(plan, box, kFar) * static_cast<double>(plan.size()) * (one_car ? 1 : 3);
}

/// Groups that are no larger than a car.
void split(const std::vector<Vec3f>& points, Group group, const GarageConfig& config,
           std::vector<Group>& out) {
  if (group.size() < static_cast<std::size_t>(kFewestOfCar)) return;
  std::vector<Vec2> plan;
  for (const std::uint32_t i : group) plan.push_back(flat(points[i]));
  const Rectangle box = fit_rectangle(plan, 0.01);
  if (box.length <= config.car_max_length_m && box.width <= config.car_max_width_m) {
    out.push_back(std::move(group));
    return;
  }
  // Of the ways, the one that leaves parts with cleaner outlines.
  std::optional<Cut> best;
  for (const Vec2& axis : {box.along(), box.across()}) {
    for (Cut& parts : cuts_of(points, group, axis, kLeastPart)) {
      parts.untidiness =
          untidiness(points, parts.first, config) + untidiness(points, parts.second, config);
      if (!best || parts.untidiness < best->untidiness) best = std::move(parts);
    }
  }
  if (!best) return;
  split(points, best->first, config, out);
  split(points, best->second, config, out);
}

/// Whether what a box holds is as deep at a man's height as at its foot, on the side of it that
/// shows most: a cabinet. A car's sides lean in above its doors.
bool is_cabinet(const Rectangle& box, const std::vector<Vec2>& low, const std::vector<Vec2>& high) {
  constexpr double kFace = 0.15, kFlush = 0.05;  // m
  constexpr std::size_t kFewest = 20;            // points
  double best_depth = 0;
  std::size_t most = 0;
  for (const double side : {-1.0, 1.0}) {
    const auto depths = [&](const std::vector<Vec2>& points) {  // behind the side of the box
      std::vector<double> out;
      for (const Vec2& p : points) {
        const double depth = 0.5 * box.width - side * (p - box.centre).dot(box.across());
        if (depth < kFace) out.push_back(depth);
      }
      return out;
    };
    std::vector<double> below = depths(low), above = depths(high);
    if (above.size() < kFewest || below.size() < kFewest || above.size() <= most) continue;
    most = above.size();
    const auto median = [](std::vector<double>& values) {
      const auto mid = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
      std::nth_element(values.begin(), mid, values.end());
      return *mid;
    };
    best_depth = median(above) - median(below);
  }
  return most >= kFewest && best_depth < kFlush;
}

/// Whether a good part of a car lies in another.
bool in_another(const ParkedCar& car, const ParkedCar& other) {
  constexpr int kSteps = 10;
  constexpr double kPart = 0.25, kStorey = 1.0;  // share, m
  if (std::abs(car.base_z - other.base_z) > kStorey) return false;
  const Vec2 u = car.box.length * car.box.along(), v = car.box.width * car.box.across();
  int inside = 0;
  for (int i = 0; i < kSteps; ++i) {
    for (int j = 0; j < kSteps; ++j) {
      const Vec2 p =
          car.box.centre + ((i + 0.5) / kSteps - 0.5) * u + ((j + 0.5) / kSteps - 0.5) * v;
      inside += other.box.distance(p) < 0;
    }
  }
  return inside > kPart * kSteps * kSteps;
}

/// Cars do not stand in each other: what was seen whole, or shows most, stays.
std::vector<ParkedCar> without_overlaps(std::vector<ParkedCar> cars) {
  std::stable_sort(cars.begin(), cars.end(), [](const ParkedCar& a, const ParkedCar& b) {
    return a.whole != b.whole ? a.whole : a.points > b.points;
  });
  std::vector<ParkedCar> kept;
  for (const ParkedCar& car : cars) {
    const bool taken = std::any_of(kept.begin(), kept.end(), [&](const ParkedCar& other) {
      return in_another(car, other) || in_another(other, car);
    });
    if (!taken) kept.push_back(car);
  }
  return kept;
}

/// Where the vehicle was nearest.
Vec2 viewer_of(const Vec2& centre, double z, std::span<const Vec3f> path) {
  Vec2 best = centre;
  double least = std::numeric_limits<double>::infinity();
  for (const Vec3f& p : path) {
    const double d = (flat(p) - centre).norm() + 3 * std::abs(static_cast<double>(p.z()) - z - 1.2);
    if (d < least) {
      least = d;
      best = flat(p);
    }
  }
  return best;
}

}  // namespace

std::vector<ParkedCar> find_cars(const WorkingCloud& cloud, const Clearances& clearances,
                                 const UprightStructure& structure, std::span<const Vec3f> path,
                                 const GarageConfig& config) {
  constexpr double kTolerance = 0.2, kTail = 0.01;  // m, share
  std::vector<Vec3f> core;
  std::vector<float> core_floor;
  for (std::size_t i = 0; i < cloud.points.size(); ++i) {
    const auto h = static_cast<double>(clearances.above_floor[i]);
    if (!(h > kCoreLow && h < kCoreHigh) || at_structure(cloud.points[i], structure)) continue;
    core.push_back(cloud.points[i]);
    core_floor.push_back(cloud.points[i].z() - clearances.above_floor[i]);
  }
  const ColumnIndex all(cloud.points, cloud.low, cloud.high, WorkingCloud::kCell);
  std::vector<ParkedCar> cars;
  for (const Group& cluster : euclidean_clusters(core, kTolerance, kFewestOfCar)) {
    std::vector<Group> groups;
    split(core, cluster, config, groups);
    for (const Group& group : groups) {
      std::vector<Vec2> plan;
      std::vector<float> floors;
      for (const std::uint32_t i : group) {
        plan.push_back(flat(core[i]));
        floors.push_back(core_floor[i]);
      }
      const auto mid = floors.begin() + static_cast<std::ptrdiff_t>(floors.size() / 2);
      std::nth_element(floors.begin(), mid, floors.end());
      ParkedCar car;
      car.base_z = static_cast<double>(*mid);
      car.box = fit_rectangle(plan, kTail);
      car.points = static_cast<int>(group.size());
      // Its height, from all that stands there.
      std::vector<double> heights;
      std::vector<Vec2> low, high;
      all.within(static_cast<float>(car.box.centre.x()), static_cast<float>(car.box.centre.y()),
                 static_cast<float>(0.5 * car.box.length + 0.2), [&](std::uint32_t i) {
                   const auto h = static_cast<double>(clearances.above_floor[i]);
                   const double floor = static_cast<double>(cloud.points[i].z()) - h;
                   if (std::abs(floor - car.base_z) < 0.4 && h > kCoreLow && h < kRoof &&
                       car.box.reaches(flat(cloud.points[i]), 0.1)) {
                     heights.push_back(h);
                     if (h < kCoreHigh) low.push_back(flat(cloud.points[i]));
                     if (h > kCabin) high.push_back(flat(cloud.points[i]));
                   }
                 });
      if (heights.size() < static_cast<std::size_t>(kFewestOfCar)) continue;
      const auto top =
          heights.begin() + static_cast<std::ptrdiff_t>(0.98 * static_cast<double>(heights.size()));
      std::nth_element(heights.begin(), top, heights.end());
      car.height = *top;
      if (car.height < kLeastHeight || is_cabinet(car.box, low, high)) continue;
      const bool length_seen = car.box.length >= config.car_min_length_m;
      const bool width_seen = car.box.width >= 1.2;
      // Of an end, the whole width and a part of the sides or the bonnet.
      const bool is_end =
          car.box.length > 1.5 && car.box.length < config.car_max_width_m && car.box.width > 0.3;
      // Of a car whose far end is hidden, the width and half of the length.
      const bool is_half = !length_seen && width_seen && car.box.length >= config.car_max_width_m;
      if (!length_seen && !is_end && !is_half) continue;
      const Vec2 away = car.box.centre - viewer_of(car.box.centre, car.base_z, path);
      if (is_half) {
        car.whole = false;
        Vec2 back = car.box.along();
        if (away.dot(back) < 0) back = -back;
        car.box.centre += 0.5 * (kUsualLength - car.box.length) * back;
        car.box.length = kUsualLength;
      } else if (!length_seen) {
        // The longer seen side is the car's end: it goes on behind it.
        car.whole = false;
        Vec2 back = car.box.across();
        if (away.dot(back) < 0) back = -back;
        const double end = -0.5 * car.box.width;
        const double width = car.box.length;
        car.box.centre += (end + 0.5 * kUsualLength) * back;
        car.box.length = kUsualLength;
        car.box.width = width;
        car.box.yaw_rad =
            std::fmod(std::atan2(back.y(), back.x()) + 2 * std::numbers::pi, std::numbers::pi);
      } else if (!width_seen) {
        car.whole = false;
        Vec2 back = car.box.across();
        if (away.dot(back) < 0) back = -back;
        car.box.centre += (-0.5 * car.box.width + 0.5 * kUsualWidth) * back;
        car.box.width = kUsualWidth;
      }
      cars.push_back(car);
    }
  }
  return without_overlaps(std::move(cars));
}

}  // namespace arex
