#include "sweep/file_io.h"

#include <fcntl.h>
#include <sys/file.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <chrono>
#include <fstream>
#include <sstream>
#include <thread>
#include <vector>

namespace arex::sim {
namespace {

namespace fs = std::filesystem;

[[noreturn]] void fail(const fs::path& path) {
  throw DiskError("cannot be written", path, std::error_code(errno, std::generic_category()));
}

/// A file descriptor that closes itself and is not inherited.
class Descriptor {
 public:
  Descriptor(const fs::path& path, int flags)
      : value_(open(path.c_str(), flags | O_CLOEXEC, 0666)) {}
  ~Descriptor() {
    if (value_ >= 0) close(value_);
  }
  Descriptor(const Descriptor&) = delete;
  Descriptor& operator=(const Descriptor&) = delete;
  [[nodiscard]] int value() const { return value_; }
  [[nodiscard]] bool valid() const { return value_ >= 0; }

 private:
  int value_;
};

bool write_all(int descriptor, const std::string& text) {
  std::size_t done = 0;
  while (done < text.size()) {
    const ssize_t count = write(descriptor, text.data() + done, text.size() - done);
    if (count < 0 && errno == EINTR) continue;
    if (count <= 0) return false;
    done += static_cast<std::size_t>(count);
  }
  return true;
}

void sync_path(const fs::path& path, int flags) {
  const Descriptor file(path, flags);
  if (!file.valid()) fail(path);
  // Some network file systems cannot sync a directory.
  if (fsync(file.value()) != 0 && errno != EINVAL) fail(path);
}

}  // namespace

bool DiskError::disk_full() const {
  return code() == std::errc::no_space_on_device || code().value() == EDQUOT;
}

std::string read_file(const fs::path& file) {
  std::ifstream stream(file, std::ios::binary);
  std::ostringstream text;
  text << stream.rdbuf();
  return text.str();
}

void write_atomically(const fs::path& file, const std::string& text, bool durable) {
  fs::path temporary = file;
  temporary += "." + std::to_string(getpid()) + ".partial";
  const bool written = [&] {
    const Descriptor out(temporary, O_WRONLY | O_CREAT | O_TRUNC);
    return out.valid() && write_all(out.value(), text) && (!durable || fsync(out.value()) == 0);
  }();
  if (written && rename(temporary.c_str(), file.c_str()) == 0) return;
  const int error = errno;
  unlink(temporary.c_str());
  errno = error;
  fail(file);
}

bool append_line(const fs::path& file, const std::string& line) {
  const Descriptor out(file, O_WRONLY | O_CREAT | O_APPEND);
  return out.valid() && write_all(out.value(), line + "\n");
}

void sync_folder(const fs::path& folder) {
  std::vector<fs::path> files;
  for (const auto& entry : fs::directory_iterator(folder)) {
    if (entry.is_regular_file()) files.push_back(entry.path());
  }
  // All of them on their way first: the journal is then written once, not once a file.
  for (const fs::path& path : files) {
    const Descriptor file(path, O_RDONLY);
    if (file.valid()) sync_file_range(file.value(), 0, 0, SYNC_FILE_RANGE_WRITE);
  }
  for (const fs::path& path : files) sync_path(path, O_RDONLY);
  sync_names(folder);
}

void sync_names(const fs::path& folder) { sync_path(folder, O_RDONLY | O_DIRECTORY); }

void remove_folder(const fs::path& folder) {
  std::error_code error;
  for (int attempt = 0; attempt < 50; ++attempt) {
    fs::remove_all(folder, error);
    if (!error) return;
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
  }
  throw DiskError("cannot be removed", folder, error);
}

bool accepts_writes(const fs::path& folder) {
  const fs::path probe = folder / (".probe-" + std::to_string(getpid()));
  const std::string block(64 * 1024, '\0');
  const bool accepted = [&] {
    const Descriptor out(probe, O_WRONLY | O_CREAT | O_TRUNC);
    return out.valid() && write_all(out.value(), block) && fsync(out.value()) == 0;
  }();
  unlink(probe.c_str());
  return accepted;
}

FileLock::FileLock(const fs::path& file, Mode mode) : file_(file), mode_(mode) {
  descriptor_ = open(file.c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0666);
  if (descriptor_ < 0) fail(file);
}

FileLock::~FileLock() { close(descriptor_); }

bool FileLock::take(double patience_s) {
  constexpr auto kPause = std::chrono::milliseconds(50);
  const int mode = mode_ == Mode::kShared ? LOCK_SH : LOCK_EX;
  const auto end = std::chrono::steady_clock::now() + std::chrono::duration<double>(patience_s);
  for (;;) {
    if (flock(descriptor_, mode | LOCK_NB) == 0 || errno != EWOULDBLOCK) return true;
    if (std::chrono::steady_clock::now() >= end) return false;
    std::this_thread::sleep_for(kPause);
  }
}

std::string FileLock::holder() const { return read_file(file_); }

void FileLock::sign(const std::string& text) {
  // A full disk must not keep a sweep from saying so itself.
  if (ftruncate(descriptor_, 0) != 0 || pwrite(descriptor_, text.data(), text.size(), 0) < 0)
    return;
}

}  // namespace arex::sim
