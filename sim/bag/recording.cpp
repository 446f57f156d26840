#include "bag/recording.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <utility>

#include "bag/mcap_format.h"
#include "config/config.h"

namespace arex::sim {
namespace {

constexpr std::string_view kRosBagMagic = "#ROSBAG V";
constexpr std::size_t kMostInMemory = std::size_t{64} << 20;  // unpacked chunks, or one if larger

RecordingIndex index_of(const InputFile& file) {
  std::string magic;
  static_cast<void>(file.read(0, std::min<std::uint64_t>(file.size(), 16), magic));
  if (magic.starts_with(kRosBagMagic)) return index_ros_bag(file);
  if (magic.starts_with(mcap::kMagic)) return index_mcap(file);
  throw ConfigError(file.path().string() + ": is no recording, expected a ROS 1 bag or MCAP");
}

}  // namespace

InputFile::InputFile(const std::filesystem::path& path) : path_(path) {
  descriptor_ = ::open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK);
  struct stat status {};
  const bool known = descriptor_ >= 0 && ::fstat(descriptor_, &status) == 0;
  const int reason = errno;
  if (known && S_ISREG(status.st_mode)) {
    size_ = static_cast<std::uint64_t>(status.st_size);
    return;
  }
  if (descriptor_ >= 0) ::close(descriptor_);
  throw ConfigError(path.string() +
                    (known ? ": is no file, expected a recording"
                           : std::string(": ") + std::strerror(reason) + ", expected a recording"));
}

InputFile::~InputFile() {
  if (descriptor_ >= 0) ::close(descriptor_);
}

InputFile::InputFile(InputFile&& other) noexcept
    : path_(std::move(other.path_)),
      descriptor_(std::exchange(other.descriptor_, -1)),
      size_(other.size_) {}

bool InputFile::read(std::uint64_t position, std::uint64_t size, std::string& out) const {
  out.clear();
  if (position > size_ || size > size_ - position) return false;
  out.resize(size);
  std::size_t done = 0;
  while (done < size) {
    const ssize_t got =
        ::pread(descriptor_, out.data() + done, size - done, static_cast<off_t>(position + done));
    if (got < 0 && errno == EINTR) continue;
    if (got <= 0) return false;  // the disk, or the file has become shorter
    done += static_cast<std::size_t>(got);
  }
  return true;
}

std::uint32_t RecordingIndex::topic(const std::string& name, const std::string& type,
                                    WireFormat format) {
  const auto known = std::find_if(topics.begin(), topics.end(), [&](const RecordedTopic& topic) {
    return topic.name == name && topic.type == type && topic.format == format;
  });
  if (known != topics.end()) return static_cast<std::uint32_t>(known - topics.begin());
  topics.push_back({name, type, format, 0});
  return static_cast<std::uint32_t>(topics.size() - 1);
}

Recording::Recording(const std::filesystem::path& path) : file_(path), index_(index_of(file_)) {
  std::stable_sort(index_.entries.begin(), index_.entries.end(),
                   [](const auto& a, const auto& b) { return a.time < b.time; });
  for (const RecordingIndex::Entry& entry : index_.entries) ++index_.topics[entry.topic].messages;
  selected_.assign(index_.topics.size(), true);
}

Stamp Recording::begin() const { return index_.entries.empty() ? 0 : index_.entries.front().time; }
Stamp Recording::end() const { return index_.entries.empty() ? 0 : index_.entries.back().time; }

void Recording::select(const std::vector<std::size_t>& topics) {
  selected_.assign(index_.topics.size(), false);
  for (const std::size_t topic : topics) selected_.at(topic) = true;
  at_ = 0;
}

bool Recording::next(RecordedMessage& message) {
  for (; at_ < index_.entries.size(); ++at_) {
    const RecordingIndex::Entry& entry = index_.entries[at_];
    if (!selected_[entry.topic]) continue;
    const std::string* bytes = chunk(entry.chunk);
    if (bytes == nullptr) continue;  // it could be read when the file was opened
    message = {entry.topic, entry.time, std::string_view(*bytes).substr(entry.offset, entry.size)};
    ++at_;
    return true;
  }
  return false;
}

const std::string* Recording::chunk(std::uint32_t number) {
  if (const auto known = unpacked_.find(number); known != unpacked_.end()) return &known->second;
  const RecordingIndex::Chunk& chunk = index_.chunks[number];
  std::string packed;
  if (!file_.read(chunk.position, chunk.size, packed)) {
    index_.damage.note("a chunk that cannot be read any more");
    return nullptr;
  }
  std::string bytes = chunk.compression == ChunkCompression::kNone
                          ? std::move(packed)
                          : unpack(packed, chunk.compression, chunk.unpacked_size);
  while (!order_.empty() && in_memory_ + bytes.size() > kMostInMemory) {
    in_memory_ -= unpacked_.at(order_.front()).size();
    unpacked_.erase(order_.front());
    order_.pop_front();
  }
  in_memory_ += bytes.size();
  order_.push_back(number);
  return &unpacked_.emplace(number, std::move(bytes)).first->second;
}

}  // namespace arex::sim
