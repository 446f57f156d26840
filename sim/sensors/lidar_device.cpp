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
  for (const LidarPoint& point : scan.points) {
    hash.add_bytes(std::span<const float>(point.p_L.data(), 3));
    hash.add(std::uint64_t{point.offset_ns} << 32 | std::bit_cast<std::uint32_t>(point.intensity));
    hash.add(std::uint64_t{point.line} << 8 | point.tag);
  }
  return hash.value();
}

}  // namespace

/// A frame in the making: its parts are cast in any order, the last one joins them.
struct LidarDevice::Frame {
  explicit Frame(std::int64_t count)
      : parts(static_cast<std::size_t>(count)),
        missing(count),
        scan(std::make_shared<LidarScan>()) {}

  /// @return whether it is whole now
  bool add(std::size_t part, LidarScan points) {
    parts[part] = std::move(points);
    if (--missing > 0) return false;
    join();
    return true;
  }

  void join() {
    scan->stamp = parts.front().stamp;
    scan->end = parts.back().end;
    for (LidarScan& part : parts) {
      const auto offset = static_cast<std::uint32_t>(part.stamp - scan->stamp);
      for (LidarPoint point : std::exchange(part.points, {})) {
        point.offset_ns += offset;
        scan->points.push_back(point);
      }
    }
    hash = hash_of(*scan);
  }

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
      outlets_(context.outlets) {}

void LidarDevice::fire(const Moment& moment) {
  part_.push_back(moment.truth);
  const Stamp begin = part_.front().stamp;
  const Stamp period = lidar_->period();
  const Stamp frame_begin = begin / period * period;
  const Stamp frame_end = frame_begin + period;
  if (moment.now < std::min(begin + kPart, frame_end)) return;
  const auto part = static_cast<std::size_t>((begin - frame_begin) / kPart);
  if (part == 0) frame_ = std::make_shared<Frame>((period + kPart - 1) / kPart);
  jobs_.schedule(lane_, frame_end + latency_,
                 [this, ticks = part_, frame = frame_, part]() -> JobQueue::Delivery {
                   if (!frame->add(part, lidar_->scan(ticks))) return nullptr;
                   return [this, frame] { deliver(*frame); };
                 });
  part_.assign(1, moment.truth);
}

void LidarDevice::deliver(const Frame& frame) {
  frame.scan->device = name_;
  note(frame.hash);
  outlets_.frames.add(frame.hash);
  outlets_.software->add_scan(frame.scan);
  if (outlets_.bag) outlets_.bag->scan(*frame.scan);
}

}  // namespace arex::sim
