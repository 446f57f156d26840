#include <zlib.h>

#include <algorithm>
#include <map>
#include <optional>
#include <vector>

#include "bag/mcap_format.h"
#include "bag/recording.h"
#include "config/config.h"

namespace arex::sim {
namespace {

constexpr std::uint64_t kRecordHead = 9;  // opcode, length
// Records other than chunks and messages are read whole; attachments are passed over.
constexpr std::uint64_t kMostDescription = std::uint64_t{64} << 20;

std::optional<WireFormat> format_named(std::string_view encoding) {
  if (encoding == "ros1") return WireFormat::kRos1;
  if (encoding == "cdr") return WireFormat::kCdr;
  return std::nullopt;
}

ChunkCompression mcap_compression(std::string_view name) {
  if (name.empty()) return ChunkCompression::kNone;
  if (name == "lz4") return ChunkCompression::kLz4;
  if (name == "zstd") return ChunkCompression::kZstd;
  throw DecodeError("a chunk of a compression that is not known");
}

/// ROS 2 says package/msg/Type.
std::string bare_type(std::string_view name) {
  std::string type(name);
  const std::size_t middle = type.find("/msg/");
  if (middle != std::string::npos) type.erase(middle, 4);
  return type;
}

Stamp stamp_of(std::uint64_t time) {
  if (time > static_cast<std::uint64_t>(kForever)) throw DecodeError("a time that is none");
  return static_cast<Stamp>(time);
}

class McapIndexer {
 public:
  explicit McapIndexer(const InputFile& file) : file_(file) {}

  RecordingIndex run() {
    std::uint64_t at = mcap::kMagic.size();
    while (at < file_.size() && !ended_) {
      try {
        at = read_record(at);
      } catch (const DecodeError& damage) {
        index_.damage.note(damage.what());
        const std::uint64_t next = chunk_after(at);
        index_.damage.skipped += next - at;
        at = next;
      }
    }
    resolve_channels();
    return std::move(index_);
  }

 private:
  struct Record {
    mcap::Op op{};
    std::uint64_t data = 0;  ///< where they begin
    std::uint64_t size = 0;  ///< of these
  };
  struct Channel {
    std::uint16_t schema = 0;
    std::string topic, encoding;
  };

  [[nodiscard]] Record record_at(std::uint64_t at) const {
    std::string head;
    if (!file_.read(at, kRecordHead, head)) throw DecodeError("a record that is cut short");
    WireReader reader(head, WireFormat::kRos1);
    Record record;
    record.op = static_cast<mcap::Op>(reader.number<std::uint8_t>());
    record.size = reader.number<std::uint64_t>();
    record.data = at + kRecordHead;
    if (record.size > file_.size() - record.data) throw DecodeError("a record that is cut short");
    return record;
  }

  [[nodiscard]] std::string bytes_of(const Record& record) const {
    if (record.size > kMostDescription) throw DecodeError("a description of more than 64 MiB");
    std::string bytes;
    if (!file_.read(record.data, record.size, bytes)) {
      throw DecodeError("a record that cannot be read");
    }
    return bytes;
  }

  /// @return where the next one begins.
  std::uint64_t read_record(std::uint64_t at) {
    const Record record = record_at(at);
    switch (record.op) {
      case mcap::Op::kSchema:
        add_schema(bytes_of(record));
        break;
      case mcap::Op::kChannel:
        add_channel(bytes_of(record));
        break;
      case mcap::Op::kMessage:
        add_message(record);
        break;
      case mcap::Op::kChunk:
        try {
          add_chunk(record);
        } catch (const DecodeError& damage) {  // the next record begins where it should
          index_.damage.note(damage.what());
        }
        break;
      case mcap::Op::kFooter:
        ended_ = true;
        break;
      default:
        break;  // indexes, attachments, what later formats may add
    }
    return record.data + record.size;
  }

  void add_schema(std::string_view bytes) {
    WireReader reader(bytes, WireFormat::kRos1);
    const auto id = reader.number<std::uint16_t>();
    schemas_[id] = bare_type(reader.text());
  }

  void add_channel(std::string_view bytes) {
    WireReader reader(bytes, WireFormat::kRos1);
    const auto id = reader.number<std::uint16_t>();
    Channel channel;
    channel.schema = reader.number<std::uint16_t>();
    channel.topic = reader.text();
    channel.encoding = reader.text();
    channels_[id] = std::move(channel);
  }

  /// A message record's fields before its data.
  static RecordingIndex::Entry entry_of(WireReader& reader) {
    RecordingIndex::Entry entry;
    entry.topic = reader.number<std::uint16_t>();  // its channel, for now
    reader.number<std::uint32_t>();                // sequence
    entry.time = stamp_of(reader.number<std::uint64_t>());
    reader.number<std::uint64_t>();  // when it was published
    return entry;
  }

  /// One that stands in no chunk makes one of its own.
  void add_message(const Record& record) {
    std::string head;
    if (record.size < mcap::kMessageHead || !file_.read(record.data, mcap::kMessageHead, head)) {
      throw DecodeError("a message that is cut short");
    }
    WireReader reader(head, WireFormat::kRos1);
    RecordingIndex::Entry entry = entry_of(reader);
    const std::uint64_t size = record.size - mcap::kMessageHead;
    if (size > UINT32_MAX) throw DecodeError("a message of more than 4 GiB");
    entry.size = static_cast<std::uint32_t>(size);
    entry.chunk = static_cast<std::uint32_t>(index_.chunks.size());
    index_.chunks.push_back(
        {record.data + mcap::kMessageHead, size, size, ChunkCompression::kNone});
    index_.entries.push_back(entry);
  }

  void add_chunk(const Record& record) {
    std::string stored;
    if (!file_.read(record.data, record.size, stored)) {
      throw DecodeError("a chunk that cannot be read");
    }
    WireReader reader(stored, WireFormat::kRos1);
    reader.skip_numbers(2, sizeof(std::uint64_t));  // times of its first and last message
    RecordingIndex::Chunk chunk;
    chunk.unpacked_size = reader.number<std::uint64_t>();
    const auto crc = reader.number<std::uint32_t>();
    chunk.compression = mcap_compression(reader.text());
    chunk.size = reader.number<std::uint64_t>();
    const std::string_view packed = reader.take(chunk.size);
    chunk.position = record.data + static_cast<std::uint64_t>(packed.data() - stored.data());
    const std::string bytes = unpack(packed, chunk.compression, chunk.unpacked_size);
    if (crc != 0 && crc != mcap::crc32_of(bytes)) throw DecodeError("a chunk with a wrong CRC");
    const auto number = static_cast<std::uint32_t>(index_.chunks.size());
    index_.chunks.push_back(chunk);
    walk(bytes, number);
  }

  void walk(const std::string& bytes, std::uint32_t chunk) {
    WireReader reader(bytes, WireFormat::kRos1);
    while (reader.left() > 0) {
      const auto op = static_cast<mcap::Op>(reader.number<std::uint8_t>());
      const std::string_view data = reader.take(reader.number<std::uint64_t>());
      if (op == mcap::Op::kSchema) add_schema(data);
      if (op == mcap::Op::kChannel) add_channel(data);
      if (op != mcap::Op::kMessage) continue;
      WireReader message(data, WireFormat::kRos1);
      RecordingIndex::Entry entry = entry_of(message);
      entry.chunk = chunk;
      entry.size = static_cast<std::uint32_t>(message.left());
      entry.offset = static_cast<std::uint64_t>(data.data() - bytes.data()) + mcap::kMessageHead;
      index_.entries.push_back(entry);
    }
  }

  /// The first chunk behind a place that the summary names; without one the file's end.
  std::uint64_t chunk_after(std::uint64_t at) {
    if (!chunk_positions_) chunk_positions_ = read_chunk_positions();
    const auto next = std::upper_bound(chunk_positions_->begin(), chunk_positions_->end(), at);
    return next == chunk_positions_->end() ? file_.size() : *next;
  }

  [[nodiscard]] std::vector<std::uint64_t> read_chunk_positions() const {
    std::vector<std::uint64_t> positions;
    try {
      std::string footer;
      if (file_.size() < mcap::kFooterSize ||
          !file_.read(file_.size() - mcap::kFooterSize, mcap::kFooterSize, footer)) {
        return positions;
      }
      WireReader reader(footer, WireFormat::kRos1);
      reader.take(kRecordHead);
      const auto summary = reader.number<std::uint64_t>();
      if (summary == 0 || summary >= file_.size()) return positions;
      positions.push_back(summary);  // schemas and channels are there once more
      for (std::uint64_t at = summary; at < file_.size();) {
        const Record record = record_at(at);
        if (record.op == mcap::Op::kFooter) break;
        if (record.op == mcap::Op::kChunkIndex) {
          const std::string bytes = bytes_of(record);
          WireReader fields(bytes, WireFormat::kRos1);
          fields.skip_numbers(2, sizeof(std::uint64_t));
          const auto position = fields.number<std::uint64_t>();
          if (position < file_.size()) positions.push_back(position);
        }
        at = record.data + record.size;
      }
    } catch (const DecodeError&) {
      // What it said up to there still holds.
    }
    std::sort(positions.begin(), positions.end());
    return positions;
  }

  /// Entries hold the numbers of channels until all of these are known.
  void resolve_channels() {
    std::map<std::uint32_t, std::uint32_t> topics;
    for (const auto& [id, channel] : channels_) {
      const auto schema = schemas_.find(channel.schema);
      const auto format = format_named(channel.encoding);
      if (schema == schemas_.end() || !format) continue;  // of other middleware
      topics[id] = index_.topic(channel.topic, schema->second, *format);
    }
    std::erase_if(index_.entries, [&](RecordingIndex::Entry& entry) {
      const auto topic = topics.find(entry.topic);
      if (topic == topics.end()) {
        index_.damage.orphans += !channels_.contains(static_cast<std::uint16_t>(entry.topic));
        return true;
      }
      entry.topic = topic->second;
      return false;
    });
  }

  const InputFile& file_;
  RecordingIndex index_;
  std::map<std::uint16_t, std::string> schemas_;
  std::map<std::uint16_t, Channel> channels_;
  bool ended_ = false;
  std::optional<std::vector<std::uint64_t>> chunk_positions_;
};

}  // namespace

RecordingIndex index_mcap(const InputFile& file) { return McapIndexer(file).run(); }

}  // namespace arex::sim
