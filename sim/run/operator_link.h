#pragma once

#include <array>
#include <cstdint>
#include <deque>
#include <string_view>
#include <vector>

#include "math/random.h"
#include "messages/events.h"
#include "messages/operator.h"

namespace arex::sim {

/// A thing that the operator does once: at a time, or on what the vehicle reports.
struct OperatorOrder {
  enum class On : std::uint8_t { kTime, kStop, kLowBattery, kTargetReached };
  friend constexpr std::array<std::string_view, 4> enum_names(On) {
    return {"time", "stop", "low_battery", "target_reached"};
  }

  On on = On::kTime;
  double at_s = 0;
  OperatorCommand::Kind what = OperatorCommand::Kind::kHold;
  Vec3 goal_m = Vec3::Zero();

  void fields(auto& f) {
    f("on", on, "time, or what the vehicle reports: the end of exploring, its battery, a target");
    f("at_s", at_s, "when, s of the run; on a report: so long after it");
    f("do", what, "land, hold, return, resume, go_to");
    f("goal_m", goal_m, "x, y, z in O of a go_to");
    f.check(at_s >= 0, "at_s >= 0");
  }
};

/// The radio between operator and vehicle.
struct OperatorLinkConfig {
  double heartbeat_hz = 1;  ///< MAVLink
  double delay_s = 0.1;
  double loss = 0;
  int tries = 3;
  double retry_s = 1;
  double cut_at_s = 0;
  double cut_for_s = 0;

  void fields(auto& f) {
    f("heartbeat_hz", heartbeat_hz, "of the ground station (MAVLink: 1); 0: nobody is there");
    f("delay_s", delay_s, "of each message, either way");
    f("loss", loss, "share of the messages that get lost, either way");
    f("tries", tries, "a command is sent so often until the vehicle has answered");
    f("retry_s", retry_s, "between them");
    f("cut_at_s", cut_at_s, "the link is cut from then on");
    f("cut_for_s", cut_for_s, "for so long; 0: it is not");
    f.check(heartbeat_hz >= 0 && heartbeat_hz <= 100, "0 <= heartbeat_hz <= 100");
    f.check(delay_s >= 0 && delay_s <= 60, "0 <= delay_s <= 60");
    f.check(loss >= 0 && loss <= 1, "0 <= loss <= 1");
    f.check(tries >= 1 && tries <= 1000, "1 <= tries <= 1000");
    f.check(retry_s >= 0.01, "retry_s >= 0.01");
    f.check(cut_at_s >= 0 && cut_for_s >= 0, "cut_at_s >= 0, cut_for_s >= 0");
  }
};

/// The operator at the other end of the link. Knows what the vehicle reports, and nothing else.
class OperatorLink {
 public:
  OperatorLink(const OperatorLinkConfig& config, std::vector<OperatorOrder> orders,
               std::uint64_t seed);

  /// What the vehicle reports. @pre called in the order of time.
  void report(const Event& event);
  /// What reaches the vehicle by `now`, in order of arrival. To be asked at every tick.
  std::vector<OperatorMessage> deliver(Stamp now);

 private:
  struct Pending {
    OperatorCommand command;
    Stamp next = 0;  ///< when it is sent (again)
    int tries = 0;   ///< so far
    bool done = false;
  };
  struct Underway {
    Stamp arrives = 0;
    OperatorMessage message;
  };

  [[nodiscard]] bool gets_through(Stamp now);
  void send(Stamp now, const OperatorMessage& message);
  void hear(const Event& event);

  OperatorLinkConfig config_;
  std::vector<OperatorOrder> waiting_;  ///< orders whose report has not come
  std::vector<Pending> pending_;
  std::deque<Underway> up_;
  std::deque<Event> down_;  ///< reports under way, stamped with their arrival
  RandomStream random_;
  Stamp next_heartbeat_ = 0;
};

}  // namespace arex::sim
