#include <gtest/gtest.h>

#include <algorithm>

#include "config/text.h"
#include "fuzz/corpus.h"
#include "fuzz/mutation.h"
#include "support/process.h"

// The same damage through the binary: what comes out of it is a result, or exit code 2 and one
// printable line on stderr.
namespace arex::test {
namespace {

/// After five seconds of work, or a minute of waiting, however busy the host is.
void expect_an_answer(std::vector<std::string> arguments, const std::string& what) {
  arguments.insert(arguments.begin(), {"--cpu=5", "timeout", "60", AREX_BINARY});
  const ProcessResult result = run_process("prlimit", arguments);
  if (result.exit_code == 0) return;
  EXPECT_EQ(result.exit_code, 2) << what << ": " << result.err;
  ASSERT_FALSE(result.err.empty()) << what;
  EXPECT_EQ(result.err.back(), '\n') << what;
  const std::string line = result.err.substr(0, result.err.size() - 1);
  EXPECT_EQ(printable(line), line) << what;
  EXPECT_LT(line.size(), 4500u) << what;
}

TEST(BinaryFuzz, DamagedInputsAreReadOrRefusedWithOneLine) {
  for (std::uint64_t number = 0; number < 15; ++number) {
    RandomStream random(number, "binary");
    const TemporaryFolder folder;
    write_files(shipped_folder(), folder.path());
    for (const bool sweep : {false, true}) {
      const Corpus& corpus = sweep ? shipped_sweeps() : shipped_scenarios();
      const std::string name = any_name(corpus, random);
      const auto file = sweep ? folder / "sweeps" / name : folder / name;
      write_text(file, damage_yaml(corpus.at(name), texts_of(corpus), random));
      const std::string what = "case " + std::to_string(number) + ", " + name;
      if (sweep) {
        expect_an_answer({"sweep", file.string(), "--dry-run", "--out", "out"}, what);
      } else {
        const std::string set = "mission.max_time_s=" + hostile_value(random);
        expect_an_answer({"params", file.string()}, what);
        expect_an_answer({"params", file.string(), "--set", set, "--seed", hostile_value(random)},
                         what);
      }
    }
    const auto world = write_damaged_world(folder.path(), random);
    write_text(folder / "world.yaml",
               "world: {kind: file, file: {path: " + world.filename().string() + "}}\n");
    expect_an_answer({"validate", (folder / "world.yaml").string()},
                     "world " + std::to_string(number) + ", " + world.filename().string());
    const auto run = folder / "run";
    write_files(recorded_run(), run);
    damage_files(recorded_run(), run, random);
    expect_an_answer({"report", run.string()}, "run " + std::to_string(number));
  }
}

}  // namespace
}  // namespace arex::test
