#include "files/files.h"

#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstring>
#include <memory>
#include <utility>

namespace arex {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kBuffer = 64 * 1024;
constexpr std::array<int, 3> kFull{ENOSPC, EDQUOT, EFBIG};

std::error_code last_error() { return {errno, std::generic_category()}; }

[[noreturn]] void refuse(const fs::path& file) {
  throw DiskError(file, "cannot be written", last_error());
}

bool write_all(int descriptor, std::string_view bytes) {
  while (!bytes.empty()) {
    const ssize_t count = write(descriptor, bytes.data(), bytes.size());
    if (count < 0 && errno == EINTR) continue;
    if (count <= 0) return false;
    bytes.remove_prefix(static_cast<std::size_t>(count));
  }
  return true;
}

const char* kind_of(mode_t mode) {
  if (S_ISDIR(mode)) return "is a folder";
  if (S_ISFIFO(mode)) return "is a FIFO";
  if (S_ISSOCK(mode)) return "is a socket";
  return "is a device";
}

// The regular file, or the free name, that an output of this name would fill.
fs::path target_of(const fs::path& file) {
  struct stat status {};
  if (lstat(file.c_str(), &status) != 0) {
    if (errno != ENOENT) refuse(file);
    return file;
  }
  const bool link = S_ISLNK(status.st_mode);
  if (link && stat(file.c_str(), &status) != 0) {
    throw DiskError(file, "is a symbolic link that points nowhere", last_error());
  }
  if (!S_ISREG(status.st_mode)) {
    throw DiskError(file, std::string(kind_of(status.st_mode)) + ", expected a file",
                    std::make_error_code(std::errc::file_exists));
  }
  if (access(file.c_str(), W_OK) != 0) refuse(file);
  return link ? fs::canonical(file) : file;
}

void remove_if_there(const fs::path& file) {
  if (unlink(file.c_str()) != 0 && errno != ENOENT) {
    throw DiskError(file, "cannot be removed", last_error());
  }
}

/// A file beside the one to be written, gone with the object unless it took the name.
class Draft {
 public:
  explicit Draft(const fs::path& target) : target_(target), draft_(target) {
    draft_ += "." + std::to_string(getpid()) + ".partial";
    unlink(draft_.c_str());
    descriptor_ = open(draft_.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0666);
    if (descriptor_ < 0) refuse(target_);
  }
  ~Draft() {
    close_file();
    if (!draft_.empty()) unlink(draft_.c_str());
  }
  Draft(const Draft&) = delete;
  Draft& operator=(const Draft&) = delete;

  void fill(std::string_view text, bool durable) {
    if (!write_all(descriptor_, text) || (durable && fsync(descriptor_) != 0)) refuse(target_);
    if (!close_file()) refuse(target_);
  }
  void take_name() {
    if (rename(draft_.c_str(), target_.c_str()) != 0) refuse(target_);
    draft_.clear();
  }
  [[nodiscard]] const fs::path& target() const { return target_; }

 private:
  bool close_file() {
    const int descriptor = std::exchange(descriptor_, -1);
    return descriptor < 0 || close(descriptor) == 0;
  }

  fs::path target_, draft_;
  int descriptor_ = -1;
};

}  // namespace

DiskError::DiskError(const fs::path& file, const std::string& what, std::error_code reason)
    : std::runtime_error(file.string() + ": " + what + ": " + reason.message()), code_(reason) {}

bool DiskError::disk_full() const {
  for (const int reason : kFull) {
    if (code_.value() == reason) return true;
  }
  return false;
}

bool names_full_disk(std::string_view text) {
  for (const int reason : kFull) {
    if (text.find(std::strerror(reason)) != std::string_view::npos) return true;
  }
  return false;
}

fs::path check_writable(const fs::path& file) {
  fs::path target = target_of(file);
  const Draft probe(target);
  return target;
}

void write_atomically(const fs::path& file, std::string_view text, bool durable) {
  Draft draft(target_of(file));
  draft.fill(text, durable);
  draft.take_name();
}

void write_together(const std::vector<FileText>& files, const std::vector<fs::path>& outdated) {
  std::vector<std::unique_ptr<Draft>> drafts;
  for (const FileText& each : files) {
    drafts.push_back(std::make_unique<Draft>(target_of(each.file)));
    drafts.back()->fill(each.text, true);
  }
  if (drafts.empty()) return;
  remove_if_there(drafts.back()->target());
  for (const fs::path& file : outdated) remove_if_there(file);
  for (const auto& draft : drafts) draft->take_name();
}

GrowingFile::GrowingFile(const fs::path& file) : file_(target_of(file)) {
  // Another process may be giving the file its final name: what was opened must still be it.
  for (;;) {
    close();
    descriptor_ = open(file_.c_str(), O_WRONLY | O_CREAT | O_CLOEXEC | O_NONBLOCK, 0666);
    if (descriptor_ < 0) refuse(file_);
    if (flock(descriptor_, LOCK_EX | LOCK_NB) != 0 && errno == EWOULDBLOCK) {
      close();
      throw DiskError(file_, "is being written by another process",
                      std::make_error_code(std::errc::device_or_resource_busy));
    }
    struct stat opened {
    }, named{};
    require(fstat(descriptor_, &opened) == 0);
    if (stat(file_.c_str(), &named) == 0 && opened.st_ino == named.st_ino) break;
  }
  require(ftruncate(descriptor_, 0) == 0);
  waiting_.reserve(kBuffer);
}

GrowingFile::~GrowingFile() { close(); }

GrowingFile::GrowingFile(GrowingFile&& other) noexcept
    : file_(std::move(other.file_)),
      waiting_(std::exchange(other.waiting_, {})),
      descriptor_(std::exchange(other.descriptor_, -1)) {}

void GrowingFile::append(std::string_view bytes) {
  waiting_ += bytes;
  if (waiting_.size() >= kBuffer) flush();
}

void GrowingFile::flush() {
  const std::string bytes = std::exchange(waiting_, {});
  require(write_all(descriptor_, bytes));
}

void GrowingFile::overwrite_beginning(std::string_view bytes) {
  const ssize_t count = pwrite(descriptor_, bytes.data(), bytes.size(), 0);
  require(count == static_cast<ssize_t>(bytes.size()));
}

void GrowingFile::finish_as(const fs::path& name) {
  flush();
  const fs::path target = target_of(name);
  require(fsync(descriptor_) == 0 && rename(file_.c_str(), target.c_str()) == 0);
  close();
}

void GrowingFile::close() {
  if (descriptor_ >= 0) ::close(std::exchange(descriptor_, -1));
}

void GrowingFile::require(bool done) {
  if (done) return;
  const DiskError error(file_, "cannot be written", last_error());
  close();
  throw error;
}

}  // namespace arex
