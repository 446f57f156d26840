#pragma once

#include <array>
#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "exploration/explorer.h"
#include "exploration/landing.h"
#include "math/progress_watch.h"
#include "messages/estimates.h"
#include "messages/events.h"
#include "messages/motion.h"
#include "messages/odometry_need.h"
#include "messages/operator.h"

namespace arex {

/// What becomes of a mission whose operator is not heard any more.
struct LinkConfig {
  enum class Lost { kContinue, kReturn, kLand };
  friend constexpr std::array<std::string_view, 3> enum_names(Lost) {
    return {"continue", "return", "land"};
  }

  double timeout_s = 5;  ///< ArduPilot's FS_GCS_TIMEOUT
  Lost lost = Lost::kContinue;

  void fields(auto& f) {
    f("timeout_s", timeout_s,
      "without a heartbeat for longer the link is lost, if there was one (ArduPilot: 5 s)");
    f("lost", lost, "what the vehicle does then");
    f.check(timeout_s > 0, "timeout_s > 0");
  }
};

/// What the vehicle is sent out to do. Positions are in O: origin where it stood at start-up, x its
/// heading then, z up.
struct MissionConfig {
  enum class Kind {
    kWaypoints,  ///< straight legs through waypoints_m
    kGoals,      ///< the planner's way through waypoints_m
    kExplore,    ///< down entry_m, then wherever the explorer says
    kYawBurst,
  };
  friend constexpr std::array<std::string_view, 4> enum_names(Kind) {
    return {"waypoints", "goals", "explore", "yaw_burst"};
  }

  Kind kind = Kind::kWaypoints;
  std::vector<Vec3> waypoints_m;  ///< flown in order; the last is where it lands
  double takeoff_height_m = 1.5;
  double arrival_radius_m = 0.2;   ///< a waypoint counts as reached within this
  double arrival_speed_mps = 0.2;  ///< and below this speed
  double hold_s = 0.5;             ///< and for this long
  double settle_s = 3.0;           ///< standing still before arming: sensors initialise
  double ready_timeout_s = 20;     ///< after that: odometry and autopilot must be ready by then
  double takeoff_timeout_s = 20;   ///< without getting higher
  double leg_timeout_s = 20;       ///< on a leg or a landing, without getting on
  double max_time_s = 600;
  std::vector<Vec3> entry_m;  ///< straight legs flown before exploring (garage: down the ramp)
  enum class LandAtStart { kFalse, kTrue, kIfInReach };
  friend constexpr std::array<std::string_view, 3> enum_names(LandAtStart) {
    return {"false", "true", "if_in_reach"};
  }
  LandAtStart land_at_start = LandAtStart::kTrue;  ///< of an exploration
  bool remain_at_end = false;
  int return_tries = 3;                          ///< before it lands at a clear place on the way
  std::vector<double> yaw_rates_radps{1, 2, 3};  ///< of a yaw burst, one after the other
  double yaw_burst_s = 4.0;                      ///< length of each
  double lost_hover_s = 1.0;  ///< without odometry: level at hover thrust, then down
  /// Without a scan for longer it comes to rest while it still knows where it is: a third of what
  /// the odometry lasts without one.
  double blind_hold_s = 1.0;
  double blind_land_s = 2.5;  ///< and lands, before an odometry without scans is lost (3 s)
  LandingConfig landing;
  LinkConfig link;

  void fields(auto& f) {
    f("kind", kind, "what the vehicle is sent out to do");
    f("waypoints_m", waypoints_m, "x, y, z in O, flown in order; it lands at the last");
    f("takeoff_height_m", takeoff_height_m, "height of the first hover above the start");
    f("arrival_radius_m", arrival_radius_m, "a waypoint counts as reached within this");
    f("arrival_speed_mps", arrival_speed_mps, "and below this speed");
    f("hold_s", hold_s, "and for this long");
    f("settle_s", settle_s, "standing still before arming");
    f("ready_timeout_s", ready_timeout_s,
      "after settle_s: stuck, with what is missing, when odometry or autopilot are not ready by "
      "then");
    f("takeoff_timeout_s", takeoff_timeout_s,
      "the take-off is given up after so long without getting nearer to its height");
    f("leg_timeout_s", leg_timeout_s,
      "a straight leg or a landing is given up after so long without getting on; for planned ways "
      "planning.replan.target_timeout_s");
    f("max_time_s", max_time_s, "the mission fails when it is not over by then");
    f("entry_m", entry_m, "x, y, z in O: straight legs flown before exploring");
    f("land_at_start", land_at_start,
      "true: an exploration keeps energy for the way home and lands there; false: it lands where "
      "it "
      "ends; if_in_reach: it explores to its end, then comes home if what is left suffices for it "
      "and the reserve, or else lands where it is");
    f("remain_at_end", remain_at_end,
      "it stays in the air where it ends until its operator asks for something or the battery is "
      "at its reserve");
    f("link", link, "to the operator");
    f("return_tries", return_tries, "failed ways home before it lands at a clear place on the way");
    f("yaw_rates_radps", yaw_rates_radps, "of a yaw burst, one after the other");
    f("yaw_burst_s", yaw_burst_s, "length of each yaw burst; a rest of the same length follows");
    f("lost_hover_s", lost_hover_s,
      "level at hover thrust without odometry, then the autopilot lands");
    f("blind_hold_s", blind_hold_s, "without a LiDAR scan for so long it comes to rest and waits");
    f("blind_land_s", blind_land_s,
      "after so long it lands, if its odometry lives on scans; on its eyes it goes on waiting");
    f("landing", landing, "where it may come down");
    f.check(yaw_burst_s >= 0.001, "yaw_burst_s >= 0.001 (a tick)");
    f.check(lost_hover_s >= 0, "lost_hover_s >= 0");
    f.check(blind_hold_s > 0 && blind_land_s >= blind_hold_s, "0 < blind_hold_s <= blind_land_s");
    f.check(takeoff_height_m > 0, "takeoff_height_m > 0");
    f.check(arrival_radius_m > 0, "arrival_radius_m > 0");
    f.check(arrival_speed_mps > 0, "arrival_speed_mps > 0");
    f.check(hold_s >= 0, "hold_s >= 0");
    f.check(settle_s >= 0, "settle_s >= 0");
    f.check(ready_timeout_s > 0, "ready_timeout_s > 0");
    f.check(takeoff_timeout_s > 0, "takeoff_timeout_s > 0");
    f.check(leg_timeout_s > 0, "leg_timeout_s > 0");
    f.check(max_time_s > 0, "max_time_s > 0");
    f.check(return_tries >= 0, "return_tries >= 0");
  }
};

/// The mission's states, in order.
enum class MissionState {
  kInitialise,
  kTakeoff,
  kEntry,  ///< legs into the area to explore
  kFly,    ///< waypoints, goals, yaw bursts
  kExplore,
  kHold,    ///< at the operator's word: comes to rest, then does what was asked
  kReturn,  ///< to the start, or to where it lands instead; hovers while it asks where that is
  kLand,
  kLost,
  kDone,
};
inline constexpr std::array<std::string_view, 10> kMissionStateNames{
    "initialise", "takeoff", "entry", "fly", "explore", "hold", "return", "land", "lost", "done"};

/// A target that was flown to.
struct MissionTarget {
  Vec3 p_O = Vec3::Zero();
  Stamp reached = 0;
};

/// The mission: a state machine from arming to disarming, driven by the odometry and the
/// autopilot's word. It knows where to go, not how.
///
/// Where it lands. At the start, where it stood. At the last waypoint, unless the map knows that
/// something stands there or that it is not flat. Everywhere else, and where those two fail, where
/// LandingFinder says; a place that turns out not to be clear or cannot be flown to gives way to
/// the next, landing.tries of them. If there is none, it comes down on the widest place that it
/// can reach, or where it is if it reaches nothing, and says so: stuck, `no_landing_place`.
class Mission {
 public:
  using EventSink = std::function<void(EventKind, const std::string& detail)>;

  Mission(const MissionConfig& config, EventSink events);

  struct Inputs {
    Stamp now = 0;
    Odometry odometry;
    OdometryNeed need = OdometryNeed::kImu;  ///< what keeps it from being ok
    bool autopilot_ready = false;            ///< its own attitude filter has settled
    bool armed = false;
    MotionProgress progress = MotionProgress::kUnderWay;  ///< of a kGoTo request
    std::string_view cause;                               ///< why it failed
    bool leg_blocked = false;                             ///< something stands in the way of a kLeg
    LandingGround below = LandingGround::kUnknown;        ///< where it would come down
    bool at_reserve = false;     ///< of the battery: what is left is needed to land
    std::string_view trouble;    ///< the first fault of sensors or vehicle that is not over
    double blind_s = 0;          ///< since the LiDAR's newest scan
    bool lives_on_scans = true;  ///< the odometry that flies: without any it will be lost
  };
  /// Advances by one control step.
  MotionRequest update(const Inputs& inputs);

  /// Takes what comes over the operator's link.
  void hear(const OperatorMessage& message, Stamp now);

  /// Takes the explorer's word while exploring.
  void decide(const Decision& decision);

  /// It hovers until this is answered; none: it asks nothing.
  [[nodiscard]] const std::optional<LandingQuery>& landing_query() const { return landing_query_; }
  /// Answers the query; nothing if no place can be reached.
  void answer(const std::optional<LandingPlace>& place);

  [[nodiscard]] const MotionRequest& request() const { return request_; }
  [[nodiscard]] MissionState state() const { return state_; }
  /// Progress with the explorer's target since its last decision.
  [[nodiscard]] TargetProgress target_progress() const { return target_progress_; }
  /// Why the mission failed, its typed cause first; empty: it did not.
  [[nodiscard]] const std::string& stuck() const { return stuck_; }
  /// Whether the odometry was lost for good: the mission ended where it stood.
  [[nodiscard]] bool lost() const { return lost_; }
  [[nodiscard]] const std::vector<MissionTarget>& targets() const { return targets_; }

 private:
  void enter(MissionState state, const Inputs& inputs);
  void wait_until_ready(const Inputs& inputs);
  void take_off(const Inputs& inputs);
  void land(const Inputs& inputs);
  void end_stuck(const std::string& cause);
  void drop_target(const std::string& cause);
  [[nodiscard]] bool stalls(const Inputs& inputs, double remaining_m, double timeout_s);
  [[nodiscard]] bool leg_stalls(const Inputs& inputs);
  void begin_flying();
  void enter_area(const Inputs& inputs);
  void explore(const Inputs& inputs);
  void return_to_land(const Inputs& inputs);
  void go_home();
  void land_on_command(const Inputs& inputs);
  void fly_to_landing(const Inputs& inputs);
  void fail_to_return(const Inputs& inputs);
  void try_another_landing(const Inputs& inputs);
  void reach(const Inputs& inputs);
  void next_waypoint(const Inputs& inputs);
  void fly(const Inputs& inputs);
  void select_waypoint(std::size_t index, Stamp now);
  void spin(const Inputs& inputs);
  void watch_odometry(const Inputs& inputs);
  void watch_sight(const Inputs& inputs);
  void watch_link(const Inputs& inputs);
  void obey(const Inputs& inputs);
  void begin_hold(const OperatorCommand& command, const Inputs& inputs);
  void hold(const Inputs& inputs);
  void do_as_asked(const Inputs& inputs);
  void resume(const Inputs& inputs);
  [[nodiscard]] bool end_in_the_air(const Inputs& inputs);
  bool rests(const Inputs& inputs, bool inside);
  bool has_arrived(const Inputs& inputs);

  static constexpr double kProgress_m = 0.1;  ///< beyond what a hover wanders

  MissionConfig config_;
  EventSink events_;
  MissionState state_ = MissionState::kInitialise;
  MotionRequest request_;
  std::size_t waypoint_ = 0;
  Stamp inside_since_ = -1;  ///< when the vehicle came to rest within the goal's radius, -1: not
  ProgressWatch progress_{kProgress_m};  ///< of the take-off, the leg, the landing
  bool was_armed_ = false;
  Stamp state_since_ = 0;
  Vec3 home_O_ = Vec3::Zero();  ///< above the start, at take-off height
  TargetProgress target_progress_ = TargetProgress::kUnderWay;
  bool stop_exploring_ = false;
  bool decided_ = false;  ///< the explorer has said something since the last step
  bool waits_ = false;    ///< the last that it said is that it waits
  std::optional<LandingQuery> landing_query_;
  std::vector<Vec2> landings_tried_;
  std::optional<LandingPlace> landing_;  ///< where it flies to land; none: home
  bool has_answer_ = false;              ///< to the query, in landing_
  int returns_ = 0;
  std::string stuck_;
  Stamp lost_since_ = -1;  ///< -1: odometry is there
  bool lost_ = false;
  MissionState interrupted_ = MissionState::kFly;  ///< what goes on when the odometry is back
  MotionRequest interrupted_request_;
  std::vector<MissionTarget> targets_;
  Stamp heard_ = -1;  ///< the last heartbeat, -1: none yet
  bool link_lost_ = false;
  std::optional<OperatorCommand> command_;  ///< heard since the last step
  OperatorCommand asked_;                   ///< what a hold is for
  MissionState held_ = MissionState::kFly;  ///< what it interrupted
  MotionRequest held_request_;
  bool blind_ = false;        ///< what it holds for
  bool lands_blind_ = false;  ///< it knew that its odometry would not last
  int orders_ = 0;
  bool home_in_reach_ = true;
};

}  // namespace arex
