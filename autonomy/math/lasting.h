#pragma once

#include <utility>

#include "math/types.h"

namespace arex {

/// Something that must last before it is told.
class Lasting {
 public:
  /// @return whether it has now lasted for `wanted` and had not before
  bool holds(bool now_so, Stamp now, Stamp wanted) {
    if (!now_so) {
      since_ = -1;
      told_ = false;
      return false;
    }
    if (since_ < 0) since_ = now;
    return now - since_ >= wanted && !std::exchange(told_, true);
  }

 private:
  Stamp since_ = -1;  ///< not now: -1
  bool told_ = false;
};

}  // namespace arex
