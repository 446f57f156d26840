#include "scoring/semantic_score.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <optional>
#include <string>
#include <tuple>
#include <unordered_map>
#include <utility>

namespace arex::sim {
namespace {

using worlds::SurfaceClass;
using worlds::World;

constexpr double kSampleSide = 0.04;  // m
constexpr double kBreast = 1.3;       // m
constexpr double kUnknown = ClassScore::kUnknown;

SurfaceClass surface_of(SemanticClass kind) {
  switch (kind) {
    case SemanticClass::kTrunk:
      return SurfaceClass::kTrunk;
    case SemanticClass::kPillar:
      return SurfaceClass::kPillar;
    case SemanticClass::kCar:
      return SurfaceClass::kCar;
    case SemanticClass::kRamp:
      return SurfaceClass::kRamp;
    case SemanticClass::kDoor:
      return SurfaceClass::kDoor;
    default:
      return SurfaceClass::kWall;
  }
}

/// How far apart a found object and a true one may be, m.
double reach_of(SemanticClass kind) {
  switch (kind) {
    case SemanticClass::kTrunk:
      return 0.3;
    case SemanticClass::kPillar:
      return 0.5;
    case SemanticClass::kDoor:
      return 1.0;
    case SemanticClass::kRamp:
      return 4.0;
    default:
      return 1.5;
  }
}

double median(std::vector<double> values) {
  if (values.empty()) return kUnknown;
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

double harmonic(double a, double b) { return a + b > 0 ? 2 * a * b / (a + b) : 0; }

/// Answers whether a point of a cloud is near, by cubes of that size.
class Nearness {
 public:
  Nearness(const std::vector<Vec3f>& cloud_O, const Pose& X_WO, double near_m) : near_(near_m) {
    struct Keyed {
      std::uint64_t key;
      Vec3f p_W;
    };
    std::vector<Keyed> keyed;
    keyed.reserve(cloud_O.size());
    for (const Vec3f& p : cloud_O) {
      if (!p.allFinite()) continue;
      const Vec3 p_W = X_WO * p.cast<double>();
      keyed.push_back({key(cube(p_W)), p_W.cast<float>()});
    }
    std::sort(keyed.begin(), keyed.end(),
              [](const Keyed& a, const Keyed& b) { return a.key < b.key; });
    points_.reserve(keyed.size());
    for (const Keyed& each : keyed) {
      const auto at = static_cast<std::uint32_t>(points_.size());
      cubes_.try_emplace(each.key, at, at).first->second.second = at + 1;
      points_.push_back(each.p_W);
    }
  }
  /// Distance to the nearest point up to the limit, infinite beyond.
  [[nodiscard]] bool at(const Vec3& p_W) const {
    const Eigen::Vector3i c = cube(p_W);
    for (int dx = -1; dx <= 1; ++dx) {
      for (int dy = -1; dy <= 1; ++dy) {
        for (int dz = -1; dz <= 1; ++dz) {
          const auto found = cubes_.find(key(c + Eigen::Vector3i(dx, dy, dz)));
          if (found == cubes_.end()) continue;
          const auto [first, last] = found->second;
          for (std::uint32_t i = first; i < last; ++i) {
            if ((points_[i].cast<double>() - p_W).norm() <= near_) return true;
          }
        }
      }
    }
    return false;
  }

 private:
  [[nodiscard]] Eigen::Vector3i cube(const Vec3& p) const {
    return (p / near_).array().floor().cast<int>();
  }
  static std::uint64_t key(const Eigen::Vector3i& c) {
    const auto part = [](int v) { return static_cast<std::uint64_t>(v + (1 << 20)) & 0x1fffff; };
    return part(c.x()) << 42 | part(c.y()) << 21 | part(c.z());
  }
  double near_;
  std::vector<Vec3f> points_;  ///< in W, by cubes
  std::unordered_map<std::uint64_t, std::pair<std::uint32_t, std::uint32_t>> cubes_;
};

struct Triangle {
  Vec3 a, b, c;
  [[nodiscard]] Vec3 cross() const { return (b - a).cross(c - a); }
};

/// Calls visit(point, normal) for samples of a triangle, one in each square of its plane's lattice
/// that starts in a corner: even, and the same for every run.
template <class Visit>
void sample(const Triangle& t, double side, Visit visit) {
  const Vec3 cross = t.cross();
  const double area2 = cross.norm();
  if (!(area2 > 0)) return;
  const Vec3 normal = cross / area2;
  const int count = std::max(1, static_cast<int>(std::lround(0.5 * area2 / (side * side))));
  double u = 0.5, w = 0.5;
  for (int i = 0; i < count; ++i) {  // the R2 sequence, folded onto the triangle
    const bool folded = u + w > 1;
    visit(Vec3(t.a + (folded ? 1 - u : u) * (t.b - t.a) + (folded ? 1 - w : w) * (t.c - t.a)),
          normal);
    u += 0.7548776662466927;
    w += 0.5698402909980532;
    u -= std::floor(u);
    w -= std::floor(w);
  }
}

/// Where a plane of constant z cuts a mesh: the middle of the outline and its length.
struct Section {
  Vec2 centre = Vec2::Zero();
  double girth = 0;
};
std::optional<Section> cut(const std::vector<Triangle>& triangles, double z) {
  Section section;
  for (const Triangle& t : triangles) {
    std::vector<Vec2> ends;
    const std::array<Vec3, 3> v{t.a, t.b, t.c};
    for (std::size_t i = 0; i < 3; ++i) {
      const Vec3 &p = v[i], &q = v[(i + 1) % 3];
      if ((p.z() < z) == (q.z() < z)) continue;
      ends.emplace_back((p + (z - p.z()) / (q.z() - p.z()) * (q - p)).head<2>());
    }
    if (ends.size() != 2) continue;
    const double length = (ends[1] - ends[0]).norm();
    section.centre += 0.5 * length * (ends[0] + ends[1]);
    section.girth += length;
  }
  if (!(section.girth > 0)) return std::nullopt;
  section.centre /= section.girth;
  return section;
}

/// The smallest rectangle around points seen from above: middle, longer and shorter side.
struct Footprint {
  Vec2 centre = Vec2::Zero();
  double length = 0, width = 0;
};
Footprint footprint_of(const std::vector<Triangle>& triangles) {
  Footprint best;
  double least = std::numeric_limits<double>::infinity();
  constexpr int kAngles = 180;
  for (int i = 0; i < kAngles; ++i) {
    const double angle = std::numbers::pi / 2 * i / kAngles;
    const Vec2 u(std::cos(angle), std::sin(angle)), v(-u.y(), u.x());
    Eigen::AlignedBox2d box;
    for (const Triangle& t : triangles) {
      for (const Vec3& p : {t.a, t.b, t.c}) {
        box.extend(Vec2(p.head<2>().dot(u), p.head<2>().dot(v)));
      }
    }
    const Vec2 sides = box.sizes();
    if (sides.prod() >= least - 1e-9) continue;
    least = sides.prod();
    best = {box.center().x() * u + box.center().y() * v, sides.maxCoeff(), sides.minCoeff()};
  }
  return best;
}

/// The triangles of one thing: objects of a class whose boxes overlap from above are one.
struct Group {
  std::vector<Triangle> triangles;
  Eigen::AlignedBox3d box;
  std::vector<Triangle> tallest;  ///< of its objects, the one that reaches highest: a door's frame
  void add(const std::vector<Triangle>& more) {
    triangles.insert(triangles.end(), more.begin(), more.end());
    Eigen::AlignedBox3d own;
    for (const Triangle& t : more) own.extend(t.a).extend(t.b).extend(t.c);
    if (box.isEmpty() || own.max().z() > box.max().z()) tallest = more;
    box.extend(own);
  }
};

std::vector<Group> groups_of(const World& world, SurfaceClass kind, bool merge) {
  std::vector<std::vector<Triangle>> objects(world.objects.size());
  for (std::size_t t = 0; t < world.mesh.triangles.size(); ++t) {
    if (world.class_of_triangle(t) != kind) continue;
    const auto& [a, b, c] = world.mesh.triangles[t];
    objects[world.mesh.object_of_triangle[t]].push_back({world.mesh.vertices[a].cast<double>(),
                                                         world.mesh.vertices[b].cast<double>(),
                                                         world.mesh.vertices[c].cast<double>()});
  }
  std::vector<Group> groups;
  for (const auto& triangles : objects) {
    if (triangles.empty()) continue;
    Group group;
    group.add(triangles);
    const auto same = [&](const Group& other) {
      if (kind == SurfaceClass::kDoor) {  // a leaf and its frame, a wall's thickness apart
        constexpr double kHinge = 0.25;   // m
        Eigen::AlignedBox3d wide = other.box;
        wide.min().array() -= kHinge;
        wide.max().array() += kHinge;
        return wide.intersects(group.box);
      }
      const Eigen::AlignedBox3d both = group.box.intersection(other.box);
      if (both.isEmpty()) return false;
      const auto area = [](const Eigen::AlignedBox3d& b) { return b.sizes().head<2>().prod(); };
      return area(both) > 0.5 * std::min(area(group.box), area(other.box));
    };
    const auto found = merge ? std::find_if(groups.begin(), groups.end(), same) : groups.end();
    if (found != groups.end()) {
      found->add(triangles);
    } else {
      groups.push_back(std::move(group));
    }
  }
  return groups;
}

/// Share of a group's samples that are mapped; only those that `wanted` names.
template <class Wanted>
double mapped_share(const Group& group, const Nearness& near, const Wanted& wanted) {
  std::size_t all = 0, mapped = 0;
  for (const Triangle& t : group.triangles) {
    sample(t, kSampleSide, [&](const Vec3& p, const Vec3& normal) {
      if (!wanted(p, normal)) return;
      ++all;
      mapped += near.at(p) ? 1 : 0;
    });
  }
  return all > 0 ? static_cast<double>(mapped) / static_cast<double>(all) : 0;
}

std::vector<TrueObject> true_trunks(const World& world, const Nearness& near) {
  std::vector<TrueObject> trunks;
  for (const Group& group : groups_of(world, SurfaceClass::kTrunk, false)) {
    const Vec3 middle = group.box.center();
    const double ground = world.terrain.at(middle.x(), middle.y());
    // The foot stands beside the box's middle where the stem leans.
    const auto foot = cut(group.triangles, ground + 0.3);
    if (!foot) continue;
    const double z = world.terrain.at(foot->centre.x(), foot->centre.y());
    const auto section = cut(group.triangles, z + kBreast);
    if (!section) continue;
    TrueObject trunk;
    trunk.kind = SemanticClass::kTrunk;
    trunk.position = section->centre;
    trunk.size = section->girth / std::numbers::pi;
    trunk.mapped_fraction = mapped_share(group, near, [&](const Vec3& p, const Vec3&) {
      return p.z() > z + 0.4 && p.z() < z + 3.0;
    });
    trunks.push_back(trunk);
  }
  return trunks;
}

/// The upper face of a slab: what has nothing of it above.
class UpperFace {
 public:
  explicit UpperFace(const Group& group) {
    for (const Triangle& t : group.triangles) {
      sample(t, kSampleSide, [&](const Vec3& p, const Vec3&) {
        const auto [at, fresh] = top_.try_emplace(key(p), p.z());
        if (!fresh) at->second = std::max(at->second, p.z());
      });
    }
  }
  [[nodiscard]] bool has(const Vec3& p) const { return p.z() > top_.at(key(p)) - kWithin; }

 private:
  static constexpr double kSquare = 0.2, kWithin = 0.2;  // m: less than a slab, more than its slope
  static std::int64_t key(const Vec3& p) {
    return (static_cast<std::int64_t>(std::floor(p.x() / kSquare)) << 32) ^
           (static_cast<std::int64_t>(std::floor(p.y() / kSquare)) & 0xffffffff);
  }
  std::unordered_map<std::int64_t, double> top_;
};

std::vector<TrueObject> true_parts(const World& world, SemanticClass kind, const Nearness& near) {
  constexpr double kFeet = 0.3;  // m, hidden by kerbs and wheels
  std::vector<TrueObject> parts;
  for (const Group& group : groups_of(world, surface_of(kind), true)) {
    const bool door = kind == SemanticClass::kDoor;
    const Footprint footprint = footprint_of(door ? group.tallest : group.triangles);
    TrueObject part;
    part.kind = kind;
    part.position = footprint.centre;
    part.size = footprint.length;
    const double low = group.box.min().z();
    const bool ramp = kind == SemanticClass::kRamp;
    const std::optional<UpperFace> upper =
        ramp ? std::optional<UpperFace>(std::in_place, group) : std::nullopt;
    part.mapped_fraction = mapped_share(group, near, [&](const Vec3& p, const Vec3& normal) {
      if (ramp) return upper->has(p);
      const bool level = std::abs(normal.z()) > 0.9;
      return (kind == SemanticClass::kCar || !level) && p.z() > low + kFeet;
    });
    if (kind == SemanticClass::kPillar) part.counts = footprint.width > 0.5 * footprint.length;
    parts.push_back(part);
  }
  return parts;
}

struct Pair {
  double distance;
  std::size_t found, truth;
};

ClassScore score_class(SemanticClass kind, const std::vector<const SemanticObject*>& found,
                       const std::vector<Vec2>& found_W, const std::vector<TrueObject>& truth,
                       const SemanticScoreConfig& config) {
  std::vector<Pair> pairs;
  for (std::size_t i = 0; i < found.size(); ++i) {
    for (std::size_t j = 0; j < truth.size(); ++j) {
      if (truth[j].kind != kind) continue;
      const double distance = (found_W[i] - truth[j].position).norm();
      if (distance <= reach_of(kind)) pairs.push_back({distance, i, j});
    }
  }
  std::sort(pairs.begin(), pairs.end(), [](const Pair& a, const Pair& b) {
    return std::tie(a.distance, a.found, a.truth) < std::tie(b.distance, b.found, b.truth);
  });
  std::vector<bool> found_taken(found.size(), false), truth_taken(truth.size(), false);
  ClassScore score;
  std::size_t left_out = 0;
  std::vector<double> positions, sizes;
  for (const Pair& pair : pairs) {
    if (found_taken[pair.found] || truth_taken[pair.truth]) continue;
    found_taken[pair.found] = truth_taken[pair.truth] = true;
    const TrueObject& object = truth[pair.truth];
    if (!object.counts || object.mapped_fraction < config.mapped_fraction) {
      ++left_out;
      continue;
    }
    ++score.right;
    positions.push_back(pair.distance);
    if (object.mapped_fraction < config.sized_fraction) continue;
    sizes.push_back(std::abs(found[pair.found]->size.x() - object.size));
  }
  for (const TrueObject& object : truth) {
    score.mapped +=
        object.kind == kind && object.counts && object.mapped_fraction >= config.mapped_fraction;
  }
  score.found = found.size() - left_out;
  score.sized = sizes.size();
  if (score.found > 0) {
    score.precision = static_cast<double>(score.right) / static_cast<double>(score.found);
  }
  if (score.mapped > 0) {
    score.recall = static_cast<double>(score.right) / static_cast<double>(score.mapped);
    score.f1 = score.found > 0 ? harmonic(score.precision, score.recall) : 0;
  }
  score.position_median_m = median(positions);
  score.size_median_m = median(sizes);
  return score;
}

/// A found wall in W, seen from above.
struct WallLine {
  Vec2 a, b;
  double low, high;
  [[nodiscard]] double distance(const Vec2& p) const {
    const Vec2 d = b - a;
    const double t = d.squaredNorm() > 0 ? std::clamp((p - a).dot(d) / d.squaredNorm(), 0., 1.) : 0;
    return (p - a - t * d).norm();
  }
};

ClassScore score_walls(const std::vector<WallLine>& found, const World& world,
                       const Nearness& near) {
  constexpr double kSide = 0.1, kRight = 0.15, kExplained = 0.2, kSlack = 0.3;  // m
  // Samples of upright true surfaces by squares of the plan.
  std::unordered_map<std::int64_t, std::vector<Vec3>> plan;
  constexpr double kSquare = 0.5;
  const auto square = [](double x, double y) {
    return (static_cast<std::int64_t>(std::floor(x / kSquare)) << 32) ^
           (static_cast<std::int64_t>(std::floor(y / kSquare)) & 0xffffffff);
  };
  std::size_t mapped = 0, explained = 0;
  for (std::size_t t = 0; t < world.mesh.triangles.size(); ++t) {
    const SurfaceClass kind = world.class_of_triangle(t);
    if (kind != SurfaceClass::kWall && kind != SurfaceClass::kDoor &&
        kind != SurfaceClass::kPillar) {
      continue;
    }
    const auto& [a, b, c] = world.mesh.triangles[t];
    const Triangle triangle{world.mesh.vertices[a].cast<double>(),
                            world.mesh.vertices[b].cast<double>(),
                            world.mesh.vertices[c].cast<double>()};
    sample(triangle, kSide, [&](const Vec3& p, const Vec3& normal) {
      if (std::abs(normal.z()) > 0.3) return;
      plan[square(p.x(), p.y())].push_back(p);
      if (kind != SurfaceClass::kWall || !near.at(p)) return;
      ++mapped;
      explained += std::any_of(found.begin(), found.end(), [&](const WallLine& wall) {
        return p.z() > wall.low - kSlack && p.z() < wall.high + kSlack &&
               wall.distance(p.head<2>()) <= kExplained;
      });
    });
  }
  std::size_t steps = 0, right = 0;
  std::vector<double> distances;
  for (const WallLine& wall : found) {
    const double length = (wall.b - wall.a).norm();
    const int count = std::max(1, static_cast<int>(std::lround(length / kSide)));
    for (int i = 0; i < count; ++i) {
      const Vec2 p = wall.a + (i + 0.5) / count * (wall.b - wall.a);
      double nearest = std::numeric_limits<double>::infinity();
      for (const double dx : {-kSquare, 0.0, kSquare}) {
        for (const double dy : {-kSquare, 0.0, kSquare}) {
          const auto found_square = plan.find(square(p.x() + dx, p.y() + dy));
          if (found_square == plan.end()) continue;
          for (const Vec3& q : found_square->second) {
            if (q.z() < wall.low - kSlack || q.z() > wall.high + kSlack) continue;
            nearest = std::min(nearest, (q.head<2>() - p).norm());
          }
        }
      }
      ++steps;
      right += nearest <= kRight;
      if (nearest <= kRight) distances.push_back(nearest);
    }
  }
  ClassScore score;
  score.found = found.size();
  if (steps > 0) score.precision = static_cast<double>(right) / static_cast<double>(steps);
  if (mapped > 0) {
    score.recall = static_cast<double>(explained) / static_cast<double>(mapped);
    score.f1 = steps > 0 ? harmonic(score.precision, score.recall) : 0;
  }
  score.position_median_m = median(distances);
  return score;
}

}  // namespace

const ClassScore& SemanticScore::of(SemanticClass kind) const {
  const auto at = std::find(kScoredClasses.begin(), kScoredClasses.end(), kind);
  return classes[static_cast<std::size_t>(at - kScoredClasses.begin())];
}

void add_figures(const SemanticScore& score, Figures& figures) {
  for (std::size_t i = 0; i < kScoredClasses.size(); ++i) {
    const ClassScore& of_class = score.classes[i];
    const std::string key =
        "semantic." +
        std::string(kSemanticClassNames[static_cast<std::size_t>(kScoredClasses[i])]) + ".";
    figures.set(key + "precision", of_class.precision);
    figures.set(key + "recall", of_class.recall);
    figures.set(key + "f1", of_class.f1);
    figures.set(key + "position_median_m", of_class.position_median_m);
    figures.set(key + "size_median_m", of_class.size_median_m);
  }
}

SemanticScore score_semantics(const SemanticMap& map, const std::vector<Vec3f>& cloud_O,
                              const Pose& X_WO, const World& world,
                              const SemanticScoreConfig& config) {
  const Nearness near(cloud_O, X_WO, config.near_m);
  SemanticScore score;
  if (world.terrain.columns > 0) score.truth = true_trunks(world, near);
  for (const SemanticClass kind : kScoredClasses) {
    if (kind == SemanticClass::kTrunk || kind == SemanticClass::kWall) continue;
    for (TrueObject& object : true_parts(world, kind, near)) score.truth.push_back(object);
  }
  for (std::size_t i = 0; i < kScoredClasses.size(); ++i) {
    const SemanticClass kind = kScoredClasses[i];
    std::vector<const SemanticObject*> found;
    std::vector<Vec2> found_W;
    std::vector<WallLine> walls;
    for (const SemanticObject& object : map.objects) {
      if (object.kind != kind) continue;
      const Vec3 p_W = X_WO * (object.position + map.origin);
      found.push_back(&object);
      found_W.emplace_back(p_W.head<2>());
      const Vec3 along_O(std::cos(object.yaw_rad), std::sin(object.yaw_rad), 0);
      const Vec2 half = 0.5 * object.size.x() * (X_WO.R * along_O).head<2>();
      walls.push_back({found_W.back() - half, found_W.back() + half,
                       p_W.z() - 0.5 * object.size.z(), p_W.z() + 0.5 * object.size.z()});
    }
    score.classes[i] = kind == SemanticClass::kWall
                           ? score_walls(walls, world, near)
                           : score_class(kind, found, found_W, score.truth, config);
  }
  return score;
}

}  // namespace arex::sim
