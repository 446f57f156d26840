#pragma once

#include <Eigen/Core>
#include <functional>
#include <map>
#include <memory>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <vector>

#include "bag/replay_input.h"
#include "jobs/job_queue.h"
#include "run/recorder.h"
#include "run/scenario.h"
#include "run/stage_timer.h"
#include "run/summary.h"
#include "scoring/flight_scorer.h"
#include "stack/flight_software.h"

namespace arex::sim {

/// What a replay amounts to.
struct ReplayResult {
  bool began = false;   ///< the odometry gave an estimate
  bool lost = false;    ///< and was lost in the end
  std::string missing;  ///< what it lacks in the end, as OdometryNeed names it
  Stamp duration = 0;
  bool interrupted = false;
  std::vector<PosePair> poses;  ///< truth and estimate at the truth's stamps; empty without truth
  OdometryScore odometry;
  double lost_s = 0;
  std::optional<VisualTally> tally;  ///< of a visual odometry in the place of the flying one
  std::map<std::string, SourceScore> others;
  std::optional<double> distance_m;  ///< along the truth
  std::vector<TimingRow> timing;

  [[nodiscard]] std::string outcome() const;
  [[nodiscard]] std::string reason() const;
};

/// The flight software fed from a recording: the same stack, clock and job queue as in a simulated
/// flight, so that a recording of one gives the estimates and maps of that flight. Nobody flies:
/// the mission stays where it begins, and what it says is not recorded.
class Replay {
 public:
  /// @pre the scenario's odometry needs nothing that `input` has not (check_replayable)
  Replay(const Scenario& scenario, ReplayInput& input, int threads);
  ~Replay();

  /// Writes what happens from now on; it must outlive the replay.
  void record_to(Recorder& recorder) { recorder_ = &recorder; }

  /// One millisecond. @return whether there is more.
  bool tick();
  [[nodiscard]] Stamp now() const { return now_; }
  [[nodiscard]] const FlightSoftware& software() const { return *stack_; }
  void interrupt() { interrupted_ = true; }

  /// Scores what was estimated. Call it once, at the end.
  /// @param truth in order of time, in whatever frame
  ReplayResult finish(const std::vector<StampedPose>& truth);

 private:
  /// Truth and estimate where there are both, and what the estimate believes of its errors.
  struct Beside {
    std::vector<PosePair> pairs;
    std::vector<Eigen::Matrix<float, 6, 6>> covariances;  ///< one for each, as Odometry::covariance
    [[nodiscard]] OdometryScore score() const;
  };

  /// What an odometry source said.
  struct Track {
    std::vector<PosePair> estimates;                      ///< the truth left open
    std::vector<Eigen::Matrix<float, 6, 6>> covariances;  ///< one for each
    Stamp newest = -1;
    double lost_s = 0;
    OdometryStatus status = OdometryStatus::kInitialising;
    bool follow(const Odometry& odometry, Stamp stamp);
    [[nodiscard]] Beside beside(const std::vector<StampedPose>& truth) const;
  };

  void deliver();
  void record();
  void note_cloud_growth();
  void write_maps();
  void write_truth(const std::vector<PosePair>& pairs);

  ScenarioConfig config_;
  ReplayInput& input_;
  Recorder* recorder_ = nullptr;
  std::optional<Arrival> coming_;
  Stamp begin_ = 0, now_ = 0;
  Stamp imu_stamp_ = 0;  ///< of the newest sample
  bool interrupted_ = false;
  Track flown_;
  std::map<std::string, Track> others_;
  std::vector<CloudGrowth> cloud_growth_;  ///< in jobs of the cloud's lane
  StageTimer stack_time_{"stack"}, reading_time_{"recording"}, semantics_time_{"semantics"};
  JobQueue jobs_;
  std::unique_ptr<FlightSoftware> stack_;
};

/// Gives a scenario the mounts that the recording knows, unless the scenario says them itself, and
/// has the input read the cameras that the scenario uses: the depth camera for the maps, the
/// infrared pair for a visual odometry. Of cameras that sit otherwise than our vehicle's the mounts
/// stand under vehicle.mounts.depth and vehicle.mounts.infrared.
/// @throws ConfigError if neither says where the LiDAR is, and for an odometry that this recording
///   does not feed, if it is to fly.
void prepare_for_replay(Scenario& scenario, ReplayInput& input);

/// summary.json of a replay: the figures that it has, and of the recording under `replay`.
nlohmann::ordered_json summarise_replay(const Scenario& scenario, const ReplayResult& result,
                                        const ReplayInput& input, const std::string& recording,
                                        const HostTime& host);

}  // namespace arex::sim
