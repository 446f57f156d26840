#include "fuzz/bag_corpus.h"
#include "fuzz/targets.h"

namespace arex::test {

std::vector<Target> all_targets() { return {{"recording", read_recording}}; }

}  // namespace arex::test
