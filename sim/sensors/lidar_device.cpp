#include "sensors/lidar_device.h"

#include <algorithm>
#include <atomic>
#include <bit>
#include <span>

namespace arex::sim {
namespace {

constexpr Stamp kPart = 20 * kNanosecondsPerTick;  // a frame is cast in parts while it is fired

std::uint64_t hash_of(const LidarScan& scan) {
  Fingerprint hash;
  hash.add(static_cast<std::uint64_t>(scan.stamp));
  for (const LidarPoint& point : scan.points) {
    hash.add_bytes(std::span<const float>(point.p_L.data(), 3));
    hash.add(std::uint64_t{point.offset_ns} << 32 | std::bit_cast<std::uint32_t>(point.intensity));
    hash.add(std::uint64_t{point.firing} << 16 | std::uint64_t{point.line} << 8 | point.tag);
  }
  return hash.value();
}

}  // namespace

/// A frame in the making: its parts are cast in any order, the last one joins them.
struct LidarDevice::Frame {
  Frame(const LidarModel& model, Stamp from, Stamp to, std::int64_t count)
      : lidar(model),
        begin(from),
        end(to),
        parts(static_cast<std::size_t>(count)),
        missing(count) {}

  /// @return whether it is whole now
  bool add(std::size_t part, LidarScan points) {
    parts[part] = std::move(points);
    if (--missing > 0) return false;
    scan = std::make_shared<LidarScan>(lidar.frame(begin, end, parts));
    parts.clear();
    hash = hash_of(*scan);
    return true;
  }

  const LidarModel& lidar;
  Stamp begin, end;
  std::vector<LidarScan> parts;
  std::atomic<std::int64_t> missing;
  std::shared_ptr<LidarScan> scan;
  std::uint64_t hash = 0;
};

LidarDevice::LidarDevice(std::unique_ptr<const LidarModel> lidar, double latency_s,
                         const DeviceContext& context)
    : name_(context.name),
      lidar_(std::move(lidar)),
      latency_(from_seconds(latency_s)),
      jobs_(context.jobs),
      lane_(jobs_.add_lane(name_.empty() ? "lidar" : name_, JobQueue::Order::kSideBySide)),
      outlets_(context.outlets),
      line_(context.faults, context.seed, name_.empty() ? "lidar" : name_) {}

void LidarDevice::fire(const Moment& moment) {
  now_ = moment.now;
  if (!line_.sound()) pass(std::nullopt);
  part_.push_back(moment.truth);
  const Stamp period = lidar_->period();
  const Stamp frame_begin = part_begin_ / period * period;
  const Stamp frame_end = frame_begin + period;
  if (moment.now < std::min(part_begin_ + kPart, frame_end)) return;
  const auto part = static_cast<std::size_t>((part_begin_ - frame_begin) / kPart);
  if (part == 0) {
    frame_ = std::make_shared<Frame>(*lidar_, frame_begin, frame_end, (period + kPart - 1) / kPart);
  }
  jobs_.schedule(lane_, frame_end + latency_,
                 [this, ticks = part_, frame = frame_, part, frame_begin]() -> JobQueue::Delivery {
                   if (!frame->add(part, lidar_->scan(ticks, frame_begin))) return nullptr;
                   return [this, frame] { deliver(*frame); };
                 });
  // What is fired within a frame's last tick may belong to the next.
  part_.clear();
  if (moment.now == frame_end) part_.push_back(moment.before);
  part_.push_back(moment.truth);
  part_begin_ = moment.now;
}

void LidarDevice::deliver(const Frame& frame) {
  frame.scan->device = name_;
  if (line_.sound()) {
    hand_on(frame.scan, frame.hash);
  } else {
    pass(frame.scan);
  }
}

void LidarDevice::pass(const std::optional<LidarScanPtr>& scan) {
  line_.pass(now_, scan,
             [this](const LidarScanPtr& arrived) { hand_on(arrived, hash_of(*arrived)); });
}

void LidarDevice::hand_on(const LidarScanPtr& scan, std::uint64_t hash) {
  note(hash);
  firings_ += scan->firings();
  misses_ += scan->misses();
  outlets_.frames.add(hash);
  outlets_.software->add_scan(scan);
  for (BagWriter* bag : outlets_.bags) bag->scan(*scan);
}

}  // namespace arex::sim
