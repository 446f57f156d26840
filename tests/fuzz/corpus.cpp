#include "fuzz/corpus.h"

#include "fuzz/mutation.h"
#include "support/temporary_folder.h"
#include "synthetic_run.h"

namespace arex::test {
namespace {

namespace fs = std::filesystem;

Corpus files_below(const fs::path& root, bool yaml_only) {
  Corpus corpus;
  for (const auto& entry : fs::recursive_directory_iterator(root)) {
    const fs::path& file = entry.path();
    if (!entry.is_regular_file() || (yaml_only && file.extension() != ".yaml")) continue;
    corpus[file.lexically_relative(root).string()] = read_text(file);
  }
  return corpus;
}

}  // namespace

const Corpus& shipped_folder() {
  static const Corpus corpus = files_below(AREX_SOURCE_DIR "/scenarios", true);
  return corpus;
}

const Corpus& shipped_scenarios() {
  static const Corpus corpus = [] {
    Corpus scenarios = shipped_folder();
    std::erase_if(scenarios, [](const auto& file) { return file.first.starts_with("sweeps/"); });
    return scenarios;
  }();
  return corpus;
}

const Corpus& shipped_sweeps() {
  static const Corpus corpus = files_below(AREX_SOURCE_DIR "/scenarios/sweeps", true);
  return corpus;
}

const Corpus& recorded_run() {
  static const Corpus corpus = [] {
    const TemporaryFolder folder;
    sim::test::write_synthetic_run(folder.path(), {2, 200, 3, 4, true});
    return files_below(folder.path(), false);
  }();
  return corpus;
}

const Corpus& recorded_sweep() {
  static const Corpus corpus = [] {
    const TemporaryFolder folder;
    sim::test::write_synthetic_sweep(folder.path());
    return files_below(folder.path(), false);
  }();
  return corpus;
}

// A file of the folder is damaged, sometimes it is lost, sometimes two are.
void damage_files(const Corpus& corpus, const fs::path& folder, RandomStream& random) {
  const int count = random.uniform_int(1, 2);
  for (int i = 0; i < count; ++i) {
    const std::string& name = any_name(corpus, random);
    if (random.uniform_int(0, 19) == 0) {
      fs::remove(folder / name);
    } else {
      const bool yaml = fs::path(name).extension() == ".yaml";
      const std::string& bytes = corpus.at(name);
      write_text(folder / name,
                 yaml ? damage_yaml(bytes, {}, random) : damage_bytes(bytes, {}, random));
    }
  }
}

}  // namespace arex::test
