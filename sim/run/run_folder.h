#pragma once

#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "config/config.h"
#include "run/file_io.h"

namespace arex::sim {

/// Another process is at work in a folder; what() says which.
class FolderInUse : public ConfigError {
 public:
  using ConfigError::ConfigError;
};

/// A run's folder, taken before anything is flown: created if need be, locked, and found fit to
/// take a run. Whoever lets go of it without having written anything leaves it as it was.
class RunFolder {
 public:
  /// @throws FolderInUse; DiskError if it cannot be written; ConfigError if it holds something else
  /// than a run: what a run replaces must be a run's.
  explicit RunFolder(const std::filesystem::path& path);
  ~RunFolder();
  RunFolder(const RunFolder&) = delete;
  RunFolder& operator=(const RunFolder&) = delete;

  [[nodiscard]] const std::filesystem::path& path() const { return folder_.path(); }
  /// Whether a run of another configuration stands there, finished or not.
  [[nodiscard]] bool holds_another(const std::string& resolved_yaml) const;

  /// The first of NAME, NAME-2, NAME-3, ... that is free or holds a run of this configuration: no
  /// run is replaced by one that flew something else. @throws as above.
  static std::unique_ptr<RunFolder> first_free(const std::filesystem::path& name,
                                               const std::string& resolved_yaml);

 private:
  void expect_room_for_a_run() const;

  OutputFolder folder_;
  FileLock lock_;
};

/// A file that a command reads or writes, by what names it on the command line.
struct NamedFile {
  std::string name;
  std::filesystem::path file;
};

/// @throws ConfigError if two of them are the same file, however it is spelled or linked.
void expect_different_files(const std::vector<NamedFile>& files);

/// The names of everything that a run writes into a folder.
std::vector<NamedFile> files_of_a_run(const std::filesystem::path& folder);

}  // namespace arex::sim
