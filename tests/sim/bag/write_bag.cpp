#include <algorithm>
#include <cstdlib>
#include <string>

#include "sample_data.h"

/// write_bag none|lz4 close|kill LAYOUT FILE: the samples as a bag, or what a killed run leaves of
/// it.
int main(int argc, char** argv) {
  using namespace arex::sim;
  if (argc != 5) return 2;
  const std::string end = argv[2];
  const auto layout = std::find(kBagLayoutNames.begin(), kBagLayoutNames.end(), argv[3]);
  if (layout == kBagLayoutNames.end()) return 2;
  BagOptions options;
  options.layout = static_cast<BagLayout>(layout - kBagLayoutNames.begin());
  if (std::string(argv[1]) == "lz4") options.compression = BagCompression::kLz4;
  BagWriter bag(argv[4], arex::VehicleConfig{}, options);
  test::write_samples(bag);
  if (end == "kill") std::_Exit(0);
  bag.close();
  return 0;
}
