#pragma once

#include <cstdint>
#include <deque>
#include <memory>
#include <optional>
#include <vector>

#include "messages/sensors.h"
#include "messages/stereo_image.h"

namespace arex::sim {

/// What arrives at one moment: one of these.
struct Arrival {
  Stamp time = 0;
  std::optional<ImuSample> imu{};
  LidarScanPtr scan{};
  DepthImagePtr depth{};
  StereoImagePtr images{};

  [[nodiscard]] bool empty() const { return !imu && !scan && !depth && !images; }
};

/// Arrivals in the order of time, the two eyes of an infrared pair joined.
///
/// Recordings have an image of each eye, in either order. A pair arrives with the later one. A left
/// image to which no right one comes arrives by itself, when it came: some cameras, ours too, read
/// their right eye in some frames only. Until that is clear what comes behind it waits. A right
/// image alone is dropped.
class ArrivalQueue {
 public:
  /// @pre arrivals come in the order of time, those of eyes too
  void push(Arrival arrival);
  /// @param left without its right image
  void push_left(Stamp time, std::shared_ptr<StereoImage> left);
  /// @param stamp of the exposure
  void push_right(Stamp time, Stamp stamp, std::vector<std::uint8_t> grey);
  /// Nothing comes any more.
  void close() { waits_ = false; }

  /// @return nothing where none is there, or what comes next is not clear yet.
  std::optional<Arrival> pop();

 private:
  /// Lets go what has waited for too long at this time.
  void pass(Stamp time);
  void push_pair(Stamp time, std::shared_ptr<StereoImage> pair);

  struct RightEye {
    Stamp stamp = 0;
    std::vector<std::uint8_t> grey;
  };
  std::deque<Arrival> queue_;
  bool waits_ = false;                 ///< for a right eye
  std::size_t waiting_ = 0;            ///< the one that waits, in queue_
  std::shared_ptr<StereoImage> left_;  ///< its images
  std::optional<RightEye> right_;      ///< the newest, which has not met its left one
};

}  // namespace arex::sim
