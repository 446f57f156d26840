#include "run/run_folder.h"

#include <algorithm>
#include <system_error>

#include "run/recorder.h"

namespace arex::sim {
namespace {

namespace fs = std::filesystem;

constexpr const char* kLock = ".lock";

bool same_file(const fs::path& a, const fs::path& b) {
  std::error_code none;
  if (fs::equivalent(a, b, none)) return true;
  // Of a relative name that is not there yet, weakly_canonical() makes no absolute one.
  const auto full = [&](const fs::path& p) { return fs::weakly_canonical(fs::absolute(p), none); };
  return full(a) == full(b);
}

}  // namespace

RunFolder::RunFolder(const fs::path& path)
    : folder_(path), lock_(path / kLock, FileLock::Mode::kExclusive) {
  if (!lock_.take()) {
    throw FolderInUse(path.string() + ": another run is at work here (" + lock_.holder() +
                      "), expected a folder of its own");
  }
  lock_.sign();
  try {
    expect_room_for_a_run();
  } catch (...) {
    lock_.remove();
    throw;
  }
}

RunFolder::~RunFolder() { lock_.remove(); }

void RunFolder::expect_room_for_a_run() const {
  const bool is_run = fs::exists(path() / "resolved.yaml");
  if (fs::exists(path() / "sweep.json")) {
    throw ConfigError(path().string() + ": holds a sweep, expected a folder for one run");
  }
  for (const std::string_view name : kRunFiles) {
    const fs::path file = path() / name;
    const fs::file_status status = fs::symlink_status(file);
    if (!fs::exists(status)) continue;
    if (!fs::is_regular_file(status)) {
      throw ConfigError(file.string() + ": is no regular file, expected one or nothing: " +
                        "the run would replace it");
    }
    if (!is_run) {
      throw ConfigError(path().string() + ": holds " + std::string(name) +
                        " and no resolved.yaml, so that it is no run; expected an empty " +
                        "folder or one of a run");
    }
  }
}

bool RunFolder::holds_another(const std::string& resolved_yaml) const {
  const fs::path file = path() / "resolved.yaml";
  return fs::exists(file) && read_file(file) != resolved_yaml;
}

std::unique_ptr<RunFolder> RunFolder::first_free(const fs::path& name,
                                                 const std::string& resolved_yaml) {
  for (int number = 1;; ++number) {
    const fs::path path =
        number == 1 ? name : fs::path(name.string() + "-" + std::to_string(number));
    try {
      auto folder = std::make_unique<RunFolder>(path);
      if (!folder->holds_another(resolved_yaml)) return folder;
    } catch (const FolderInUse&) {
      // It may be flying anything.
    }
  }
}

void expect_different_files(const std::vector<NamedFile>& files) {
  for (auto a = files.begin(); a != files.end(); ++a) {
    for (auto b = a + 1; b != files.end(); ++b) {
      if (!same_file(a->file, b->file)) continue;
      throw ConfigError(a->name + " and " + b->name + ": are the same file " + b->file.string() +
                        ", expected two");
    }
  }
}

std::vector<NamedFile> files_of_a_run(const fs::path& folder) {
  std::vector<NamedFile> files{{"the run's lock", folder / kLock}};
  for (const std::string_view name : kRunFiles) {
    files.push_back({"the run's " + std::string(name), folder / name});
  }
  return files;
}

}  // namespace arex::sim
