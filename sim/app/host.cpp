#include "app/host.h"

#include <fcntl.h>
#include <sched.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstdio>

#include "files/files.h"

namespace arex::app {

int cores() {
  cpu_set_t set;
  CPU_ZERO(&set);
  return sched_getaffinity(0, sizeof set, &set) == 0 ? std::max(1, CPU_COUNT(&set)) : 1;
}

std::filesystem::path resolve_input_file(const std::filesystem::path& file) {
  namespace fs = std::filesystem;
  std::error_code none;
  if (file.empty() || file.is_absolute() || fs::exists(file, none)) return file;
  const fs::path share = fs::read_symlink("/proc/self/exe", none).parent_path() / "../share/arex";
  for (const fs::path& candidate : {share / file, share / "scenarios" / file}) {
    if (fs::is_regular_file(candidate, none)) return fs::weakly_canonical(candidate, none);
  }
  return file;
}

void open_standard_streams() {
  for (int stream = STDIN_FILENO; stream <= STDERR_FILENO; ++stream) {
    // The lowest free number is the one that is closed.
    if (fcntl(stream, F_GETFD) == -1) (void)open("/dev/null", O_RDWR);
  }
  // What a command prints fits, so that the flush at its end still knows why it was refused.
  if (isatty(STDOUT_FILENO) == 0) std::setvbuf(stdout, nullptr, _IOFBF, std::size_t{1} << 20U);
}

void flush_standard_output() {
  errno = 0;
  const bool flushed = std::fflush(stdout) == 0;
  const int reason = errno != 0 ? errno : EIO;  // an earlier call's is gone
  if (flushed && std::ferror(stdout) == 0) return;
  std::clearerr(stdout);
  throw DiskError("standard output", "cannot be written", {reason, std::generic_category()});
}

}  // namespace arex::app
