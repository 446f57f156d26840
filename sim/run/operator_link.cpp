#include "run/operator_link.h"

#include <algorithm>
#include <string>
#include <utility>

namespace arex::sim {
namespace {

bool is(const Event& event, OperatorOrder::On on) {
  switch (on) {
    case OperatorOrder::On::kStop:
      return event.detail.starts_with("stop exploring");
    case OperatorOrder::On::kLowBattery:
      return event.kind == EventKind::kBattery;
    case OperatorOrder::On::kTargetReached:
      return event.kind == EventKind::kTargetReached;
    case OperatorOrder::On::kTime:
      break;
  }
  return false;
}

std::string_view name_of(const OperatorCommand& command) {
  return enum_names(command.kind)[static_cast<std::size_t>(command.kind)];
}

}  // namespace

OperatorLink::OperatorLink(const OperatorLinkConfig& config, std::vector<OperatorOrder> orders,
                           std::uint64_t seed)
    : config_(config), random_(seed, "operator link") {
  for (OperatorOrder& order : orders) {
    if (order.on == OperatorOrder::On::kTime) {
      pending_.push_back({{order.what, order.goal_m}, from_seconds(order.at_s)});
    } else {
      waiting_.push_back(order);
    }
  }
}

bool OperatorLink::gets_through(Stamp now) {
  const Stamp cut = from_seconds(config_.cut_at_s);
  if (now >= cut && now < cut + from_seconds(config_.cut_for_s)) return false;
  return !(random_.uniform(0, 1) < config_.loss);
}

void OperatorLink::report(const Event& event) {
  if (!gets_through(event.stamp)) return;
  down_.push_back(event);
  down_.back().stamp += from_seconds(config_.delay_s);
}

void OperatorLink::hear(const Event& event) {
  // An answer names the command, whether it was taken or refused.
  if (event.kind == EventKind::kOperator) {
    for (Pending& pending : pending_) {
      const bool sent = pending.tries > 0 && !pending.done;
      if (sent && event.detail.starts_with(name_of(pending.command))) {
        pending.done = true;
        break;
      }
    }
  }
  std::erase_if(waiting_, [&](const OperatorOrder& order) {
    if (!is(event, order.on)) return false;
    pending_.push_back({{order.what, order.goal_m}, event.stamp + from_seconds(order.at_s)});
    return true;
  });
}

void OperatorLink::send(Stamp now, const OperatorMessage& message) {
  if (gets_through(now)) up_.push_back({now + from_seconds(config_.delay_s), message});
}

std::vector<OperatorMessage> OperatorLink::deliver(Stamp now) {
  while (!down_.empty() && down_.front().stamp <= now) {
    hear(down_.front());
    down_.pop_front();
  }
  if (config_.heartbeat_hz > 0 && now >= next_heartbeat_) {
    next_heartbeat_ += from_seconds(1 / config_.heartbeat_hz);
    send(now, {});
  }
  for (Pending& pending : pending_) {
    if (pending.done || pending.tries >= config_.tries || now < pending.next) continue;
    ++pending.tries;
    pending.next = now + from_seconds(config_.retry_s);
    send(now, {pending.command});
  }
  std::vector<OperatorMessage> arrived;
  while (!up_.empty() && up_.front().arrives <= now) {
    arrived.push_back(up_.front().message);
    up_.pop_front();
  }
  return arrived;
}

}  // namespace arex::sim
