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

/// Slurm cannot be asked, or said no; what() has its words on one line.
class SlurmError : public std::runtime_error {
 public:
  explicit SlurmError(const std::string& message, bool refused = false)
      : std::runtime_error(message), refused_(refused) {}
  /// It did answer, with a no: nothing has been submitted.
  [[nodiscard]] bool refused() const { return refused_; }

 private:
  bool refused_;
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

/// What of a sweep's folder waits in Slurm's queue or flies.
struct SlurmQueue {
  std::set<std::string> runs;     ///< ids
  std::set<std::string> job_ids;  ///< of the arrays that they belong to
};
/// @throws SlurmError if there are batches and Slurm does not answer: their runs must not be
/// submitted again.
SlurmQueue queue_of(const SweepFolder& folder);

/// Asks a cluster, before anything is made ready for it. @throws SlurmError if there is none.
/// @return the tasks that one array may have
std::size_t max_array_size();

/// How to submit.
struct SlurmOptions {
  std::size_t longest = 1;  ///< tasks of an array
  int at_a_time = 0;        ///< tasks of all arrays together that may run at once; 0: any number
  std::vector<std::string> sbatch;  ///< of sbatch; they win over ours, but for array and name
};

/// What came of a submission: the batches that Slurm took, and why it took no more.
struct SlurmSubmission {
  std::vector<SlurmBatch> batches;
  std::string refusal;  ///< empty: all are submitted
};

/// Submits runs, in as many arrays as `longest` asks for. Where at_a_time bounds them, each array
/// waits for the end of the one before and of what is in the queue already.
SlurmSubmission submit(const SweepFolder& folder, const SweepPlan& plan,
                       const std::vector<RunOrder>& orders, const std::filesystem::path& program,
                       const SlurmQueue& queue, const SlurmOptions& options);

}  // namespace arex::sim
