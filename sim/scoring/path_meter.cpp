#include "scoring/path_meter.h"

#include <cmath>

#include "math/so3.h"

namespace arex::sim {

void PathMeter::add(const Vec3& p_W, bool mapped) {
  const Vec2 p = p_W.head<2>();
  if (!started_) {
    started_ = true;
    previous_ = chord_start_ = p;
    return;
  }
  // Pieces so short that one lies in about one cell.
  const double step = 0.1 * config_.revisit_cell_m;
  const int pieces = std::max(1, static_cast<int>(std::ceil((p - previous_).norm() / step)));
  const Vec2 start = previous_;
  for (int i = 1; i <= pieces; ++i) {
    const Vec2 to = start + (static_cast<double>(i) / pieces) * (p - start);
    add_piece(previous_, to, mapped);
    previous_ = to;
  }
  add_course(p);
}

void PathMeter::add_piece(const Vec2& from, const Vec2& to, bool mapped) {
  const double length = (to - from).norm();
  const Eigen::Vector2i cell =
      (0.5 * (from + to) / config_.revisit_cell_m).array().floor().cast<int>();
  const std::uint64_t key =
      (static_cast<std::uint64_t>(static_cast<std::uint32_t>(cell.x())) << 32) |
      static_cast<std::uint32_t>(cell.y());
  const auto [it, is_new] = visits_.try_emplace(key, Visit{length_m_, false});
  Visit& visit = it->second;
  if (!is_new && length_m_ - visit.last_m > config_.revisit_gap_m) visit.returned = true;
  if (visit.returned && mapped) revisited_m_ += length;
  length_m_ += length;
  visit.last_m = length_m_;
}

void PathMeter::add_course(const Vec2& to) {
  // A long step is one straight chord; short ones gather until they make one.
  const Vec2 chord = to - chord_start_;
  const double length = chord.norm();
  if (length < config_.heading_step_m) return;
  const double course = std::atan2(chord.y(), chord.x());
  if (has_course_) turned_rad_ += std::abs(so3::wrap(course - course_rad_));
  has_course_ = true;
  course_rad_ = course;
  chords_m_ += length;
  chord_start_ = to;
}

}  // namespace arex::sim
