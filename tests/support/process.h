#pragma once

#include <fcntl.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <csignal>
#include <filesystem>
#include <string>
#include <vector>

#include "support/temporary_folder.h"

namespace arex::test {

/// How a program ended: its exit code, or 128 and the signal.
struct ProcessResult {
  int exit_code = -1;
  std::string out;
  std::string err;
};

/// A program as a child of the test; what it says goes to files in `folder`.
class Process {
 public:
  Process(const std::string& program, const std::vector<std::string>& arguments,
          const std::filesystem::path& folder)
      : out_(folder / "stdout"), err_(folder / "stderr") {
    pid_ = fork();
    if (pid_ != 0) return;
    prctl(PR_SET_PDEATHSIG, SIGKILL);  // a test that dies leaves nothing behind
    dup2(creat(out_.c_str(), 0600), STDOUT_FILENO);
    dup2(creat(err_.c_str(), 0600), STDERR_FILENO);
    std::vector<char*> argv{const_cast<char*>(program.c_str())};
    for (const std::string& a : arguments) argv.push_back(const_cast<char*>(a.c_str()));
    argv.push_back(nullptr);
    execvp(program.c_str(), argv.data());
    _exit(127);
  }
  [[nodiscard]] pid_t pid() const { return pid_; }
  void signal(int number) const { kill(pid_, number); }
  [[nodiscard]] ProcessResult wait() const {
    int status = 0;
    waitpid(pid_, &status, 0);
    return {WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status), read_text(out_),
            read_text(err_)};
  }

 private:
  std::filesystem::path out_, err_;
  pid_t pid_ = -1;
};

/// Runs a program to its end.
inline ProcessResult run_process(const std::string& program,
                                 const std::vector<std::string>& arguments) {
  const TemporaryFolder folder;
  return Process(program, arguments, folder.path()).wait();
}

}  // namespace arex::test
