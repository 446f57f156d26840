#include <algorithm>
#include <array>
#include <bit>
#include <charconv>
#include <cmath>
#include <cstring>
#include <fstream>
#include <map>
#include <sstream>
#include <stdexcept>
#include <string_view>
#include <utility>

#include "config/text.h"
#include "worlds/file_readers.h"
#include "worlds/world.h"

namespace arex::worlds {
namespace {

enum class Encoding : std::uint8_t { kAscii, kLittle, kBig };
enum class Type : std::uint8_t { kI8, kU8, kI16, kU16, kI32, kU32, kF32, kF64 };
constexpr std::array<std::size_t, 8> kSizes{1, 1, 2, 2, 4, 4, 4, 8};

struct Property {
  std::string name;
  Type type = Type::kF32;
  bool is_list = false;
  Type count_type = Type::kU8;
};

struct Element {
  std::string name;
  std::uint64_t count = 0;
  std::vector<Property> properties;

  [[nodiscard]] int index_of(std::initializer_list<std::string_view> names) const {
    for (std::size_t i = 0; i < properties.size(); ++i) {
      if (std::find(names.begin(), names.end(), properties[i].name) != names.end()) {
        return static_cast<int>(i);
      }
    }
    return -1;
  }
};

Type type_of(const std::string& name) {
  static const std::map<std::string, Type, std::less<>> kTypes{
      {"char", Type::kI8},    {"int8", Type::kI8},     {"uchar", Type::kU8},
      {"uint8", Type::kU8},   {"short", Type::kI16},   {"int16", Type::kI16},
      {"ushort", Type::kU16}, {"uint16", Type::kU16},  {"int", Type::kI32},
      {"int32", Type::kI32},  {"uint", Type::kU32},    {"uint32", Type::kU32},
      {"float", Type::kF32},  {"float32", Type::kF32}, {"double", Type::kF64},
      {"float64", Type::kF64}};
  const auto found = kTypes.find(name);
  if (found == kTypes.end()) throw std::runtime_error("has a property of unknown type " + name);
  return found->second;
}

/// The header, and where the data begins.
struct Header {
  Encoding encoding = Encoding::kAscii;
  std::vector<Element> elements;
  std::size_t data = 0;
};

void add_property(std::istringstream& words, Header& header) {
  if (header.elements.empty()) throw std::runtime_error("has a property before any element");
  Property property;
  std::string type;
  words >> type;
  if (type == "list") {
    std::string count_type;
    words >> count_type >> type;
    property.is_list = true;
    property.count_type = type_of(count_type);
  }
  property.type = type_of(type);
  words >> property.name;
  header.elements.back().properties.push_back(property);
}

Header read_header(std::string_view bytes) {
  if (!bytes.starts_with("ply")) throw std::runtime_error("is no PLY file");
  Header header;
  bool has_format = false;
  for (std::size_t at = 0; at < bytes.size();) {
    const std::size_t end = std::min(bytes.find('\n', at), bytes.size());
    std::string line(bytes.substr(at, end - at));
    at = end + 1;
    if (!line.empty() && line.back() == '\r') line.pop_back();
    std::istringstream words(line);
    std::string word;
    words >> word;
    if (word == "format") {
      std::string name;
      words >> name;
      has_format = true;
      if (name == "binary_little_endian") header.encoding = Encoding::kLittle;
      if (name == "binary_big_endian") header.encoding = Encoding::kBig;
    } else if (word == "element") {
      Element element;
      std::string count;
      words >> element.name >> count;
      const auto number = parse_uint64(count);
      if (!number) throw std::runtime_error("counts '" + shortened(count) + "' of an element");
      element.count = *number;
      header.elements.push_back(element);
    } else if (word == "property") {
      add_property(words, header);
    } else if (word == "end_header") {
      if (!has_format) throw std::runtime_error("does not name its format");
      header.data = at;
      return header;
    }
  }
  throw std::runtime_error("ends within its header");
}

/// The numbers of the data, one after the other.
class Numbers {
 public:
  Numbers(std::string_view data, Encoding encoding) : left_(data), encoding_(encoding) {}

  double next(Type type) { return encoding_ == Encoding::kAscii ? next_word() : next_binary(type); }
  [[nodiscard]] std::size_t bytes_left() const { return left_.size(); }

 private:
  [[noreturn]] static void end() { throw std::runtime_error("ends before its data does"); }

  double next_word() {
    const auto is_space = [](char c) { return c == ' ' || c == '\n' || c == '\r' || c == '\t'; };
    std::size_t at = 0;
    while (at < left_.size() && is_space(left_[at])) ++at;
    left_.remove_prefix(at);
    if (left_.empty()) end();
    double value = 0;
    const auto [stop, error] = std::from_chars(left_.data(), left_.data() + left_.size(), value);
    const auto length = static_cast<std::size_t>(stop - left_.data());
    if (error != std::errc() || (length < left_.size() && !is_space(left_[length]))) {
      throw std::runtime_error("has '" +
                               shortened(left_.substr(0, left_.find_first_of(" \r\n\t")), 20) +
                               "' where a number is expected");
    }
    left_.remove_prefix(length);
    return value;
  }

  template <class T>
  double take() {
    std::array<char, sizeof(T)> bytes;
    if (left_.size() < sizeof(T)) end();
    std::memcpy(bytes.data(), left_.data(), sizeof(T));
    left_.remove_prefix(sizeof(T));
    if (encoding_ == Encoding::kBig) std::reverse(bytes.begin(), bytes.end());
    return static_cast<double>(std::bit_cast<T>(bytes));
  }

  double next_binary(Type type) {
    switch (type) {
      case Type::kI8:
        return take<std::int8_t>();
      case Type::kU8:
        return take<std::uint8_t>();
      case Type::kI16:
        return take<std::int16_t>();
      case Type::kU16:
        return take<std::uint16_t>();
      case Type::kI32:
        return take<std::int32_t>();
      case Type::kU32:
        return take<std::uint32_t>();
      case Type::kF32:
        return take<float>();
      case Type::kF64:
        break;
    }
    return take<double>();
  }

  std::string_view left_;
  Encoding encoding_;
};

std::size_t length_of_list(Numbers& numbers, const Property& property) {
  const double count = numbers.next(property.count_type);
  constexpr double kLongest = 1e5;
  if (!(count >= 0 && count <= kLongest)) throw std::runtime_error("has a list of absurd length");
  return static_cast<std::size_t>(count);
}

/// An element of ASCII takes two bytes for each property at least.
void expect_room(const Element& element, const Header& header, std::size_t bytes_left) {
  std::size_t least = 0;
  for (const Property& property : element.properties) {
    const Type type = property.is_list ? property.count_type : property.type;
    least += header.encoding == Encoding::kAscii ? 2 : kSizes[static_cast<std::size_t>(type)];
  }
  if (least == 0) {
    if (element.count > 0) throw std::runtime_error("has an element without properties");
    return;
  }
  if (element.count > bytes_left / least + 1) {
    throw std::runtime_error("ends before its data does");
  }
}

void skip(const Element& element, Numbers& numbers) {
  for (std::uint64_t i = 0; i < element.count; ++i) {
    for (const Property& property : element.properties) {
      const std::size_t count = property.is_list ? length_of_list(numbers, property) : 1;
      for (std::size_t k = 0; k < count; ++k) numbers.next(property.type);
    }
  }
}

void read_vertices(const Element& element, Numbers& numbers, std::vector<Vec3>& out) {
  const std::array<int, 3> axes{element.index_of({"x"}), element.index_of({"y"}),
                                element.index_of({"z"})};
  if (std::min({axes[0], axes[1], axes[2]}) < 0) {
    throw std::runtime_error("has vertices without x, y and z");
  }
  out.reserve(element.count);
  for (std::uint64_t i = 0; i < element.count; ++i) {
    Vec3 p = Vec3::Zero();
    for (std::size_t k = 0; k < element.properties.size(); ++k) {
      const Property& property = element.properties[k];
      const std::size_t count = property.is_list ? length_of_list(numbers, property) : 1;
      double value = 0;
      for (std::size_t n = 0; n < count; ++n) value = numbers.next(property.type);
      for (std::size_t axis = 0; axis < 3; ++axis) {
        if (axes[axis] == static_cast<int>(k)) p[static_cast<Eigen::Index>(axis)] = value;
      }
    }
    out.push_back(p);
  }
}

/// What a face of our own export says of itself; not a number: it does not.
struct FaceLabel {
  double object = std::nan("");
  double surface_class = std::nan("");
  double reflectivity = std::nan("");
};

class Faces {
 public:
  explicit Faces(FileScene& scene) : scene_(scene) {}

  void read(const Element& element, Numbers& numbers) {
    const int corners = element.index_of({"vertex_indices", "vertex_index"});
    if (corners < 0) throw std::runtime_error("has faces without vertex_indices");
    const int object = element.index_of({"object"});
    const int surface_class = element.index_of({"class"});
    const int reflectivity = element.index_of({"reflectivity"});
    for (std::uint64_t i = 0; i < element.count; ++i) {
      FaceLabel label;
      for (std::size_t k = 0; k < element.properties.size(); ++k) {
        const Property& property = element.properties[k];
        const auto at = static_cast<int>(k);
        if (property.is_list) {
          const std::size_t count = length_of_list(numbers, property);
          if (at == corners) face_.clear();
          for (std::size_t n = 0; n < count; ++n) {
            const double value = numbers.next(property.type);
            if (at == corners) face_.push_back(value);
          }
          continue;
        }
        const double value = numbers.next(property.type);
        if (at == object) label.object = value;
        if (at == surface_class) label.surface_class = value;
        if (at == reflectivity) label.reflectivity = value;
      }
      add(group_of(label));
    }
  }

 private:
  std::uint32_t group_of(const FaceLabel& label) {
    const bool own = label.surface_class >= 0 &&
                     label.surface_class < static_cast<double>(kSurfaceClassNames.size());
    const std::array<double, 3> key{
        std::isnan(label.object) ? -1 : label.object, own ? label.surface_class : -1,
        own && label.reflectivity >= 0 && label.reflectivity <= 1 ? label.reflectivity : -1};
    const auto [place, fresh] =
        group_of_label_.try_emplace(key, static_cast<std::uint32_t>(scene_.groups.size()));
    if (fresh) {
      FileGroup group;
      group.shape = "mesh";
      group.name = "mesh";
      if (own) {
        group.surface_class = static_cast<int>(label.surface_class);
        group.name = kSurfaceClassNames[static_cast<std::size_t>(group.surface_class)];
        group.reflectivity = key[2];
      }
      scene_.groups.push_back(std::move(group));
    }
    return place->second;
  }

  void add(std::uint32_t group) {
    const auto most = static_cast<double>(scene_.vertices.size());
    for (const double corner : face_) {
      if (!(corner >= 0 && corner < most))
        throw std::runtime_error("has a face of unknown vertices");
    }
    for (std::size_t k = 1; k + 1 < face_.size(); ++k) {
      scene_.triangles.push_back({static_cast<std::uint32_t>(face_[0]),
                                  static_cast<std::uint32_t>(face_[k]),
                                  static_cast<std::uint32_t>(face_[k + 1])});
      scene_.group_of_triangle.push_back(group);
    }
  }

  FileScene& scene_;
  std::vector<double> face_;
  std::map<std::array<double, 3>, std::uint32_t> group_of_label_;
};

}  // namespace

std::string read_bytes(const std::filesystem::path& file) {
  std::ifstream stream(file, std::ios::binary);
  if (!stream) throw std::runtime_error("cannot be opened");
  stream.seekg(0, std::ios::end);
  const auto size = stream.tellg();
  if (size <= 0) throw std::runtime_error("is empty");
  std::string bytes(static_cast<std::size_t>(size), '\0');
  stream.seekg(0);
  stream.read(bytes.data(), size);
  if (!stream) throw std::runtime_error("cannot be read");
  return bytes;
}

FileScene read_ply(const std::filesystem::path& file) {
  const std::string bytes = read_bytes(file);
  const Header header = read_header(bytes);
  Numbers numbers(std::string_view(bytes).substr(std::min(header.data, bytes.size())),
                  header.encoding);
  FileScene scene;
  bool has_vertices = false;
  for (const Element& element : header.elements) {
    expect_room(element, header, numbers.bytes_left());
    if (element.name == "vertex" && !has_vertices) {
      read_vertices(element, numbers, scene.vertices);
      has_vertices = true;
    } else if (element.name == "face" && element.count > 0) {
      if (!has_vertices) throw std::runtime_error("has faces before its vertices");
      Faces(scene).read(element, numbers);
    } else {
      if (element.name == "tristrips") scene.notes.emplace_back("triangle strips left out");
      skip(element, numbers);
    }
  }
  if (scene.triangles.empty()) {
    scene.points = std::exchange(scene.vertices, {});
    scene.groups.push_back({"cloud", "", "voxels"});
  }
  return scene;
}

}  // namespace arex::worlds
