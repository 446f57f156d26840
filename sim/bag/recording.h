#pragma once

#include <cstdint>
#include <deque>
#include <filesystem>
#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "bag/wire_reader.h"
#include "math/types.h"

namespace arex::sim {

/// One topic of a recording; publishers that share it are one.
struct RecordedTopic {
  std::string name;
  std::string type;  ///< package/Type, of ROS 2 as well
  WireFormat format = WireFormat::kRos1;
  std::uint64_t messages = 0;
};

struct RecordedMessage {
  std::size_t topic = 0;   ///< index in topics()
  Stamp time = 0;          ///< when it was recorded, ns
  std::string_view bytes;  ///< valid until the next call of next()
};

/// What of a file could not be used.
struct RecordingDamage {
  std::uint64_t places = 0;   ///< chunks and records that could not be read
  std::uint64_t orphans = 0;  ///< messages of connections that nothing describes
  std::uint64_t skipped = 0;  ///< bytes passed over
  std::string first;          ///< what the first was, in words; empty: none

  void note(const std::string& what) {
    if (places++ == 0) first = what;
  }
};

/// How a chunk of records is compressed.
enum class ChunkCompression : std::uint8_t { kNone, kBz2, kLz4, kZstd };

/// @return the bytes, at most `size` of them. @throws DecodeError if there are more or fewer.
std::string unpack(std::string_view bytes, ChunkCompression compression, std::uint64_t size);

/// A file that is read at any place.
class InputFile {
 public:
  /// @throws ConfigError if it cannot be opened or is no regular file.
  explicit InputFile(const std::filesystem::path& path);
  ~InputFile();
  InputFile(InputFile&& other) noexcept;
  InputFile& operator=(InputFile&&) = delete;

  [[nodiscard]] std::uint64_t size() const { return size_; }
  [[nodiscard]] const std::filesystem::path& path() const { return path_; }
  /// Replaces `out`. @return whether all of it could be read.
  bool read(std::uint64_t position, std::uint64_t size, std::string& out) const;

 private:
  std::filesystem::path path_;
  int descriptor_ = -1;
  std::uint64_t size_ = 0;
};

/// Where the messages of a file lie: all that its format says. Made by walking through the whole
/// file, since indexes may be missing or damaged; the one at the end only helps past damage.
struct RecordingIndex {
  struct Chunk {
    std::uint64_t position = 0;  ///< of its compressed bytes
    std::uint64_t size = 0;      ///< of these
    std::uint64_t unpacked_size = 0;
    ChunkCompression compression = ChunkCompression::kNone;
  };
  struct Entry {
    Stamp time = 0;
    std::uint64_t offset = 0;  ///< of the message in the unpacked chunk
    std::uint32_t size = 0;
    std::uint32_t chunk = 0;
    std::uint32_t topic = 0;
  };
  std::vector<RecordedTopic> topics;
  std::vector<Chunk> chunks;
  std::vector<Entry> entries;  ///< in the order of the file
  RecordingDamage damage;

  /// The topic of this name and type, made if need be.
  std::uint32_t topic(const std::string& name, const std::string& type, WireFormat format);
};

/// What a ROS 1 bag of format 2.0 holds. @throws ConfigError if the file is no such bag.
RecordingIndex index_ros_bag(const InputFile& file);

/// The same of an MCAP file: channels with ROS 1 or CDR messages, chunks of none, lz4 or zstd. A
/// chunk whose checksum is wrong is damaged. @pre the file begins as one
RecordingIndex index_mcap(const InputFile& file);

/// A recording of anybody's: messages in the order in which they were recorded, those recorded at
/// the same time in the file's order.
class Recording {
 public:
  /// @throws ConfigError, one line, for what is no recording.
  explicit Recording(const std::filesystem::path& path);

  [[nodiscard]] const std::vector<RecordedTopic>& topics() const { return index_.topics; }
  [[nodiscard]] const RecordingDamage& damage() const { return index_.damage; }
  /// Time of the first and the last message; 0 if there is none.
  [[nodiscard]] Stamp begin() const;
  [[nodiscard]] Stamp end() const;

  /// From here on the messages of these topics are read, from the first one on.
  void select(const std::vector<std::size_t>& topics);
  /// @return whether there was one more.
  bool next(RecordedMessage& message);

 private:
  [[nodiscard]] const std::string* chunk(std::uint32_t number);

  InputFile file_;
  RecordingIndex index_;
  std::vector<bool> selected_;
  std::size_t at_ = 0;
  std::map<std::uint32_t, std::string> unpacked_;  ///< chunks in memory
  std::deque<std::uint32_t> order_;                ///< of these, the longest there first
  std::size_t in_memory_ = 0;                      ///< bytes
};

}  // namespace arex::sim
