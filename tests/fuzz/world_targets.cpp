#include "fuzz/corpus.h"
#include "fuzz/targets.h"

namespace arex::test {

std::vector<Target> all_targets() { return {{"world file", read_damaged_world}}; }

}  // namespace arex::test
