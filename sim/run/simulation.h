#pragma once

#include <deque>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "autopilot/autopilot.h"
#include "jobs/job_queue.h"
#include "math/fingerprint.h"
#include "physics/flexible_frame.h"
#include "physics/physics.h"
#include "run/dshot.h"
#include "run/fault_log.h"
#include "run/flight_display.h"
#include "run/recorder.h"
#include "run/scenario.h"
#include "run/stage_timer.h"
#include "scoring/flight_scorer.h"
#include "scoring/map_error.h"
#include "scoring/omniscient_tour.h"
#include "scoring/semantic_score.h"
#include "scoring/world_complexity.h"
#include "sensors/device.h"
#include "sensors/scene.h"
#include "stack/flight_software.h"

namespace arex::sim {

/// How a flight ended.
enum class Outcome { kFlying, kSucceeded, kCollided, kStuck, kLost, kTimedOut, kInterrupted };
inline constexpr std::array<std::string_view, 7> kOutcomeNames{
    "flying", "succeeded", "collided", "stuck", "lost", "timed_out", "interrupted"};

/// What the explorer decided, in sum.
struct ExplorationLog {
  int decisions = 0;
  int issued = 0;      ///< decisions for a new target
  int exhaustive = 0;  ///< of these from the exhaustive search, because the trees had none
  int seen = 0;        ///< targets dropped because they were seen on the way
  int given_up = 0;    ///< targets that proved unreachable, or were cut off
  int directed = 0;    ///< decisions for a target that R alone would not have chosen
  int reached = 0;     ///< targets that the mission said it reached while exploring
  StopReason stop_reason = StopReason::kNone;
  std::optional<double> open_frontier_m2;  ///< see Decision

  void add(const Decision& decision);
  /// Sets the figures `exploration.*`, if the explorer was ever asked.
  void add_figures(Figures& figures) const;
};

/// What a flight amounts to; summary.json comes from it.
struct FlightResult {
  Outcome outcome = Outcome::kFlying;
  std::string reason;
  Stamp duration = 0;
  std::string trajectory_hash;  ///< of the true state at every tick and every command
  std::string sensor_hash;      ///< of every scan and frame delivered
  /// What each device delivered: where two hosts differ, the first to differ tells.
  std::map<std::string, std::string> device_hashes;
  std::int64_t lidar_firings = 0;  ///< of the first LiDAR's scans delivered
  std::int64_t lidar_misses = 0;   ///< of these without a return
  int collisions = 0;
  std::vector<MissionTarget> targets;
  FlightScore flight;
  std::optional<MapScore> map;                ///< nothing without a map
  std::optional<CoverageResult> coverage;     ///< of explorations
  std::optional<SemanticScore> semantic;      ///< of explorations that make a semantic map
  std::optional<OmniscientTour> tour;         ///< of explorations, where scoring.tour is enabled
  std::optional<WorldComplexity> complexity;  ///< of explorations
  ExplorationLog exploration;
  PlanCounts plans;
  FaultLog faults{{}};
  BatteryState battery;
  std::string renderer;  ///< of the depth frames; empty if none was read
  std::vector<TimingRow> timing;
};

/// The vehicle in its world, in lockstep with its flight software: one integer clock, one thread of
/// control, jobs whose results become visible at modelled times.
class Simulation {
 public:
  /// Builds the world and everything in it. @throws ConfigError if the recipe gives no world.
  /// @param threads host threads; the flight does not depend on them
  Simulation(const Scenario& scenario, int threads);
  ~Simulation();

  /// Writes what happens from now on; `recorder` must outlive the flight.
  void record_to(Recorder& recorder);

  /// Gives what the sensors deliver to a bag as well, and what the flight software makes of it; to
  /// one more with each call. It must outlive the flight.
  void record_to(BagWriter& bag);

  /// Flies one millisecond. @return whether the flight goes on.
  bool tick();
  /// Ends the flight from outside.
  void interrupt(const std::string& reason);

  /// Area explored so far, of what can be reached; 0 where it is not scored.
  [[nodiscard]] double area_fraction() const { return area_fraction_; }
  [[nodiscard]] Stamp now() const { return now_; }
  [[nodiscard]] const Truth& truth() const { return physics_.truth(); }
  [[nodiscard]] const FlightSoftware& software() const { return *stack_; }
  [[nodiscard]] FlightView view() const { return stack_->view(); }
  [[nodiscard]] MappedFrames mapped_frames() const { return stack_->mapped_frames(); }
  // Of what was flown so far.
  [[nodiscard]] std::string trajectory_hash() const { return hash_.text(); }
  [[nodiscard]] std::map<std::string, std::string> device_hashes() const;
  /// Scores what was flown. Call it once, at the end.
  FlightResult finish();

 private:
  void add_devices();
  void fire_devices();
  void run_stack();
  void run_autopilot();
  void step_physics();
  /// Nothing where rotors and air move the vehicle.
  [[nodiscard]] std::optional<CarriedMotion> carried_motion() const;
  void record();
  void check_end();
  void end(Outcome outcome, const std::string& reason);
  void write_cloud();
  void note_cloud_growth();
  void score_coverage();
  void compare_with_the_possible(FlightResult& result);
  [[nodiscard]] SemanticScore map_semantics(const std::vector<Vec3f>& cloud_O,
                                            const std::vector<PosePair>& poses) const;

  struct Timers {
    StageTimer devices{"devices"}, stack{"stack"}, autopilot{"autopilot"}, physics{"physics"},
        recording{"recording"}, semantics{"semantics"}, tour{"tour"};
  };

  ScenarioConfig config_;
  worlds::World world_;
  Scene scene_;
  Physics physics_;
  FlexibleFrame frame_;
  Autopilot autopilot_;
  DshotWires wires_;
  Recorder* recorder_ = nullptr;

  Stamp now_ = 0;
  Outcome outcome_ = Outcome::kFlying;
  std::string reason_;
  MotorCommand motors_;
  Truth previous_truth_;
  Fingerprint hash_;
  FlightScorer scorer_;
  std::unique_ptr<CoverageScorer> coverage_;  ///< in jobs of the cloud's lane
  std::vector<Vec3> path_W_;                  ///< flown since the last score
  std::size_t covered_points_ = 0;            ///< of the cloud, already scored
  std::vector<CloudGrowth> cloud_growth_;     ///< in jobs of the cloud's lane
  double area_fraction_ = 0;
  ExplorationLog exploration_;
  FaultLog fault_log_;
  int collisions_ = 0;
  Timers timers_;

  JobQueue jobs_;
  Outlets outlets_;
  std::vector<std::pair<std::string, std::unique_ptr<Device>>> devices_;  ///< fired in this order
  std::unique_ptr<FlightSoftware> stack_;
  std::deque<FlightDisplay> displays_;  ///< one of each bag; jobs know where they are
  OperatorLink operator_;
  bool drive_faulty_;  ///< motors, speed controllers or battery, at some time
};

}  // namespace arex::sim
