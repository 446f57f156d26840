#include "sweep/child_process.h"

#include <fcntl.h>
#include <signal.h>
#include <sys/mman.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <csignal>
#include <system_error>
#include <thread>
#include <utility>

namespace arex::sim {
namespace {

constexpr off_t kMostOutput = 16 << 20;

// A SIGHUP that is ignored on purpose, as under nohup, stays ignored.
sigset_t gate_signals() {
  sigset_t set;
  sigemptyset(&set);
  for (const int signal : {SIGCHLD, SIGINT, SIGTERM}) sigaddset(&set, signal);
  struct sigaction action {};
  sigaction(SIGHUP, nullptr, &action);
  if (action.sa_handler != SIG_IGN) sigaddset(&set, SIGHUP);
  return set;
}

/// What the child does between fork and exec: calls that are safe there only.
[[noreturn]] void exec_child(const char* program, char* const* argv, const char* folder, int output,
                             pid_t parent) {
  prctl(PR_SET_PDEATHSIG, SIGKILL);
  if (getppid() != parent) _exit(127);  // the parent died before the line above
  setpgid(0, 0);  // Ctrl-C in a terminal is for the parent, which ends its children itself
  const sigset_t ours = gate_signals();
  sigprocmask(SIG_UNBLOCK, &ours, nullptr);
  ::signal(SIGPIPE, SIG_DFL);
  dup2(output, STDOUT_FILENO);
  dup2(output, STDERR_FILENO);
  const int null = open("/dev/null", O_RDONLY);
  dup2(null, STDIN_FILENO);
  if (chdir(folder) == 0) execvp(program, argv);
  static constexpr char kMessage[] = "cannot be started\n";
  if (write(STDERR_FILENO, kMessage, sizeof kMessage - 1) < 0) _exit(126);
  _exit(127);
}

double seconds(const timeval& time) {
  return static_cast<double>(time.tv_sec) + 1e-6 * static_cast<double>(time.tv_usec);
}

}  // namespace

ChildProcess::ChildProcess(const std::filesystem::path& program,
                           const std::vector<std::string>& arguments,
                           const std::filesystem::path& folder)
    : begin_(std::chrono::steady_clock::now()) {
  std::vector<char*> argv{const_cast<char*>(program.c_str())};
  for (const std::string& a : arguments) argv.push_back(const_cast<char*>(a.c_str()));
  argv.push_back(nullptr);
  output_ = memfd_create("arex-output", MFD_CLOEXEC);
  if (output_ < 0) throw std::system_error(errno, std::generic_category(), "memfd_create");
  fcntl(output_, F_SETFL, O_APPEND);
  const pid_t parent = getpid();
  pid_ = fork();
  if (pid_ == 0) exec_child(program.c_str(), argv.data(), folder.c_str(), output_, parent);
  if (pid_ < 0) {
    const int error = errno;
    close(output_);
    throw std::system_error(error, std::generic_category(), "fork");
  }
}

ChildProcess::ChildProcess(ChildProcess&& other) noexcept
    : pid_(std::exchange(other.pid_, -1)),
      output_(std::exchange(other.output_, -1)),
      begin_(other.begin_) {}

ChildProcess::~ChildProcess() {
  if (pid_ > 0) {
    kill();
    waitpid(pid_, nullptr, 0);
  }
  if (output_ >= 0) close(output_);
}

void ChildProcess::kill() {
  if (pid_ > 0) ::kill(pid_, SIGKILL);
}

double ChildProcess::age_s() const {
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - begin_).count();
}

std::string ChildProcess::output() const {
  const off_t size = lseek(output_, 0, SEEK_END);
  const off_t from = std::max<off_t>(0, size - kMostOutput);
  std::string text(static_cast<std::size_t>(std::max<off_t>(0, size - from)), '\0');
  const ssize_t count = pread(output_, text.data(), text.size(), from);
  text.resize(static_cast<std::size_t>(std::max<ssize_t>(0, count)));
  return text;
}

std::optional<ChildExit> ChildProcess::poll() {
  int status = 0;
  rusage usage{};
  if (pid_ < 0 || wait4(pid_, &status, WNOHANG, &usage) != pid_) return std::nullopt;
  pid_ = -1;
  ChildExit exit;
  if (WIFEXITED(status)) exit.exit_code = WEXITSTATUS(status);
  if (WIFSIGNALED(status)) exit.signal = WTERMSIG(status);
  exit.wall_s = age_s();
  exit.cpu_s = seconds(usage.ru_utime) + seconds(usage.ru_stime);
  exit.max_rss_mb = static_cast<double>(usage.ru_maxrss) / 1024;
  exit.output = output();
  return exit;
}

std::optional<ChildExit> ChildProcess::wait(double longest_s) {
  for (;;) {
    if (std::optional<ChildExit> exit = poll()) return exit;
    if (age_s() > longest_s) return std::nullopt;
    std::this_thread::sleep_for(std::chrono::milliseconds(2));
  }
}

SignalGate::SignalGate() {
  ::signal(SIGCHLD, SIG_DFL);  // ignored, it would take the exit codes with it
  const sigset_t set = gate_signals();
  sigprocmask(SIG_BLOCK, &set, nullptr);
}

SignalGate::~SignalGate() {
  const sigset_t set = gate_signals();
  const timespec now{};
  while (sigtimedwait(&set, nullptr, &now) > 0) {  // none is left to be delivered late
  }
  sigprocmask(SIG_UNBLOCK, &set, nullptr);
}

int SignalGate::wait(double longest_s) {
  const sigset_t set = gate_signals();
  timespec limit{};
  limit.tv_sec = static_cast<time_t>(longest_s);
  limit.tv_nsec = static_cast<long>((longest_s - std::floor(longest_s)) * 1e9);
  const int signal = sigtimedwait(&set, nullptr, &limit);
  return signal > 0 && signal != SIGCHLD ? signal : 0;
}

}  // namespace arex::sim
