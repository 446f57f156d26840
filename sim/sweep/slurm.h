#pragma once

#include <filesystem>
#include <set>
#include <stdexcept>
#include <string>
#include <vector>

#include "sweep/supervisor.h"

/// The same sweep on a Slurm cluster: an array of jobs, a run each. Nodes need the folder of the
/// sweep, which holds a copy of the binary, and the libraries that the binary links.
///
///     bin/arex-BUILD       the binary as it was when the runs were submitted
///     slurm/NAME.json      a batch: what task I of the array of this name flies
///     slurm/NAME.sh, NAME-I.log
///
/// Nothing has to be remembered of a job but its name, so that nothing is lost when the submission
/// is killed between Slurm's yes and our note of it.
namespace arex::sim {

/// Slurm said no; what() has its words.
class SlurmError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// An array of jobs that Slurm took.
struct SlurmBatch {
  std::string name;
  std::string job_id;
  std::size_t runs = 0;
};

/// A batch as its file says it.
struct BatchFile {
  double timeout_s = 0;
  int retries = 0;
  std::vector<RunOrder> runs;  ///< by index of the array
};
BatchFile load_batch(const std::filesystem::path& file);

/// Ids of the runs that wait in Slurm's queue or fly. @throws SlurmError if there are batches and
/// Slurm does not answer: their runs must not be submitted again.
std::set<std::string> queued_runs(const SweepFolder& folder);

/// Tasks that one array may have on this cluster.
std::size_t max_array_size(const SweepFolder& folder);

/// Submits runs, in as many arrays as MaxArraySize asks for.
/// @param at_a_time tasks of an array that may run at once; 0: as many as Slurm gives
/// @param options of sbatch; they come after ours and win, but for the array and its name
/// @throws SlurmError; the batches before it are submitted.
std::vector<SlurmBatch> submit(const SweepFolder& folder, const SweepPlan& plan,
                               const std::vector<RunOrder>& orders,
                               const std::filesystem::path& program, int at_a_time,
                               const std::vector<std::string>& options);

}  // namespace arex::sim
