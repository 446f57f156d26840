#include <array>
#include <charconv>
#include <cmath>
#include <cstring>
#include <sstream>
#include <stdexcept>
#include <string_view>

#include "config/text.h"
#include "worlds/file_readers.h"

namespace arex::worlds {
namespace {

struct Field {
  std::string name;
  std::size_t size = 4;
  char type = 'F';
  std::size_t count = 1;
  std::size_t offset = 0;  ///< in a point, bytes
};

struct Header {
  std::vector<Field> fields;
  std::uint64_t points = 0;
  std::string data;  ///< ascii, binary or binary_compressed
  std::size_t begin = 0;
  std::size_t point_size = 0;

  [[nodiscard]] const Field& field(std::string_view name) const {
    for (const Field& field : fields) {
      if (field.name != name) continue;
      const bool known = field.count == 1 && ((field.type == 'F' && field.size == 4) ||
                                              (field.type == 'F' && field.size == 8));
      if (!known) throw std::runtime_error("has a coordinate that is no float or double");
      return field;
    }
    throw std::runtime_error("has points without " + std::string(name));
  }
};

std::uint64_t number_of(const std::string& word) {
  const auto value = parse_uint64(word);
  if (!value) throw std::runtime_error("has '" + shortened(word, 20) + "' for a number");
  return *value;
}

/// One value for each field of a header's line.
void each_field(std::istringstream& words, std::vector<Field>& fields,
                void (*set)(Field&, const std::string&)) {
  for (Field& field : fields) {
    std::string word;
    words >> word;
    set(field, word);
  }
}

void place_fields(Header& header) {
  for (Field& field : header.fields) {
    const bool fair = (field.size == 1 || field.size == 2 || field.size == 4 || field.size == 8) &&
                      field.count >= 1 && field.count <= 10'000;
    if (!fair) throw std::runtime_error("has a field of absurd size");
    field.offset = header.point_size;
    header.point_size += field.size * field.count;
  }
}

Header read_header(std::string_view bytes) {
  Header header;
  std::uint64_t width = 0, height = 1;
  bool has_points = false;
  for (std::size_t at = 0; at < bytes.size();) {
    const std::size_t end = std::min(bytes.find('\n', at), bytes.size());
    std::string line(bytes.substr(at, end - at));
    at = end + 1;
    if (!line.empty() && line.back() == '\r') line.pop_back();
    std::istringstream words(line);
    std::string key, word;
    words >> key;
    if (key == "FIELDS") {
      while (words >> word) header.fields.push_back({word});
    } else if (key == "SIZE") {
      each_field(words, header.fields,
                 [](Field& f, const std::string& w) { f.size = number_of(w); });
    } else if (key == "TYPE") {
      each_field(words, header.fields,
                 [](Field& f, const std::string& w) { f.type = w.empty() ? '?' : w[0]; });
    } else if (key == "COUNT") {
      each_field(words, header.fields,
                 [](Field& f, const std::string& w) { f.count = number_of(w); });
    } else if (key == "WIDTH") {
      words >> word;
      width = number_of(word);
    } else if (key == "HEIGHT") {
      words >> word;
      height = number_of(word);
    } else if (key == "POINTS") {
      words >> word;
      header.points = number_of(word);
      has_points = true;
    } else if (key == "DATA") {
      words >> header.data;
      header.begin = std::min(at, bytes.size());
      if (!has_points) header.points = width * height;
      place_fields(header);
      return header;
    } else if (!key.empty() && key[0] != '#' && key != "VERSION" && key != "VIEWPOINT") {
      throw std::runtime_error("is no PCD file");
    }
  }
  throw std::runtime_error("is no PCD file, or ends within its header");
}

/// Marc Lehmann's LZF, as PCL uses it. @throws std::runtime_error for what is none.
std::string decompress_lzf(std::string_view in, std::size_t size) {
  const auto fail = [] { throw std::runtime_error("has compressed data that is damaged"); };
  std::string out;
  out.reserve(size);
  for (std::size_t at = 0; at < in.size();) {
    const auto control = static_cast<unsigned char>(in[at++]);
    if (control < 32) {  // literals
      const std::size_t length = control + 1U;
      if (at + length > in.size() || out.size() + length > size) fail();
      out.append(in.substr(at, length));
      at += length;
      continue;
    }
    std::size_t length = control >> 5;
    if (length == 7) {
      if (at >= in.size()) fail();
      length += static_cast<unsigned char>(in[at++]);
    }
    if (at >= in.size()) fail();
    const std::size_t back = ((control & 0x1FU) << 8) + static_cast<unsigned char>(in[at++]) + 1;
    length += 2;
    if (back > out.size() || out.size() + length > size) fail();
    for (std::size_t i = 0; i < length; ++i) out.push_back(out[out.size() - back]);
  }
  if (out.size() != size) fail();
  return out;
}

double value_at(std::string_view data, std::size_t at, const Field& field) {
  if (field.size == 8) {
    double value = 0;
    std::memcpy(&value, data.data() + at, 8);
    return value;
  }
  float value = 0;
  std::memcpy(&value, data.data() + at, 4);
  return static_cast<double>(value);
}

std::vector<Vec3> binary_points(const Header& header, std::string_view data, bool by_field) {
  const std::array<const Field*, 3> axes{&header.field("x"), &header.field("y"),
                                         &header.field("z")};
  if (header.points > data.size() / header.point_size) {
    throw std::runtime_error("ends before its data does");
  }
  std::vector<Vec3> points(header.points);
  for (std::size_t i = 0; i < points.size(); ++i) {
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const Field& field = *axes[axis];
      const std::size_t at = by_field ? field.offset * points.size() + i * field.size
                                      : i * header.point_size + field.offset;
      points[i][static_cast<Eigen::Index>(axis)] = value_at(data, at, field);
    }
  }
  return points;
}

std::vector<Vec3> ascii_points(const Header& header, std::string_view data) {
  const std::array<std::string_view, 3> names{"x", "y", "z"};
  for (const std::string_view name : names) static_cast<void>(header.field(name));
  std::vector<Vec3> points;
  std::istringstream lines{std::string(data)};
  std::string line;
  while (points.size() < header.points && std::getline(lines, line)) {
    std::istringstream words(line);
    std::string word;
    Vec3 p = Vec3::Zero();
    bool any = false;
    for (const Field& field : header.fields) {
      for (std::size_t k = 0; k < field.count && words >> word; ++k) {
        any = true;
        for (std::size_t axis = 0; axis < 3; ++axis) {
          if (field.name != names[axis]) continue;
          const auto value = parse_double(word);
          p[static_cast<Eigen::Index>(axis)] = value ? *value : std::nan("");
        }
      }
    }
    if (any) points.push_back(p);
  }
  if (points.size() < header.points) throw std::runtime_error("ends before its data does");
  return points;
}

std::vector<Vec3> read_points(const Header& header, std::string_view data) {
  if (header.data == "ascii") return ascii_points(header, data);
  if (header.data == "binary") return binary_points(header, data, false);
  if (header.data != "binary_compressed") {
    throw std::runtime_error("has data of kind '" + shortened(header.data, 20) +
                             "', expected ascii, binary or binary_compressed");
  }
  std::array<std::uint32_t, 2> sizes{};
  if (data.size() < sizeof(sizes)) throw std::runtime_error("ends before its data does");
  std::memcpy(sizes.data(), data.data(), sizeof(sizes));
  data.remove_prefix(sizeof(sizes));
  // LZF makes at most 264 bytes of 3.
  if (sizes[0] > data.size() || sizes[1] / 88 > sizes[0]) {
    throw std::runtime_error("ends before its data does");
  }
  return binary_points(header, decompress_lzf(data.substr(0, sizes[0]), sizes[1]), true);
}

}  // namespace

FileScene read_pcd(const std::filesystem::path& file) {
  const std::string bytes = read_bytes(file);
  const Header header = read_header(bytes);
  FileScene scene;
  scene.points = read_points(header, std::string_view(bytes).substr(header.begin));
  const std::size_t before = scene.points.size();
  std::erase_if(scene.points, [](const Vec3& p) { return !p.allFinite(); });
  if (scene.points.size() < before) {
    scene.notes.push_back(std::to_string(before - scene.points.size()) +
                          " points that are not finite left out");
  }
  scene.groups.push_back({"cloud", "", "voxels"});
  return scene;
}

}  // namespace arex::worlds
