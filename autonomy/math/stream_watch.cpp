#include "math/stream_watch.h"

#include <algorithm>
#include <cmath>

namespace arex {
namespace {

constexpr double kDelayMemory = 4;     // readings
constexpr double kMissingMemory = 40;  // readings
// A period may jitter by half of itself before a reading counts as missing.
constexpr double kGap = 1.5;

}  // namespace

void StreamWatch::add(Stamp now, Stamp stamp, std::span<const double> values) {
  std::array<double, kValues> reading{};
  std::copy_n(values.begin(), std::min(values.size(), kValues), reading.begin());
  same_ = arrived_ >= 0 && reading == last_ ? same_ + 1 : 0;
  last_ = reading;
  const double delay_s = to_seconds(now - stamp), period_s = to_seconds(stamp - stamp_);
  if (arrived_ >= 0) learn(delay_s, period_s);
  arrived_ = now;
  stamp_ = stamp;
}

void StreamWatch::learn(double delay_s, double period_s) {
  if (readings_ < config_.learnt_readings) {
    ++readings_;
    usual_delay_s_ += (delay_s - usual_delay_s_) / readings_;
    usual_period_s_ += (period_s - usual_period_s_) / readings_;
    delay_s_ = usual_delay_s_;
    return;
  }
  delay_s_ += (delay_s - delay_s_) / kDelayMemory;
  const double left_out =
      period_s > kGap * usual_period_s_ ? std::round(period_s / usual_period_s_) - 1 : 0;
  missing_ += (std::min(left_out, 1.0) - missing_) / kMissingMemory;
}

StreamWatch::State StreamWatch::newest(Stamp now, bool lively) const {
  if (arrived_ < 0) {
    const bool missed = expected_ >= 0 && now - expected_ > from_seconds(kStart_s);
    return missed ? State::kSilent : State::kSound;
  }
  const double silent_s = std::max(config_.silent_s, config_.silent_periods * usual_period_s_);
  const bool knows_period = config_.silent_periods == 0 || readings_ > 0;
  if (knows_period && now - arrived_ > from_seconds(silent_s)) return State::kSilent;
  const bool counts = lively || state_ == State::kStuck;  // at rest it is not sound again
  if (counts && same_ >= config_.stuck_readings) return State::kStuck;
  if (delay_s_ > usual_delay_s_ + config_.late_s) return State::kLate;
  return missing_ > config_.missing_share ? State::kMissing : State::kSound;
}

std::optional<std::string> StreamWatch::update(Stamp now, bool lively) {
  const State state = newest(now, lively);
  if (state != State::kSound) faulty_at_ = now;
  const bool waits = state == State::kSound && now - faulty_at_ < from_seconds(kSoundAfter_s);
  if (state == state_ || (waits && faulty_at_ >= 0)) return std::nullopt;
  state_ = state;
  switch (state) {
    case State::kSilent:
      return name_ + " silent";
    case State::kStuck:
      return name_ + " stuck";
    case State::kLate:
      return name_ + " late";
    case State::kMissing:
      return name_ + " readings missing";
    case State::kSound:
      break;
  }
  return name_ + " sound again";
}

}  // namespace arex
