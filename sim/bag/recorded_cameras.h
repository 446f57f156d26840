#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "bag/image_decoder.h"
#include "bag/recording.h"
#include "messages/sensors.h"
#include "messages/stereo_image.h"

namespace arex::sim {

/// A camera of a recording: a topic of images, and what its camera_info says of them.
struct RecordedCamera {
  std::size_t topic = 0;
  std::string frame;
  PinholeCamera camera;
};
/// The same of an infrared pair; its frame is the left eye's.
struct RecordedPair {
  std::size_t left = 0, right = 0;  ///< topics
  std::string frame;
  StereoCamera camera;
};

/// The depth camera and the infrared pair of a recording, found by what their first messages hold
/// and by names as RealSense drivers give them (and by those of our own flights):
///
///     depth       16UC1, mono16 or 32FC1; "depth" in the name; not one aligned to another camera
///     infrared    mono8 or 8UC1 on NAMEinfra1REST and NAMEinfra2REST, or with left and right
///     calibration sensor_msgs/CameraInfo on camera_info beside the images, or of the same frame
///
/// Of several the busiest. Images must be a pinhole's: rectified, as these drivers give them.
class RecordedCameras {
 public:
  /// Reads the first messages of all topics of images.
  /// @param depth_topic, infrared_topic (the left eye's); empty: as above
  /// @throws ConfigError for a topic that is not there, or whose images cannot be used
  RecordedCameras(Recording& recording, const std::string& depth_topic,
                  const std::string& infrared_topic);

  [[nodiscard]] const std::optional<RecordedCamera>& depth() const { return depth_; }
  [[nodiscard]] const std::optional<RecordedPair>& infrared() const { return infrared_; }
  /// What a reader should know of cameras that are left out; a sentence each.
  [[nodiscard]] const std::vector<std::string>& notes() const { return notes_; }

 private:
  struct Seen {
    std::size_t topic = 0;
    std::string name, frame, encoding;
    std::size_t width = 0, height = 0;
    std::uint64_t messages = 0;
  };
  void survey(Recording& recording);
  void find_depth(const std::string& asked);
  void find_infrared(const std::string& asked);
  /// Of a topic's images; nullptr: nothing describes them.
  [[nodiscard]] const DecodedCamera* calibration_of(const Seen& images) const;
  /// Why the camera cannot be used; empty: it can.
  [[nodiscard]] std::string fault_of(const Seen& images) const;
  [[nodiscard]] const Seen* named(const std::string& name) const;

  std::vector<Seen> images_;
  std::map<std::string, DecodedCamera> cameras_;  ///< by the topic's name
  std::optional<RecordedCamera> depth_;
  std::optional<RecordedPair> infrared_;
  std::vector<std::string> notes_;
};

}  // namespace arex::sim
