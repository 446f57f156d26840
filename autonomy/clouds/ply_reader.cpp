#include "clouds/ply_reader.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <utility>

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
using cloud_fields::size_of;

constexpr std::size_t kMostEntries = 4096;
constexpr std::size_t kMostCount = 400'000'000;

NumberType type_of(std::string_view word) {
  constexpr std::array<std::pair<std::string_view, NumberType>, 16> kNames{{
      {"char", NumberType::kI8},
      {"int8", NumberType::kI8},
      {"uchar", NumberType::kU8},
      {"uint8", NumberType::kU8},
      {"short", NumberType::kI16},
      {"int16", NumberType::kI16},
      {"ushort", NumberType::kU16},
      {"uint16", NumberType::kU16},
      {"int", NumberType::kI32},
      {"int32", NumberType::kI32},
      {"uint", NumberType::kU32},
      {"uint32", NumberType::kU32},
      {"float", NumberType::kF32},
      {"float32", NumberType::kF32},
      {"double", NumberType::kF64},
      {"float64", NumberType::kF64},
  }};
  for (const auto& [name, type] : kNames) {
    if (word == name) return type;
  }
  refuse("has a property of type '" + shortened(std::string(word), 40) + "', expected a PLY type");
}

PlyElement parse_element(std::string_view line) {
  PlyElement element;
  element.name = std::string(next_word(line));
  element.count =
      parse_count(next_word(line), "element " + shortened(element.name, 40), kMostCount);
  if (const std::string_view more = next_word(line); !more.empty()) {
    refuse("element " + shortened(element.name, 40) + " has '" + shortened(std::string(more), 40) +
           "' behind its number, expected a line's end");
  }
  return element;
}

PlyProperty parse_property(std::string_view line) {
  PlyProperty property;
  std::string_view type = next_word(line);
  if (type == "list") {
    property.length = type_of(next_word(line));
    type = next_word(line);
  }
  property.type = type_of(type);
  property.name = std::string(next_word(line));
  return property;
}

/// Reads the numbers of elements one after the other from binary data, never beyond its end.
class BinarySource {
 public:
  BinarySource(std::string_view bytes, bool swapped) : bytes_(bytes), swapped_(swapped) {}
  double next(NumberType type) {
    const std::size_t size = size_of(type);
    if (bytes_.size() < size) refuse("ends within its elements");
    const double value = cloud_fields::number(bytes_.data(), type, swapped_);
    bytes_.remove_prefix(size);
    return value;
  }
  void skip(std::size_t bytes) {
    if (bytes_.size() < bytes) refuse("ends within its elements");
    bytes_.remove_prefix(bytes);
  }
  void skip(NumberType type, std::size_t count) { skip(size_of(type) * count); }
  [[nodiscard]] std::string_view rest() const { return bytes_; }

 private:
  std::string_view bytes_;
  bool swapped_;
};

/// The same from text: words, whatever the lines.
class TextSource {
 public:
  TextSource(std::string_view text, std::size_t line) : text_(text), number_(line) {}
  double next(NumberType) {
    std::string_view word = next_word(line_);
    while (word.empty()) {
      if (text_.empty()) refuse("ends within its elements");
      line_ = next_line(text_);
      ++number_;
      word = next_word(line_);
    }
    const auto value = parse_number(word);
    if (!value) {
      refuse("line " + std::to_string(number_) + ": '" + shortened(std::string(word), 40) +
             "' is no number");
    }
    return *value;
  }
  void skip(NumberType type, std::size_t count) {
    for (std::size_t i = 0; i < count; ++i) next(type);
  }
  /// What no line has been begun of; words left in the last line are one too many.
  [[nodiscard]] std::string_view rest() const {
    std::string_view line = line_;
    const std::string_view word = next_word(line);
    return word.empty() ? text_ : word;
  }

 private:
  std::string_view text_, line_;
  std::size_t number_;
};

template <class Source>
std::size_t list_length(Source& source, NumberType type) {
  const double length = source.next(type);
  if (!(length >= 0) || length > static_cast<double>(kMostCount) || length != std::floor(length)) {
    refuse("has a list of no sensible length");
  }
  return static_cast<std::size_t>(length);
}

template <class Source>
RawCloud read_elements(const PlyHeader& header, Source& source) {
  RawCloud cloud;
  for (const PlyElement& element : header.elements) {
    const bool vertices = element.name == "vertex";
    const auto property = [&](std::string_view name) {
      const auto found = std::find_if(element.properties.begin(), element.properties.end(),
                                      [&](const PlyProperty& p) { return p.name == name; });
      return found - element.properties.begin();
    };
    const auto x = property("x"), y = property("y"), z = property("z");
    auto intensity = property("intensity");
    const auto none = static_cast<std::ptrdiff_t>(element.properties.size());
    for (const char* name : {"scalar_Intensity", "scalar_intensity", "Intensity"}) {
      if (intensity == none) intensity = property(name);
    }
    std::vector<double> values(element.properties.size(), 0);
    for (std::size_t i = 0; i < element.count; ++i) {
      for (std::size_t k = 0; k < element.properties.size(); ++k) {
        const PlyProperty& p = element.properties[k];
        if (p.length) {
          source.skip(p.type, list_length(source, *p.length));
        } else {
          values[k] = source.next(p.type);
        }
      }
      if (!vertices) continue;
      cloud.points.emplace_back(values[static_cast<std::size_t>(x)],
                                values[static_cast<std::size_t>(y)],
                                values[static_cast<std::size_t>(z)]);
      if (intensity == none) continue;
      cloud.intensity.push_back(static_cast<float>(values[static_cast<std::size_t>(intensity)]));
    }
    if (!vertices) continue;
    // Other elements behind them are not asked for.
    if (&element == &header.elements.back())
      cloud_fields::expect_padding(source.rest(), element.count);
    return cloud;
  }
  return cloud;
}

void expect_vertices(const PlyHeader& header) {
  const auto vertices = std::find_if(header.elements.begin(), header.elements.end(),
                                     [](const PlyElement& e) { return e.name == "vertex"; });
  if (vertices == header.elements.end()) refuse("has no element vertex");
  if (std::any_of(vertices + 1, header.elements.end(),
                  [](const PlyElement& e) { return e.name == "vertex"; })) {
    refuse("has two elements vertex, expected one");
  }
  for (const char* name : {"x", "y", "z"}) {
    const bool there =
        std::any_of(vertices->properties.begin(), vertices->properties.end(),
                    [&](const PlyProperty& p) { return p.name == name && !p.length; });
    if (!there) refuse("its vertices have no x, y, z");
  }
}

}  // namespace

PlyHeader parse_ply_header(std::string_view head, std::uintmax_t size) {
  PlyHeader header;
  std::string_view rest = head;
  bool ended = false, format = false;
  std::size_t entries = 0;
  while (!rest.empty() && !ended) {
    std::string_view line = next_line(rest);
    ++header.lines;
    const std::string_view key = next_word(line);
    if (++entries > kMostEntries) refuse("has more than 4096 header lines");
    if (key == "format") {
      const std::string_view word = next_word(line);
      format = true;
      if (word == "binary_little_endian") {
        header.data = PlyHeader::Data::kLittleEndian;
      } else if (word == "binary_big_endian") {
        header.data = PlyHeader::Data::kBigEndian;
      } else if (word != "ascii") {
        refuse("format is " + shortened(std::string(word), 40) +
               ", expected ascii, binary_little_endian or binary_big_endian");
      }
    } else if (key == "element") {
      header.elements.push_back(parse_element(line));
    } else if (key == "property") {
      if (header.elements.empty()) refuse("has a property before any element");
      header.elements.back().properties.push_back(parse_property(line));
    } else {
      ended = key == "end_header";
    }
  }
  if (!ended || !format) refuse("has no format or no end_header in its first 64 KB");
  header.begin = head.size() - rest.size();
  expect_vertices(header);
  // Every number takes at least so many bytes of the file.
  std::uintmax_t left = size - std::min<std::uintmax_t>(size, header.begin);
  for (const PlyElement& element : header.elements) {
    std::uintmax_t least = 0;
    for (const PlyProperty& property : element.properties) {
      least += header.data == PlyHeader::Data::kAscii ? 2
               : property.length                      ? size_of(*property.length)
                                                      : size_of(property.type);
    }
    // The last word of a text needs no blank behind it.
    if (least * element.count > left + 1) {
      refuse("has " + std::to_string(left) + " bytes left for " + std::to_string(element.count) +
             " elements '" + shortened(element.name, 40) + "', expected more");
    }
    left -= std::min(left, least * element.count);
    if (element.name == "vertex") break;
    if (element.properties.empty() && element.count > 0) refuse("has elements without properties");
  }
  return header;
}

RawCloud read_ply(const PlyHeader& header, std::string_view bytes) {
  bytes.remove_prefix(std::min(header.begin, bytes.size()));
  if (header.data == PlyHeader::Data::kAscii) {
    TextSource source(bytes, header.lines);
    return read_elements(header, source);
  }
  const bool big = header.data == PlyHeader::Data::kBigEndian;
  BinarySource source(bytes, big != (std::endian::native == std::endian::big));
  return read_elements(header, source);
}

}  // namespace arex
