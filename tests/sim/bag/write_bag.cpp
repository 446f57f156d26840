#include <cstdlib>
#include <string>

#include "sample_data.h"

/// write_bag none|lz4 close|kill FILE: the samples as a bag, or what a killed run leaves of it.
int main(int argc, char** argv) {
  using namespace arex::sim;
  if (argc != 4) return 2;
  const bool lz4 = std::string(argv[1]) == "lz4";
  BagWriter bag(argv[3], arex::VehicleConfig{}, lz4 ? BagCompression::kLz4 : BagCompression::kNone);
  test::write_samples(bag);
  if (std::string(argv[2]) == "kill") std::_Exit(0);
  bag.close();
  return 0;
}
