#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <utility>
#include <vector>

#include "bag/message_file.h"
#include "files/files.h"

namespace arex::sim {

/// Writes the container of a ROS 1 bag, format 2.0: what rosbag reads, indexed and chunked.
///
/// Our own, because Debian 12's C++ packages cannot be used: the generated message headers do not
/// compile as C++20 (std::allocator::rebind), and rosbag_storage has no working pkg-config file and
/// pulls in plugin loaders, encryption and an embedded Python. The format itself is small. Source:
/// wiki.ros.org/Bags/Format/2.0.
///
/// `rosbag reindex` repairs what a killed run leaves.
class RosBag : public MessageFile {
 public:
  RosBag(std::filesystem::path path, BagCompression compression);
  /// Without close() the file stays FILE.active, its last chunk written if the disk allows.
  ~RosBag() override;

  [[nodiscard]] WireFormat format() const override { return WireFormat::kRos1; }
  std::uint32_t add_topic(const std::string& topic, const RosMessageType& type,
                          bool latched) override;
  void write(std::uint32_t connection, RosTime time, const RosBytes& message) override;
  void close() override;

 private:
  struct IndexEntry {
    RosTime time;
    std::uint32_t offset = 0;  ///< of the message's record in the uncompressed chunk
  };
  struct Connection {
    std::string topic;
    RosBytes record;  ///< the whole connection record
    bool written = false;
    std::vector<IndexEntry> index;  ///< of the open chunk
  };

  void write_out(std::string_view bytes);
  [[nodiscard]] RosBytes file_header(std::uint64_t index_position) const;
  void finish_chunk();
  /// Appends the open chunk's index records to `out` and its info record to chunk_infos_.
  void put_index(RosBytes& out, std::uint64_t chunk_position);
  void require_open() const;

  std::filesystem::path path_;
  BagCompression compression_;
  GrowingFile file_;
  std::uint64_t position_ = 0;  ///< bytes written
  std::vector<Connection> connections_;
  RosBytes chunk_;        ///< the open chunk, uncompressed
  RosBytes chunk_infos_;  ///< records of the finished chunks, for the end of the file
  std::uint32_t chunk_count_ = 0;
};

}  // namespace arex::sim
