#include "sweep/sweep_folder.h"

#include <unistd.h>

#include <algorithm>
#include <array>
#include <cstdio>
#include <ctime>
#include <nlohmann/json.hpp>

#include "run/file_io.h"
#include "run/foreign_json.h"
#include "run/summary.h"

namespace arex::sim {
namespace {

namespace fs = std::filesystem;
using nlohmann::ordered_json;

constexpr std::string_view kPartial = ".partial-";

ordered_json parse_or_null(const fs::path& file) { return parse_object(read_file(file)); }

bool valid(const ordered_json& summary) {
  if (!summary.is_object() || !summary.contains("outcome") || !summary.contains("build")) {
    return false;
  }
  if (summary.contains("unwritten")) return false;  // the disk refused a part of the run
  const ordered_json& outcome = summary["outcome"];
  return outcome.is_string() && outcome != "interrupted" && outcome != "flying";
}

std::string utc_now() {
  const std::time_t now = std::time(nullptr);
  std::tm utc{};
  gmtime_r(&now, &utc);
  std::array<char, 32> text{};
  std::strftime(text.data(), text.size(), "%Y-%m-%dT%H:%M:%SZ", &utc);
  return text.data();
}

}  // namespace

fs::path SweepFolder::configuration(const std::string& id) {
  return fs::path("plan") / (id + ".yaml");
}
fs::path SweepFolder::finished(const std::string& id) { return fs::path("runs") / id; }
fs::path SweepFolder::failed(const std::string& id) { return fs::path("runs") / (id + ".failed"); }
fs::path SweepFolder::partial(const std::string& id) {
  return fs::path("runs") /
         (id + std::string(kPartial) + host_name() + "-" + std::to_string(getpid()));
}

void SweepFolder::prepare(const SweepPlan& plan) const {
  std::error_code error;
  for (const char* name : {"plan", "runs"}) {
    fs::create_directories(root_ / name, error);
    if (error) throw DiskError(root_ / name, "cannot be created", error);
  }
  for (const PlannedRun& run : plan.runs) {
    const fs::path file = root_ / configuration(run.id);
    if (read_file(file) != run.resolved) write_atomically(file, run.resolved, false);
  }
  sync_folder(root_ / "plan");
  const ordered_json sweep{{"name", plan.name},       {"build", plan.build},
                           {"keys", plan.keys},       {"variants", plan.has_variants},
                           {"repeats", plan.repeats}, {"timeout_s", plan.timeout_s},
                           {"retries", plan.retries}, {"runs", plan.runs.size()}};
  write_atomically(root_ / "sweep.json", json_text(sweep));
}

std::optional<ordered_json> SweepFolder::summary(const std::string& id) const {
  ordered_json summary = parse_or_null(root_ / finished(id) / "summary.json");
  if (!valid(summary)) return std::nullopt;
  return summary;
}

ordered_json SweepFolder::host(const std::string& id) const {
  const ordered_json host = parse_or_null(root_ / finished(id) / "host.json");
  return host.is_object() ? host : ordered_json::object();
}

RunState SweepFolder::state(const std::string& id) const {
  if (summary(id)) return {Failure::kNone, ""};
  const ordered_json record = parse_or_null(root_ / failed(id) / "failure.json");
  if (!record.is_object()) return {};
  RunState state{Failure::kUnfinished, text_field(record, "detail")};
  const std::string name = text_field(record, "failure");
  const auto at = std::find(kFailureNames.begin(), kFailureNames.end(), name);
  if (at != kFailureNames.end()) state.failure = static_cast<Failure>(at - kFailureNames.begin());
  return state;
}

bool SweepFolder::publish(const std::string& id) const {
  const fs::path from = root_ / partial(id);
  const fs::path to = root_ / finished(id);
  if (!valid(parse_or_null(from / "summary.json"))) return false;
  sync_folder(from);
  if (summary(id)) {  // another process was faster
    remove_folder(from);
    return true;
  }
  remove_folder(to);
  std::error_code error;
  fs::rename(from, to, error);
  if (error) throw DiskError(from, "cannot be renamed", error);
  sync_names(root_ / "runs");
  remove_folder(root_ / failed(id));
  return true;
}

void SweepFolder::record_failure(const std::string& id, const RunState& state, int attempts) const {
  const fs::path from = root_ / partial(id);
  const fs::path to = root_ / failed(id);
  std::error_code error;
  fs::create_directories(from, error);
  const ordered_json record{{"failure", kFailureNames[static_cast<std::size_t>(state.failure)]},
                            {"detail", state.detail},
                            {"attempts", attempts},
                            {"host", host_name()}};
  write_atomically(from / "failure.json", json_text(record));
  remove_folder(to);
  fs::rename(from, to, error);
  if (error) throw DiskError(from, "cannot be renamed", error);
}

void SweepFolder::remove_partial(const std::string& id) const {
  remove_folder(root_ / partial(id));
}

void SweepFolder::remove_all_partials() const {
  std::vector<fs::path> stale;
  for (const auto& entry : fs::directory_iterator(root_ / "runs")) {
    if (entry.path().filename().string().find(kPartial) != std::string::npos) {
      stale.push_back(entry.path());
    }
  }
  for (const fs::path& folder : stale) remove_folder(folder);
}

std::vector<std::string> SweepFolder::partials() const {
  std::vector<std::string> ids;
  std::error_code none;
  for (const auto& entry : fs::directory_iterator(root_ / "runs", none)) {
    const std::string name = entry.path().filename().string();
    const auto at = name.find(kPartial);
    if (at != std::string::npos) ids.push_back(name.substr(0, at));
  }
  std::sort(ids.begin(), ids.end());
  return ids;
}

void SweepFolder::log(const std::string& event, const std::string& id, int attempt,
                      const std::string& detail) const {
  const fs::path file = root_ / "log.csv";
  std::error_code none;
  if (!fs::exists(file, none)) append_line(file, "time,host,pid,event,run,attempt,detail");
  append_line(file, utc_now() + "," + host_name() + "," + std::to_string(getpid()) + "," + event +
                        "," + id + "," + std::to_string(attempt) + "," + csv_cell(detail));
}

std::string csv_cell(const std::string& text) {
  if (text.find_first_of(",\"\n\r") == std::string::npos) return text;
  std::string quoted = "\"";
  for (const char c : text) quoted += c == '"' ? std::string("\"\"") : std::string(1, c);
  return quoted + "\"";
}

}  // namespace arex::sim
