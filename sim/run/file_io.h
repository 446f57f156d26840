#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "files/files.h"

/// Folders that others read and write at the same time. What writes files of the disk stands in
/// files/files.h. All functions that write @throw DiskError.
namespace arex::sim {

/// The whole text of a file; empty if it cannot be read.
std::string read_file(const std::filesystem::path& file);

/// Appends one line in one write: lines of several writers do not mix. @return whether it worked.
bool append_line(const std::filesystem::path& file, const std::string& line);

/// Makes a folder's files and names last beyond a power cut.
void sync_folder(const std::filesystem::path& folder);
/// The names only.
void sync_names(const std::filesystem::path& folder);

/// Removes a folder and what is in it, also while a dying process still writes there.
void remove_folder(const std::filesystem::path& folder);

/// A folder that is made for what a command will write, and goes again if nothing was.
class OutputFolder {
 public:
  /// Creates what is missing of the path. @throws DiskError.
  explicit OutputFolder(std::filesystem::path path);
  /// Removes of what it created what is empty.
  ~OutputFolder();
  OutputFolder(const OutputFolder&) = delete;
  OutputFolder& operator=(const OutputFolder&) = delete;
  [[nodiscard]] const std::filesystem::path& path() const { return path_; }

 private:
  std::filesystem::path path_;
  std::vector<std::filesystem::path> created_;  ///< from the innermost on
};

/// Whether a small file can be written in the folder.
bool accepts_writes(const std::filesystem::path& folder);

std::string host_name();

/// A lock of the whole file between processes and, where the file system says so, hosts. Ends with
/// the object or the process, so that no dead process ever holds one.
class FileLock {
 public:
  enum class Mode { kShared, kExclusive };
  FileLock(const std::filesystem::path& file, Mode mode);
  ~FileLock();
  FileLock(const FileLock&) = delete;
  FileLock& operator=(const FileLock&) = delete;

  /// Tries to take it, for so long. @return whether this object holds it. A file system without
  /// locks gives it to everyone.
  bool take(double patience_s = 0);
  /// What the holder wrote about itself.
  [[nodiscard]] std::string holder() const;
  /// Writes that this process holds it; of an exclusive lock.
  void sign();
  /// Takes its file away and ends the lock; of an exclusive lock that is held.
  void remove();

 private:
  void open_file();
  void close_file();
  /// Whether the file still has its name: its last holder may have taken it away.
  [[nodiscard]] bool in_place() const;

  std::filesystem::path file_;
  Mode mode_;
  int descriptor_ = -1;
};

}  // namespace arex::sim
