#include "run/recorder.h"

#include <fmt/format.h>

#include <algorithm>
#include <fstream>
#include <limits>
#include <nlohmann/json.hpp>
#include <stdexcept>
#include <utility>

#include "mapping/cloud_io.h"
#include "mapping/map_files.h"
#include "run/snapshot.h"
#include "run/summary.h"
#include "scoring/figures.h"
#include "semantics/cloud_file.h"
#include "semantics/semantic_picture.h"

namespace arex::sim {
namespace {

const std::string kTumHeader = "# time_s x_m y_m z_m qx qy qz qw ";

std::string tum_row(Stamp stamp, const Pose& X) {
  const Quat q = X.quaternion();
  return fmt::format("{:.9f} {:.6f} {:.6f} {:.6f} {:.9f} {:.9f} {:.9f} {:.9f}\n", to_seconds(stamp),
                     X.p.x(), X.p.y(), X.p.z(), q.x(), q.y(), q.z(), q.w());
}

/// Whether a TUM file is one that a run has written, whatever its odometry source was called.
bool has_run_header(const std::filesystem::path& file) {
  std::string beginning(kTumHeader.size(), '\0');
  std::ifstream(file).read(beginning.data(), static_cast<std::streamsize>(beginning.size()));
  return beginning == kTumHeader;
}

// What an older run and a killed one have left: nothing of them may stand beside the new.
void remove_older_run(const std::filesystem::path& directory) {
  std::vector<std::filesystem::path> drafts;
  for (const auto& entry : std::filesystem::directory_iterator(directory)) {
    const std::string name = entry.path().filename().string();
    const bool ours = std::any_of(kRunFiles.begin(), kRunFiles.end(), [&](std::string_view file) {
      return name.starts_with(std::string(file) + ".") && name.ends_with(".partial");
    });
    if (ours || (name.ends_with(".tum") && has_run_header(entry.path()))) {
      drafts.push_back(entry.path());
    }
  }
  std::error_code none;
  for (const auto& draft : drafts) std::filesystem::remove(draft, none);
  remove_snapshots(directory);
  for (const std::string_view name : kRunFiles) {
    std::error_code error;
    std::filesystem::remove(directory / name, error);
    if (error) throw DiskError(directory / name, "cannot be removed", error);
  }
}

std::filesystem::path made_folder(const std::filesystem::path& directory) {
  std::error_code error;
  std::filesystem::create_directories(directory, error);
  if (error) throw DiskError(directory, "cannot be created", error);
  remove_older_run(directory);
  return directory;
}

std::string csv_quoted(const std::string& text) {
  if (text.find_first_of(",\"\n") == std::string::npos) return text;
  std::string quoted = "\"";
  for (const char c : text) quoted += c == '"' ? std::string("\"\"") : std::string(1, c);
  return quoted + "\"";
}

// distance_m,angle_rad,direction,revenue: empty for a candidate that was dropped before they were
// worked out.
std::string terms_of(const Candidate& c) {
  if (c.verdict != Verdict::kKept && c.verdict != Verdict::kOffDirection) return ",,,";
  const double angle = c.angle_rad.value_or(std::numeric_limits<double>::quiet_NaN());
  return csv_number(c.distance_m, 3) + "," + csv_number(angle, 4) + "," +
         csv_number(c.direction, 4) + "," + csv_number(c.revenue, 4);
}

}  // namespace

Recorder::Recorder(const std::filesystem::path& directory, const std::string& resolved_yaml)
    : directory_(made_folder(directory)),
      truth_((write_atomically(directory_ / "resolved.yaml", resolved_yaml),
              open("truth.tum", kTumHeader + "(true X_OB)\n"))),
      estimate_(open("estimate.tum", kTumHeader + "(estimated X_OB)\n")),
      events_(open("events.csv", csv_header("events.csv"))),
      flight_(open("flight.csv", csv_header("flight.csv"))),
      decisions_(open("decisions.csv", csv_header("decisions.csv"))) {}

Recorder::~Recorder() {
  flush();  // of a flight that was left by an exception
}

GrowingFile Recorder::open(const std::string& name, const std::string& header) {
  GrowingFile file(directory_ / name);
  file.append(header);
  file.flush();
  return file;
}

void Recorder::attempt(const std::function<void()>& write) {
  try {
    write();
  } catch (const DiskError& error) {
    const std::lock_guard lock(mutex_);
    failed_ = true;
    const bool known =
        std::find(failures_.begin(), failures_.end(), error.what()) != failures_.end();
    if (!known) failures_.emplace_back(error.what());  // the cloud is tried every ten seconds
  }
}

std::vector<std::string> Recorder::failures() const {
  const std::lock_guard lock(mutex_);
  return failures_;
}

// A file that was refused once has been named and closed.
void Recorder::append(GrowingFile& file, std::string_view text) {
  if (file.is_open()) attempt([&] { file.append(text); });
}

void Recorder::event(const Event& event) {
  append(events_, fmt::format("{:.3f},", to_seconds(event.stamp)) +
                      std::string(kEventKindNames[static_cast<std::size_t>(event.kind)]) + "," +
                      csv_quoted(event.detail) + "\n");
}

void Recorder::sample(Stamp stamp, const FlightSample& sample) {
  if (sample.truth_X_OB) append(truth_, tum_row(stamp, *sample.truth_X_OB));
  if (sample.estimate_X_OB) append(estimate_, tum_row(stamp, *sample.estimate_X_OB));
  for (const auto& [name, X_OB] : sample.others_X_OB) {
    const auto [place, is_new] = others_.try_emplace(name);
    std::optional<GrowingFile>& file = place->second;
    if (is_new) {
      const std::string header = fmt::format("{}(X_OB as {} has it)\n", kTumHeader, name);
      attempt([&, tum = name + ".tum"] { file.emplace(open(tum, header)); });
    }
    if (file) append(*file, tum_row(stamp, X_OB));
  }
  if (!sample.row) return;
  const FlightRow& row = *sample.row;
  append(flight_,
         fmt::format("{:.3f},{:.4f},{},{:.4f},{:.5f},{},{:.4f},{},{},{}\n", to_seconds(row.stamp),
                     row.speed_mps, csv_number(row.tracking_error_m, 4), row.odometry_error_m,
                     row.odometry_yaw_error_rad, csv_number(row.clearance_m, 4), row.height_m,
                     csv_number(row.battery_voltage_v, 3), csv_number(row.battery_power_w, 1),
                     csv_number(row.battery_fraction, 5)));
}

void Recorder::images(const InfraredShot& shot, const StereoImage& images, double mean_grey) {
  if (!infrared_) {
    attempt([&] { infrared_.emplace(open("infrared.csv", csv_header("infrared.csv"))); });
  }
  if (!infrared_) return;
  std::string row =
      fmt::format("{:.9f},{},{},{:.2f},{:d}", to_seconds(shot.stamp), images.exposure_s,
                  images.gain, mean_grey, images.right.empty() ? 0 : 1);
  // Digits enough to take the same picture again.
  const Quat q = shot.X_WB.quaternion();
  for (const double value : {shot.X_WB.p.x(), shot.X_WB.p.y(), shot.X_WB.p.z(), q.x(), q.y(), q.z(),
                             q.w(), shot.v_WB.x(), shot.v_WB.y(), shot.v_WB.z(), shot.w_WB_B.x(),
                             shot.w_WB_B.y(), shot.w_WB_B.z()}) {
    row += fmt::format(",{}", value);
  }
  append(*infrared_, row + "\n");
}

void Recorder::features(const std::vector<FeatureSight>& features) {
  if (features.empty()) return;
  if (!features_) {
    attempt([&] { features_.emplace(open("vio_features.csv", csv_header("vio_features.csv"))); });
  }
  if (!features_) return;
  std::string rows;
  for (const FeatureSight& f : features) {
    rows += fmt::format("{:.9f},{},{:.2f},{:.2f},{}\n", to_seconds(f.stamp), f.id, f.left_px.x(),
                        f.left_px.y(), f.age);
  }
  append(*features_, rows);
}

void Recorder::decision(const Decision& decision) {
  const auto name = [](const auto& names, auto value) {
    return std::string(names[static_cast<std::size_t>(value)]);
  };
  const std::string head = name(kDecisionKindNames, decision.kind) + "," +
                           std::string(decision.source) + "," +
                           name(kTargetEndNames, decision.previous_end) + "," +
                           name(kStopReasonNames, decision.stop_reason);
  const std::string begin =
      fmt::format("{:.3f},{},", to_seconds(decision.stamp), decision.sequence) + head + ",";
  if (decision.candidates.empty()) append(decisions_, begin + ",,,,,,,,,\n");
  for (std::size_t i = 0; i < decision.candidates.size(); ++i) {
    const Candidate& c = decision.candidates[i];
    append(decisions_,
           begin + fmt::format("{},{},{:.2f},{:.2f},{},{:.3f},{}\n", i,
                               decision.winner == i ? 1 : 0, c.point.x(), c.point.y(),
                               name(kVerdictNames, c.verdict), c.information_m2, terms_of(c)));
  }
}

void Recorder::flush() {
  std::vector<GrowingFile*> files{&decisions_, &truth_, &estimate_, &events_, &flight_};
  for (auto& [name, file] : others_) {
    if (file) files.push_back(&*file);
  }
  if (infrared_) files.push_back(&*infrared_);
  if (features_) files.push_back(&*features_);
  for (GrowingFile* file : files) {
    if (file->is_open()) attempt([&] { file->flush(); });
  }
}

void Recorder::write_cloud(const std::vector<Vec3f>& points_O,
                           const std::vector<CloudGrowth>& growth) {
  attempt([&] { write_pcd(directory_ / "cloud.pcd", points_O); });
  std::string csv = csv_header("cloud_growth.csv");
  for (const CloudGrowth& row : growth) {
    csv += fmt::format("{:.3f},{}\n", to_seconds(row.stamp), row.points);
  }
  write_file("cloud_growth.csv", csv);
}

void Recorder::write_maps(const Mapper& mapper) {
  attempt([&] { mapper.global().write_octomap(directory_ / "map.bt"); });
  attempt([&] { write_map_2d(mapper.occupancy_2d(), directory_, "map2d"); });
}

void Recorder::write_semantics(const SemanticMap& map, const std::vector<Vec3f>& points_O,
                               const std::vector<Vec3f>& path_O) {
  attempt([&] {
    write_atomically(directory_ / "semantic.pcd", semantic_pcd({map.origin, points_O, {}}, map),
                     false);
  });
  write_file("objects.csv", objects_csv(map));
  write_file("semantic.png", png_bytes(draw_semantic_map(map, path_O)));
}

void Recorder::write_file(const std::string& name, const std::string& content) {
  if (std::find(kRunFiles.begin(), kRunFiles.end(), name) == kRunFiles.end()) {
    throw std::logic_error(name + " is missing in kRunFiles, expected all that a run writes");
  }
  attempt([&] { write_atomically(directory_ / name, content); });
}

void Recorder::write_summary(const nlohmann::ordered_json& summary) {
  flush();
  write_file("summary.json", json_text(summary));
}

}  // namespace arex::sim
