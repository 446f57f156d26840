#pragma once

#include <filesystem>
#include <string>

/// Small files that are whole or not there. All functions that write @throw DiskError.
namespace arex::sim {

/// The disk refused; what() names the file and the reason.
class DiskError : public std::filesystem::filesystem_error {
 public:
  using std::filesystem::filesystem_error::filesystem_error;
  [[nodiscard]] bool disk_full() const;
};

/// The whole text of a file; empty if it cannot be read.
std::string read_file(const std::filesystem::path& file);

/// Writes a file of its own and renames it into place: readers see the old text or the new one.
/// @param durable also after a power cut; otherwise sync_folder() sees to that
void write_atomically(const std::filesystem::path& file, const std::string& text,
                      bool durable = true);

/// Appends one line in one write: lines of several writers do not mix. @return whether it worked.
bool append_line(const std::filesystem::path& file, const std::string& line);

/// Makes a folder's files and names last beyond a power cut.
void sync_folder(const std::filesystem::path& folder);
/// The names only.
void sync_names(const std::filesystem::path& folder);

/// Removes a folder and what is in it, also while a dying process still writes there.
void remove_folder(const std::filesystem::path& folder);

/// Whether a small file can be written in the folder.
bool accepts_writes(const std::filesystem::path& folder);

/// A lock of the whole file between processes and, where the file system says so, hosts. Ends with
/// the object or the process.
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
  /// Writes who holds it; of an exclusive lock.
  void sign(const std::string& text);

 private:
  std::filesystem::path file_;
  Mode mode_;
  int descriptor_ = -1;
};

}  // namespace arex::sim
