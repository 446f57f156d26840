#include "bag/image_decoder.h"

#include <bit>
#include <cmath>
#include <cstring>

namespace arex::sim {
namespace {

constexpr std::size_t kLongestSide_px = 16384;  // beyond any camera

/// @throws DecodeError if a row holds less than its pixels.
void expect_rows(const DecodedImage& image, std::size_t pixel_bytes) {
  if (image.step < image.width * pixel_bytes) {
    throw DecodeError("an image whose rows are shorter than they say");
  }
}

template <class T>
T pixel_of(const DecodedImage& image, std::size_t row, std::size_t column) {
  char bytes[sizeof(T)];
  std::memcpy(bytes, image.data.data() + row * image.step + column * sizeof(T), sizeof(T));
  if (image.big_endian) {
    for (std::size_t i = 0; i < sizeof(T) / 2; ++i) std::swap(bytes[i], bytes[sizeof(T) - 1 - i]);
  }
  return std::bit_cast<T>(bytes);
}

}  // namespace

DecodedImage decode_image(std::string_view bytes, WireFormat format) {
  WireReader reader(bytes, format);
  const WireHeader header = reader.header();
  DecodedImage image;
  image.stamp = header.stamp;
  image.frame = header.frame;
  image.height = reader.number<std::uint32_t>();
  image.width = reader.number<std::uint32_t>();
  image.encoding = reader.text();
  image.big_endian = reader.number<std::uint8_t>() != 0;
  image.step = reader.number<std::uint32_t>();
  image.data = reader.take(reader.length(1));
  const bool possible = image.width > 0 && image.height > 0 && image.width <= kLongestSide_px &&
                        image.height <= kLongestSide_px;
  if (!possible) throw DecodeError("an image of no possible size");
  if (image.step == 0 || image.height > image.data.size() / image.step) {
    throw DecodeError("an image with less data than it says");
  }
  return image;
}

bool is_depth_encoding(std::string_view encoding) {
  return encoding == "32FC1" || encoding == "16UC1" || encoding == "mono16";
}

std::vector<float> depth_of(const DecodedImage& image) {
  const bool metres = image.encoding == "32FC1";
  if (!is_depth_encoding(image.encoding)) throw DecodeError("an image that is no depth");
  expect_rows(image, metres ? sizeof(float) : sizeof(std::uint16_t));
  constexpr float kMetre_mm = 1000;
  std::vector<float> depth_m;
  depth_m.reserve(image.width * image.height);
  for (std::size_t row = 0; row < image.height; ++row) {
    for (std::size_t column = 0; column < image.width; ++column) {
      const float z = metres ? pixel_of<float>(image, row, column)
                             : pixel_of<std::uint16_t>(image, row, column) / kMetre_mm;
      depth_m.push_back(std::isfinite(z) && z > 0 ? z : 0.0F);
    }
  }
  return depth_m;
}

bool is_grey_encoding(std::string_view encoding) {
  return encoding == "mono8" || encoding == "8UC1";
}

std::vector<std::uint8_t> grey_of(const DecodedImage& image) {
  if (!is_grey_encoding(image.encoding)) throw DecodeError("an image that is not grey");
  expect_rows(image, 1);
  std::vector<std::uint8_t> grey(image.width * image.height);
  for (std::size_t row = 0; row < image.height; ++row) {
    std::memcpy(grey.data() + row * image.width, image.data.data() + row * image.step, image.width);
  }
  return grey;
}

DecodedCamera decode_camera_info(std::string_view bytes, WireFormat format) {
  WireReader reader(bytes, format);
  DecodedCamera decoded;
  decoded.frame = reader.header().frame;
  PinholeCamera& camera = decoded.camera;
  const auto height = reader.number<std::uint32_t>(), width = reader.number<std::uint32_t>();
  if (width > kLongestSide_px || height > kLongestSide_px) {
    throw DecodeError("a camera of no possible size");
  }
  camera.height = static_cast<int>(height);
  camera.width = static_cast<int>(width);
  reader.text();  // distortion model
  const std::size_t coefficients = reader.length(sizeof(double));
  for (std::size_t i = 0; i < coefficients; ++i) {
    if (reader.number<double>() != 0) decoded.distorted = true;
  }
  std::array<double, 9> K{};
  for (double& value : K) value = reader.number<double>();
  reader.skip_numbers(9, sizeof(double));  // R
  std::array<double, 12> P{};
  for (double& value : P) value = reader.number<double>();
  camera.fx = K[0];
  camera.cx = K[2];
  camera.fy = K[4];
  camera.cy = K[5];
  const bool possible = camera.fx > 0 && camera.fy > 0 && std::isfinite(camera.fx) &&
                        std::isfinite(camera.fy) && std::isfinite(camera.cx) &&
                        std::isfinite(camera.cy);
  if (!possible) throw DecodeError("a camera that is none");
  decoded.baseline_m = P[0] > 0 && std::isfinite(P[3]) ? -P[3] / P[0] : 0;
  return decoded;
}

}  // namespace arex::sim
