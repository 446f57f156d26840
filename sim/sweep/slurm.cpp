#include "sweep/slurm.h"

#include <algorithm>
#include <cctype>
#include <cmath>
#include <cstdlib>
#include <map>
#include <nlohmann/json.hpp>
#include <sstream>

#include "config/text.h"
#include "run/file_io.h"
#include "run/foreign_json.h"
#include "run/summary.h"
#include "sweep/child_process.h"

namespace arex::sim {
namespace {

namespace fs = std::filesystem;
using nlohmann::ordered_json;

constexpr std::size_t kDefaultMaxArraySize = 1001;  // Slurm's own default
constexpr double kPatience_s = 120;                 // with a controller that does not answer
constexpr int kNotFound = 127;                      // as in a shell
constexpr int kTimeMargin_min = 2;                  // to start, to write, to be scheduled out

std::vector<std::string> lines_of(const std::string& text) {
  std::istringstream stream(text);
  std::vector<std::string> lines;
  for (std::string line; std::getline(stream, line);) lines.push_back(line);
  return lines;
}

// What a command complains of, its lines joined.
std::string on_one_line(const std::string& text) {
  std::string words;
  for (const std::string& line : lines_of(text)) {
    if (!line.empty()) words += (words.empty() ? "" : "; ") + line;
  }
  return printable(words);
}

/// What a command of Slurm answers. @throws SlurmError if it fails.
std::string ask(const std::string& program, const std::vector<std::string>& arguments,
                const fs::path& folder) {
  ChildProcess process(program, arguments, folder);
  const auto exit = process.wait(kPatience_s);
  if (!exit) throw SlurmError(program + ": does not answer, expected a cluster that does");
  if (exit->exit_code == kNotFound) {
    throw SlurmError(program + ": not found, expected Slurm's commands in PATH");
  }
  if (exit->exit_code == 0) return exit->output;
  const std::string words = on_one_line(exit->output);
  throw SlurmError(program + ": " + (words.empty() ? "failed without a word" : words), true);
}

bool is_number(const std::string& text) {
  return !text.empty() && text.find_first_not_of("0123456789") == std::string::npos;
}

std::vector<fs::path> batch_files(const SweepFolder& folder) {
  std::vector<fs::path> files;
  std::error_code none;
  for (const auto& entry : fs::directory_iterator(folder.root() / "slurm", none)) {
    if (entry.path().extension() == ".json") files.push_back(entry.path());
  }
  std::sort(files.begin(), files.end());
  return files;
}

// One name, one batch of one folder: that is how it is found again in the queue.
std::string batch_name(const SweepFolder& folder, const std::string& sweep, std::size_t number) {
  const std::string root = content_hash(folder.root().string());
  std::string name = "arex-" + sweep + "-" + root.substr(0, 8) + "-" + std::to_string(number);
  for (char& c : name) {
    const bool plain =
        std::isalnum(static_cast<unsigned char>(c)) || c == '-' || c == '_' || c == '.';
    if (!plain) c = '_';
  }
  return name;
}

std::string shell_quoted(const std::string& text) {
  std::string quoted = "'";
  for (const char c : text) quoted += c == '\'' ? std::string("'\\''") : std::string(1, c);
  return quoted + "'";
}

// Jobs wait in the queue while people build: they fly what was submitted.
fs::path keep_program(const SweepFolder& folder, const SweepPlan& plan, const fs::path& program) {
  const fs::path kept = folder.root() / "bin" / ("arex-" + plan.build);
  if (fs::exists(kept)) return kept;
  fs::create_directories(kept.parent_path());
  fs::path partial = kept;
  partial += ".partial";
  fs::copy_file(program, partial, fs::copy_options::overwrite_existing);
  fs::permissions(partial, fs::perms(0755));
  fs::rename(partial, kept);
  return kept;
}

void write_batch(const SweepFolder& folder, const std::string& name, const SweepPlan& plan,
                 const std::vector<RunOrder>& runs, const fs::path& program) {
  ordered_json list = ordered_json::array();
  for (const RunOrder& run : runs) list.push_back({{"id", run.id}, {"scenario", run.scenario}});
  const ordered_json batch{
      {"timeout_s", plan.timeout_s}, {"retries", plan.retries}, {"runs", list}};
  const fs::path file = folder.root() / "slurm" / (name + ".json");
  write_atomically(folder.root() / "slurm" / (name + ".sh"),
                   "#!/bin/sh\nexec " + shell_quoted(program.string()) + " sweep-task " +
                       shell_quoted(file.string()) + " \"$SLURM_ARRAY_TASK_ID\"\n");
  write_atomically(file, json_text(batch));
}

void remove_batch(const SweepFolder& folder, const std::string& name) {
  std::error_code none;
  for (const char* ending : {".json", ".sh"}) {
    fs::remove(folder.root() / "slurm" / (name + ending), none);
  }
}

// Beside what the user's own --dependency asks for; sbatch would heed the last one only.
std::string dependency_on(const std::set<std::string>& job_ids,
                          const std::vector<std::string>& sbatch) {
  constexpr std::string_view kLong = "--dependency";
  std::string text;
  for (std::size_t i = 0; i < sbatch.size(); ++i) {
    const std::string& word = sbatch[i];
    if (word.starts_with(std::string(kLong) + "=")) text = word.substr(kLong.size() + 1) + ",";
    if ((word == kLong || word == "-d") && i + 1 < sbatch.size()) text = sbatch[i + 1] + ",";
  }
  text += "afterany";
  for (const std::string& id : job_ids) text += ":" + id;
  return std::string(kLong) + "=" + text;
}

std::vector<std::string> sbatch_arguments(const SweepFolder& folder, const SweepPlan& plan,
                                          const std::string& name, std::size_t runs,
                                          const SlurmOptions& options,
                                          const std::set<std::string>& before) {
  // A plan's timeout is at most 1e9 s, its retries are at most a hundred.
  const auto minutes = kTimeMargin_min + static_cast<std::int64_t>(
                                             std::ceil(plan.timeout_s * (plan.retries + 1) / 60));
  std::string array = "--array=0-" + std::to_string(runs - 1);
  if (options.at_a_time > 0) array += "%" + std::to_string(options.at_a_time);
  std::vector<std::string> arguments{"--parsable",
                                     "--ntasks=1",
                                     "--cpus-per-task=1",
                                     "--time=" + std::to_string(minutes),
                                     "--requeue",
                                     "--open-mode=append",
                                     "--chdir=" + folder.root().string(),
                                     "--output=slurm/" + name + "-%a.log"};
  arguments.insert(arguments.end(), options.sbatch.begin(), options.sbatch.end());
  if (options.at_a_time > 0 && !before.empty()) {
    arguments.push_back(dependency_on(before, options.sbatch));
  }
  arguments.insert(arguments.end(), {array, "--job-name=" + name, "slurm/" + name + ".sh"});
  return arguments;
}

// JOB or JOB;CLUSTER, after any warnings.
std::string job_id_of(const std::string& answer) {
  std::string found = "?";
  for (const std::string& line : lines_of(answer)) {
    const std::string id = line.substr(0, line.find(';'));
    if (is_number(id)) found = id;
  }
  return found;
}

}  // namespace

BatchFile load_batch(const fs::path& file) {
  const ordered_json json = parse_object(read_file(file));
  const auto number = [&](const char* key) { return json.contains(key) && json[key].is_number(); };
  bool whole = json.is_object() && number("timeout_s") && number("retries") &&
               json.contains("runs") && json["runs"].is_array();
  BatchFile batch;
  if (whole) {
    batch.timeout_s = std::clamp(json["timeout_s"].get<double>(), 0.0, 1e9);
    batch.retries = static_cast<int>(std::clamp(json["retries"].get<double>(), 0.0, 100.0));
    for (const auto& run : json["runs"]) {
      whole &= run.is_object() && !text_field(run, "id").empty();
      if (whole) batch.runs.push_back({text_field(run, "id"), text_field(run, "scenario")});
    }
  }
  if (!whole) {
    throw ConfigError(file.string() +
                      ":1: is not a batch, expected one that 'arex sweep --slurm' " +
                      "has written");
  }
  return batch;
}

SlurmQueue queue_of(const SweepFolder& folder) {
  const std::vector<fs::path> files = batch_files(folder);
  if (files.empty()) return {};
  std::map<std::string, BatchFile> batches;
  std::string names;
  for (const fs::path& file : files) {
    batches.emplace(file.stem().string(), load_batch(file));
    names += (names.empty() ? "" : ",") + file.stem().string();
  }
  // Waiting and running tasks, a line each: name, index and array.
  const std::string answer = ask(
      "squeue", {"--noheader", "--array", "--name=" + names, "--format=%j %K %F"}, folder.root());
  SlurmQueue queue;
  for (const std::string& line : lines_of(answer)) {
    std::istringstream cells(line);
    std::string name, index, job;
    if (!(cells >> name >> index >> job) || !is_number(index) || index.size() > 9) continue;
    const auto batch = batches.find(name);
    const std::size_t task = std::stoul(index);
    if (batch == batches.end() || task >= batch->second.runs.size()) continue;
    queue.runs.insert(batch->second.runs[task].id);
    queue.job_ids.insert(job);
  }
  return queue;
}

std::size_t max_array_size() {
  ask("sbatch", {"--version"}, "/");
  for (const std::string& line : lines_of(ask("scontrol", {"show", "config"}, "/"))) {
    if (!line.starts_with("MaxArraySize")) continue;
    const auto digits = line.find_first_of("0123456789");
    if (digits == std::string::npos) continue;
    const unsigned long size = std::strtoul(line.c_str() + digits, nullptr, 10);
    return std::max<std::size_t>(1, size);
  }
  return kDefaultMaxArraySize;
}

SlurmSubmission submit(const SweepFolder& folder, const SweepPlan& plan,
                       const std::vector<RunOrder>& orders, const fs::path& program,
                       const SlurmQueue& queue, const SlurmOptions& options) {
  SlurmSubmission submission;
  if (orders.empty()) return submission;
  fs::create_directories(folder.root() / "slurm");
  const fs::path kept = keep_program(folder, plan, program);
  std::set<std::string> before = queue.job_ids;
  std::size_t number = batch_files(folder).size();
  for (std::size_t begin = 0; begin < orders.size(); begin += options.longest) {
    const std::size_t end = std::min(orders.size(), begin + options.longest);
    const std::vector<RunOrder> runs(orders.begin() + static_cast<std::ptrdiff_t>(begin),
                                     orders.begin() + static_cast<std::ptrdiff_t>(end));
    std::string name;
    do {
      name = batch_name(folder, plan.name, ++number);
    } while (fs::exists(folder.root() / "slurm" / (name + ".json")));
    write_batch(folder, name, plan, runs, kept);
    try {
      const auto arguments = sbatch_arguments(folder, plan, name, runs.size(), options, before);
      const std::string job_id = job_id_of(ask("sbatch", arguments, folder.root()));
      submission.batches.push_back({name, job_id, runs.size()});
      before = {job_id};
    } catch (const SlurmError& error) {
      // Without an answer it may be in the queue: then its name must stay known.
      if (error.refused()) remove_batch(folder, name);
      submission.refusal = error.what();
      return submission;
    }
  }
  return submission;
}

}  // namespace arex::sim
