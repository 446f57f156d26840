#include "bag/message_stream.h"

#include "bag/mcap_file.h"
#include "bag/ros_bag.h"

namespace arex::sim {
namespace {

std::unique_ptr<MessageFile> file_for(const std::filesystem::path& path,
                                      BagCompression compression) {
  if (path.extension() == ".mcap") return std::make_unique<McapFile>(path, compression);
  return std::make_unique<RosBag>(path, compression);
}

}  // namespace

MessageStream::MessageStream(const std::filesystem::path& path, BagCompression compression)
    : file_(file_for(path, compression)), message_(file_->format()) {}

void MessageStream::begin_message(Topic& topic, Stamp stamp, const std::string& frame) {
  message_.clear();
  put_header(topic, stamp, frame);
}

void MessageStream::put_header(Topic& topic, Stamp stamp, const std::string& frame) {
  if (format() == WireFormat::kRos1) message_.put(topic.sequence++);
  message_.put(ros_time(stamp));
  message_.put(frame);
}

void MessageStream::put_numbers(std::span<const double> values) {
  message_.align(sizeof(double));
  message_.put_raw(values.data(), values.size_bytes());
}

}  // namespace arex::sim
