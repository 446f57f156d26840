#include "stack/field_watch.h"

#include <algorithm>

namespace arex {

void FieldWatch::add(const Vec3& field_gauss) {
  if (field_gauss.isZero(0) || !field_gauss.allFinite()) return;
  const bool same = readings_ > 0 && field_gauss == last_;
  same_ = same ? same_ + 1 : 0;
  last_ = field_gauss;
  if (readings_ < kLearnt) {
    ++readings_;
    usual_ = std::max(usual_, same_);
  }
  // Steps are those between samples, however often the nine axes repeat one.
  if (!same) noise_.add(field_gauss);
}

std::optional<std::string> FieldWatch::update(bool in_air) {
  if (auto change = noise_.update()) return change;
  const bool stuck = same_ >= std::max(kStuck, kSlow * (usual_ + 1));
  if (stuck == stuck_ || (stuck && !in_air)) return std::nullopt;
  stuck_ = stuck;
  return stuck ? "imu's magnetometer stuck" : "imu's magnetometer sound again";
}

}  // namespace arex
