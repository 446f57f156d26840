#pragma once

#include <cstdint>
#include <limits>
#include <unordered_map>

#include "math/types.h"

namespace arex::sim {

struct PathMeterConfig {
  double revisit_cell_m = 1.0;
  double revisit_gap_m = 3.0;
  double heading_step_m = 0.5;

  void fields(auto& f) {
    f("revisit_cell_m", revisit_cell_m, "side of the square cells that are visited");
    f("revisit_gap_m", revisit_gap_m, "path flown elsewhere before a return counts as a revisit");
    f("heading_step_m", heading_step_m, "chord over which the course is taken");
    f.check(revisit_cell_m >= 0.05, "revisit_cell_m >= 0.05");
    f.check(revisit_gap_m >= 1.5 * revisit_cell_m,
            "revisit_gap_m >= 1.5 revisit_cell_m (a cell's diagonal)");
    f.check(heading_step_m >= 0.01, "heading_step_m >= 0.01");
  }
};

/// What a flown path says about how well it was chosen: how much of it repeats itself, and how much
/// it turns. Horizontal only: hovering, climbing and turning on the spot add nothing.
class PathMeter {
 public:
  explicit PathMeter(const PathMeterConfig& config = {}) : config_(config) {}

  /// The next position of the path, m. @param mapped whether the place was known before: only then
  /// can it be a revisit
  void add(const Vec3& p_W, bool mapped);

  [[nodiscard]] double length_m() const { return length_m_; }
  /// Share of the path inside cells that were mapped, visited and left before; not a number
  /// without a path.
  [[nodiscard]] double revisit_ratio() const {
    return length_m_ > 0 ? revisited_m_ / length_m_ : kUnknown;
  }
  /// Sum of the course's absolute changes over the path's length, in rad/m; not a number without
  /// a path.
  [[nodiscard]] double heading_change_radpm() const {
    return chords_m_ > 0 ? turned_rad_ / chords_m_ : kUnknown;
  }

 private:
  static constexpr double kUnknown = std::numeric_limits<double>::quiet_NaN();
  struct Visit {
    double last_m = 0;      ///< where on the path the cell was last entered or crossed
    bool returned = false;  ///< the present stay is a revisit
  };
  void add_piece(const Vec2& from, const Vec2& to, bool mapped);
  void add_course(const Vec2& to);

  PathMeterConfig config_;
  bool started_ = false;
  Vec2 previous_ = Vec2::Zero();
  double length_m_ = 0;
  double revisited_m_ = 0;
  std::unordered_map<std::uint64_t, Visit> visits_;  ///< looked up only, never walked through

  Vec2 chord_start_ = Vec2::Zero();
  bool has_course_ = false;
  double course_rad_ = 0;
  double turned_rad_ = 0;
  double chords_m_ = 0;
};

}  // namespace arex::sim
