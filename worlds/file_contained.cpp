#include "worlds/file_contained.h"

#include <fcntl.h>
#include <sys/mman.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <csignal>
#include <cstring>
#include <exception>
#include <new>
#include <stdexcept>

#include "config/config.h"

namespace arex::worlds {
namespace {

#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
constexpr bool kSanitized = true;  // shadow memory is terabytes of address space
#else
constexpr bool kSanitized = false;
#endif

constexpr char kAnswer = 'A';
constexpr char kComplaint = 'C';

class Descriptor {
 public:
  explicit Descriptor(int fd) : fd_(fd) {}
  ~Descriptor() {
    if (fd_ >= 0) close(fd_);
  }
  Descriptor(const Descriptor&) = delete;
  Descriptor& operator=(const Descriptor&) = delete;
  [[nodiscard]] int get() const { return fd_; }

 private:
  int fd_;
};

bool write_all(int fd, const char* data, std::size_t size) {
  while (size > 0) {
    const ssize_t written = write(fd, data, size);
    if (written < 0 && errno == EINTR) continue;
    if (written <= 0) return false;
    data += written;
    size -= static_cast<std::size_t>(written);
  }
  return true;
}

void limit_resources(const ContainedLimits& limits) {
  prctl(PR_SET_PDEATHSIG, SIGKILL);
  for (const int signal : {SIGINT, SIGTERM, SIGHUP, SIGXFSZ}) std::signal(signal, SIG_DFL);
  const int nowhere = open("/dev/null", O_RDWR | O_CLOEXEC);
  for (const int stream : {0, 1, 2}) dup2(nowhere, stream);
  const auto seconds = static_cast<rlim_t>(limits.cpu_s) + 1;
  const rlimit cpu{seconds, seconds + 1};
  setrlimit(RLIMIT_CPU, &cpu);
  const rlimit no_core{0, 0};
  setrlimit(RLIMIT_CORE, &no_core);
  if (!kSanitized) {
    const rlimit memory{limits.memory_bytes, limits.memory_bytes};
    setrlimit(RLIMIT_AS, &memory);
  }
}

[[noreturn]] void work(int fd, const std::function<std::string()>& job,
                       const ContainedLimits& limits) {
  limit_resources(limits);
  char kind = kComplaint;
  std::string text;
  try {
    text = job();
    kind = kAnswer;
  } catch (const std::bad_alloc&) {
    text = "needs more memory than a world may";
  } catch (const std::length_error&) {
    text = "holds a length that no memory has";
  } catch (const std::exception& error) {
    text = error.what();
  } catch (...) {
    text = "its reader failed";
  }
  const bool told = write_all(fd, &kind, 1) && write_all(fd, text.data(), text.size());
  _exit(told ? 0 : 1);
}

int wait_for(pid_t child) {
  int status = 0;
  while (waitpid(child, &status, 0) < 0) {
    if (errno != EINTR) throw std::runtime_error(std::string("waitpid: ") + std::strerror(errno));
  }
  return status;
}

std::string read_back(int fd) {
  struct stat info {};
  if (fstat(fd, &info) != 0) throw std::runtime_error("the reader's answer cannot be read");
  std::string text(static_cast<std::size_t>(info.st_size), '\0');
  for (std::size_t done = 0; done < text.size();) {
    const ssize_t got = pread(fd, text.data() + done, text.size() - done, static_cast<off_t>(done));
    if (got < 0 && errno == EINTR) continue;
    if (got <= 0) throw std::runtime_error("the reader's answer cannot be read");
    done += static_cast<std::size_t>(got);
  }
  return text;
}

}  // namespace

std::string run_contained(const std::function<std::string()>& job, const ContainedLimits& limits) {
  const Descriptor answer(memfd_create("world", MFD_CLOEXEC));
  if (answer.get() < 0) {
    throw std::runtime_error(std::string("memfd_create: ") + std::strerror(errno));
  }
  const pid_t child = fork();
  if (child < 0) throw std::runtime_error(std::string("fork: ") + std::strerror(errno));
  if (child == 0) work(answer.get(), job, limits);
  const int status = wait_for(child);
  if (WIFSIGNALED(status)) {
    const int signal = WTERMSIG(status);
    if (signal == SIGXCPU || signal == SIGKILL) {
      throw ConfigError("its reader did not come to an end");
    }
    throw ConfigError(std::string("its reader crashed on it (") + strsignal(signal) + ")");
  }
  std::string text = read_back(answer.get());
  if (WEXITSTATUS(status) != 0 || text.empty()) throw ConfigError("its reader failed on it");
  const char kind = text.front();
  text.erase(0, 1);
  if (kind != kAnswer) throw ConfigError(text);
  return text;
}

}  // namespace arex::worlds
