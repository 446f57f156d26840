#include "bag/mcap_file.h"

#include <algorithm>
#include <exception>
#include <initializer_list>
#include <stdexcept>
#include <utility>

#include "bag/lz4_frame.h"
#include "bag/mcap_format.h"

namespace arex::sim {
namespace {

constexpr std::size_t kMcapChunk = 1024 * 1024;

// What rosbag2 stores of a publisher whose newest message late subscribers get.
constexpr std::string_view kTransientLocal =
    "- history: 1\n  depth: 1\n  reliability: 1\n  durability: 1\n"
    "  deadline:\n    sec: 9223372036\n    nsec: 854775807\n"
    "  lifespan:\n    sec: 9223372036\n    nsec: 854775807\n"
    "  liveliness: 1\n"
    "  liveliness_lease_duration:\n    sec: 9223372036\n    nsec: 854775807\n"
    "  avoid_ros_namespace_conventions: false\n";

std::string record(mcap::Op op, std::string_view content) {
  RosBytes head;
  head.put(static_cast<std::uint8_t>(op));
  head.put(static_cast<std::uint64_t>(content.size()));
  return std::string(head.view()).append(content);
}

std::string two_texts(std::initializer_list<std::pair<std::string_view, std::string_view>> map) {
  RosBytes entries, out;
  for (const auto& [key, value] : map) {
    entries.put(key);
    entries.put(value);
  }
  out.put(entries.view());
  return std::string(out.view());
}

std::uint64_t nanoseconds(RosTime time) {
  return std::uint64_t{time.seconds} * static_cast<std::uint64_t>(kNanosecondsPerSecond) +
         time.nanoseconds;
}

}  // namespace

McapFile::McapFile(std::filesystem::path path, BagCompression compression)
    : path_(std::move(path)), compression_(compression), file_(active_name(check_writable(path_))) {
  write_out(mcap::kMagic);
  RosBytes header;
  header.put("ros2");
  header.put("arex");
  write_out(record(mcap::Op::kHeader, header.view()));
}

McapFile::~McapFile() {
  if (!file_.is_open()) return;
  try {
    finish_chunk();
  } catch (const std::exception&) {
    // The chunk is lost; the name FILE.active already says that the file is incomplete.
  }
}

std::uint16_t McapFile::schema_of(const RosMessageType& type) {
  const std::string name = ros2_name(type);
  const auto known = std::find_if(schemas_.begin(), schemas_.end(),
                                  [&](const Schema& schema) { return schema.name == name; });
  if (known != schemas_.end()) return static_cast<std::uint16_t>(known - schemas_.begin() + 1);
  const auto number = static_cast<std::uint16_t>(schemas_.size() + 1);
  RosBytes content;
  content.put(number);
  content.put(name);
  content.put("ros2msg");
  content.put(ros2_definition(type));
  schemas_.push_back({name, record(mcap::Op::kSchema, content.view()), false});
  return number;
}

std::uint32_t McapFile::add_topic(const std::string& topic, const RosMessageType& type,
                                  bool latched) {
  const auto id = static_cast<std::uint16_t>(channels_.size());
  Channel& channel = channels_.emplace_back();
  channel.schema = schema_of(type);
  RosBytes content;
  content.put(id);
  content.put(channel.schema);
  content.put(topic);
  content.put("cdr");
  const std::string metadata =
      latched ? two_texts({{"offered_qos_profiles", kTransientLocal}}) : two_texts({});
  content.put_raw(metadata.data(), metadata.size());
  channel.record = record(mcap::Op::kChannel, content.view());
  return id;
}

void McapFile::write(std::uint32_t id, RosTime time, const RosBytes& message) {
  require_open();
  Channel& channel = channels_.at(id);
  Schema& schema = schemas_.at(channel.schema - std::size_t{1});
  if (!schema.written) chunk_ += schema.record;
  if (!channel.written) chunk_ += channel.record;
  schema.written = channel.written = true;
  channel.index.push_back({nanoseconds(time), chunk_.size()});
  RosBytes content;
  content.put(static_cast<std::uint16_t>(id));
  content.put(channel.messages++);  // sequence
  content.put(nanoseconds(time));   // recorded
  content.put(nanoseconds(time));   // published
  content.put_raw(message.view().data(), message.size());
  chunk_ += record(mcap::Op::kMessage, content.view());
  if (chunk_.size() > kMcapChunk) finish_chunk();
}

void McapFile::finish_chunk() {
  if (chunk_.empty()) return;
  Chunk chunk;
  chunk.first = UINT64_MAX;
  for (const Channel& channel : channels_) {
    for (const IndexEntry& entry : channel.index) {
      chunk.first = std::min(chunk.first, entry.time);
      chunk.last = std::max(chunk.last, entry.time);
    }
  }
  const bool lz4 = compression_ == BagCompression::kLz4;
  const std::string packed = lz4 ? lz4_frame(chunk_) : chunk_;
  chunk.unpacked_size = chunk_.size();
  chunk.packed_size = packed.size();
  RosBytes content;
  content.put(chunk.first);
  content.put(chunk.last);
  content.put(chunk.unpacked_size);
  content.put(mcap::crc32_of(chunk_));
  content.put(lz4 ? "lz4" : "");
  content.put(chunk.packed_size);
  content.put_raw(packed.data(), packed.size());
  chunk.position = position_;
  const std::string written = record(mcap::Op::kChunk, content.view());
  chunk.size = written.size();
  chunk_.clear();
  write_out(written);
  put_index(chunk);
  chunks_.push_back(std::move(chunk));
  file_.flush();
}

void McapFile::put_index(Chunk& chunk) {
  const std::uint64_t begin = position_;
  for (std::size_t id = 0; id < channels_.size(); ++id) {
    std::vector<IndexEntry>& index = channels_[id].index;
    if (index.empty()) continue;
    std::ranges::stable_sort(index, {}, &IndexEntry::time);
    RosBytes entries, content;
    for (const IndexEntry& entry : index) {
      entries.put(entry.time);
      entries.put(entry.offset);
    }
    content.put(static_cast<std::uint16_t>(id));
    content.put(entries.view());
    chunk.index_positions[static_cast<std::uint16_t>(id)] = position_;
    write_out(record(mcap::Op::kMessageIndex, content.view()));
    index.clear();
  }
  chunk.index_size = position_ - begin;
}

std::string McapFile::chunk_index_record(const Chunk& chunk) const {
  RosBytes positions, content;
  for (const auto& [channel, position] : chunk.index_positions) {
    positions.put(channel);
    positions.put(position);
  }
  content.put(chunk.first);
  content.put(chunk.last);
  content.put(chunk.position);
  content.put(chunk.size);
  content.put(positions.view());
  content.put(chunk.index_size);
  content.put(compression_ == BagCompression::kLz4 ? "lz4" : "");
  content.put(chunk.packed_size);
  content.put(chunk.unpacked_size);
  return record(mcap::Op::kChunkIndex, content.view());
}

std::string McapFile::statistics_record() const {
  std::uint64_t messages = 0, first = chunks_.empty() ? 0 : UINT64_MAX, last = 0;
  std::uint32_t channels = 0;
  RosBytes counts, content;
  for (std::size_t id = 0; id < channels_.size(); ++id) {
    if (!channels_[id].written) continue;
    ++channels;
    messages += channels_[id].messages;
    counts.put(static_cast<std::uint16_t>(id));
    counts.put(std::uint64_t{channels_[id].messages});
  }
  for (const Chunk& chunk : chunks_) {
    first = std::min(first, chunk.first);
    last = std::max(last, chunk.last);
  }
  content.put(messages);
  content.put(static_cast<std::uint16_t>(std::ranges::count(schemas_, true, &Schema::written)));
  content.put(channels);
  content.put(std::uint32_t{0});  // attachments
  content.put(std::uint32_t{0});  // metadata
  content.put(static_cast<std::uint32_t>(chunks_.size()));
  content.put(first);
  content.put(last);
  content.put(counts.view());
  return record(mcap::Op::kStatistics, content.view());
}

void McapFile::close() {
  require_open();
  finish_chunk();
  RosBytes no_crc;
  no_crc.put(std::uint32_t{0});  // of the data section: each chunk has its own
  write_out(record(mcap::Op::kDataEnd, no_crc.view()));

  const std::uint64_t summary_begin = position_;
  std::string summary, offsets;
  const auto end_group = [&](mcap::Op op, std::size_t begin) {
    if (summary.size() == begin) return;
    RosBytes content;
    content.put(static_cast<std::uint8_t>(op));
    content.put(summary_begin + begin);
    content.put(static_cast<std::uint64_t>(summary.size() - begin));
    offsets += record(mcap::Op::kSummaryOffset, content.view());
  };
  for (const Schema& schema : schemas_) {
    if (schema.written) summary += schema.record;
  }
  end_group(mcap::Op::kSchema, 0);
  std::size_t begin = summary.size();
  for (const Channel& channel : channels_) {
    if (channel.written) summary += channel.record;
  }
  end_group(mcap::Op::kChannel, begin);
  begin = summary.size();
  summary += statistics_record();
  end_group(mcap::Op::kStatistics, begin);
  begin = summary.size();
  for (const Chunk& chunk : chunks_) summary += chunk_index_record(chunk);
  end_group(mcap::Op::kChunkIndex, begin);

  RosBytes footer;
  footer.put(summary_begin);
  footer.put(summary_begin + summary.size());
  summary += offsets;
  // The checksum covers the footer up to itself.
  footer.put(std::uint32_t{0});
  std::string end = record(mcap::Op::kFooter, footer.view());
  const std::size_t crc_at = end.size() - sizeof(std::uint32_t);
  const std::uint32_t crc =
      mcap::crc32_of(std::string_view(end).substr(0, crc_at), mcap::crc32_of(summary));
  RosBytes crc_bytes;
  crc_bytes.put(crc);
  end.replace(crc_at, sizeof crc, crc_bytes.view());
  write_out(summary);
  write_out(end);
  write_out(mcap::kMagic);
  file_.flush();
  file_.finish_as(path_);
}

void McapFile::write_out(std::string_view bytes) {
  file_.append(bytes);
  position_ += bytes.size();
}

void McapFile::require_open() const {
  if (!file_.is_open()) throw std::runtime_error(path_.string() + ": the recording is closed");
}

}  // namespace arex::sim
