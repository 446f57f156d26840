#include "mapping/flown_trail.h"

#include "mapping/line_walk.h"

namespace arex {

void FlownTrail::add(const Vec3& p_O) {
  const Vec2 p = p_O.head<2>();
  const bool goes_on = began_ && (p - last_).norm() <= kLongestStep_m;
  walk_line(geometry_, goes_on ? last_ : p, p, [&](const Eigen::Vector2i& cell) {
    if (geometry_.contains(cell) && !seen_[geometry_.index(cell)]) {
      seen_[geometry_.index(cell)] = true;
      cells_.push_back(static_cast<std::uint32_t>(geometry_.index(cell)));
      heights_m_.push_back(static_cast<float>(p_O.z()));
    }
    return true;
  });
  last_ = p;
  began_ = true;
}

}  // namespace arex
