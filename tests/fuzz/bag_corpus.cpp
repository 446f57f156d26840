#include "fuzz/bag_corpus.h"

#include <array>
#include <cstdint>
#include <stdexcept>

#include "bag/bag_writer.h"
#include "bag/recording.h"
#include "bag/replay_input.h"
#include "fuzz/mutation.h"
#include "support/temporary_folder.h"

namespace arex::test {
namespace {

constexpr int kEye_px = 64;

void write_infrared(sim::BagWriter& bag, Stamp now) {
  StereoImage image;
  image.time_ns = now;
  image.width = image.height = kEye_px;
  image.camera = {kEye_px, kEye_px, 40, 31, 31, 0.05, {}};
  image.left.assign(std::size_t{kEye_px} * kEye_px, 7);
  image.right = image.left;
  bag.infrared(image);
}

void write_display(sim::DisplayWriter& display, Stamp now) {
  const std::vector<sim::PathPose> path(3);
  display.path(now, path);
  Decision decision;
  decision.stamp = now;
  decision.candidates.resize(2);
  decision.winner = 0;
  display.decision(decision, 1);
  display.event({now, EventKind::kArmed, ""});
}

std::string record_some(const std::string& name, sim::BagLayout layout, bool packed, bool cameras) {
  const TemporaryFolder folder;
  sim::BagOptions options;
  options.layout = layout;
  if (packed) options.compression = sim::BagCompression::kLz4;
  options.infrared = cameras;
  sim::BagWriter bag(folder / name, VehicleConfig{}, options);
  bag.place_odom(Pose(), true);
  for (int i = 0; i < 60; ++i) {
    const Stamp now = (i + 1) * 5 * kNanosecondsPerTick;
    bag.begin(now);
    bag.imu({now, {0.1, 0, 0}, {0, 0, kGravity}, {0, 0, 0}});
    bag.truth(now, Pose(), Vec3::Zero(), Vec3::Zero());
    if (i % 20 != 0) continue;
    LidarScan scan{"", now, now + 1, {}};
    for (std::uint32_t k = 0; k < 12; ++k) {
      scan.points.push_back({Vec3f(1, 2, static_cast<float>(k)), 7, 5000 * k, 1, 0, 0});
    }
    bag.scan(scan);
    if (!cameras) continue;
    bag.depth({"", now, {4, 3, 2, 2, 1.5, 1}, std::vector<float>(12, 2.5F)});
    if (i == 20) write_infrared(bag, now);
    if (i == 40) write_display(bag.display(), now);
  }
  bag.close();
  return read_text(folder / name);
}

void put(std::string& out, std::uint64_t value, int bytes) {
  for (int i = 0; i < bytes; ++i) out += static_cast<char>(value >> (8 * i) & 0xff);
}
void put(std::string& out, const std::string& text) {
  put(out, text.size(), 4);
  out += text;
}
std::string mcap_record(std::uint8_t op, const std::string& content) {
  std::string out(1, static_cast<char>(op));
  put(out, content.size(), 8);
  return out + content;
}

/// The same messages as MCAP of another hand, in one chunk without a checksum: damage to it reaches
/// what reads messages, and those of ROS 1 are read from this container, too.
std::string as_plain_mcap(const std::string& bag) {
  const TemporaryFolder folder;
  write_text(folder / "a", bag);
  sim::Recording recording(folder / "a");
  std::string records;
  for (std::size_t i = 0; i < recording.topics().size(); ++i) {
    const sim::RecordedTopic& topic = recording.topics()[i];
    std::string schema, channel;
    put(schema, i + 1, 2);
    put(schema, topic.type);
    put(schema, "ros1msg");
    put(schema, "");
    put(channel, i, 2);
    put(channel, i + 1, 2);
    put(channel, topic.name);
    put(channel, topic.format == sim::WireFormat::kRos1 ? "ros1" : "cdr");
    put(channel, 0, 4);
    records += mcap_record(3, schema) + mcap_record(4, channel);
  }
  sim::RecordedMessage message;
  while (recording.next(message)) {
    std::string content;
    put(content, message.topic, 2);
    put(content, 0, 4);
    for (int i = 0; i < 2; ++i) put(content, static_cast<std::uint64_t>(message.time), 8);
    records += mcap_record(5, content.append(message.bytes));
  }
  std::string chunk;
  for (int i = 0; i < 2; ++i) put(chunk, 0, 8);
  put(chunk, records.size(), 8);
  put(chunk, 0, 4);
  put(chunk, "");
  put(chunk, records.size(), 8);
  return "\x89MCAP0\r\n" + mcap_record(1, std::string(8, '\0')) + mcap_record(6, chunk + records) +
         mcap_record(0x0f, std::string(4, '\0')) + mcap_record(2, std::string(20, '\0')) +
         "\x89MCAP0\r\n";
}

/// A third of a second in each container, layout and encoding, with and without compression, some
/// with cameras and with what viewers show; small, so that damage meets more than points.
const std::vector<std::string>& recorded_bags() {
  static const std::vector<std::string> bags = [] {
    std::vector<std::string> all;
    for (const sim::BagLayout layout :
         {sim::BagLayout::kGeneric, sim::BagLayout::kLivoxDriver2, sim::BagLayout::kLivoxCustom}) {
      for (const char* name : {"a.bag", "a.mcap"}) {
        for (const bool packed : {false, true}) {
          all.push_back(record_some(name, layout, packed, false));
        }
      }
    }
    for (const char* name : {"a.bag", "a.mcap"}) {
      const std::string cameras = record_some(name, sim::BagLayout::kGeneric, false, true);
      all.push_back(cameras);
      all.push_back(as_plain_mcap(cameras));
      all.push_back(as_plain_mcap(record_some(name, sim::BagLayout::kLivoxCustom, false, false)));
    }
    return all;
  }();
  return bags;
}

/// damage_bytes(), or numbers of the file replaced by absurd ones: lengths, counts, offsets.
std::string damage_bag(const std::string& bag, RandomStream& random) {
  if (random.uniform() < 0.5) return damage_bytes(bag, recorded_bags(), random);
  constexpr std::array<std::uint64_t, 8> kAbsurd{0,          1,          0x7fffffff, 0x80000000,
                                                 0xffffffff, 0xfffffffe, 1'000'000,  ~0ULL};
  std::string damaged = bag;
  const int count = random.uniform_int(1, 3);
  for (int i = 0; i < count; ++i) {
    const int bytes = random.uniform_int(0, 3) == 0 ? 8 : 4;
    const int last = static_cast<int>(damaged.size()) - bytes;
    const auto at = static_cast<std::size_t>(random.uniform_int(0, last));
    const std::uint64_t value = kAbsurd.at(static_cast<std::size_t>(random.uniform_int(0, 7)));
    std::string number;
    put(number, value, bytes);
    damaged.replace(at, number.size(), number);
  }
  return damaged;
}

}  // namespace

void read_recording(const std::filesystem::path& folder, RandomStream& random) {
  const std::vector<std::string>& sound = recorded_bags();
  const auto last = static_cast<int>(sound.size()) - 1;
  const std::string& bytes = sound[static_cast<std::size_t>(random.uniform_int(0, last))];
  write_text(folder / "a.bag", damage_bag(bytes, random));
  sim::ReplayInput input(folder / "a.bag", {});
  sim::CameraUse cameras;
  cameras.depth = input.cameras().depth().has_value();
  cameras.infrared = input.cameras().infrared().has_value();
  input.use(cameras);
  Stamp before = -kForever;
  while (const auto arrival = input.next()) {
    if (arrival->time < before) throw std::runtime_error("time runs backwards");
    before = arrival->time;
    if (arrival->scan && arrival->scan->end <= arrival->scan->stamp) {
      throw std::runtime_error("a frame that ends before it begins");
    }
    if (arrival->depth) {
      const PinholeCamera& camera = arrival->depth->camera;
      const auto pixels =
          static_cast<std::size_t>(camera.width) * static_cast<std::size_t>(camera.height);
      if (arrival->depth->depth_m.size() != pixels)
        throw std::runtime_error("a depth image of no size");
    }
  }
  static_cast<void>(input.read_truth());
  static_cast<void>(input.notes());
}

}  // namespace arex::test
