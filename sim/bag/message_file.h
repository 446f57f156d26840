#pragma once

#include <cstdint>
#include <filesystem>
#include <string>

#include "bag/ros_bytes.h"
#include "bag/ros_messages.h"

namespace arex::sim {

enum class BagCompression { kNone, kLz4 };

/// A container of messages that grows.
///
/// As `rosbag record` does, the file is FILE.active while it grows; close() writes the index and
/// renames it. A killed run leaves FILE.active with every whole chunk. Same calls, same bytes. One
/// thread at a time.
/// All functions throw DiskError when the disk refuses; no call but the destructor is of use after
/// that.
class MessageFile {
 public:
  MessageFile() = default;
  virtual ~MessageFile() = default;
  MessageFile(const MessageFile&) = delete;
  MessageFile& operator=(const MessageFile&) = delete;

  /// How its messages are to be serialised.
  [[nodiscard]] virtual WireFormat format() const = 0;
  /// Announces a topic; it is in the file once it has a message.
  /// @param latched who comes late is to get its newest message
  /// @return its number
  virtual std::uint32_t add_topic(const std::string& topic, const RosMessageType& type,
                                  bool latched) = 0;
  /// @param time of the recording, by which players order messages
  virtual void write(std::uint32_t topic, RosTime time, const RosBytes& message) = 0;
  /// Everything up to here becomes a finished file under its own name.
  virtual void close() = 0;
};

/// What a file is called while it grows.
inline std::filesystem::path active_name(std::filesystem::path path) { return path += ".active"; }

}  // namespace arex::sim
