#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cstdint>
#include <cstring>
#include <string>
#include <vector>

#include "math/random.h"
#include "math/types.h"

/// Point files made byte by byte, independent of what reads them.
namespace arex::test {

template <class T>
void append(std::string& bytes, T value, bool big_endian = false) {
  std::array<char, sizeof(T)> raw{};
  std::memcpy(raw.data(), &value, sizeof value);
  if (big_endian) std::reverse(raw.begin(), raw.end());
  bytes.append(raw.data(), raw.size());
}

inline std::string pcd_header(const std::string& fields, std::size_t count,
                              const std::string& data) {
  return "# .PCD v0.7 - Point Cloud Data file format\nVERSION 0.7\n" + fields + "WIDTH " +
         std::to_string(count) + "\nHEIGHT 1\nVIEWPOINT 0 0 0 1 0 0 0\nPOINTS " +
         std::to_string(count) + "\nDATA " + data + "\n";
}

inline const std::string kXyzi =
    "FIELDS x y z intensity\nSIZE 4 4 4 4\nTYPE F F F F\nCOUNT 1 1 1 1\n";

inline std::string pcd_ascii(const std::vector<Vec3f>& points) {
  std::string bytes = pcd_header(kXyzi, points.size(), "ascii");
  for (std::size_t i = 0; i < points.size(); ++i) {
    for (int k = 0; k < 3; ++k) bytes += std::to_string(points[i][k]) + " ";
    bytes += std::to_string(i % 256) + "\n";
  }
  return bytes;
}

inline std::string pcd_binary(const std::vector<Vec3f>& points) {
  std::string bytes = pcd_header(kXyzi, points.size(), "binary");
  for (std::size_t i = 0; i < points.size(); ++i) {
    for (int k = 0; k < 3; ++k) append(bytes, points[i][k]);
    append(bytes, static_cast<float>(i % 256));
  }
  return bytes;
}

/// Literal runs only: valid LZF that compresses nothing.
inline std::string lzf_literals(const std::string& raw) {
  std::string packed;
  for (std::size_t i = 0; i < raw.size(); i += 32) {
    const std::string run = raw.substr(i, 32);
    packed += static_cast<char>(run.size() - 1);
    packed += run;
  }
  return packed;
}

inline std::string pcd_compressed(const std::vector<Vec3f>& points) {
  std::string raw;
  for (int k = 0; k < 3; ++k) {
    for (const Vec3f& p : points) append(raw, p[k]);
  }
  for (std::size_t i = 0; i < points.size(); ++i) append(raw, static_cast<float>(i % 256));
  const std::string packed = lzf_literals(raw);
  std::string bytes = pcd_header(kXyzi, points.size(), "binary_compressed");
  append(bytes, static_cast<std::uint32_t>(packed.size()));
  append(bytes, static_cast<std::uint32_t>(raw.size()));
  return bytes + packed;
}

/// A PLY whose vertices stand behind a list and carry doubles, a colour and an intensity.
inline std::string ply(const std::vector<Vec3f>& points, const std::string& format) {
  std::string bytes = "ply\nformat " + format +
                      " 1.0\ncomment made by a test\nelement strip 2\nproperty list uchar int "
                      "indices\nelement vertex " +
                      std::to_string(points.size()) +
                      "\nproperty double x\nproperty double y\nproperty double z\nproperty uchar "
                      "red\nproperty float intensity\nelement face 1\nproperty list uchar int "
                      "vertex_indices\nend_header\n";
  const bool big = format == "binary_big_endian";
  if (format == "ascii") {
    bytes += "3 0 1 2\n0\n";
    for (std::size_t i = 0; i < points.size(); ++i) {
      for (int k = 0; k < 3; ++k) bytes += std::to_string(points[i][k]) + " ";
      bytes += "7 " + std::to_string(i % 256) + "\n";
    }
    return bytes + "3 0 1 2\n";
  }
  const auto list = [&](std::initializer_list<int> indices) {
    append(bytes, static_cast<std::uint8_t>(indices.size()));
    for (const int index : indices) append(bytes, static_cast<std::int32_t>(index), big);
  };
  list({0, 1, 2});
  list({});
  for (std::size_t i = 0; i < points.size(); ++i) {
    for (int k = 0; k < 3; ++k) append(bytes, static_cast<double>(points[i][k]), big);
    append(bytes, std::uint8_t{7});
    append(bytes, static_cast<float>(i % 256), big);
  }
  list({0, 1, 2});
  return bytes;
}

inline std::vector<Vec3f> some_points(std::size_t count) {
  RandomStream random(1, "cloud_bytes");
  std::vector<Vec3f> points;
  for (std::size_t i = 0; i < count; ++i) {
    // Multiples of 1/64 survive six decimals.
    points.push_back((random.normal3() * 640).array().round().cast<float>() / 64);
  }
  return points;
}

/// One of each kind.
inline std::vector<std::string> all_encodings(const std::vector<Vec3f>& points) {
  return {pcd_ascii(points),
          pcd_binary(points),
          pcd_compressed(points),
          ply(points, "ascii"),
          ply(points, "binary_little_endian"),
          ply(points, "binary_big_endian")};
}

}  // namespace arex::test
