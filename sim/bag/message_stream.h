#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <span>
#include <string>

#include "bag/message_file.h"
#include "math/types.h"

namespace arex::sim {

inline constexpr const char* kOdomFrame = "odom";       ///< O
inline constexpr const char* kBodyFrame = "base_link";  ///< B

/// A recording that grows, the clock by which messages arrive in it, and the one message that is
/// being written. Those who write to it take turns. Errors: see MessageFile.
class MessageStream {
 public:
  struct Topic {
    std::uint32_t connection = 0;
    std::uint32_t sequence = 0;  ///< of the next header
  };

  /// FILE.mcap is MCAP with messages of ROS 2, everything else a ROS 1 bag.
  MessageStream(const std::filesystem::path& path, BagCompression compression);

  [[nodiscard]] WireFormat format() const { return file_->format(); }
  Topic topic(const std::string& name, const RosMessageType& type, bool latched = false) {
    return {file_->add_topic(name, type, latched), 0};
  }

  /// Sets the clock: what is written from here on arrives at `now`.
  void begin(Stamp now) { now_ = now; }

  /// The one being written.
  [[nodiscard]] RosBytes& message() { return message_; }
  /// Starts the message with a std_msgs/Header.
  void begin_message(Topic& topic, Stamp stamp, const std::string& frame);
  /// The same within a message.
  void put_header(Topic& topic, Stamp stamp, const std::string& frame);
  void put_numbers(std::span<const double> values);

  /// Writes the message, which arrives now, or at a time of its own.
  void write(const Topic& topic) { write(topic, now_); }
  void write(const Topic& topic, Stamp arrival) {
    file_->write(topic.connection, ros_time(arrival), message_);
  }
  void close() { file_->close(); }

 private:
  std::unique_ptr<MessageFile> file_;
  Stamp now_ = 0;
  RosBytes message_;
};

}  // namespace arex::sim
