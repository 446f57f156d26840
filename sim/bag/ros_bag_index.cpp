#include <algorithm>
#include <cstring>
#include <map>
#include <optional>
#include <vector>

#include "bag/recording.h"
#include "config/config.h"

// The format: wiki.ros.org/Bags/Format/2.0. A record is a header of fields `name=value` and data,
// each behind its length. Chunks hold connection and message records; the last records of a whole
// bag say what connections and which chunks there are.
namespace arex::sim {
namespace {

constexpr std::string_view kMagic = "#ROSBAG V2.0\n";
constexpr std::uint32_t kMostHeader = 1 << 20;  // bytes

enum Op : std::uint8_t {
  kMessage = 2,
  kFileHeader = 3,
  kChunk = 5,
  kChunkInfo = 6,
  kConnection = 7
};

/// The fields of a header. @throws DecodeError.
class Fields {
 public:
  explicit Fields(std::string_view bytes) {
    WireReader reader(bytes, WireFormat::kRos1);
    while (reader.left() > 0) {
      const std::string_view field = reader.text();
      const std::size_t equals = field.find('=');
      if (equals == std::string_view::npos) throw DecodeError("a header field without a name");
      fields_.emplace_back(field.substr(0, equals), field.substr(equals + 1));
    }
  }
  [[nodiscard]] std::optional<std::string_view> find(std::string_view name) const {
    for (const auto& [key, value] : fields_) {
      if (key == name) return value;
    }
    return std::nullopt;
  }
  [[nodiscard]] std::string_view text(std::string_view name) const {
    const auto value = find(name);
    if (!value) throw DecodeError("a header without '" + std::string(name) + "'");
    return *value;
  }
  template <class T>
  [[nodiscard]] T number(std::string_view name) const {
    const std::string_view value = text(name);
    if (value.size() != sizeof(T)) throw DecodeError("a header's number of another size");
    T number;
    std::memcpy(&number, value.data(), sizeof(T));
    return number;
  }
  [[nodiscard]] Stamp time(std::string_view name) const {
    return WireReader(text(name), WireFormat::kRos1).time();
  }

 private:
  std::vector<std::pair<std::string_view, std::string_view>> fields_;
};

ChunkCompression bag_compression(std::string_view name) {
  if (name == "none") return ChunkCompression::kNone;
  if (name == "bz2") return ChunkCompression::kBz2;
  if (name == "lz4") return ChunkCompression::kLz4;
  throw DecodeError("a compression that no bag has");
}

class Indexer {
 public:
  explicit Indexer(const InputFile& file) : file_(file) {}

  RecordingIndex run() {
    std::string magic;
    if (!file_.read(0, kMagic.size(), magic) || magic != kMagic) {
      throw ConfigError(file_.path().string() + ": is no bag of format 2.0, expected one");
    }
    std::uint64_t at = kMagic.size();
    while (at < file_.size()) {
      try {
        at = read_record(at);
      } catch (const DecodeError& damage) {
        index_.damage.note(damage.what());
        const std::uint64_t next = chunk_after(at);
        index_.damage.skipped += next - at;
        at = next;
      }
    }
    resolve_connections();
    return std::move(index_);
  }

 private:
  /// A record's header and where its data lie.
  struct Record {
    std::string header;
    std::uint64_t data = 0;
    std::uint32_t data_size = 0;
  };

  [[nodiscard]] std::uint32_t length_at(std::uint64_t at) const {
    std::string bytes;
    if (!file_.read(at, 4, bytes)) throw DecodeError("a record that is cut short");
    std::uint32_t length = 0;
    std::memcpy(&length, bytes.data(), 4);
    return length;
  }

  [[nodiscard]] Record record_at(std::uint64_t at) const {
    Record record;
    const std::uint32_t size = length_at(at);
    if (size > kMostHeader) throw DecodeError("a record's header of more than 1 MiB");
    if (!file_.read(at + 4, size, record.header)) throw DecodeError("a record that is cut short");
    record.data_size = length_at(at + 4 + size);
    record.data = at + 8 + size;
    return record;
  }

  /// @return where the next one begins.
  std::uint64_t read_record(std::uint64_t at) {
    const Record record = record_at(at);
    if (record.data_size > file_.size() - record.data) {
      throw DecodeError("a record that is cut short");
    }
    const Fields fields(record.header);
    const std::uint64_t next = record.data + record.data_size;
    switch (fields.number<std::uint8_t>("op")) {
      case kFileHeader:
        index_position_ = fields.number<std::uint64_t>("index_pos");
        refuse_encrypted(fields);
        break;
      case kConnection: {
        std::string data;
        if (!file_.read(record.data, record.data_size, data)) {
          throw DecodeError("a record that cannot be read");
        }
        add_connection(fields, data);
        break;
      }
      case kChunk:
        try {
          add_chunk(fields, record);
        } catch (const DecodeError& damage) {  // the next record begins where it should
          index_.damage.note(damage.what());
        }
        break;
      default:
        break;  // indexes, and what later formats may add
    }
    return next;
  }

  void refuse_encrypted(const Fields& fields) const {
    const auto encryptor = fields.find("encryptor");
    if (!encryptor || encryptor->empty()) return;
    throw ConfigError(file_.path().string() + ": is encrypted, expected a plain bag");
  }

  void add_connection(const Fields& fields, std::string_view data) {
    const Fields details(data);
    connections_[fields.number<std::uint32_t>("conn")] = {std::string(fields.text("topic")),
                                                          std::string(details.text("type"))};
  }

  void add_chunk(const Fields& fields, const Record& record) {
    RecordingIndex::Chunk chunk{record.data, record.data_size, fields.number<std::uint32_t>("size"),
                                bag_compression(fields.text("compression"))};
    std::string packed;
    if (!file_.read(chunk.position, chunk.size, packed)) {
      throw DecodeError("a chunk that cannot be read");
    }
    const std::string bytes = unpack(packed, chunk.compression, chunk.unpacked_size);
    const auto number = static_cast<std::uint32_t>(index_.chunks.size());
    index_.chunks.push_back(chunk);
    WireReader reader(bytes, WireFormat::kRos1);
    while (reader.left() > 0) {
      const Fields inner(reader.text());
      const std::string_view data = reader.text();
      const auto op = inner.number<std::uint8_t>("op");
      if (op == kConnection) {
        add_connection(inner, data);
      } else if (op == kMessage) {
        index_.entries.push_back(
            {inner.time("time"), static_cast<std::uint64_t>(data.data() - bytes.data()),
             static_cast<std::uint32_t>(data.size()), number, inner.number<std::uint32_t>("conn")});
      }
    }
  }

  /// The first chunk behind a place that the index at the end names; without one the file's end.
  std::uint64_t chunk_after(std::uint64_t at) {
    if (!chunk_positions_) chunk_positions_ = read_chunk_positions();
    const auto next = std::upper_bound(chunk_positions_->begin(), chunk_positions_->end(), at);
    return next == chunk_positions_->end() ? file_.size() : *next;
  }

  [[nodiscard]] std::vector<std::uint64_t> read_chunk_positions() const {
    std::vector<std::uint64_t> positions;
    try {
      for (std::uint64_t at = index_position_; at > 0 && at < file_.size();) {
        const Record record = record_at(at);
        const Fields fields(record.header);
        if (fields.number<std::uint8_t>("op") == kChunkInfo) {
          positions.push_back(fields.number<std::uint64_t>("chunk_pos"));
        }
        at = record.data + record.data_size;
      }
    } catch (const DecodeError&) {
      // What it said up to there still holds.
    }
    std::erase_if(positions, [&](std::uint64_t position) { return position >= file_.size(); });
    // Connections may stand there that no chunk before the damage has named.
    if (index_position_ > 0 && index_position_ < file_.size()) {
      positions.push_back(index_position_);
    }
    std::sort(positions.begin(), positions.end());
    return positions;
  }

  /// Entries hold the numbers of connections until all of these are known.
  void resolve_connections() {
    std::map<std::uint32_t, std::uint32_t> topics;
    for (const auto& [number, connection] : connections_) {
      topics[number] = index_.topic(connection.topic, connection.type, WireFormat::kRos1);
    }
    const std::size_t all = index_.entries.size();
    std::erase_if(index_.entries, [&](RecordingIndex::Entry& entry) {
      const auto topic = topics.find(entry.topic);
      if (topic == topics.end()) return true;
      entry.topic = topic->second;
      return false;
    });
    index_.damage.orphans = all - index_.entries.size();
  }

  struct Connection {
    std::string topic, type;
  };

  const InputFile& file_;
  RecordingIndex index_;
  std::map<std::uint32_t, Connection> connections_;
  std::uint64_t index_position_ = 0;
  std::optional<std::vector<std::uint64_t>> chunk_positions_;
};

}  // namespace

RecordingIndex index_ros_bag(const InputFile& file) { return Indexer(file).run(); }

}  // namespace arex::sim
