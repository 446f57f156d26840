#pragma once

namespace arex {

/// Whether corrections stay away. Where each comes late, the time since the newest passes the limit
/// before every one: silence lasts until a whole interval between two of them has been without.
class Silence {
 public:
  explicit Silence(double limit_s) : limit_s_(limit_s) {}

  /// @param since_s time since the moment that the newest correction is of
  /// @returns whether the source is silent
  bool wait(double since_s) {
    in_this_interval_ = in_this_interval_ || since_s > limit_s_;
    return lasts();
  }
  /// A correction has come.
  void end_interval() {
    in_last_interval_ = in_this_interval_;
    in_this_interval_ = false;
  }
  [[nodiscard]] bool lasts() const { return in_this_interval_ || in_last_interval_; }

 private:
  double limit_s_;
  bool in_this_interval_ = false, in_last_interval_ = false;
};

}  // namespace arex
