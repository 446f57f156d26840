#pragma once

#include <cstddef>
#include <functional>

namespace arex {

/// Does pieces 0 to count - 1 of a piece of work, in any order and on any thread; returns when all
/// are done. Pieces share nothing that changes.
using Split = std::function<void(std::size_t count, const std::function<void(std::size_t)>& piece)>;

/// On the caller's thread, one after the other.
inline void in_turn(std::size_t count, const std::function<void(std::size_t)>& piece) {
  for (std::size_t i = 0; i < count; ++i) piece(i);
}

}  // namespace arex
