#include <cstdlib>
#include <string>

#include "sample_data.h"

/// write_bag none|lz4 close|kill|misses FILE: the samples as a bag, what a killed run leaves of it,
/// or one scan with its misses.
int main(int argc, char** argv) {
  using namespace arex::sim;
  if (argc != 4) return 2;
  const bool lz4 = std::string(argv[1]) == "lz4";
  const bool misses = std::string(argv[2]) == "misses";
  BagWriter bag(argv[3], arex::VehicleConfig{}, lz4 ? BagCompression::kLz4 : BagCompression::kNone,
                misses);
  if (misses) {
    bag.scan(test::scan_with_misses());
    bag.close();
    return 0;
  }
  test::write_samples(bag);
  if (std::string(argv[2]) == "kill") std::_Exit(0);
  bag.close();
  return 0;
}
