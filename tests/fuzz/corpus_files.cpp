#include "fuzz/corpus.h"
#include "support/temporary_folder.h"

namespace arex::test {

namespace fs = std::filesystem;

void write_files(const Corpus& corpus, const fs::path& folder) {
  for (const auto& [name, bytes] : corpus) {
    fs::create_directories((folder / name).parent_path());
    write_text(folder / name, bytes);
  }
}

std::vector<std::string> texts_of(const Corpus& corpus) {
  std::vector<std::string> texts;
  for (const auto& [name, text] : corpus) texts.push_back(text);
  return texts;
}

const std::string& any_name(const Corpus& corpus, RandomStream& random) {
  const int last = static_cast<int>(corpus.size()) - 1;
  return std::next(corpus.begin(), random.uniform_int(0, last))->first;
}

}  // namespace arex::test
