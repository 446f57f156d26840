#pragma once

#include <array>
#include <atomic>
#include <filesystem>
#include <functional>
#include <map>
#include <mutex>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "exploration/explorer.h"
#include "files/files.h"
#include "mapping/mapper.h"
#include "math/pose.h"
#include "messages/events.h"
#include "messages/stereo_image.h"
#include "messages/visual_tracks.h"
#include "scoring/flight_scorer.h"
#include "semantics/semantic_map.h"
#include "sensors/infrared_shot.h"

namespace arex::sim {

/// Every file that a run, its report or a sweep writes into a run folder: what an older run in the
/// same folder may have left. resolved.yaml stands last: it goes last, too.
inline constexpr std::array<std::string_view, 24> kRunFiles{
    "summary.json", "truth.tum",    "estimate.tum",     "coverage.csv",       "events.csv",
    "timing.csv",   "cloud.pcd",    "map.bt",           "map2d.pgm",          "map2d.yaml",
    "report.html",  "flight.csv",   "decisions.csv",    "odometry_error.csv", "cloud_growth.csv",
    "infrared.csv", "semantic.pcd", "objects.csv",      "semantic.png",       "host.json",
    "output.txt",   "failure.json", "vio_features.csv", "resolved.yaml"};

/// How many points the cloud had at a moment. Points are in the order of their first sight, so that
/// the first `points` of cloud.pcd are the map of that moment.
struct CloudGrowth {
  Stamp stamp = 0;
  std::size_t points = 0;
};

/// How often what was written is given to the disk, for a killed run, and how finely a replay of
/// the map resolves its growth.
inline constexpr Stamp kFlushPeriod = 1000 * kNanosecondsPerTick;
inline constexpr Stamp kGrowthPeriod = 500 * kNanosecondsPerTick;

/// What a run writes into its folder. Everything but the summary is written while flying, so that a
/// killed run leaves what it had; the summary is written last and atomically: a folder without it
/// is unfinished. A disk that refuses does not end the flight by an exception: each file that could
/// not be written is named in failures(), and the others are still written.
class Recorder {
 public:
  /// Creates the folder if need be, removes an older run's files and writes resolved.yaml.
  /// @throws DiskError.
  Recorder(const std::filesystem::path& directory, const std::string& resolved_yaml);
  ~Recorder();

  void event(const Event& event);
  /// To truth.tum, estimate.tum and flight.csv; what further sources say to NAME.tum.
  void sample(Stamp stamp, const FlightSample& sample);
  /// From where and how an infrared frame was taken, to infrared.csv.
  void images(const InfraredShot& shot, const StereoImage& images, double mean_grey);
  /// What a visual odometry followed in an exposure, to vio_features.csv.
  void features(const std::vector<FeatureSight>& features);
  /// Every candidate of a decision with its terms, to decisions.csv.
  void decision(const Decision& decision);
  /// Makes what was recorded so far readable by others.
  void flush();

  /// cloud.pcd and cloud_growth.csv, each replaced atomically. May be called from a job.
  void write_cloud(const std::vector<Vec3f>& points_O, const std::vector<CloudGrowth>& growth);
  /// map.bt, map2d.pgm and map2d.yaml.
  void write_maps(const Mapper& mapper);
  /// semantic.pcd, objects.csv and semantic.png.
  void write_semantics(const SemanticMap& map, const std::vector<Vec3f>& points_O,
                       const std::vector<Vec3f>& path_O);
  /// A whole file of the folder, replaced atomically. @pre name is one of kRunFiles.
  void write_file(const std::string& name, const std::string& content);
  /// Flushes everything, then writes summary.json.
  void write_summary(const nlohmann::ordered_json& summary);

  /// What the disk refused so far, a line for each file. May be called while a job writes.
  [[nodiscard]] std::vector<std::string> failures() const;
  [[nodiscard]] bool failed() const { return failed_; }
  [[nodiscard]] const std::filesystem::path& directory() const { return directory_; }

 private:
  /// Does it, and remembers what the disk said against it.
  void attempt(const std::function<void()>& write);
  void append(GrowingFile& file, std::string_view text);
  GrowingFile open(const std::string& name, const std::string& header);

  std::filesystem::path directory_;
  GrowingFile truth_, estimate_, events_, flight_, decisions_;
  std::map<std::string, std::optional<GrowingFile>>
      others_;                           ///< NAME.tum of further odometry sources
  std::optional<GrowingFile> infrared_;  ///< made when the first frame comes
  std::optional<GrowingFile> features_;  ///< likewise
  std::vector<std::string> failures_;
  std::atomic<bool> failed_ = false;
  mutable std::mutex mutex_;  ///< of failures_: the cloud is written in a job
};

}  // namespace arex::sim
