#include "run/file_io.h"

#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <chrono>
#include <fstream>
#include <sstream>
#include <thread>
#include <utility>
#include <vector>

namespace arex::sim {
namespace {

namespace fs = std::filesystem;

[[noreturn]] void fail(const fs::path& path) {
  throw DiskError(path, "cannot be written", {errno, std::generic_category()});
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

std::string read_file(const fs::path& file) {
  std::ifstream stream(file, std::ios::binary);
  std::ostringstream text;
  text << stream.rdbuf();
  return text.str();
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
  throw DiskError(folder, "cannot be removed", error);
}

OutputFolder::OutputFolder(fs::path path) : path_(std::move(path)) {
  std::error_code error;
  for (fs::path folder = fs::absolute(path_).lexically_normal();
       !fs::exists(fs::symlink_status(folder, error)); folder = folder.parent_path()) {
    if (folder.has_filename()) created_.push_back(folder);
  }
  fs::create_directories(path_, error);
  if (!error && !fs::is_directory(path_)) error = std::make_error_code(std::errc::not_a_directory);
  if (error) throw DiskError(path_, "cannot be a folder to write", error);
}

OutputFolder::~OutputFolder() {
  std::error_code none;
  for (const fs::path& folder : created_) fs::remove(folder, none);
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

std::string host_name() {
  std::array<char, 256> name{};
  gethostname(name.data(), name.size() - 1);
  return name.data();
}

FileLock::FileLock(const fs::path& file, Mode mode) : file_(file), mode_(mode) { open_file(); }

FileLock::~FileLock() { close_file(); }

void FileLock::open_file() {
  close_file();
  // What stands there and is no lock of ours must not be waited for, followed or written to.
  descriptor_ = open(file_.c_str(), O_RDWR | O_CREAT | O_CLOEXEC | O_NOFOLLOW | O_NONBLOCK, 0666);
  struct stat status {};
  if (descriptor_ < 0) fail(file_);
  if (fstat(descriptor_, &status) == 0 && S_ISREG(status.st_mode)) return;
  close_file();
  errno = EEXIST;
  fail(file_);
}

void FileLock::close_file() {
  if (descriptor_ >= 0) close(std::exchange(descriptor_, -1));
}

bool FileLock::in_place() const {
  struct stat held {
  }, named{};
  return fstat(descriptor_, &held) == 0 && stat(file_.c_str(), &named) == 0 &&
         held.st_ino == named.st_ino && held.st_dev == named.st_dev;
}

bool FileLock::take(double patience_s) {
  constexpr auto kPause = std::chrono::milliseconds(50);
  const int mode = mode_ == Mode::kShared ? LOCK_SH : LOCK_EX;
  const auto end = std::chrono::steady_clock::now() + std::chrono::duration<double>(patience_s);
  for (;;) {
    if (flock(descriptor_, mode | LOCK_NB) == 0 || errno != EWOULDBLOCK) {
      if (in_place()) return true;
      open_file();
      continue;
    }
    if (std::chrono::steady_clock::now() >= end) return false;
    std::this_thread::sleep_for(kPause);
  }
}

std::string FileLock::holder() const { return read_file(file_); }

void FileLock::sign() {
  const std::string text = "process " + std::to_string(getpid()) + " on " + host_name();
  // A full disk must not keep its holder from saying so itself.
  if (ftruncate(descriptor_, 0) != 0 || pwrite(descriptor_, text.data(), text.size(), 0) < 0)
    return;
}

void FileLock::remove() {
  unlink(file_.c_str());
  close_file();
}

}  // namespace arex::sim
