#pragma once

#include <filesystem>
#include <optional>
#include <string>

#include "run/snapshot.h"
#include "run/snapshot_picture.h"

namespace arex::sim {

/// A snapshot as its folder has it.
struct ReadSnapshot {
  std::string name;   ///< of its folder: the time, s
  Snapshot snapshot;  ///< of its points and cells only the part asked for
};

/// A part of a run's snapshot. @param time_s which; nothing: the only one
/// @throws ConfigError if there is no such snapshot, it is unfinished, or a file is damaged.
[[nodiscard]] ReadSnapshot read_snapshot(const std::filesystem::path& run, SnapshotPart part,
                                         std::optional<double> time_s);

}  // namespace arex::sim
