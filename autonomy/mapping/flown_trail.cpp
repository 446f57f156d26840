#include "mapping/flown_trail.h"

#include "mapping/line_walk.h"

namespace arex {

void FlownTrail::add(const Vec2& p) {
  walk_line(geometry_, began_ ? last_ : p, p, [&](const Eigen::Vector2i& cell) {
    if (geometry_.contains(cell) && !seen_[geometry_.index(cell)]) {
      seen_[geometry_.index(cell)] = true;
      cells_.push_back(static_cast<std::uint32_t>(geometry_.index(cell)));
    }
    return true;
  });
  last_ = p;
  began_ = true;
}

}  // namespace arex
