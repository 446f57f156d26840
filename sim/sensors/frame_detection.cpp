#include "sensors/frame_detection.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <utility>

namespace arex::sim {
namespace {

constexpr int kSides = 12;           // of the prism that stands for a round bar
constexpr double kNearAxis_m = 0.3;  // noise and the widening of merged returns stay within
constexpr int kFive = 5;             // frames that the paper merges

/// Bars about the vertical through the origin, each an object of its own.
worlds::World world_of_bars(const SparseQuery& query) {
  worlds::World world;
  for (const double heading : bar_headings()) {
    world.objects.push_back(
        {worlds::SurfaceClass::kBranch, static_cast<float>(query.reflectivity)});
    const auto object = static_cast<std::uint32_t>(world.objects.size() - 1);
    const Vec3 axis(query.distance_m * std::cos(heading), query.distance_m * std::sin(heading), 0);
    const auto corner = [&](int side, double z) -> Vec3 {
      const double angle = 2 * std::numbers::pi * side / kSides;
      return axis + Vec3(0.5 * query.thickness_m * std::cos(angle),
                         0.5 * query.thickness_m * std::sin(angle), z);
    };
    const double half = 0.5 * query.length_m;
    for (int side = 0; side < kSides; ++side) {
      const std::array<Vec3, 4> face{corner(side, -half), corner(side + 1, -half),
                                     corner(side + 1, half), corner(side, half)};
      const auto first = static_cast<std::uint32_t>(world.mesh.vertices.size());
      for (const Vec3& p : face) world.mesh.vertices.push_back(p.cast<float>());
      world.mesh.triangles.push_back({first, first + 1, first + 2});
      world.mesh.triangles.push_back({first, first + 2, first + 3});
      world.mesh.object_of_triangle.insert(world.mesh.object_of_triangle.end(), 2, object);
    }
  }
  return world;
}

/// Counts the returns that lie about each bar, each for the nearest one.
void count_returns(const LidarScan& scan, const Pose& X_BL, const SparseQuery& query,
                   std::vector<int>& counts) {
  const std::vector<double> headings = bar_headings();
  for (const LidarPoint& point : scan.points) {
    const Vec3 p = X_BL * point.p_L.cast<double>();
    if (std::abs(p.z()) > 0.5 * query.length_m + kNearAxis_m) continue;
    double nearest = kNearAxis_m;
    std::size_t found = headings.size();
    for (std::size_t bar = 0; bar < headings.size(); ++bar) {
      const Vec2 axis = query.distance_m * Vec2(std::cos(headings[bar]), std::sin(headings[bar]));
      const double distance = (p.head<2>() - axis).norm();
      if (distance > nearest) continue;
      nearest = distance;
      found = bar;
    }
    if (found < headings.size()) ++counts[found];
  }
}

}  // namespace

std::vector<double> bar_headings() {
  std::vector<double> headings;
  for (int i = -5; i <= 5; ++i) headings.push_back(std::numbers::pi / 18 * i);
  return headings;
}

SparseAnswer look_at_bars(const SparseQuery& query, const Mid360Config& lidar, const Pose& X_BL,
                          std::uint64_t seed) {
  const worlds::World world = world_of_bars(query);
  const Scene scene(world);
  const Mid360 device(lidar, scene, X_BL, {}, seed);
  const std::size_t bars = bar_headings().size();
  SparseAnswer answer;
  std::vector<int> five(bars);  // returns in the five frames under way
  int fives = 0;
  for (int frame = 0; frame < query.frames; ++frame) {
    std::vector<Truth> ticks(static_cast<std::size_t>(device.period() / kNanosecondsPerTick) + 1);
    for (std::size_t i = 0; i < ticks.size(); ++i) {
      ticks[i].stamp = frame * device.period() + static_cast<Stamp>(i) * kNanosecondsPerTick;
    }
    std::vector<int> counts(bars);
    count_returns(device.scan(ticks), X_BL, query, counts);
    for (std::size_t bar = 0; bar < bars; ++bar) {
      answer.returns_per_frame += counts[bar];
      answer.missed_one += counts[bar] == 0;
      answer.missed_lone += counts[bar] < 2;
      five[bar] += counts[bar];
    }
    if (frame % kFive != kFive - 1) continue;
    ++fives;
    for (int& count : five) answer.missed_five += std::exchange(count, 0) == 0;
  }
  const double looks = static_cast<double>(bars) * query.frames;
  answer.returns_per_frame /= looks;
  answer.missed_one /= looks;
  answer.missed_lone /= looks;
  answer.missed_five /= std::max(1.0, static_cast<double>(bars) * fives);
  return answer;
}

}  // namespace arex::sim
