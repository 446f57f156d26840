#include "semantics/upright_structure.h"

#include <Eigen/Dense>
#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>
#include <map>
#include <numbers>
#include <optional>
#include <set>

#include "semantics/outlined_square.h"
#include "semantics/pcl_models.h"
#include "semantics/wall_band.h"

namespace arex {
namespace {

constexpr double kOnLine = 0.06;       // m, from a wall's line
constexpr double kTaken = 0.09;        // m, from a wall's face: no pillar's
constexpr double kWallGap = 1.0;       // m, a pillar or a door in a wall
constexpr double kLeastWall = 1.0;     // m, of a piece without a gap: more than a pillar's side
constexpr double kStraight = 0.03;     // m, deviation of a wall's points from its line
constexpr double kCovered = 0.6;       // of a wall's length
constexpr double kClusterStep = 0.25;  // m, between points of one cluster

/// The line through points: a point on it and its direction.
struct Line {
  Vec2 p = Vec2::Zero(), u = Vec2::UnitX();
  double across = 0;  ///< deviation of the points from it
  [[nodiscard]] double distance(const Vec2& q) const {
    return std::abs(u.x() * (q - p).y() - u.y() * (q - p).x());
  }
};

Line line_through(const std::vector<Vec2>& points) {
  Line line;
  for (const Vec2& q : points) line.p += q / static_cast<double>(points.size());
  Eigen::Matrix2d spread = Eigen::Matrix2d::Zero();
  for (const Vec2& q : points) {
    spread += (q - line.p) * (q - line.p).transpose() / static_cast<double>(points.size());
  }
  Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d> solver;
  solver.computeDirect(spread);
  line.u = solver.eigenvectors().col(1);
  line.across = std::sqrt(std::max(0.0, solver.eigenvalues()[0]));
  return line;
}

/// The line through a place that most points around it lie on, refined on those. A thin wall's
/// other face is near, too: the points as a whole would not do.
std::optional<Line> local_line(const std::vector<Vec2>& near, const Vec2& place) {
  constexpr std::size_t kFewest = 6;
  constexpr double kLeastArm = 0.15;  // m
  std::vector<Vec2> best;
  for (const Vec2& q : near) {
    const Vec2 arm = q - place;
    if (arm.norm() < kLeastArm) continue;
    const Line line{place, arm.normalized(), 0};
    std::vector<Vec2> on;
    for (const Vec2& p : near) {
      if (line.distance(p) < 0.5 * kOnLine) on.push_back(p);
    }
    if (on.size() > best.size()) best = std::move(on);
  }
  if (best.size() < kFewest) return std::nullopt;
  return line_through(best);
}

/// Of each of the band's points whether something stands there: a duct's underside is one flat
/// layer, and lines along it would cut the walls that it passes through.
std::vector<std::uint8_t> standing(const Band& band, const ColumnIndex& index) {
  constexpr float kAround = 0.12F, kLeast = 0.07F, kStorey = 1.5F;  // m
  std::vector<std::uint8_t> stands(band.points.size(), 0);
  for (std::size_t i = 0; i < band.points.size(); ++i) {
    const Vec3f& p = band.points[i];
    float low = p.z(), high = p.z();
    index.within(p.x(), p.y(), kAround, [&](std::uint32_t k) {
      const float z = band.points[k].z();
      if (std::abs(z - p.z()) > kStorey) return;
      low = std::min(low, z);
      high = std::max(high, z);
    });
    stands[i] = high - low > kLeast ? 1 : 0;
  }
  return stands;
}

/// Grows wall faces in one storey's band.
class WallGrower {
 public:
  WallGrower(const Band& band, const ColumnIndex& index)
      : band_(band), index_(index), free_(band.points.size(), 1), stands_(standing(band, index)) {}

  /// The long ones first, so that no short line takes a piece of a long one askew.
  std::vector<WallFace> grow_all() {
    std::vector<WallFace> walls;
    for (const double least : {8.0, 3.0, kLeastWall}) {
      std::set<std::uint64_t> tried;
      for (std::size_t i = 0; i < band_.points.size(); ++i) {
        if (!is_open(i) || tried.count(cell(i)) > 0) continue;
        if (auto wall = grow_from(i, least)) {
          for (std::size_t k : members(*wall, kTaken)) free_[k] = 0;
          walls.push_back(*wall);
        } else {
          tried.insert(cell(i));
        }
      }
    }
    return walls;
  }
  [[nodiscard]] const std::vector<std::uint8_t>& free() const { return free_; }

 private:
  [[nodiscard]] std::uint64_t cell(std::size_t i) const {  // one try in each 0.2 m, each storey
    const Vec3f c = (band_.points[i] / 0.2F).array().floor();
    return static_cast<std::uint64_t>(static_cast<std::int64_t>(c.x()) * 2000003 +
                                      static_cast<std::int64_t>(c.y())) *
               64 +
           static_cast<std::uint64_t>(static_cast<std::int64_t>(c.z() / 10) & 63);
  }

  std::optional<WallFace> grow_from(std::size_t seed, double least) const {
    constexpr float kLocal = 0.4F, kStorey = 1.5F;  // m
    constexpr std::size_t kFewest = 6;
    const Vec3f& s = band_.points[seed];
    std::vector<Vec2> near;
    index_.within(s.x(), s.y(), kLocal, [&](std::uint32_t i) {
      if (is_open(i) && std::abs(band_.points[i].z() - s.z()) < kStorey) {
        near.push_back(flat(band_.points[i]));
      }
    });
    if (near.size() < kFewest) return std::nullopt;
    const auto start = local_line(near, flat(s));
    if (!start) return std::nullopt;
    Line line = *start;
    WallFace wall;
    for (int round = 0; round < 12; ++round) {
      const double before = round == 0 ? 0 : wall.length();
      std::vector<Vec2> taken;
      if (!extend(line, flat(s), s.z(), wall, taken)) return std::nullopt;
      line = line_through(taken);
      if (round > 1 && wall.length() < before + 0.05) break;
    }
    if (wall.length() < least || line.across > kStraight) return std::nullopt;
    return wall;
  }

  /// What of the line around a point is covered without a wide gap.
  bool extend(const Line& line, const Vec2& from, float z, WallFace& wall,
              std::vector<Vec2>& taken) const {
    constexpr double kBin = 0.1;
    constexpr float kStorey = 1.5F;
    const double start = (from - line.p).dot(line.u);
    double ends[2] = {start, start};
    std::vector<int> filled;  // bins, from the start
    float low = z, high = z;
    for (const int side : {-1, 1}) {
      double gap = 0;
      int bin = side > 0 ? 0 : -1;
      for (double t = start + (side > 0 ? 0 : -kBin); gap <= kWallGap; t += side * kBin) {
        const Vec2 middle = line.p + (t + 0.5 * kBin) * line.u;
        const std::size_t before = taken.size();
        index_.within(static_cast<float>(middle.x()), static_cast<float>(middle.y()),
                      static_cast<float>(0.5 * kBin + kOnLine), [&](std::uint32_t i) {
                        const Vec2 p = flat(band_.points[i]);
                        const double at = (p - line.p).dot(line.u);
                        if (!is_open(i) || line.distance(p) > kOnLine || at < t || at >= t + kBin)
                          return;
                        if (std::abs(band_.points[i].z() - z) > kStorey) return;
                        taken.push_back(p);
                        low = std::min(low, band_.points[i].z());
                        high = std::max(high, band_.points[i].z());
                      });
        if (taken.size() > before) {
          filled.push_back(bin);
          gap = 0;
          ends[side > 0 ? 1 : 0] = side > 0 ? t + kBin : t;
        } else {
          gap += kBin;
        }
        bin += side;
      }
    }
    const double length = ends[1] - ends[0];
    const double covered = static_cast<double>(filled.size()) * kBin;
    if (taken.size() < 6 || covered < kCovered * length ||
        longest_run(std::move(filled)) * kBin < kLeastWall - kBin) {
      return false;
    }
    wall.a = line.p + ends[0] * line.u;
    wall.b = line.p + ends[1] * line.u;
    wall.low = static_cast<double>(low);
    wall.high = static_cast<double>(high);
    wall.points = static_cast<int>(taken.size());
    return true;
  }

  /// How many bins the longest piece spans that has no gap wider than between points far off.
  static int longest_run(std::vector<int> bins) {
    constexpr int kStep = 3;  // bins
    std::sort(bins.begin(), bins.end());
    int longest = 0;
    for (std::size_t first = 0, last = 0; first < bins.size(); first = last) {
      for (last = first + 1; last < bins.size() && bins[last] - bins[last - 1] <= kStep; ++last) {
      }
      longest = std::max(longest, bins[last - 1] - bins[first] + 1);
    }
    return longest;
  }

  [[nodiscard]] std::vector<std::size_t> members(const WallFace& wall, double within) const {
    std::vector<std::size_t> out;
    const int steps = std::max(1, static_cast<int>(std::ceil(wall.length() / 0.5)));
    for (int k = 0; k <= steps; ++k) {
      const Vec2 p = wall.a + static_cast<double>(k) / steps * (wall.b - wall.a);
      index_.within(static_cast<float>(p.x()), static_cast<float>(p.y()), 0.5F,
                    [&](std::uint32_t i) {
                      const auto z = static_cast<double>(band_.points[i].z());
                      if (free_[i] != 0 && z > wall.low - 0.5 && z < wall.high + 0.5 &&
                          wall.distance(flat(band_.points[i])) <= within) {
                        out.push_back(i);
                      }
                    });
    }
    return out;
  }

  /// Whether a wall may be made of it.
  [[nodiscard]] bool is_open(std::size_t point) const {
    return free_[point] != 0 && stands_[point] != 0;
  }

  const Band& band_;
  const ColumnIndex& index_;
  std::vector<std::uint8_t> free_, stands_;
};

/// Whether things reach up through the metre below the band, and to the floor as far as one can
/// see.
bool reaches_down(const Rectangle& box, const ColumnIndex& index, const WorkingCloud& cloud,
                  const Clearances& clearances, double base_z, Pillar& pillar) {
  constexpr double kLayer = 0.15, kFrom = 0.9, kSlack = 0.1;  // m
  const int layers = static_cast<int>((BandHeights::kLow - kFrom) / kLayer);
  std::vector<bool> filled(static_cast<std::size_t>(layers), false);
  const double reach = 0.5 * std::hypot(box.length, box.width) + kSlack;
  double top = base_z;
  index.within(static_cast<float>(box.centre.x()), static_cast<float>(box.centre.y()),
               static_cast<float>(reach), [&](std::uint32_t i) {
                 const double h = static_cast<double>(clearances.above_floor[i]);
                 const auto z = static_cast<double>(cloud.points[i].z());
                 if (std::abs(z - h - base_z) > 0.5) return;
                 if (!box.reaches(flat(cloud.points[i]), kSlack)) return;
                 top = std::max(top, z);
                 const double layer = (h - kFrom) / kLayer;
                 if (layer >= 0 && layer < layers) filled[static_cast<std::size_t>(layer)] = true;
               });
  pillar.top_z = top;
  return 10 * std::count(filled.begin(), filled.end(), true) >= 6 * layers;
}

/// A pillar that shows only what sticks out of a wall, as deep as it is wide.
void complete(Pillar& pillar, const WallFace& wall, const std::vector<Vec2>& points) {
  const Vec2 u = wall.along();
  Vec2 n = wall.normal();
  if ((pillar.box.centre - wall.a).dot(n) < 0) n = -n;
  double low = std::numeric_limits<double>::infinity(), high = -low, front = -low;
  for (const Vec2& p : points) {
    low = std::min(low, (p - wall.a).dot(u));
    high = std::max(high, (p - wall.a).dot(u));
    front = std::max(front, (p - wall.a).dot(n));
  }
  const double width = high - low;
  pillar.box.centre = wall.a + 0.5 * (low + high) * u + (front - 0.5 * width) * n;
  pillar.box.length = pillar.box.width = width;
  pillar.box.yaw_rad = std::fmod(std::atan2(u.y(), u.x()) + 2 * std::numbers::pi, std::numbers::pi);
}

/// Whether a corner of one lies in the other: enough for what is about as large.
bool overlap(const Rectangle& a, const Rectangle& b) {
  const auto reaches = [](const Rectangle& one, const Rectangle& other) {
    const Vec2 u = 0.5 * one.length * one.along(), v = 0.5 * one.width * one.across();
    for (const Vec2& corner : {Vec2(u + v), Vec2(u - v), Vec2(-u + v), Vec2(-u - v)}) {
      if (other.distance(one.centre + corner) < 0) return true;
    }
    return false;
  };
  return reaches(a, b) || reaches(b, a);
}

/// A pillar as one of its pieces has it.
struct PillarPiece {
  Pillar pillar;
  double gain = 0;  ///< of its outline, m; 0 if none was fitted
};

std::vector<Pillar> merge_twins(std::vector<PillarPiece> pieces) {
  constexpr double kTwins = 0.45;  // m: one pillar, seen from both sides of its wall
  // The piece whose outline is filled best says where the pillar is.
  std::stable_sort(pieces.begin(), pieces.end(),
                   [](const PillarPiece& a, const PillarPiece& b) { return a.gain > b.gain; });
  std::vector<Pillar> pillars;
  for (const PillarPiece& piece : pieces) pillars.push_back(piece.pillar);
  for (std::size_t i = 0; i < pillars.size(); ++i) {
    for (std::size_t j = i + 1; j < pillars.size();) {
      Pillar &a = pillars[i], &b = pillars[j];
      const bool twins = overlap(a.box, b.box) || (a.box.centre - b.box.centre).norm() < kTwins;
      if (!twins || std::abs(a.base_z - b.base_z) > 1.5) {
        ++j;
        continue;
      }
      if (a.attached && b.attached) a.box.centre = 0.5 * (a.box.centre + b.box.centre);
      if (a.attached && !b.attached) a.box = b.box;
      a.attached = a.attached && b.attached;
      a.points += b.points;
      a.top_z = std::max(a.top_z, b.top_z);
      pillars.erase(pillars.begin() + static_cast<std::ptrdiff_t>(j));
    }
  }
  return pillars;
}

/// What of the band no wall has taken falls into pieces; pillars are made of them.
class PillarFinder {
 public:
  PillarFinder(const Band& band, const BandHeights& heights, const ColumnIndex& index,
               const std::vector<WallFace>& walls, const WorkingCloud& cloud,
               const ColumnIndex& all, const Clearances& clearances, const GarageConfig& config)
      : band_(band),
        heights_(heights),
        index_(index),
        walls_(walls),
        cloud_(cloud),
        all_(all),
        clearances_(clearances),
        config_(config) {}

  [[nodiscard]] std::vector<Pillar> find(const std::vector<std::uint8_t>& free) const {
    constexpr int kFewest = 12;
    std::vector<Vec3f> rest;
    std::vector<std::uint32_t> of_cloud;
    for (std::size_t i = 0; i < free.size(); ++i) {
      if (free[i] == 0) continue;
      rest.push_back(band_.points[i]);
      of_cloud.push_back(band_.of_cloud[i]);
    }
    std::vector<PillarPiece> pillars;
    for (const auto& cluster : euclidean_clusters(rest, kClusterStep, kFewest)) {
      const Piece piece = piece_of(rest, of_cloud, cluster);
      if (rectangle_around(piece.points, 0, 0).length <= 2 * config_.pillar_max_m) {
        if (auto pillar = pillar_of(piece)) pillars.push_back(*pillar);
        continue;
      }
      // A duct or a pipe that passes by joins what stands.
      std::vector<Vec3f> standing;
      std::vector<std::uint32_t> standing_of;
      for (const std::uint32_t i : upright_of(rest, of_cloud, cluster)) {
        standing.push_back(rest[i]);
        standing_of.push_back(of_cloud[i]);
      }
      for (const auto& part : euclidean_clusters(standing, kClusterStep, kFewest)) {
        if (auto pillar = pillar_of(piece_of(standing, standing_of, part))) {
          pillars.push_back(*pillar);
        }
      }
    }
    return merge_twins(std::move(pillars));
  }

 private:
  static constexpr double kLeastProud = 0.28;  // m, side of a pillar at a wall
  static constexpr double kUpright = 0.6;      // of the band's height
  static constexpr double kOneSide = 0.35;     // width over length
  struct Piece {
    std::vector<Vec2> points;
    double z = 0, base_z = 0;  ///< of one of its points; of its floor
    float room = std::numeric_limits<float>::infinity();
    float low = std::numeric_limits<float>::infinity(), high = 0;  ///< above the floor
    double band = 0;  ///< the band's height where it is highest
  };

  [[nodiscard]] Piece piece_of(const std::vector<Vec3f>& points,
                               const std::vector<std::uint32_t>& of_cloud,
                               const std::vector<std::uint32_t>& cluster) const {
    Piece piece;
    std::vector<float> floors;
    for (const std::uint32_t i : cluster) {
      const std::uint32_t k = of_cloud[i];
      piece.points.push_back(flat(points[i]));
      piece.room = std::min(piece.room, clearances_.room[k]);
      floors.push_back(points[i].z() - clearances_.above_floor[k]);
      piece.low = std::min(piece.low, clearances_.above_floor[k]);
      piece.high = std::max(piece.high, clearances_.above_floor[k]);
      piece.band = std::max(piece.band, heights_.high(k) - heights_.low(k));
    }
    piece.z = static_cast<double>(points[cluster.front()].z());
    const auto mid = floors.begin() + static_cast<std::ptrdiff_t>(floors.size() / 2);
    std::nth_element(floors.begin(), mid, floors.end());
    piece.base_z = static_cast<double>(*mid);
    return piece;
  }

  /// Those of a cluster above and below which the band is filled, within a hand's breadth.
  [[nodiscard]] std::vector<std::uint32_t> upright_of(
      const std::vector<Vec3f>& points, const std::vector<std::uint32_t>& of_cloud,
      const std::vector<std::uint32_t>& cluster) const {
    constexpr float kSquare = 0.05F;  // m
    constexpr double kLayer = 0.15;   // m
    const auto square = [&](std::uint32_t i) {
      return Eigen::Vector2i((points[i].head<2>() / kSquare).array().floor().cast<int>());
    };
    std::map<std::pair<int, int>, std::uint32_t> layers;
    for (const std::uint32_t i : cluster) {
      const std::uint32_t k = of_cloud[i];
      const double above = static_cast<double>(clearances_.above_floor[k]) - heights_.low(k);
      const Eigen::Vector2i at = square(i);
      layers[{at.x(), at.y()}] |= 1U
                                  << static_cast<unsigned>(std::clamp(above / kLayer, 0.0, 31.0));
    }
    std::vector<std::uint32_t> upright;
    for (const std::uint32_t i : cluster) {
      const std::uint32_t k = of_cloud[i];
      const Eigen::Vector2i at = square(i);
      std::uint32_t filled = 0;
      for (int dy = -1; dy <= 1; ++dy) {
        for (int dx = -1; dx <= 1; ++dx) {
          const auto found = layers.find({at.x() + dx, at.y() + dy});
          if (found != layers.end()) filled |= found->second;
        }
      }
      const double band = heights_.high(k) - heights_.low(k);
      if (std::popcount(filled) * kLayer >= kUpright * band) upright.push_back(i);
    }
    return upright;
  }

  [[nodiscard]] std::optional<PillarPiece> pillar_of(const Piece& piece) const {
    constexpr double kTail = 0.04;                 // of the points: edges throw some off
    constexpr double kTouch = 0.2, kProud = 0.08;  // m
    constexpr double kBeam = 0.9, kPost = 0.3;     // m
    // Door leaves and frames reach into the band, no further.
    if (static_cast<double>(piece.high - piece.low) < kUpright * piece.band) return std::nullopt;
    PillarPiece found;
    Pillar& pillar = found.pillar;
    pillar.base_z = piece.base_z;
    pillar.points = static_cast<int>(piece.points.size());
    pillar.box = fit_rectangle(piece.points, kTail);
    if (pillar.box.length > config_.pillar_max_m) return std::nullopt;
    if (!reaches_down(pillar.box, all_, cloud_, clearances_, pillar.base_z, pillar)) {
      return std::nullopt;
    }
    const auto wall = std::find_if(walls_.begin(), walls_.end(), [&](const WallFace& w) {
      return piece.z > w.low - 1 && piece.z < w.high + 1 &&
             std::any_of(piece.points.begin(), piece.points.end(),
                         [&](const Vec2& p) { return w.distance(p) < kTouch; });
    });
    const bool at_wall = wall != walls_.end();
    // Two sides of one that are seen alone are far apart.
    const bool one_side = pillar.box.width < kOneSide * pillar.box.length;
    const auto square = at_wall ? square_at(piece, std::atan2(wall->along().y(), wall->along().x()))
                        : one_side ? square_at(piece, pillar.box.yaw_rad)
                                   : std::nullopt;
    if (square) {
      pillar.box = square->box;
      found.gain = square->gain;
    }
    if (pillar.box.length < config_.pillar_min_m) return std::nullopt;
    // It bears a ceiling, or is too thick for a lamp post.
    const bool bears = pillar.top_z > pillar.base_z + static_cast<double>(piece.room) - kBeam;
    if (std::isfinite(piece.room) ? !bears : pillar.box.length < kPost) return std::nullopt;
    if (at_wall && !square) {
      double proud = 0;
      for (const Vec2& p : piece.points) proud = std::max(proud, wall->distance(p));
      if (proud < kProud || pillar.box.length < kLeastProud) return std::nullopt;
      pillar.attached = true;
      complete(pillar, *wall, piece.points);
    } else if (pillar.box.width < kOneSide * pillar.box.length) {
      // One face is all that was seen: as deep as it is wide, on the side where nothing is.
      pillar.attached = true;
    }
    return found;
  }

  [[nodiscard]] std::optional<FittedSquare> square_at(const Piece& piece, double yaw) const {
    constexpr double kStorey = 1.5;  // m
    const Vec2 middle = rectangle_around(piece.points, 0, 0).centre;
    std::vector<Vec2> around;
    index_.within(static_cast<float>(middle.x()), static_cast<float>(middle.y()),
                  static_cast<float>(std::numbers::sqrt2 * OutlinedSquare::kReach),
                  [&](std::uint32_t i) {
                    if (std::abs(static_cast<double>(band_.points[i].z()) - piece.z) < kStorey) {
                      around.push_back(flat(band_.points[i]));
                    }
                  });
    return OutlinedSquare(piece.points, around, yaw)
        .fit(std::max(kLeastProud, config_.pillar_min_m), config_.pillar_max_m);
  }

  const Band& band_;
  const BandHeights& heights_;
  const ColumnIndex& index_;
  const std::vector<WallFace>& walls_;
  const WorkingCloud& cloud_;
  const ColumnIndex& all_;
  const Clearances& clearances_;
  const GarageConfig& config_;
};

/// A wall's floor, by the band's points on it.
double floor_of(const WallFace& wall, const Band& band, const ColumnIndex& index,
                const Clearances& clearances) {
  std::vector<float> floors;
  const Vec2 middle = 0.5 * (wall.a + wall.b);
  index.within(static_cast<float>(middle.x()), static_cast<float>(middle.y()),
               static_cast<float>(0.5 * wall.length() + kOnLine), [&](std::uint32_t i) {
                 const auto z = static_cast<double>(band.points[i].z());
                 if (wall.distance(flat(band.points[i])) > kOnLine || z < wall.low - 0.1 ||
                     z > wall.high + 0.1) {
                   return;
                 }
                 floors.push_back(band.points[i].z() - clearances.above_floor[band.of_cloud[i]]);
               });
  if (floors.empty()) return wall.low - BandHeights::kLow;
  const auto mid = floors.begin() + static_cast<std::ptrdiff_t>(floors.size() / 2);
  std::nth_element(floors.begin(), mid, floors.end());
  return static_cast<double>(*mid);
}

/// Whether a wall goes on below the band, where a pipe or a beam does not; sets its top. The roofs
/// of cars below a pipe lie at one height each, where a wall fills several.
bool stands(WallFace& wall, const WorkingCloud& cloud, const ColumnIndex& all,
            const Clearances& clearances) {
  constexpr double kBin = 0.25, kFrom = 1.3, kTo = 1.95, kShare = 0.35, kNear = 0.12;
  constexpr double kLayer = 0.15;  // m
  constexpr int kFewest = 2;       // layers
  const auto count = static_cast<std::size_t>(wall.length() / kBin) + 1;
  std::vector<std::uint8_t> layers(count, 0);
  float top = static_cast<float>(wall.high);
  for (std::size_t k = 0; k < count; ++k) {
    const Vec2 p = wall.a + (static_cast<double>(k) + 0.5) * kBin * wall.along();
    all.within(static_cast<float>(p.x()), static_cast<float>(p.y()),
               static_cast<float>(0.5 * kBin + kNear), [&](std::uint32_t i) {
                 const auto h = static_cast<double>(clearances.above_floor[i]);
                 const auto z = static_cast<double>(cloud.points[i].z());
                 if (!(std::abs(z - h - wall.base_z) < 1.0)) return;
                 if (wall.distance(flat(cloud.points[i])) > kNear) return;
                 if (h > kFrom && h < kTo) {
                   layers[k] |=
                       static_cast<std::uint8_t>(1U << static_cast<unsigned>((h - kFrom) / kLayer));
                 }
                 if (h <= static_cast<double>(clearances.room[i])) {
                   top = std::max(top, cloud.points[i].z());
                 }
               });
  }
  wall.high = static_cast<double>(top);
  const auto filled = std::count_if(layers.begin(), layers.end(),
                                    [](std::uint8_t bin) { return std::popcount(bin) >= kFewest; });
  return static_cast<double>(filled) >= kShare * static_cast<double>(count);
}

}  // namespace

UprightStructure find_upright_structure(const WorkingCloud& cloud, const Clearances& clearances,
                                        const GarageConfig& config) {
  UprightStructure structure;
  const BandHeights heights(clearances);
  const Band band = band_of(cloud, heights);
  if (band.points.empty()) return structure;
  const ColumnIndex index(band.points, cloud.low, cloud.high, WorkingCloud::kCell);
  const ColumnIndex all(cloud.points, cloud.low, cloud.high, WorkingCloud::kCell);
  WallGrower grower(band, index);
  for (WallFace& wall : grower.grow_all()) {
    wall.base_z = floor_of(wall, band, index, clearances);
    if (stands(wall, cloud, all, clearances)) structure.walls.push_back(wall);
  }
  structure.pillars =
      PillarFinder(band, heights, index, structure.walls, cloud, all, clearances, config)
          .find(grower.free());
  return structure;
}

}  // namespace arex
