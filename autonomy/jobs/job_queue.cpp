#include "jobs/job_queue.h"

#include <algorithm>
#include <ctime>
#include <limits>
#include <utility>

namespace arex {
namespace {

// CPU time of this thread: what the work cost, however busy the host was.
double thread_seconds() {
  timespec time{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &time);
  return static_cast<double>(time.tv_sec) + 1e-9 * static_cast<double>(time.tv_nsec);
}

// CPU time that others spent on pieces of this thread's job.
thread_local double helped_seconds = 0;

}  // namespace

JobQueue::JobQueue(int threads) : threads_(std::max(threads, 1)) {
  try {
    for (int i = 1; i < threads; ++i) workers_.emplace_back([this] { run_worker(); });
  } catch (...) {
    stop();  // a host that refuses a thread: those that began wait for work, and must end
    throw;
  }
}

JobQueue::~JobQueue() { stop(); }

void JobQueue::stop() {
  {
    const std::lock_guard lock(mutex_);
    stopping_ = true;
  }
  work_available_.notify_all();
  for (std::thread& worker : workers_) worker.join();
  workers_.clear();
}

void JobQueue::drain() {
  std::unique_lock lock(mutex_);
  while (!pending_.empty()) {
    const JobPtr job = pending_.front();
    finish(lock, *job);
    pending_.erase(pending_.begin());
    if (job->error) std::rethrow_exception(job->error);
  }
}

JobQueue::Lane JobQueue::add_lane(std::string name, Order order) {
  const std::lock_guard lock(mutex_);
  LaneState& lane = lanes_.emplace_back();
  lane.name = std::move(name);
  lane.order = order;
  return lanes_.size() - 1;
}

Stamp JobQueue::start(Lane lane, Stamp now, Stamp latency, Work work) {
  std::unique_lock lock(mutex_);
  LaneState& state = lanes_.at(lane);
  const Stamp visible_at = std::max(now, state.free_at) + latency;
  state.free_at = visible_at;
  enqueue(lock, lane, visible_at, std::move(work));
  return visible_at;
}

void JobQueue::schedule(Lane lane, Stamp visible_at, Work work) {
  std::unique_lock lock(mutex_);
  enqueue(lock, lane, visible_at, std::move(work));
}

void JobQueue::enqueue(std::unique_lock<std::mutex>& lock, Lane lane, Stamp visible_at, Work work) {
  auto job = std::make_shared<Job>();
  job->visible_at = visible_at;
  job->lane = lane;
  job->work = std::move(work);
  const auto position = std::upper_bound(
      pending_.begin(), pending_.end(), job,
      [](const JobPtr& a, const JobPtr& b) { return a->visible_at < b->visible_at; });
  pending_.insert(position, job);
  lanes_.at(lane).waiting.push_back(job);
  if (workers_.empty()) {
    run_one(lock, lane);
  } else {
    work_available_.notify_one();
  }
}

void JobQueue::run(const std::function<Lane()>& work) {
  const double begin = thread_seconds();
  const Lane lane = work();
  const auto seconds = static_cast<float>(thread_seconds() - begin);
  const std::lock_guard lock(mutex_);
  lanes_.at(lane).seconds.push_back(seconds);
}

void JobQueue::advance(Stamp now) {
  for (;;) {
    std::unique_lock lock(mutex_);
    if (pending_.empty() || pending_.front()->visible_at > now) return;
    const JobPtr job = pending_.front();
    finish(lock, *job);
    pending_.erase(pending_.begin());
    lock.unlock();
    if (job->error) std::rethrow_exception(job->error);
    if (job->delivery) job->delivery();
  }
}

bool JobQueue::is_free(Lane lane, Stamp now) const {
  const std::lock_guard lock(mutex_);
  return lanes_.at(lane).free_at <= now;
}

std::vector<JobQueue::LaneTiming> JobQueue::timings() const {
  const std::lock_guard lock(mutex_);
  std::vector<LaneTiming> out;
  for (const LaneState& lane : lanes_) out.push_back({lane.name, lane.seconds});
  return out;
}

void JobQueue::execute(Job& job) {
  const double begin = thread_seconds();
  helped_seconds = 0;
  try {
    job.delivery = job.work();
  } catch (...) {
    job.error = std::current_exception();
  }
  job.work = nullptr;  // lets go of its inputs
  job.seconds = static_cast<float>(thread_seconds() - begin + helped_seconds);
}

void JobQueue::split(std::size_t count, const std::function<void(std::size_t)>& piece) {
  if (threads_ == 1) {
    in_turn(count, piece);
    return;
  }
  Pieces pieces{piece, count};
  std::unique_lock lock(mutex_);
  splits_.push_back(&pieces);
  work_available_.notify_all();
  job_done_.notify_all();
  while (pieces.begun < count) do_piece(lock, pieces, false);
  job_done_.wait(lock, [&] { return pieces.done == count; });
  splits_.erase(std::find(splits_.begin(), splits_.end(), &pieces));
  helped_seconds += pieces.others_s;
  if (pieces.error) std::rethrow_exception(pieces.error);
}

// Does the next piece on this thread. @param helps whether it is another's job
void JobQueue::do_piece(std::unique_lock<std::mutex>& lock, Pieces& pieces, bool helps) {
  const std::size_t i = pieces.begun++;
  lock.unlock();
  const double begin = thread_seconds();
  std::exception_ptr error;
  try {
    pieces.piece(i);
  } catch (...) {
    error = std::current_exception();
  }
  const double seconds = thread_seconds() - begin;
  lock.lock();
  if (error && (!pieces.error || i < pieces.thrown_by)) {
    pieces.error = error;
    pieces.thrown_by = i;
  }
  if (helps) pieces.others_s += seconds;
  if (++pieces.done == pieces.count) job_done_.notify_all();
}

// Pieces of a job under way that nobody has begun.
JobQueue::Pieces* JobQueue::next_pieces() const {
  const auto open = std::find_if(splits_.begin(), splits_.end(),
                                 [](const Pieces* p) { return p->begun < p->count; });
  return open == splits_.end() ? nullptr : *open;
}

// Runs the next job of a lane on this thread.
void JobQueue::run_one(std::unique_lock<std::mutex>& lock, Lane lane) {
  const JobPtr job = lanes_[lane].waiting.front();
  lanes_[lane].waiting.pop_front();
  ++lanes_[lane].running;
  lock.unlock();
  execute(*job);
  lock.lock();
  --lanes_[lane].running;  // lanes_ may have grown meanwhile: no reference is kept
  lanes_[lane].seconds.push_back(job->seconds);
  lanes_[lane].sum_s += static_cast<double>(job->seconds);
  job->done = true;
  job_done_.notify_all();
  if (!lanes_[lane].waiting.empty()) work_available_.notify_one();
}

// The lane whose next job will be waited for first, of those whose jobs are no longer than that.
std::optional<JobQueue::Lane> JobQueue::next_lane(double longest_s) const {
  const auto next = std::find_if(pending_.begin(), pending_.end(), [&](const JobPtr& job) {
    const LaneState& lane = lanes_[job->lane];
    const bool open = lane.running == 0 || lane.order == Order::kSideBySide;
    return open && !lane.waiting.empty() && lane.waiting.front() == job &&
           lane.mean_s() <= longest_s;
  });
  return next == pending_.end() ? std::nullopt : std::optional((*next)->lane);
}

// Waits for the first of the pending jobs. The caller's thread is one of the host threads: while
// another one runs that job it takes the next, but none that is longer: the flight goes on when the
// job is done, and with it the work for all threads. Pieces of jobs under way come first: one of
// them may be the awaited job's, and none is long.
void JobQueue::finish(std::unique_lock<std::mutex>& lock, const Job& job) {
  while (!job.done) {
    if (Pieces* pieces = next_pieces()) {
      do_piece(lock, *pieces, true);
    } else if (const auto lane = next_lane(lanes_[job.lane].mean_s())) {
      run_one(lock, *lane);
    } else {
      job_done_.wait(lock);
    }
  }
}

void JobQueue::run_worker() {
  std::unique_lock lock(mutex_);
  while (!stopping_) {
    if (Pieces* pieces = next_pieces()) {
      do_piece(lock, *pieces, true);
    } else if (const auto lane = next_lane(std::numeric_limits<double>::infinity())) {
      run_one(lock, *lane);
    } else {
      work_available_.wait(lock);
    }
  }
}

}  // namespace arex
