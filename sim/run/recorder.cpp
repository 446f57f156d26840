#include "run/recorder.h"

#include <fcntl.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <limits>
#include <nlohmann/json.hpp>
#include <stdexcept>
#include <utility>

#include "mapping/cloud_io.h"
#include "scoring/figures.h"

namespace arex::sim {
namespace {

// Every file of the contract: what an older run in the same folder may have left.
constexpr const char* kContractFiles[] = {
    "summary.json", "resolved.yaml", "truth.tum",          "estimate.tum",
    "coverage.csv", "events.csv",    "timing.csv",         "cloud.pcd",
    "map.bt",       "map2d.pgm",     "map2d.yaml",         "report.html",
    "flight.csv",   "decisions.csv", "odometry_error.csv", "cloud_growth.csv"};

[[noreturn]] void fail(const std::filesystem::path& file) {
  throw std::runtime_error(file.string() + ": cannot be written: " + std::strerror(errno));
}

void write_tum(std::FILE* file, Stamp stamp, const Pose& X) {
  const Quat q = X.quaternion();
  std::fprintf(file, "%.9f %.6f %.6f %.6f %.9f %.9f %.9f %.9f\n", to_seconds(stamp), X.p.x(),
               X.p.y(), X.p.z(), q.x(), q.y(), q.z(), q.w());
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

Recorder::Recorder(std::filesystem::path directory, const std::string& resolved_yaml)
    : directory_(std::move(directory)),
      truth_(nullptr, &std::fclose),
      estimate_(nullptr, &std::fclose),
      events_(nullptr, &std::fclose),
      flight_(nullptr, &std::fclose),
      decisions_(nullptr, &std::fclose) {
  std::error_code error;
  std::filesystem::create_directories(directory_, error);
  if (error) throw std::runtime_error(directory_.string() + ": " + error.message());
  for (const char* name : kContractFiles) std::filesystem::remove(directory_ / name, error);
  write_file("resolved.yaml", resolved_yaml);
  truth_ = open("truth.tum", "# time_s x_m y_m z_m qx qy qz qw (true X_OB)\n");
  estimate_ = open("estimate.tum", "# time_s x_m y_m z_m qx qy qz qw (estimated X_OB)\n");
  events_ = open("events.csv", csv_header("events.csv"));
  flight_ = open("flight.csv", csv_header("flight.csv"));
  decisions_ = open("decisions.csv", csv_header("decisions.csv"));
  flush();
}

Recorder::~Recorder() = default;

Recorder::File Recorder::open(const char* name, const std::string& header) {
  File file(std::fopen((directory_ / name).c_str(), "w"), &std::fclose);
  if (!file) fail(directory_ / name);
  std::fputs(header.c_str(), file.get());
  return file;
}

void Recorder::truth(Stamp stamp, const Pose& X_OB) { write_tum(truth_.get(), stamp, X_OB); }

void Recorder::estimate(Stamp stamp, const Pose& X_OB) { write_tum(estimate_.get(), stamp, X_OB); }

void Recorder::event(const Event& event) {
  std::fprintf(events_.get(), "%.3f,%s,%s\n", to_seconds(event.stamp),
               std::string(kEventKindNames[static_cast<std::size_t>(event.kind)]).c_str(),
               csv_quoted(event.detail).c_str());
}

void Recorder::flight(const FlightRow& row) {
  std::fprintf(flight_.get(), "%.3f,%.4f,%s,%.4f,%.5f,%s,%.4f,%.3f,%.1f,%.5f\n",
               to_seconds(row.stamp), row.speed_mps, csv_number(row.tracking_error_m, 4).c_str(),
               row.odometry_error_m, row.odometry_yaw_error_rad,
               csv_number(row.clearance_m, 4).c_str(), row.height_m, row.battery_voltage_v,
               row.battery_power_w, row.battery_fraction);
}

void Recorder::decision(const Decision& decision) {
  const auto name = [](const auto& names, auto value) {
    return std::string(names[static_cast<std::size_t>(value)]);
  };
  const std::string head = name(kDecisionKindNames, decision.kind) + "," +
                           name(kCandidateSourceNames, decision.source) + "," +
                           name(kTargetEndNames, decision.previous_end) + "," +
                           name(kStopReasonNames, decision.stop_reason);
  if (decision.candidates.empty()) {
    std::fprintf(decisions_.get(), "%.3f,%d,%s,,,,,,,,,,\n", to_seconds(decision.stamp),
                 decision.sequence, head.c_str());
  }
  for (std::size_t i = 0; i < decision.candidates.size(); ++i) {
    const Candidate& c = decision.candidates[i];
    std::fprintf(decisions_.get(), "%.3f,%d,%s,%zu,%d,%.2f,%.2f,%s,%.3f,%s\n",
                 to_seconds(decision.stamp), decision.sequence, head.c_str(), i,
                 decision.winner == i ? 1 : 0, c.point.x(), c.point.y(),
                 name(kVerdictNames, c.verdict).c_str(), c.information_m2, terms_of(c).c_str());
  }
}

void Recorder::flush() {
  check(decisions_.get(), "decisions.csv");
  check(truth_.get(), "truth.tum");
  check(estimate_.get(), "estimate.tum");
  check(events_.get(), "events.csv");
  check(flight_.get(), "flight.csv");
}

void Recorder::check(std::FILE* file, const char* name) {
  if (std::fflush(file) != 0 || std::ferror(file) != 0) fail(directory_ / name);
}

void Recorder::write_cloud(const std::vector<Vec3f>& points_O,
                           const std::vector<CloudGrowth>& growth) const {
  if (!write_pcd(directory_ / "cloud.pcd", points_O)) fail(directory_ / "cloud.pcd");
  std::string csv = csv_header("cloud_growth.csv");
  std::array<char, 64> line{};
  for (const CloudGrowth& row : growth) {
    std::snprintf(line.data(), line.size(), "%.3f,%zu\n", to_seconds(row.stamp), row.points);
    csv += line.data();
  }
  write_file("cloud_growth.csv", csv);
}

void Recorder::write_maps(const Mapper& mapper) const {
  if (!mapper.write(directory_)) fail(directory_ / "map.bt");
}

void Recorder::write_file(const std::string& name, const std::string& content) const {
  const std::filesystem::path final_path = directory_ / name;
  const std::filesystem::path temporary = directory_ / (name + ".partial");
  File file(std::fopen(temporary.c_str(), "w"), &std::fclose);
  if (!file) fail(temporary);
  const bool written =
      std::fwrite(content.data(), 1, content.size(), file.get()) == content.size() &&
      std::fflush(file.get()) == 0 && fsync(fileno(file.get())) == 0;
  file.reset();
  if (!written || std::rename(temporary.c_str(), final_path.c_str()) != 0) fail(final_path);
}

void Recorder::write_summary(const nlohmann::ordered_json& summary) {
  flush();
  write_file("summary.json", summary.dump(2) + "\n");
}

}  // namespace arex::sim
