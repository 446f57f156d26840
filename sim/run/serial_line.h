#pragma once

#include <algorithm>
#include <cstdint>
#include <deque>
#include <optional>
#include <string_view>
#include <utility>

#include "math/random.h"
#include "math/types.h"
#include "run/interfaces.h"

namespace arex::sim {

/// One direction of a UART: messages leave one after the other, each as long as its bytes take, and
/// arrive in their order.
template <class Message>
class SerialLine {
 public:
  SerialLine(const UartConfig& config, std::uint64_t seed, std::string_view name)
      : config_(config), random_(seed, name) {}

  /// @pre called in the order of time
  void send(Stamp now, int bytes, Message message) {
    free_at_ = std::max(free_at_, now);
    if (free_at_ - now + time_of(bytes) > time_of(config_.buffer_bytes)) {
      ++refused_;
      return;
    }
    free_at_ += time_of(bytes);
    const double jitter = config_.jitter_s > 0 ? random_.uniform(0, config_.jitter_s) : 0;
    if (config_.loss > 0 && random_.uniform() < config_.loss) return;
    last_ = std::max(last_, free_at_ + from_seconds(config_.latency_s + jitter));
    underway_.push_back({last_, std::move(message)});
  }

  /// The next message that has arrived by `now`; none: no more.
  std::optional<Message> receive(Stamp now) {
    if (underway_.empty() || underway_.front().first > now) return std::nullopt;
    Message message = std::move(underway_.front().second);
    underway_.pop_front();
    return message;
  }

  /// Messages that found the sender's buffer full.
  [[nodiscard]] std::int64_t refused() const { return refused_; }

 private:
  /// 8 data bits, a start bit and a stop bit.
  [[nodiscard]] Stamp time_of(int bytes) const {
    return from_seconds(10 * bytes / config_.rate_hz);
  }

  UartConfig config_;
  RandomStream random_;
  Stamp free_at_ = 0;  ///< when the wire is
  Stamp last_ = 0;     ///< arrival of the newest
  std::int64_t refused_ = 0;
  std::deque<std::pair<Stamp, Message>> underway_;
};

}  // namespace arex::sim
