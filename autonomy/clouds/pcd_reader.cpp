#include "clouds/pcd_reader.h"

#include <limits>
#include <string>

#include "config/config.h"
#include "config/text.h"

namespace arex {
namespace {

using cloud_fields::next_line;
using cloud_fields::next_word;
using cloud_fields::NumberType;
using cloud_fields::parse_count;
using cloud_fields::parse_number;
using cloud_fields::refuse;

constexpr std::size_t kMostFields = 4096;
constexpr std::size_t kMostPoints = 400'000'000;

std::vector<std::string_view> words_of(std::string_view line) {
  std::vector<std::string_view> words;
  for (std::string_view word = next_word(line); !word.empty(); word = next_word(line)) {
    words.push_back(word);
    if (words.size() > kMostFields) refuse("has more than 4096 fields, expected a point cloud");
  }
  return words;
}

NumberType type_of(std::string_view type, std::size_t size) {
  if (type == "F" && size == 4) return NumberType::kF32;
  if (type == "F" && size == 8) return NumberType::kF64;
  if (type == "I" || type == "U") {
    const bool sign = type == "I";
    if (size == 1) return sign ? NumberType::kI8 : NumberType::kU8;
    if (size == 2) return sign ? NumberType::kI16 : NumberType::kU16;
    if (size == 4) return sign ? NumberType::kI32 : NumberType::kU32;
    if (size == 8) return sign ? NumberType::kI64 : NumberType::kU64;
  }
  refuse("has a field of TYPE " + shortened(std::string(type), 20) + " and SIZE " +
         std::to_string(size) + ", expected F (4, 8), I or U (1, 2, 4, 8)");
}

/// The header's lines by their keys, until DATA.
struct Lines {
  std::vector<std::string_view> names, sizes, types, counts;
  std::string_view width, height, points, data;
};

/// The words of a line whose key is there for the first time: of two the reader cannot know which
/// is meant.
void take_words(std::string_view line, const char* key, std::vector<std::string_view>& words) {
  if (!words.empty()) refuse(std::string("has two lines ") + key + ", expected one");
  words = words_of(line);
}

/// The one word of such a line.
void take_word(std::string_view line, const char* key, std::string_view& word) {
  std::vector<std::string_view> words;
  if (!word.empty()) words.push_back(word);
  take_words(line, key, words);
  if (words.size() != 1) {
    refuse(std::string(key) + " has " + std::to_string(words.size()) + " entries, expected one");
  }
  word = words.front();
}

Lines read_lines(std::string_view head, PcdHeader& header) {
  Lines lines;
  std::string_view rest = head;
  while (!rest.empty()) {
    std::string_view line = next_line(rest);
    ++header.lines;
    if (line.starts_with('#')) continue;
    const std::string_view key = next_word(line);
    if (key == "FIELDS" || key == "COLUMNS") take_words(line, "FIELDS", lines.names);
    if (key == "SIZE") take_words(line, "SIZE", lines.sizes);
    if (key == "TYPE") take_words(line, "TYPE", lines.types);
    if (key == "COUNT") take_words(line, "COUNT", lines.counts);
    if (key == "WIDTH") take_word(line, "WIDTH", lines.width);
    if (key == "HEIGHT") take_word(line, "HEIGHT", lines.height);
    if (key == "POINTS") take_word(line, "POINTS", lines.points);
    if (key != "DATA") continue;
    take_word(line, "DATA", lines.data);
    header.begin = head.size() - rest.size();
    return lines;
  }
  refuse("has no DATA line in its first 64 KB, expected a PCD header");
}

void add_fields(const Lines& lines, PcdHeader& header) {
  const std::size_t n = lines.names.size();
  if (n == 0 || lines.sizes.size() != n || lines.types.size() != n ||
      (!lines.counts.empty() && lines.counts.size() != n)) {
    refuse("FIELDS, SIZE, TYPE and COUNT differ in length, expected one entry each per field");
  }
  std::size_t word = 0;
  for (std::size_t i = 0; i < n; ++i) {
    PcdField field;
    field.type = type_of(lines.types[i], parse_count(lines.sizes[i], "SIZE", 8));
    if (!lines.counts.empty()) field.count = parse_count(lines.counts[i], "COUNT", 65536);
    field.offset = header.stride;
    field.word = word;
    header.stride += field.count * cloud_fields::size_of(field.type);
    word += field.count;
    header.fields.push_back(field);
    if (field.count != 1) continue;
    const int at = static_cast<int>(i);
    if (lines.names[i] == "x") header.x = at;
    if (lines.names[i] == "y") header.y = at;
    if (lines.names[i] == "z") header.z = at;
    if (lines.names[i] == "intensity" || lines.names[i] == "i") header.intensity = at;
  }
  if (header.x < 0 || header.y < 0 || header.z < 0) refuse("has no fields x, y, z");
}

/// Numbers of the wanted fields, whichever way they lie.
template <class Number>
RawCloud gather(const PcdHeader& header, const Number& number) {
  RawCloud cloud;
  cloud.points.resize(header.points);
  if (header.intensity >= 0) cloud.intensity.resize(header.points);
  for (std::size_t i = 0; i < header.points; ++i) {
    cloud.points[i] = {number(i, header.x), number(i, header.y), number(i, header.z)};
    if (header.intensity >= 0) {
      cloud.intensity[i] = static_cast<float>(number(i, header.intensity));
    }
  }
  return cloud;
}

std::size_t words_of_point(const PcdHeader& header) {
  return header.fields.back().word + header.fields.back().count;
}

RawCloud read_ascii(const PcdHeader& header, std::string_view text) {
  RawCloud cloud;
  std::vector<double> values(header.points == 0 ? 0 : words_of_point(header));
  std::size_t number = header.lines;
  const auto at = [&](int field) {
    return values[header.fields[static_cast<std::size_t>(field)].word];
  };
  while (cloud.points.size() < header.points) {
    if (text.empty()) {
      refuse("ends after " + std::to_string(cloud.points.size()) + " of " +
             std::to_string(header.points) + " points");
    }
    std::string_view line = next_line(text);
    ++number;
    std::string_view rest = line;
    if (next_word(rest).empty()) continue;
    for (double& value : values) {
      const std::string_view word = next_word(line);
      const auto parsed = parse_number(word);
      if (!parsed) {
        refuse("line " + std::to_string(number) + ": '" + shortened(std::string(word), 40) +
               "' is no number");
      }
      value = *parsed;
    }
    if (!next_word(line).empty()) {
      refuse("line " + std::to_string(number) + " has more than " + std::to_string(values.size()) +
             " numbers, expected as many as FIELDS and COUNT announce");
    }
    cloud.points.emplace_back(at(header.x), at(header.y), at(header.z));
    if (header.intensity >= 0) cloud.intensity.push_back(static_cast<float>(at(header.intensity)));
  }
  cloud_fields::expect_padding(text, header.points);
  return cloud;
}

/// Source of the format: M. Lehmann, LibLZF. @return whether exactly `size` bytes came out
bool decompress_lzf(std::string_view in, std::size_t size, std::string& out) {
  out.clear();
  out.reserve(size);
  for (std::size_t i = 0; i < in.size();) {
    const auto control = static_cast<unsigned char>(in[i++]);
    if (control < 32) {  // a run of bytes
      const std::size_t length = control + 1U;
      if (i + length > in.size() || out.size() + length > size) return false;
      out.append(in, i, length);
      i += length;
      continue;
    }
    std::size_t length = control >> 5;  // what stood there before
    if (length == 7) {
      if (i >= in.size()) return false;
      length += static_cast<unsigned char>(in[i++]);
    }
    if (i >= in.size()) return false;
    const std::size_t back =
        (static_cast<std::size_t>(control & 31) << 8) + static_cast<unsigned char>(in[i++]) + 1;
    length += 2;
    if (back > out.size() || out.size() + length > size) return false;
    for (std::size_t k = 0; k < length; ++k) out.push_back(out[out.size() - back]);
  }
  return out.size() == size;
}

RawCloud read_compressed(const PcdHeader& header, std::string_view bytes) {
  constexpr std::size_t kMostGain = 264;  // bytes from one, in LZF
  if (bytes.size() < 8) refuse("ends before its compressed points");
  const auto word = [&](std::size_t at) {
    return static_cast<std::size_t>(
        cloud_fields::number(bytes.data() + at, NumberType::kU32, false));
  };
  const std::size_t packed = word(0), size = word(4);
  bytes.remove_prefix(8);
  if (packed > bytes.size()) refuse("ends within its compressed points");
  if (size != header.points * header.stride || size > kMostGain * packed) {
    refuse("its compressed points are " + std::to_string(size) + " bytes long, expected " +
           std::to_string(header.points * header.stride));
  }
  std::string out;
  if (!decompress_lzf(bytes.substr(0, packed), size, out))
    refuse("its compressed points are damaged");
  cloud_fields::expect_padding(bytes.substr(packed), header.points);
  // Field by field.
  return gather(header, [&](std::size_t i, int f) {
    const PcdField& field = header.fields[static_cast<std::size_t>(f)];
    const std::size_t one = cloud_fields::size_of(field.type);
    return cloud_fields::number(out.data() + field.offset * header.points + i * one, field.type,
                                false);
  });
}

}  // namespace

bool looks_like_pcd(std::string_view bytes) {
  return bytes.starts_with("# .PCD") || bytes.starts_with("VERSION") ||
         bytes.starts_with("FIELDS") || bytes.starts_with("#");
}

PcdHeader parse_pcd_header(std::string_view head, std::uintmax_t size) {
  PcdHeader header;
  const Lines lines = read_lines(head, header);
  add_fields(lines, header);
  if (lines.data == "ascii") {
    header.data = PcdHeader::Data::kAscii;
  } else if (lines.data == "binary") {
    header.data = PcdHeader::Data::kBinary;
  } else if (lines.data == "binary_compressed") {
    header.data = PcdHeader::Data::kCompressed;
  } else {
    refuse("DATA is " + shortened(std::string(lines.data), 40) +
           ", expected ascii, binary or binary_compressed");
  }
  const std::size_t width =
      lines.width.empty() ? 0 : parse_count(lines.width, "WIDTH", kMostPoints);
  const std::size_t height =
      lines.height.empty() ? 1 : parse_count(lines.height, "HEIGHT", kMostPoints);
  header.points =
      lines.points.empty() ? width * height : parse_count(lines.points, "POINTS", kMostPoints);
  // Beyond that the products with the points' sizes below would be too large for their type.
  if (header.points > kMostPoints) {
    refuse("WIDTH times HEIGHT is " + std::to_string(header.points) + ", expected at most " +
           std::to_string(kMostPoints));
  }
  if (!lines.width.empty() && width * height != header.points) {
    refuse("POINTS is " + std::to_string(header.points) + ", expected WIDTH times HEIGHT");
  }
  // A point takes at least so many bytes of the file.
  const std::uintmax_t rest = size - std::min<std::uintmax_t>(size, header.begin);
  const bool ascii = header.data == PcdHeader::Data::kAscii;
  const bool binary = header.data == PcdHeader::Data::kBinary;
  const std::size_t fewest = ascii ? 2 * words_of_point(header) - 1 : binary ? header.stride : 0;
  if (fewest * header.points > rest ||
      (!ascii && !binary && header.points * header.stride > 264 * rest)) {
    refuse("has " + std::to_string(rest) + " bytes of points, expected " +
           std::to_string(header.points) + " points");
  }
  return header;
}

RawCloud read_pcd(const PcdHeader& header, std::string_view bytes) {
  bytes.remove_prefix(std::min(header.begin, bytes.size()));
  if (header.data == PcdHeader::Data::kAscii) return read_ascii(header, bytes);
  if (header.data == PcdHeader::Data::kCompressed) return read_compressed(header, bytes);
  const std::size_t all = header.points * header.stride;
  if (bytes.size() < all) refuse("ends within its points");
  cloud_fields::expect_padding(bytes.substr(all), header.points);
  return gather(header, [&](std::size_t i, int f) {
    const PcdField& field = header.fields[static_cast<std::size_t>(f)];
    return cloud_fields::number(bytes.data() + i * header.stride + field.offset, field.type, false);
  });
}

}  // namespace arex
