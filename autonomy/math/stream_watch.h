#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>

#include "math/types.h"

namespace arex {

/// When a stream of readings is called faulty.
struct StreamWatchConfig {
  double silent_s = 0.5;      ///< without a reading: silent
  double silent_periods = 0;  ///< and so many of its usual periods: of what comes at any rate
  int stuck_readings = 100;   ///< in a row without a changed bit: stuck; no real sensor is so still
  double late_s = 0.03;       ///< readings come this much later than at first: late
  double missing_share = 0.05;  ///< of the readings: they are missing
  int learnt_readings = 200;    ///< over which the usual delay and period are learnt
};

/// Watches the readings of one sensor as they arrive, whatever they mean: whether they come, come
/// late, come all, and whether they change.
///
/// The delay is held against the sensor's own usual one, so that a clock that is off by a constant
/// is not called late.
class StreamWatch {
 public:
  static constexpr std::size_t kValues = 6;

  StreamWatch(std::string_view name, const StreamWatchConfig& config)
      : name_(name), config_(config) {}

  /// @param now when it arrived
  /// @param stamp of the measurement, by the sensor's clock
  /// @param values at most kValues of the reading
  void add(Stamp now, Stamp stamp, std::span<const double> values);

  /// Readings are to come from now on: a sensor that has been dead from the start is silent, too.
  void expect(Stamp now) {
    if (arrived_ < 0 && expected_ < 0) expected_ = now;
  }

  /// @param lively the vehicle flies: readings that stay the same are no sign of rest
  /// @return what has changed since the last call, for an event: "imu silent", "imu sound again"
  [[nodiscard]] std::optional<std::string> update(Stamp now, bool lively);

  /// Whether it was last told to be faulty.
  [[nodiscard]] bool faulty() const { return state_ != State::kSound; }
  [[nodiscard]] bool silent() const { return state_ == State::kSilent; }

 private:
  enum class State : std::uint8_t { kSound, kSilent, kStuck, kLate, kMissing };

  [[nodiscard]] State newest(Stamp now, bool lively) const;
  void learn(double delay_s, double period_s);

  static constexpr double kSoundAfter_s = 0.3;  ///< of good readings: so that an event is not two
  static constexpr double kStart_s = 1;         ///< the first of them may take so long

  std::string name_;
  StreamWatchConfig config_;
  std::array<double, kValues> last_{};
  Stamp expected_ = -1;  ///< from then on; -1: it may not be there at all
  Stamp arrived_ = -1;   ///< -1: none yet
  Stamp stamp_ = 0;
  int readings_ = 0;  ///< learnt from, at most learnt_readings
  int same_ = 0;      ///< in a row
  double usual_delay_s_ = 0;
  double usual_period_s_ = 0;
  double delay_s_ = 0;  ///< averaged over a few readings
  double missing_ = 0;  ///< share, averaged over some twenty
  State state_ = State::kSound;
  Stamp faulty_at_ = -1;  ///< when it last was
};

}  // namespace arex
