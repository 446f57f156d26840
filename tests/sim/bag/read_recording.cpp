#include <zlib.h>

#include <cstdio>
#include <exception>

#include "bag/recording.h"

/// read_recording FILE: a line for each message in the order that we read them in: time in ns,
/// topic, type, size, CRC-32. Then one of what was damaged.
int main(int argc, char** argv) {
  if (argc != 2) return 2;
  try {
    arex::sim::Recording recording(argv[1]);
    arex::sim::RecordedMessage message;
    while (recording.next(message)) {
      const arex::sim::RecordedTopic& topic = recording.topics()[message.topic];
      const auto crc = crc32(0, reinterpret_cast<const Bytef*>(message.bytes.data()),
                             static_cast<uInt>(message.bytes.size()));
      std::printf("%lld %s %s %zu %lu\n", static_cast<long long>(message.time), topic.name.c_str(),
                  topic.type.c_str(), message.bytes.size(), crc);
    }
    std::printf("damaged %llu\n", static_cast<unsigned long long>(recording.damage().places));
    return 0;
  } catch (const std::exception& error) {
    std::fprintf(stderr, "%s\n", error.what());
    return 1;
  }
}
