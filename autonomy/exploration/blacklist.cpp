#include "exploration/blacklist.h"

#include <algorithm>
#include <cmath>

namespace arex {

void Blacklist::strike(const Vec2& target, Stamp now) {
  Entry* nearest = nullptr;
  for (Entry& entry : entries_) {
    const double distance = (entry.place - target).norm();
    if (distance > config_.radius_m) continue;
    if (nearest == nullptr || distance < (nearest->place - target).norm()) nearest = &entry;
  }
  if (nearest == nullptr) {
    nearest = &entries_.emplace_back();
    nearest->place = target;
  }
  nearest->until = now + from_seconds(std::ldexp(config_.duration_s, nearest->strikes));
  ++nearest->strikes;
}

bool Blacklist::bars(const Vec2& target, Stamp now) const {
  return std::any_of(entries_.begin(), entries_.end(), [&](const Entry& entry) {
    return (entry.place - target).norm() <= config_.radius_m &&
           (now < entry.until || entry.strikes >= config_.max_strikes);
  });
}

bool Blacklist::gave_up(const Vec2& target) const {
  return std::any_of(entries_.begin(), entries_.end(), [&](const Entry& entry) {
    return (entry.place - target).norm() <= config_.radius_m &&
           entry.strikes >= config_.max_strikes;
  });
}

}  // namespace arex
