#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "odometry/lidar_inertial_config.h"

namespace arex {

/// Where a surface runs through a cell of the map, seen from one query point.
struct SurfelMatch {
  Vec3 normal = Vec3::UnitZ();  ///< unit, sign arbitrary
  Vec3 mean = Vec3::Zero();     ///< of the surfel's points, in O, m
  double variance_m2 = 0;  ///< of the surface's height along the normal at the query: thickness
                           ///< and the fit's own variance
  Mat3 normal_covariance = Mat3::Zero();  ///< of the normal's error, in O
  int level = 0;                          ///< 0: the finest
  int born = 0;                           ///< the insertion that began its cell
  std::uint32_t cell = 0;                 ///< its number in its level
};

/// Hashed cells of several resolutions. Each keeps the weighted moments of the points that fell
/// into it, and the plane fitted to them (a surfel). A query is answered by the resolution that is
/// surest of its surface there: a wall by a large cell that averages hundreds of points, a trunk by
/// the smallest. Cells stand on a corner: were their faces level and upright, the noise that
/// carries points across a face would cut off one tail of every floor and wall that runs beside
/// one, over its whole length, and bend it. Memory is fixed: when a level is full the cells longest
/// unseen make room (CLOCK).
///
/// Source: the moments are those of the normal-distributions transform (Biber and Strasser, 2003),
/// the variance of a fitted plane that of a linear regression, CLOCK is Corbato's, 1968.
class SurfelMap {
 public:
  explicit SurfelMap(const SurfelMapConfig& config);

  void clear();

  /// Adds points, each with the variance of its position.
  /// @param insertion a number for what it begins, SurfelMatch::born
  void insert(std::span<const Vec3f> points_O, std::span<const float> variances_m2,
              int insertion = 0);

  /// The surfel with the least variance at p_O among the cells that hold p_O, if any has one.
  [[nodiscard]] std::optional<SurfelMatch> find(const Vec3& p_O) const;

  /// Calls visit(i, find(points_O[i])) for each point in order. The time of a query goes into
  /// waiting for memory, so that what it reads is asked for some points ahead.
  template <typename Visit>
  void find_each(std::span<const Vec3> points_O, Visit visit) const {
    constexpr std::size_t kSlotsAhead = 16, kSurfelsAhead = 8;
    std::array<Query, kSlotsAhead> queries;
    const std::size_t n = points_O.size();
    for (std::size_t i = 0; i < n + kSlotsAhead; ++i) {
      // A query's place is taken again only after it was answered.
      if (i >= kSlotsAhead) {
        visit(i - kSlotsAhead, answer(queries[i % kSlotsAhead]));
      }
      if (i < n) queries[i % kSlotsAhead] = begin(points_O[i]);
      if (i >= kSurfelsAhead && i - kSurfelsAhead < n) {
        look_up(queries[(i - kSurfelsAhead) % kSlotsAhead]);
      }
    }
  }

  /// Whether some cell of the coarsest level that holds a surfel contains p_O.
  [[nodiscard]] bool occupied(const Vec3& p_O) const;

  /// From O to the axes of the cells: the vertical is the cells' diagonal, so that their faces lie
  /// 35 degrees from every upright plane, 55 from every level one and 25 from a ramp of 30.
  static const Mat3 kR_GO;

  [[nodiscard]] double edge_m(int level) const {
    return config_.finest_edge_m * static_cast<double>(1 << level);
  }
  [[nodiscard]] std::size_t cells(int level) const {
    return levels_[static_cast<std::size_t>(level)].cells.size();
  }
  [[nodiscard]] std::size_t memory_bytes() const;

  /// What a cell says of its points: for the oracle in the tests.
  struct Fit {
    Vec3 mean, normal;
    double thickness_m2 = 0;  ///< variance about the plane, with the prior of the points' own noise
    Mat3 regression;          ///< d^T regression d: variance of the plane's height at mean + d
  };
  /// Fits a plane to moments: count, sum of weights w = 1/variance, weighted mean and covariance.
  static Fit fit(int count, double weight, const Vec3& mean, const Mat3& covariance);

 private:
  static constexpr std::uint32_t kNone = 0xffffffffU;
  static constexpr std::size_t kMostLevels = 4;

  /// Moments in G relative to the cell's centre, weights relative to 1 cm of noise. One cache line.
  struct alignas(64) Cell {
    std::uint64_t key = 0;
    std::int32_t count = 0;
    std::int32_t refresh_at = 0;
    float weight = 0;
    std::array<float, 3> first{};
    std::array<float, 6> second{};
  };
  /// The fitted plane, in G. One cache line.
  struct alignas(64) Surfel {
    std::array<float, 3> mean{};  ///< relative to the cell's centre
    std::array<float, 3> normal{};
    std::array<float, 6> regression{};
    float thickness_m2 = -1;  ///< negative: no surfel
    std::int32_t born = 0;
  };
  /// Four to a cache line; what most insertions end at, so that a saturated cell is not fetched.
  struct Slot {
    std::uint64_t key = 0;
    std::uint32_t cell = kNone;
    std::uint16_t seen = 0;  ///< CLOCK's reference bit
    std::uint16_t saturated = 0;
  };
  struct Level {
    double edge_m = 1;
    double inverse_edge = 1;
    std::vector<Slot> slots;  ///< open addressing, linear probing, power of two
    std::vector<Cell> cells;  ///< as many as were needed so far
    std::vector<Surfel> surfels;
    std::size_t hand = 0;  ///< CLOCK's
  };

  /// A point and the cells that hold it, one of each level. Asked in three steps, of which each
  /// asks the memory for what the next reads.
  struct Query {
    Vec3 p_G;
    std::array<std::uint64_t, kMostLevels> keys;
    std::array<std::uint32_t, kMostLevels> cells;
  };
  [[nodiscard]] Query begin(const Vec3& p_O) const;
  void look_up(Query& query) const;
  [[nodiscard]] std::optional<SurfelMatch> answer(const Query& query) const;

  /// The slot that holds `key`, or the empty one where it would go.
  static std::size_t slot_of(const Level& level, std::uint64_t key);
  /// Room for so many cells more, a slot taken for each two.
  void make_slots(Level& level, std::size_t more_cells) const;
  Slot& obtain(Level& level, std::uint64_t key, int insertion);
  [[nodiscard]] std::uint32_t make_room(Level& level) const;
  static void erase_slot(Level& level, std::size_t hole);
  void add(Level& level, Slot& slot, const Vec3& offset_G, float weight);
  void refresh(const Level& level, const Cell& cell, Surfel& surfel) const;

  SurfelMapConfig config_;
  std::vector<Level> levels_;
};

}  // namespace arex
