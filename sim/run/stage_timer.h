#pragma once

#include <algorithm>
#include <chrono>
#include <limits>
#include <string>
#include <vector>

namespace arex::sim {

/// Host time of one stage of the loop, for timing.csv only: no logic reads it.
class StageTimer {
 public:
  explicit StageTimer(std::string name) : name_(std::move(name)) {}

  /// Times a scope.
  class Scope {
   public:
    explicit Scope(StageTimer& timer) : timer_(timer), begin_(Clock::now()) {}
    ~Scope() {
      timer_.seconds_.push_back(std::chrono::duration<float>(Clock::now() - begin_).count());
    }
    Scope(const Scope&) = delete;
    Scope& operator=(const Scope&) = delete;

   private:
    using Clock = std::chrono::steady_clock;
    StageTimer& timer_;
    Clock::time_point begin_;
  };

  [[nodiscard]] const std::string& name() const { return name_; }
  [[nodiscard]] const std::vector<float>& seconds() const { return seconds_; }

 private:
  std::string name_;
  std::vector<float> seconds_;
};

/// What timing.csv says of one module.
struct TimingRow {
  std::string module;
  std::size_t calls = 0;
  double median_ms = std::numeric_limits<double>::quiet_NaN();  ///< of no call there is none
  double p99_ms = std::numeric_limits<double>::quiet_NaN();
  double total_s = 0;
};

inline TimingRow timing_row(const std::string& module, std::vector<float> seconds) {
  TimingRow row;
  row.module = module;
  row.calls = seconds.size();
  if (seconds.empty()) return row;
  std::sort(seconds.begin(), seconds.end());
  row.median_ms = 1e3 * static_cast<double>(seconds[seconds.size() / 2]);
  row.p99_ms = 1e3 * static_cast<double>(seconds[seconds.size() * 99 / 100]);
  for (const float s : seconds) row.total_s += static_cast<double>(s);
  return row;
}

}  // namespace arex::sim
