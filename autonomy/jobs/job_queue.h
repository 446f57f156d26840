#pragma once

#include <condition_variable>
#include <deque>
#include <exception>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "jobs/split.h"
#include "math/types.h"

namespace arex {

/// Heavy work with modelled compute time.
///
/// A job belongs to a lane: the thread that one module would have on the vehicle. It starts when
/// its lane is free and its result becomes visible `latency` later, however long the host took. So
/// what the rest of the system sees does not depend on the number of host threads or their speed.
///
/// Contract: a job may touch its lane's module and what it captured by value or shared const
/// pointer; everything else waits for its delivery, which runs on the thread that calls advance().
class JobQueue {
 public:
  using Delivery = std::function<void()>;
  using Work = std::function<Delivery()>;
  using Lane = std::size_t;

  /// @param threads host threads in all, the caller's included: 1 runs every job inside start().
  explicit JobQueue(int threads);
  ~JobQueue();
  JobQueue(const JobQueue&) = delete;
  JobQueue& operator=(const JobQueue&) = delete;

  /// Ends the host threads; jobs not begun are dropped. To be called before anything that jobs
  /// touch goes away.
  void stop();

  /// Runs every job that was begun or waits, and drops the results: the end of a flight.
  void drain();

  /// How a lane's jobs run on the host: each after the one before, or, where they share nothing
  /// that changes, as many at a time as there are threads. What they deliver comes in order anyway.
  enum class Order { kOneByOne, kSideBySide };
  Lane add_lane(std::string name, Order order = Order::kOneByOne);

  /// Starts `work` at `now` or when the lane is free. @return the stamp at which it becomes
  /// visible.
  Stamp start(Lane lane, Stamp now, Stamp latency, Work work);

  /// Schedules device work that becomes visible at a stamp of the caller's: a sensor that is read
  /// out while it exposes the next frame. It does not occupy the lane in simulated time.
  void schedule(Lane lane, Stamp visible_at, Work work);

  /// Does a job's work in pieces, on every host thread that has nothing else to do; to be called by
  /// jobs. Rethrows what a piece threw, the first of them. @see Split
  void split(std::size_t count, const std::function<void(std::size_t)>& piece);

  [[nodiscard]] int threads() const { return threads_; }

  /// Does light work at once on the caller's thread, only to have it timed with the rest: by the
  /// lane that `work` returns.
  void run(const std::function<Lane()>& work);

  /// Delivers every result that is visible at `now`, in order of visibility, then of start.
  /// Rethrows what a job threw.
  void advance(Stamp now);

  /// Whether the lane would start a job at `now` without queueing it.
  [[nodiscard]] bool is_free(Lane lane, Stamp now) const;

  /// Host seconds that each job took, by lane; for timing.csv only.
  struct LaneTiming {
    std::string name;
    std::vector<float> seconds;
  };
  [[nodiscard]] std::vector<LaneTiming> timings() const;

 private:
  struct Job {
    Stamp visible_at = 0;
    Lane lane = 0;
    Work work;
    Delivery delivery;
    std::exception_ptr error;
    float seconds = 0;
    bool done = false;
  };
  using JobPtr = std::shared_ptr<Job>;
  struct LaneState {
    std::string name;
    Order order = Order::kOneByOne;
    Stamp free_at = 0;
    std::deque<JobPtr> waiting;  ///< not yet run, in order
    int running = 0;
    std::vector<float> seconds;
    double sum_s = 0;
    [[nodiscard]] double mean_s() const {
      return seconds.empty() ? 0 : sum_s / static_cast<double>(seconds.size());
    }
  };

  /// What a job does in pieces, while it waits for them.
  struct Pieces {
    const std::function<void(std::size_t)>& piece;
    std::size_t count = 0, begun = 0, done = 0;
    std::exception_ptr error = nullptr;
    std::size_t thrown_by = 0;
    double others_s = 0;  ///< CPU time of threads that are not the job's
  };

  void enqueue(std::unique_lock<std::mutex>& lock, Lane lane, Stamp visible_at, Work work);
  static void execute(Job& job);
  void run_one(std::unique_lock<std::mutex>& lock, Lane lane);
  [[nodiscard]] std::optional<Lane> next_lane(double longest_s) const;
  [[nodiscard]] Pieces* next_pieces() const;
  void do_piece(std::unique_lock<std::mutex>& lock, Pieces& pieces, bool helps);
  void finish(std::unique_lock<std::mutex>& lock, const Job& job);
  void run_worker();

  int threads_;
  std::vector<LaneState> lanes_;
  std::vector<JobPtr> pending_;  ///< not yet delivered, in delivery order
  std::vector<Pieces*> splits_;  ///< of the jobs under way
  std::vector<std::thread> workers_;
  mutable std::mutex mutex_;
  std::condition_variable work_available_;
  std::condition_variable job_done_;
  bool stopping_ = false;
};

}  // namespace arex
