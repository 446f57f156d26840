#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "bag/message_file.h"
#include "files/files.h"

namespace arex::sim {

/// Writes MCAP as rosbag2 does: profile ros2, messages in CDR, schemas as ros2msg; chunked, with
/// indexes, statistics and checksums, so that players find their way without reading all of it.
/// Our own, because Debian has no library of it, and the format is small. Source: mcap.dev/spec.
class McapFile : public MessageFile {
 public:
  McapFile(std::filesystem::path path, BagCompression compression);
  /// Without close() the file stays FILE.active, its last chunk written if the disk allows.
  ~McapFile() override;

  [[nodiscard]] WireFormat format() const override { return WireFormat::kCdr; }
  std::uint32_t add_topic(const std::string& topic, const RosMessageType& type,
                          bool latched) override;
  void write(std::uint32_t topic, RosTime time, const RosBytes& message) override;
  void close() override;

 private:
  struct IndexEntry {
    std::uint64_t time = 0;
    std::uint64_t offset = 0;  ///< of the message's record in the uncompressed chunk
  };
  struct Channel {
    std::uint16_t schema = 0;
    std::string record;  ///< the whole record
    bool written = false;
    std::uint32_t messages = 0;
    std::vector<IndexEntry> index;  ///< of the open chunk
  };
  struct Schema {
    std::string name;
    std::string record;
    bool written = false;
  };
  struct Chunk {
    std::uint64_t first = 0, last = 0;  ///< times of its messages
    std::uint64_t position = 0, size = 0;
    std::uint64_t index_size = 0;  ///< of the message indexes behind it
    std::uint64_t packed_size = 0, unpacked_size = 0;
    std::map<std::uint16_t, std::uint64_t> index_positions;  ///< by channel
  };

  std::uint16_t schema_of(const RosMessageType& type);
  void write_out(std::string_view bytes);
  void finish_chunk();
  void put_index(Chunk& chunk);
  [[nodiscard]] std::string chunk_index_record(const Chunk& chunk) const;
  [[nodiscard]] std::string statistics_record() const;
  void require_open() const;

  std::filesystem::path path_;
  BagCompression compression_;
  GrowingFile file_;
  std::uint64_t position_ = 0;   ///< bytes written
  std::vector<Schema> schemas_;  ///< the first has number 1
  std::vector<Channel> channels_;
  std::string chunk_;  ///< the open one's records
  std::vector<Chunk> chunks_;
};

}  // namespace arex::sim
