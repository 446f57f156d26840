#pragma once

#include <functional>
#include <list>
#include <string>
#include <vector>

#include "sweep/child_process.h"
#include "sweep/sweep_folder.h"

namespace arex::sim {

/// A run to be flown.
struct RunOrder {
  std::string id;
  std::string scenario;
};

/// How runs are flown.
struct FlyOptions {
  int jobs = 1;
  double timeout_s = 0;
  int retries = 0;
};

/// What a sweep has come to, for the line that a person watches.
struct SweepProgress {
  std::size_t total = 0;            ///< runs ordered
  std::size_t finished = 0;         ///< with a summary
  std::size_t broken = 0;           ///< without one, after every retry
  std::size_t missions_failed = 0;  ///< finished, and the mission did not succeed
  std::size_t running = 0;
  double elapsed_s = 0;
  double left_s = -1;  ///< estimate; negative while unknown
};

enum class SweepEnd { kDone, kInterrupted, kDiskFull };

/// Flies runs, some at a time, a process each. A run that crashes, overruns its time or leaves no
/// summary is tried again; one whose configuration is refused is not. When the disk is full,
/// nothing more is started and what fell victim to it counts as not flown.
class Supervisor {
 public:
  /// Hears of every run that breaks, and about once a second how it goes.
  struct Listener {
    std::function<void(const RunOrder&, const RunState&)> broken;
    std::function<void(const SweepProgress&)> progress;
  };

  /// @param program the binary to start as `program run ...`
  Supervisor(const SweepFolder& folder, std::filesystem::path program, const FlyOptions& options,
             Listener listener);

  SweepEnd fly(const std::vector<RunOrder>& orders);
  /// What the disk said when it took no more.
  [[nodiscard]] const std::string& disk_full() const { return disk_full_; }
  [[nodiscard]] const SweepProgress& progress() const { return progress_; }

 private:
  struct Flight {
    const RunOrder* order;
    int attempt;
    bool overran;
    ChildProcess process;
  };

  void start(const RunOrder& order, int attempt);
  void refill();
  void kill_overdue();
  void collect();
  /// @return whether the run is done with, one way or the other.
  bool finish_attempt(const Flight& flight, const ChildExit& exit);
  bool keep(const Flight& flight, const ChildExit& exit);
  void give_up(const RunOrder& order, const RunState& state, int attempts,
               const std::string& output);
  void stop_all();
  void report_progress();

  const SweepFolder& folder_;
  std::filesystem::path program_;
  FlyOptions options_;
  Listener listener_;
  std::list<Flight> flights_;
  std::vector<std::pair<const RunOrder*, int>> waiting_;  ///< with the attempt, last one first
  SweepProgress progress_;
  std::string disk_full_;  ///< what the disk said; empty: it takes more
  double work_s_ = 0;      ///< wall time of what has finished
  std::chrono::steady_clock::time_point begin_;
};

}  // namespace arex::sim
