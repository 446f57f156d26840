#pragma once

#include <sys/types.h>

#include <chrono>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

namespace arex::sim {

/// The program that runs: a sweep and a blame start themselves again.
inline constexpr const char* kThisProgram = "/proc/self/exe";

/// How a child ended and what it took.
struct ChildExit {
  int exit_code = -1;  ///< -1 if a signal ended it
  int signal = 0;
  double wall_s = 0;
  double cpu_s = 0;
  double max_rss_mb = 0;
  std::string output;  ///< what it said on stdout and stderr, of the last 16 MB
};

/// A process of ours: it dies with us, whatever ends us, and what it says needs no disk.
class ChildProcess {
 public:
  /// Starts `program`, looked for in PATH if it has no slash, in `folder`. @throws
  /// std::system_error if there is no process to be had.
  ChildProcess(const std::filesystem::path& program, const std::vector<std::string>& arguments,
               const std::filesystem::path& folder);
  /// Kills it if it still runs.
  ~ChildProcess();
  ChildProcess(ChildProcess&& other) noexcept;
  ChildProcess& operator=(ChildProcess&&) = delete;

  /// How it ended; nothing while it runs. Never waits.
  std::optional<ChildExit> poll();
  /// Waits; nothing if it still runs then.
  std::optional<ChildExit> wait(double longest_s);
  void kill();
  [[nodiscard]] double age_s() const;
  [[nodiscard]] pid_t pid() const { return pid_; }

 private:
  [[nodiscard]] std::string output() const;

  pid_t pid_ = -1;  ///< -1 once it was waited for
  int output_ = -1;
  std::chrono::steady_clock::time_point begin_;
};

/// Holds back SIGCHLD and the signals that ask us to stop, so that they can be waited for. Children
/// start with the mask that was there before.
class SignalGate {
 public:
  SignalGate();
  ~SignalGate();
  SignalGate(const SignalGate&) = delete;
  SignalGate& operator=(const SignalGate&) = delete;

  /// Waits for a signal. @return SIGINT, SIGTERM or SIGHUP if one asked us to stop, otherwise 0.
  static int wait(double longest_s);
};

}  // namespace arex::sim
