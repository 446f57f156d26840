#include "stack/lidar_watch.h"

#include <algorithm>
#include <cmath>

namespace arex {

LidarWatch::Survey LidarWatch::survey(const LidarScan& scan) const {
  // By their place among the firings: the times of packets overlap.
  const bool counted = !scan.packets_ns.empty();
  const auto period = static_cast<std::uint32_t>(std::lround(config_.firing_period_s * 1e9));
  const std::size_t firings = counted ? static_cast<std::size_t>(scan.firings())
                                      : static_cast<std::size_t>(scan.end - scan.stamp) / period;
  std::vector<float> range(firings, 0);
  for (const LidarPoint& point : scan.points) {
    const std::size_t i = counted ? point.firing : point.offset_ns / period;
    if (i < firings) range[i] = point.p_L.norm();
  }
  Survey out;
  double deviation = 0;
  const auto next = static_cast<std::size_t>(config_.lines);
  const auto same = static_cast<float>(config_.same_surface_fraction);
  const auto spike = static_cast<float>(config_.spike_fraction);
  for (std::size_t i = next; i + next < firings; ++i) {
    const float before = range[i - next], after = range[i + next];
    if (before == 0 || after == 0 || std::abs(before - after) > same * std::min(before, after)) {
      continue;
    }
    ++out.between;
    const float expected = 0.5F * (before + after);
    if (range[i] == 0) {
      ++out.missing;
    } else if (std::abs(range[i] - expected) > spike * expected) {
      ++out.spikes;
    } else {
      deviation += std::abs(range[i] - expected);
    }
  }
  const int others = out.between - out.missing - out.spikes;
  if (others > 0) out.noise_m = deviation / others;
  return out;
}

void LidarWatch::add_scan(Stamp now, const LidarScan& scan) {
  if (scan.points.size() < static_cast<std::size_t>(config_.least_points)) return;
  if (last_scan_ >= 0 && now - last_scan_ > from_seconds(config_.silent_after_s)) {
    sound_in_a_row_ = 0;
  }
  last_scan_ = now;
  const Survey s = survey(scan);
  if (s.between < config_.least_points) {
    sound_in_a_row_ = 0;  // nobody knows
    return;
  }
  const double share = static_cast<double>(s.spikes) / s.between;
  if (usual_spikes_ < 0) usual_spikes_ = share;
  if (usual_between_ < 0) usual_between_ = s.between;
  // Among leaves few firings lie between returns of one surface, and more of those few lie so by
  // chance.
  const double fewer = std::sqrt(std::max(1.0, usual_between_ / s.between));
  const bool missing = s.missing > fewer * config_.missing_share * s.between;
  missing_in_a_row_ = missing ? missing_in_a_row_ + 1 : 0;
  const bool spikes = share > usual_spikes_ + fewer * config_.false_share;
  spikes_in_a_row_ = spikes ? spikes_in_a_row_ + 1 : 0;
  // What is false does not become usual.
  if (!spikes) {
    usual_spikes_ += (share - usual_spikes_) / config_.memory_scans;
    usual_between_ += (s.between - usual_between_) / config_.memory_scans;
  }
  if (usual_noise_m_ < 0) usual_noise_m_ = s.noise_m;
  const bool noisy =
      s.noise_m > fewer * std::max(config_.noise_m, config_.noise_factor * usual_noise_m_);
  noisy_in_a_row_ = noisy ? noisy_in_a_row_ + 1 : 0;
  if (!noisy) usual_noise_m_ += (s.noise_m - usual_noise_m_) / config_.memory_scans;
  const bool refused = refused_in_a_row_ > 0 && matches_tell_;
  sound_in_a_row_ = missing || spikes || noisy || refused ? 0 : sound_in_a_row_ + 1;
  // Of what was refused before the matches ceased to tell, the returns themselves have the last
  // word.
  if (!matches_tell_ && sound_in_a_row_ >= config_.sound_scans) refused_in_a_row_ = 0;
}

void LidarWatch::add_matched_share(std::optional<double> share) {
  matches_tell_ = share.has_value();
  if (!share) {
    if (refused_in_a_row_ < config_.false_scans) refused_in_a_row_ = 0;
    return;
  }
  if (usual_matched_ < 0) usual_matched_ = *share;
  const bool refused = *share < config_.refused_fraction * usual_matched_;
  refused_in_a_row_ = refused ? refused_in_a_row_ + 1 : 0;
  if (!refused) usual_matched_ += (*share - usual_matched_) / config_.memory_scans;
}

LidarWatch::State LidarWatch::newest(Stamp now) const {
  if (now - last_scan_ > from_seconds(config_.silent_after_s)) return State::kSilent;
  if (std::max(spikes_in_a_row_, refused_in_a_row_) >= config_.false_scans) return State::kFalse;
  if (noisy_in_a_row_ >= config_.false_scans) return State::kNoisy;
  return missing_in_a_row_ >= config_.false_scans ? State::kMissing : State::kSound;
}

std::optional<std::string_view> LidarWatch::update(Stamp now) {
  if (last_scan_ < 0) return std::nullopt;
  const State state = newest(now);
  if (state == state_) return std::nullopt;
  if (state == State::kSound && sound_in_a_row_ < patience_) return std::nullopt;
  if (state == State::kSound) {
    called_sound_ = now;
  } else if (state_ == State::kSound) {
    // What comes and goes is told a few times, not each time.
    constexpr int kMostScans = 100;
    const bool relapse =
        called_sound_ >= 0 && now - called_sound_ < from_seconds(config_.relapse_s);
    patience_ = relapse ? std::min(2 * patience_, std::max(kMostScans, config_.sound_scans))
                        : config_.sound_scans;
  }
  state_ = state;
  switch (state) {
    case State::kSilent:
      return "lidar silent";
    case State::kMissing:
      return "lidar returns missing";
    case State::kFalse:
      return "lidar returns false";
    case State::kNoisy:
      return "lidar noisy";
    default:
      return "lidar sound again";
  }
}

}  // namespace arex
