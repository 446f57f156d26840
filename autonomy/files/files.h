#pragma once

#include <filesystem>
#include <stdexcept>
#include <string>
#include <string_view>
#include <system_error>
#include <vector>

/// The only way in which anything of the house reaches the disk: files that are whole or not there,
/// and files that grow. Nothing but a regular file is ever replaced: no folder, device, FIFO or
/// socket. A symbolic link to a regular file stays a link, and what it points to is replaced, as a
/// shell's `>` does; one that points nowhere is refused.
namespace arex {

/// The disk refused. what() is "FILE: what cannot be done: the system's reason".
class DiskError : public std::runtime_error {
 public:
  DiskError(const std::filesystem::path& file, const std::string& what, std::error_code reason);
  [[nodiscard]] std::error_code code() const { return code_; }
  /// No room, no quota left, or the largest size that a file may have: a second try ends the same.
  [[nodiscard]] bool disk_full() const;

 private:
  std::error_code code_;
};

/// Whether a text names, in the system's words, a reason for which disk_full() holds.
bool names_full_disk(std::string_view text);

/// Throws if an output of this name could not be written now, and leaves nothing behind. Before the
/// work, what would fail after it costs nothing.
/// @return the file that would be written: links are followed. @throws DiskError.
std::filesystem::path check_writable(const std::filesystem::path& file);

/// Writes a file of its own and renames it into place: readers see the old text or the new one.
/// @param durable also after a power cut; otherwise whoever syncs the folder sees to that
/// @throws DiskError; what stood there before is left alone then.
void write_atomically(const std::filesystem::path& file, std::string_view text,
                      bool durable = true);

/// One of several files that belong together.
struct FileText {
  std::filesystem::path file;
  std::string text;
};

/// Writes files of which each tells of the others, durably. All are on the disk before the first
/// takes its name, and what the last of them replaces goes before that: where it stands, all of its
/// own making stand beside it, also after a kill.
/// @param outdated files of an earlier set that this one has not; gone with it
/// @throws DiskError; while files are written, what stood there before is left alone.
void write_together(const std::vector<FileText>& files,
                    const std::vector<std::filesystem::path>& outdated = {});

/// A file that others may read while it grows, up to the last flush(). Every refusal of the disk is
/// a DiskError with the reason of the very call that failed; the file is closed then.
class GrowingFile {
 public:
  /// Empties or creates it. While the object lives, no other process can open it in this way.
  /// @throws DiskError.
  explicit GrowingFile(const std::filesystem::path& file);
  ~GrowingFile();
  GrowingFile(GrowingFile&& other) noexcept;
  GrowingFile& operator=(GrowingFile&&) = delete;

  void append(std::string_view bytes);
  void flush();
  /// Writes over what stands at the beginning. @pre flushed
  void overwrite_beginning(std::string_view bytes);
  /// Flushes, makes it last beyond a power cut, and gives the file its final name. Closes it.
  void finish_as(const std::filesystem::path& name);
  [[nodiscard]] bool is_open() const { return descriptor_ >= 0; }
  [[nodiscard]] const std::filesystem::path& path() const { return file_; }

 private:
  void close();
  void require(bool done);

  std::filesystem::path file_;
  std::string waiting_;  ///< bytes not handed to the system yet
  int descriptor_ = -1;
};

}  // namespace arex
