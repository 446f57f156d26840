#pragma once

#include <filesystem>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <vector>

#include "sweep/sweep_plan.h"

namespace arex::sim {

/// Why a run has no summary.
enum class Failure { kNone, kCrashed, kOverran, kRefused, kUnfinished, kMissing };
inline constexpr std::array<std::string_view, 6> kFailureNames{"",        "crashed",    "overran",
                                                               "refused", "unfinished", "missing"};

/// What is known of one run.
struct RunState {
  Failure failure = Failure::kMissing;
  std::string detail;  ///< of the failure
};

/// The folder of a sweep: everything that a run needs and everything that it leaves.
///
///     sweep.json           what is swept: keys, number of runs, build
///     plan/ID.yaml         the resolved configuration of each run
///     runs/ID/             a finished run: it appears whole, by a rename, and is never written
///     again runs/ID.failed/      what the last attempt of a broken run left, with failure.json
///     runs/ID.partial-*/   a run in flight, or what a killed sweep left of one
///     log.csv              every start and end of an attempt
///     sweep.csv            one row a run; sweep_host.csv: what depends on the host
class SweepFolder {
 public:
  explicit SweepFolder(std::filesystem::path root) : root_(std::move(root)) {}

  [[nodiscard]] const std::filesystem::path& root() const { return root_; }
  /// Paths relative to the root, so that nothing written inside depends on where it stands.
  [[nodiscard]] static std::filesystem::path configuration(const std::string& id);
  [[nodiscard]] static std::filesystem::path finished(const std::string& id);
  [[nodiscard]] static std::filesystem::path failed(const std::string& id);
  /// Of this process.
  [[nodiscard]] static std::filesystem::path partial(const std::string& id);

  /// Creates the folders, writes sweep.json and each run's configuration.
  void prepare(const SweepPlan& plan) const;
  /// The valid summary of a finished run: a mission that ended by itself.
  [[nodiscard]] std::optional<nlohmann::ordered_json> summary(const std::string& id) const;
  /// host.json of a finished run; empty without it.
  [[nodiscard]] nlohmann::ordered_json host(const std::string& id) const;
  [[nodiscard]] RunState state(const std::string& id) const;

  /// Makes the partial run of this process a finished one. @return whether it is one: false if its
  /// summary is not valid. If another process was faster, its run stays.
  [[nodiscard]] bool publish(const std::string& id) const;
  /// Keeps what a broken run left. @throws DiskError.
  void record_failure(const std::string& id, const RunState& state, int attempts) const;
  void remove_partial(const std::string& id) const;
  /// Removes what killed sweeps left. Only for who holds both locks.
  void remove_all_partials() const;
  /// Ids of the partial runs.
  [[nodiscard]] std::vector<std::string> partials() const;
  /// A line of log.csv.
  void log(const std::string& event, const std::string& id, int attempt,
           const std::string& detail) const;

 private:
  std::filesystem::path root_;
};

/// A cell of a CSV file, quoted where it must be.
std::string csv_cell(const std::string& text);

}  // namespace arex::sim
