#pragma once

#include <cstddef>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "evaluation/timed_pose.h"

namespace arex::sim {

/// How programs write trajectories, a pose a line.
enum class TrajectoryFormat {
  kTum,    ///< time_s x y z qx qy qz qw
  kEuroc,  ///< time_ns, x, y, z, qw, qx, qy, qz, and whatever follows
  kKitti,  ///< the upper three rows of the 4 x 4 pose, one after the other; no time
};

/// What people write for it: tum, euroc, kitti.
std::string_view format_name(TrajectoryFormat format);

std::optional<TrajectoryFormat> format_named(std::string_view name);

/// A trajectory as another program left it, and what was done to its lines.
struct Trajectory {
  std::string file;  ///< its name, printable
  TrajectoryFormat format = TrajectoryFormat::kTum;
  std::vector<TimedPose> poses;  ///< in order of time; of KITTI in the file's, without times

  std::size_t not_finite = 0;    ///< lines left out: a NaN or an infinity stands in them
  std::size_t out_of_order = 0;  ///< poses earlier than the one before them in the file; sorted
  std::size_t same_stamp = 0;    ///< poses with the stamp of the one before them; kept
  std::size_t normalised = 0;    ///< quaternions further from unit length than rounding takes them
  std::size_t cut_short = 0;     ///< last line without its end, as a killed program leaves it

  [[nodiscard]] bool has_time() const { return format != TrajectoryFormat::kKitti; }
};

/// Reads numbers between blanks or commas, whichever line ends, with comments (#), blank lines and
/// a heading. The format is told by the number of columns and by the first stamp.
/// @param format what a file is whose lines may be of this format and of others
/// @throws ConfigError, FILE:LINE, for what is no number, no rotation or no such file; for files
/// without poses and those whose format remains open.
Trajectory read_trajectory(const std::filesystem::path& file,
                           std::optional<TrajectoryFormat> format = {});

/// The same from text; `name` stands for the file in messages.
Trajectory parse_trajectory(std::string_view text, const std::string& name,
                            std::optional<TrajectoryFormat> format = {});

}  // namespace arex::sim
