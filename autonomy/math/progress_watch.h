#pragma once

#include <limits>

#include "math/types.h"

namespace arex {

/// Notices when a distance that should fall does not: progress is what was gained of the way, not
/// the time that went by.
class ProgressWatch {
 public:
  /// @param step_m less than this is noise, not progress
  explicit ProgressWatch(double step_m) : step_m_(step_m) {}

  /// A new way, from now on.
  void begin(Stamp now) {
    least_m_ = std::numeric_limits<double>::infinity();
    since_ = now;
  }
  /// The way has turned out longer: what is left of it is measured from here. The clock runs on.
  void lengthen(double remaining_m) { least_m_ = remaining_m; }

  void update(double remaining_m, Stamp now) {
    if (remaining_m > least_m_ - step_m_) return;
    least_m_ = remaining_m;
    since_ = now;
  }
  /// The least that was left so far, m.
  [[nodiscard]] double least_m() const { return least_m_; }
  /// Since when nothing was gained.
  [[nodiscard]] Stamp since() const { return since_; }

 private:
  double step_m_;
  double least_m_ = std::numeric_limits<double>::infinity();
  Stamp since_ = 0;
};

}  // namespace arex
