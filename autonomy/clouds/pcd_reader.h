#pragma once

#include <cstdint>
#include <string_view>
#include <vector>

#include "clouds/cloud_fields.h"
#include "math/types.h"

namespace arex {

/// A cloud as its file has it.
struct RawCloud {
  std::vector<Vec3> points;      ///< m
  std::vector<float> intensity;  ///< one per point, or empty
};

/// One column of a PCD.
struct PcdField {
  cloud_fields::NumberType type = cloud_fields::NumberType::kF32;
  std::size_t count = 1;   ///< numbers of the column in a point
  std::size_t offset = 0;  ///< in a point, bytes
  std::size_t word = 0;    ///< in a line, words
};

struct PcdHeader {
  enum class Data : std::uint8_t { kAscii, kBinary, kCompressed };
  Data data = Data::kAscii;
  std::size_t points = 0;
  std::size_t stride = 0;  ///< bytes of a point
  std::size_t begin = 0;   ///< where the points begin in the file
  std::size_t lines = 0;   ///< of the header
  std::vector<PcdField> fields;
  // Which of them; x, y, z are there, intensity may be -1.
  int x = -1, y = -1, z = -1, intensity = -1;
};

/// Whether the first bytes are those of a PCD.
bool looks_like_pcd(std::string_view bytes);

/// Source of the format: pointclouds.org, "The PCD file format", version 0.7.
/// @param head the beginning of the file; @param size the file's size
/// @throws ConfigError without the file's name
PcdHeader parse_pcd_header(std::string_view head, std::uintmax_t size);
/// @param bytes the whole file
RawCloud read_pcd(const PcdHeader& header, std::string_view bytes);

}  // namespace arex
