#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "bag/wire_reader.h"
#include "messages/sensors.h"

/// The images of other people's recordings. Stamps are the headers' own, ns. All functions throw
/// DecodeError for bytes that are no such message.
namespace arex::sim {

/// A sensor_msgs/Image, looked at where it lies.
struct DecodedImage {
  Stamp stamp = 0;
  std::string_view frame, encoding;
  std::size_t width = 0, height = 0;  ///< px; neither is zero
  std::size_t step = 0;               ///< bytes of a row
  bool big_endian = false;
  std::string_view data;
};
DecodedImage decode_image(std::string_view bytes, WireFormat format);

/// Whether depth_of() knows the encoding: 32FC1 (m), 16UC1 or mono16 (mm).
bool is_depth_encoding(std::string_view encoding);
/// z-depths in m, rows from the top; 0 where nothing was measured (REP 118: NaN or 0).
std::vector<float> depth_of(const DecodedImage& image);

/// Whether grey_of() knows the encoding: mono8 or 8UC1.
bool is_grey_encoding(std::string_view encoding);
std::vector<std::uint8_t> grey_of(const DecodedImage& image);

/// A sensor_msgs/CameraInfo.
struct DecodedCamera {
  std::string frame;
  PinholeCamera camera;
  double baseline_m = 0;   ///< to the left eye, of a right one
  bool distorted = false;  ///< its images are not those of a pinhole
};
DecodedCamera decode_camera_info(std::string_view bytes, WireFormat format);

}  // namespace arex::sim
