#include "bag/ros_bag.h"

#include <algorithm>
#include <exception>
#include <stdexcept>

#include "bag/lz4_frame.h"

namespace arex::sim {
namespace {

constexpr std::string_view kMagic = "#ROSBAG V2.0\n";
constexpr std::size_t kFileHeaderSize = 4096;        // header and padding of the first record
constexpr std::size_t kChunkThreshold = 768 * 1024;  // as rosbag record: written when exceeded
constexpr std::uint32_t kRecordVersion = 1;          // of index and chunk info records

enum class Op : std::uint8_t {
  kMessage = 2,
  kFileHeader = 3,
  kIndex = 4,
  kChunk = 5,
  kChunkInfo = 6,
  kConnection = 7,
};

/// A record's header: fields `name=value`, each after its length.
class Header {
 public:
  explicit Header(Op op) { field("op", static_cast<std::uint8_t>(op)); }
  Header() = default;

  template <class T>
  Header& field(std::string_view name, const T& value) {
    RosBytes bytes;
    if constexpr (std::is_convertible_v<T, std::string_view>) {
      const std::string_view text(value);
      bytes.put_raw(text.data(), text.size());
    } else {
      bytes.put(value);
    }
    bytes_.put_length(name.size() + 1 + bytes.size());
    bytes_.put_raw(name.data(), name.size());
    bytes_.put('=');
    bytes_.put_raw(bytes.view().data(), bytes.size());
    return *this;
  }
  [[nodiscard]] std::string_view view() const { return bytes_.view(); }

 private:
  RosBytes bytes_;
};

void put_record(RosBytes& out, const Header& header, std::string_view data) {
  out.put(header.view());
  out.put(data);
}

}  // namespace

RosBag::RosBag(std::filesystem::path path, BagCompression compression)
    : path_(std::move(path)), compression_(compression), file_(active_name(check_writable(path_))) {
  write_out(kMagic);
  write_out(file_header(0).view());
}

RosBag::~RosBag() {
  if (!file_.is_open()) return;
  try {
    finish_chunk();
  } catch (const std::exception&) {
    // The chunk is lost; the name FILE.active already says that the bag is incomplete.
  }
}

std::uint32_t RosBag::add_topic(const std::string& topic, const RosMessageType& type,
                                bool latched) {
  Connection& connection = connections_.emplace_back();
  const auto id = static_cast<std::uint32_t>(connections_.size() - 1);
  Header details;
  details.field("topic", topic)
      .field("type", type.name)
      .field("md5sum", type.md5)
      .field("message_definition", type.definition);
  if (latched) details.field("latching", "1");
  put_record(connection.record, Header(Op::kConnection).field("conn", id).field("topic", topic),
             details.view());
  return id;
}

void RosBag::write(std::uint32_t id, RosTime time, const RosBytes& message) {
  require_open();
  Connection& connection = connections_.at(id);
  // A chunk explains itself: `rosbag reindex` knows connections by their records among messages.
  if (!connection.written)
    chunk_.put_raw(connection.record.view().data(), connection.record.size());
  connection.written = true;
  connection.index.push_back({time, static_cast<std::uint32_t>(chunk_.size())});
  put_record(chunk_, Header(Op::kMessage).field("conn", id).field("time", time), message.view());
  if (chunk_.size() > kChunkThreshold) finish_chunk();
}

void RosBag::finish_chunk() {
  if (chunk_.size() == 0) return;
  const std::uint64_t chunk_position = position_;
  const bool lz4 = compression_ == BagCompression::kLz4;
  const std::string compressed = lz4 ? lz4_frame(chunk_.view()) : std::string();
  RosBytes out;
  put_record(out,
             Header(Op::kChunk)
                 .field("compression", lz4 ? "lz4" : "none")
                 .field("size", static_cast<std::uint32_t>(chunk_.size())),
             lz4 ? std::string_view(compressed) : chunk_.view());

  put_index(out, chunk_position);
  ++chunk_count_;
  chunk_.clear();
  write_out(out.view());
  file_.flush();
}

void RosBag::put_index(RosBytes& out, std::uint64_t chunk_position) {
  RosTime first{UINT32_MAX, UINT32_MAX}, last;
  RosBytes counts;
  std::uint32_t connection_count = 0;
  for (std::uint32_t id = 0; id < connections_.size(); ++id) {
    std::vector<IndexEntry>& index = connections_[id].index;
    if (index.empty()) continue;
    // Readers take an index as sorted; a device's clock may have stepped back.
    std::ranges::stable_sort(index, {}, &IndexEntry::time);
    first = std::min(first, index.front().time);
    last = std::max(last, index.back().time);
    const auto count = static_cast<std::uint32_t>(index.size());
    counts.put(id);
    counts.put(count);
    ++connection_count;
    RosBytes entries;
    for (const IndexEntry& entry : index) {
      entries.put(entry.time);
      entries.put(entry.offset);
    }
    Header header(Op::kIndex);
    header.field("ver", kRecordVersion).field("conn", id).field("count", count);
    put_record(out, header, entries.view());
    index.clear();
  }
  Header header(Op::kChunkInfo);
  header.field("ver", kRecordVersion)
      .field("chunk_pos", chunk_position)
      .field("start_time", first)
      .field("end_time", last)
      .field("count", connection_count);
  put_record(chunk_infos_, header, counts.view());
}

void RosBag::close() {
  require_open();
  finish_chunk();
  const std::uint64_t index_position = position_;
  for (const Connection& connection : connections_) {
    if (connection.written) write_out(connection.record.view());
  }
  write_out(chunk_infos_.view());
  file_.flush();
  file_.overwrite_beginning(std::string(kMagic).append(file_header(index_position).view()));
  file_.finish_as(path_);
}

RosBytes RosBag::file_header(std::uint64_t index_position) const {
  const auto connection_count =
      static_cast<std::uint32_t>(std::ranges::count(connections_, true, &Connection::written));
  Header header(Op::kFileHeader);
  header.field("index_pos", index_position)
      .field("conn_count", connection_count)
      .field("chunk_count", chunk_count_);
  RosBytes record;
  put_record(record, header, std::string(kFileHeaderSize - header.view().size(), ' '));
  return record;
}

void RosBag::write_out(std::string_view bytes) {
  file_.append(bytes);
  position_ += bytes.size();
}

void RosBag::require_open() const {
  if (!file_.is_open()) throw std::runtime_error(path_.string() + ": the bag is closed");
}

}  // namespace arex::sim
