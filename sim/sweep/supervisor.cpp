#include "sweep/supervisor.h"

#include <fmt/format.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <nlohmann/json.hpp>
#include <utility>

#include "run/file_io.h"
#include "run/summary.h"

namespace arex::sim {
namespace {

constexpr double kLongestWait_s = 0.5;  // between two looks at the clock
constexpr std::size_t kKeptOutput = 16 * 1024;

std::string last_line(const std::string& text) {
  const auto end = text.find_last_not_of("\n ");
  if (end == std::string::npos) return "";
  const auto newline = text.find_last_of('\n', end);
  const std::size_t begin = newline == std::string::npos ? 0 : newline + 1;
  return text.substr(begin, end - begin + 1);
}

// What ended a run that left no valid summary, in words that are the same each time.
RunState diagnose(const ChildExit& exit, bool overran, double timeout_s) {
  if (overran) {
    return {Failure::kOverran, fmt::format("killed after {:g} s", timeout_s)};
  }
  if (exit.signal != 0) {
    return {Failure::kCrashed,
            "signal " + std::to_string(exit.signal) + " (" + strsignal(exit.signal) + ")"};
  }
  const std::string said = last_line(exit.output);
  if (exit.exit_code == 2) return {Failure::kRefused, said};
  std::string detail = "exit code " + std::to_string(exit.exit_code);
  if (!said.empty()) detail += ": " + said;
  return {Failure::kUnfinished, detail};
}

std::string end_of(const std::string& text) {
  return text.size() <= kKeptOutput ? text : text.substr(text.size() - kKeptOutput);
}

}  // namespace

Supervisor::Supervisor(const SweepFolder& folder, std::filesystem::path program,
                       const FlyOptions& options, Listener listener)
    : folder_(folder),
      program_(std::move(program)),
      options_(options),
      listener_(std::move(listener)),
      begin_(std::chrono::steady_clock::now()) {}

SweepEnd Supervisor::fly(const std::vector<RunOrder>& orders) {
  const SignalGate gate;
  progress_ = {};
  progress_.total = orders.size();
  for (auto order = orders.rbegin(); order != orders.rend(); ++order) {
    waiting_.emplace_back(&*order, 1);
  }
  double told_s = -1;
  while (!flights_.empty() || (!waiting_.empty() && disk_full_.empty())) {
    refill();
    if (SignalGate::wait(kLongestWait_s) != 0) {
      stop_all();
      report_progress();
      return SweepEnd::kInterrupted;
    }
    kill_overdue();
    const std::size_t settled = progress_.finished + progress_.broken;
    collect();
    progress_.elapsed_s =
        std::chrono::duration<double>(std::chrono::steady_clock::now() - begin_).count();
    if (settled != progress_.finished + progress_.broken || progress_.elapsed_s > told_s + 1) {
      told_s = progress_.elapsed_s;
      report_progress();
    }
  }
  return disk_full_.empty() ? SweepEnd::kDone : SweepEnd::kDiskFull;
}

void Supervisor::start(const RunOrder& order, int attempt) {
  folder_.remove_partial(order.id);
  folder_.log("start", order.id, attempt, "");
  const std::vector<std::string> arguments{"run",       SweepFolder::configuration(order.id),
                                           "--name",    order.scenario,
                                           "--out",     SweepFolder::partial(order.id),
                                           "--threads", "1",
                                           "--quiet",   "--no-report"};
  flights_.push_back({&order, attempt, false, ChildProcess(program_, arguments, folder_.root())});
}

void Supervisor::kill_overdue() {
  for (Flight& flight : flights_) {
    if (flight.overran || flight.process.age_s() < options_.timeout_s) continue;
    flight.overran = true;
    flight.process.kill();
  }
}

void Supervisor::refill() {
  while (disk_full_.empty() && !waiting_.empty() &&
         flights_.size() < static_cast<std::size_t>(options_.jobs)) {
    const auto [order, attempt] = waiting_.back();
    waiting_.pop_back();
    start(*order, attempt);
  }
}

void Supervisor::collect() {
  std::list<std::pair<Flight, ChildExit>> ended;
  for (auto flight = flights_.begin(); flight != flights_.end();) {
    std::optional<ChildExit> exit = flight->process.poll();
    if (exit) {
      ended.emplace_back(std::move(*flight), std::move(*exit));
      flight = flights_.erase(flight);
    } else {
      ++flight;
    }
  }
  refill();  // no core waits for the disk
  for (const auto& [flight, exit] : ended) {
    if (!finish_attempt(flight, exit)) waiting_.emplace_back(flight.order, flight.attempt + 1);
  }
}

bool Supervisor::finish_attempt(const Flight& flight, const ChildExit& exit) {
  const RunOrder& order = *flight.order;
  const RunState state = diagnose(exit, flight.overran, options_.timeout_s);
  try {
    if (!flight.overran && keep(flight, exit)) return true;
    folder_.log("broken", order.id, flight.attempt, state.detail);
    if (names_full_disk(exit.output) || !accepts_writes(folder_.root())) {
      disk_full_ = last_line(exit.output);
      if (disk_full_.empty()) disk_full_ = folder_.root().string() + ": takes no more";
    } else if (state.failure == Failure::kRefused || flight.attempt > options_.retries) {
      give_up(order, state, flight.attempt, exit.output);
      return true;
    }
  } catch (const DiskError& error) {
    if (!error.disk_full() && accepts_writes(folder_.root())) throw;
    disk_full_ = error.what();
  }
  folder_.remove_partial(order.id);
  return !disk_full_.empty();
}

// Exit code 1 with a summary is a mission that failed: a result like any other.
bool Supervisor::keep(const Flight& flight, const ChildExit& exit) {
  if (exit.exit_code != 0 && exit.exit_code != 1) return false;
  const RunOrder& order = *flight.order;
  const auto partial = folder_.root() / SweepFolder::partial(order.id);
  if (!std::filesystem::exists(partial / "summary.json")) return false;
  const nlohmann::ordered_json host{{"host", host_name()},
                                    {"attempt", flight.attempt},
                                    {"wall_s", exit.wall_s},
                                    {"cpu_s", exit.cpu_s},
                                    {"max_rss_mb", exit.max_rss_mb}};
  write_atomically(partial / "host.json", json_text(host));
  if (!exit.output.empty()) write_atomically(partial / "output.txt", end_of(exit.output));
  if (!folder_.publish(order.id)) return false;
  folder_.log("finish", order.id, flight.attempt, "");
  ++progress_.finished;
  if (exit.exit_code != 0) ++progress_.missions_failed;
  work_s_ += exit.wall_s;
  return true;
}

void Supervisor::give_up(const RunOrder& order, const RunState& state, int attempts,
                         const std::string& output) {
  const auto partial = folder_.root() / SweepFolder::partial(order.id);
  std::filesystem::create_directories(partial);
  if (!output.empty()) write_atomically(partial / "output.txt", end_of(output));
  folder_.record_failure(order.id, state, attempts);
  ++progress_.broken;
  if (listener_.broken) listener_.broken(order, state);
}

void Supervisor::stop_all() {
  for (Flight& flight : flights_) flight.process.kill();
  std::vector<const RunOrder*> orders;
  for (const Flight& flight : flights_) orders.push_back(flight.order);
  flights_.clear();  // waits for each
  for (const RunOrder* order : orders) {
    folder_.log("stopped", order->id, 0, "");
    folder_.remove_partial(order->id);
  }
}

void Supervisor::report_progress() {
  progress_.running = flights_.size();
  const std::size_t settled = progress_.finished + progress_.broken;
  if (progress_.finished > 0) {
    const double each = work_s_ / static_cast<double>(progress_.finished);
    progress_.left_s =
        each * static_cast<double>(progress_.total - settled) / static_cast<double>(options_.jobs);
  }
  if (listener_.progress) listener_.progress(progress_);
}

}  // namespace arex::sim
