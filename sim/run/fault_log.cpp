#include "run/fault_log.h"

#include <algorithm>

namespace arex::sim {
namespace {

bool names_a_fault(const Event& event) {
  return event.kind == EventKind::kSensorFault || event.kind == EventKind::kVehicleFault ||
         event.kind == EventKind::kVibration;
}

bool is_weak_odometry(const Event& event) {
  return event.kind == EventKind::kOdometryStatus &&
         (event.detail == "degenerate" || event.detail == "lost");
}

/// That something is wrong, if not what.
bool is_typed(const Event& event) {
  return names_a_fault(event) || is_weak_odometry(event) || event.kind == EventKind::kStuck;
}

}  // namespace

FaultLog::FaultLog(const std::vector<FaultConfig>& faults) {
  for (const FaultConfig& fault : faults) {
    const Stamp begin = from_seconds(fault.from_s);
    begin_ = begin_ ? std::min(*begin_, begin) : begin;
  }
}

void FaultLog::add(const Event& event) {
  events_ += names_a_fault(event);
  standing_.add(event.kind, event.detail);
  if (event.kind == EventKind::kOdometryStatus) {
    odometry_ = is_weak_odometry(event) ? "odometry " + event.detail : "";
  }
  if (event.kind == EventKind::kStuck) when_stuck_ = standing_.first();
  if (!begin_ || event.stamp < *begin_ || !told_.empty() || !is_typed(event)) return;
  told_ = std::string(kEventKindNames[static_cast<std::size_t>(event.kind)]) + ": " + event.detail;
  told_at_ = event.stamp;
}

std::string FaultLog::standing() const {
  const std::string first(standing_.first());
  return first.empty() ? odometry_ : first;
}

void FaultLog::add_figures(Figures& figures) const {
  figures.set("faults.events", events_);
  if (told_.empty()) return;
  figures.set("faults.told", told_);
  figures.set("faults.told_after_s", to_seconds(told_at_ - *begin_));
}

}  // namespace arex::sim
