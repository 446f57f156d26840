#include "stack/lidar_watch.h"

namespace arex {

void LidarWatch::add_scan(Stamp now, std::size_t points) {
  if (points >= static_cast<std::size_t>(config_.least_points)) last_scan_ = now;
}

void LidarWatch::add_registration(const RegistrationReport& report) {
  if (report.points == 0) return;
  const double share = static_cast<double>(report.matched) / report.points;
  false_returns_ = share < config_.refused_fraction * usual_share_;
  if (usual_share_ == 0) usual_share_ = share;
  // What is false does not become usual.
  if (!false_returns_) usual_share_ += (share - usual_share_) / config_.memory_scans;
}

std::optional<std::string_view> LidarWatch::update(Stamp now) {
  if (last_scan_ < 0) return std::nullopt;
  State state = State::kSound;
  if (now - last_scan_ > from_seconds(config_.silent_after_s)) {
    state = State::kSilent;
  } else if (false_returns_) {
    state = State::kFalse;
  }
  if (state == state_) return std::nullopt;
  state_ = state;
  switch (state) {
    case State::kSilent:
      return "lidar silent";
    case State::kFalse:
      return "lidar returns refused";
    default:
      return "lidar sound again";
  }
}

}  // namespace arex
