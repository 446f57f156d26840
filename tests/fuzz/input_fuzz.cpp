// Damages what users hand to AREX - scenarios, overrides, sweeps, run folders - and reads it as the
// commands do. Whatever comes, the answer is a result or a ConfigError of one printable line,
// within five seconds of work. Case N is a pure function of N:
//
//     input_fuzz [--count N] [--first CASE] [--seconds S]
//
// A case that fails is named with its number and its files, which stay where they are.

#include <sys/mman.h>
#include <sys/time.h>
#include <sys/wait.h>
#include <unistd.h>

#include <chrono>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <iostream>
#include <optional>
#include <stdexcept>

#include "config/config.h"
#include "config/text.h"
#include "fuzz/mutation.h"
#include "fuzz/targets.h"
#include "support/temporary_folder.h"

namespace arex::test {
namespace {

namespace fs = std::filesystem;

constexpr unsigned kLongest_s = 5;             // of work on one case; sanitizers included
constexpr unsigned kStuck_s = 120;             // of waiting, however busy the host is
constexpr std::size_t kLongestMessage = 4500;  // a path may have 4096 bytes

/// What the child tells its parent, who is there when it dies.
struct Progress {
  std::uint64_t next = 0;  ///< the case that is being read
  std::uint64_t read = 0, refused = 0;
};

void check_message(const std::string& message) {
  if (message.empty() || message.size() > kLongestMessage || printable(message) != message) {
    throw std::runtime_error("a message that is no printable line: " + shortened(message, 500));
  }
}

void read_case(std::uint64_t number, const Target& target, const fs::path& folder,
               Progress& progress) {
  RandomStream random(number, target.name);
  try {
    target.run(folder, random);
    ++progress.read;
  } catch (const ConfigError& error) {
    check_message(error.what());
    ++progress.refused;
  }
}

/// From now on. Its signals end this process, and the parent tells.
void limit_time() {
  const itimerval longest{{}, {kLongest_s, 0}};
  setitimer(ITIMER_PROF, &longest, nullptr);
  alarm(kStuck_s);
}

[[noreturn]] void work(std::uint64_t end, double seconds, const fs::path& folder,
                       Progress& progress) {
  const auto begin = std::chrono::steady_clock::now();
  const std::vector<Target> targets = all_targets();
  for (; progress.next < end; ++progress.next) {
    const std::chrono::duration<double> elapsed = std::chrono::steady_clock::now() - begin;
    if (elapsed.count() > seconds) break;
    const Target& target = targets[progress.next % targets.size()];
    fs::remove_all(folder);
    fs::create_directories(folder);
    limit_time();
    try {
      read_case(progress.next, target, folder, progress);
    } catch (const std::exception& error) {
      std::fprintf(stderr, "%s: %s\n", std::string(target.name).c_str(), error.what());
      std::_Exit(1);
    }
  }
  std::_Exit(0);
}

struct Options {
  std::uint64_t first = 0, count = 1'000'000'000;
  double seconds = 1e9;
};

Options parse(int argc, char** argv) {
  Options options;
  for (int i = 1; i < argc; i += 2) {
    const std::string name = argv[i];
    const auto value = i + 1 < argc ? parse_uint64(argv[i + 1]) : std::nullopt;
    if (!value) throw std::invalid_argument(name + ": expected a number behind it");
    if (name == "--first") {
      options.first = *value;
    } else if (name == "--count") {
      options.count = *value;
    } else if (name == "--seconds") {
      options.seconds = static_cast<double>(*value);
    } else {
      throw std::invalid_argument(name + ": expected --first, --count or --seconds");
    }
  }
  return options;
}

int fuzz(const Options& options) {
  const TemporaryFolder folder;
  const fs::path inputs = folder / "case";
  void* shared =
      mmap(nullptr, sizeof(Progress), PROT_READ | PROT_WRITE, MAP_SHARED | MAP_ANONYMOUS, -1, 0);
  auto* progress = new (shared) Progress{options.first};
  const pid_t child = fork();
  if (child == 0) work(options.first + options.count, options.seconds, inputs, *progress);
  int status = 0;
  waitpid(child, &status, 0);
  std::printf("%llu cases: %llu read, %llu refused\n",
              static_cast<unsigned long long>(progress->next - options.first),
              static_cast<unsigned long long>(progress->read),
              static_cast<unsigned long long>(progress->refused));
  if (WIFEXITED(status) && WEXITSTATUS(status) == 0) return 0;
  const fs::path kept = fs::temp_directory_path() / ("arex-fuzz-" + std::to_string(progress->next));
  fs::remove_all(kept);
  fs::copy(inputs, kept, fs::copy_options::recursive);
  const bool slow = WIFSIGNALED(status) && WTERMSIG(status) == SIGPROF;
  const bool stuck = WIFSIGNALED(status) && WTERMSIG(status) == SIGALRM;
  const std::string end = stuck  ? "hung"
                          : slow ? "took longer than " + std::to_string(kLongest_s) + " s"
                          : WIFSIGNALED(status)
                              ? "died of signal " + std::to_string(WTERMSIG(status))
                              : "failed";
  std::fprintf(stderr, "case %llu %s; its input: %s; again: --count 1 --first %llu\n",
               static_cast<unsigned long long>(progress->next), end.c_str(), kept.c_str(),
               static_cast<unsigned long long>(progress->next));
  return 1;
}

}  // namespace
}  // namespace arex::test

int main(int argc, char** argv) {
  try {
    return arex::test::fuzz(arex::test::parse(argc, argv));
  } catch (const std::exception& error) {
    std::fprintf(stderr, "input_fuzz: %s\n", error.what());
    return 2;
  }
}
