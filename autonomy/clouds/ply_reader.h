#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "clouds/pcd_reader.h"

namespace arex {

struct PlyProperty {
  std::string name;
  cloud_fields::NumberType type = cloud_fields::NumberType::kF32;
  std::optional<cloud_fields::NumberType> length;  ///< of a list's length; nothing: a number
};

struct PlyElement {
  std::string name;
  std::size_t count = 0;
  std::vector<PlyProperty> properties;
};

struct PlyHeader {
  enum class Data : std::uint8_t { kAscii, kLittleEndian, kBigEndian };
  Data data = Data::kAscii;
  std::vector<PlyElement> elements;
  std::size_t begin = 0;  ///< where the elements begin in the file
  std::size_t lines = 0;  ///< of the header
};

/// Source of the format: G. Turk, The PLY polygon file format, 1994.
/// @param head the beginning of the file; @param size the file's size
/// @throws ConfigError without the file's name
PlyHeader parse_ply_header(std::string_view head, std::uintmax_t size);
/// @param bytes the whole file
RawCloud read_ply(const PlyHeader& header, std::string_view bytes);

}  // namespace arex
