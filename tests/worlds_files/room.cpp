#include "room.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <bit>
#include <cstring>
#include <fstream>
#include <sstream>

#include "config/config.h"

namespace arex::worlds::test {
namespace {

void add_quad(Part& part, const Vec3& a, const Vec3& b, const Vec3& c, const Vec3& d) {
  const auto first = static_cast<std::uint32_t>(part.vertices.size());
  part.vertices.insert(part.vertices.end(), {a, b, c, d});
  part.triangles.push_back({first, first + 1, first + 2});
  part.triangles.push_back({first, first + 2, first + 3});
}

template <class T>
void put(std::string& out, T value, bool big = false) {
  auto bytes = std::bit_cast<std::array<char, sizeof(T)>>(value);
  if (big) std::reverse(bytes.begin(), bytes.end());
  out.append(bytes.data(), bytes.size());
}

std::string text_of(const Vec3& v) {
  std::ostringstream text;
  text.precision(9);
  text << v.x() << ' ' << v.y() << ' ' << v.z();
  return text.str();
}

std::size_t count_of(const std::vector<Part>& parts) {
  std::size_t count = 0;
  for (const Part& part : parts) count += part.triangles.size();
  return count;
}

std::string base64(const std::string& bytes) {
  static constexpr char kDigits[] =
      "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string out;
  for (std::size_t i = 0; i < bytes.size(); i += 3) {
    std::uint32_t word = 0;
    for (std::size_t k = 0; k < 3; ++k) {
      word = word << 8 | (i + k < bytes.size() ? static_cast<unsigned char>(bytes[i + k]) : 0U);
    }
    for (int k = 3; k >= 0; --k) {
      const bool real = i + static_cast<std::size_t>(3 - k) <= bytes.size();
      out += real ? kDigits[word >> (6 * k) & 63] : '=';
    }
  }
  return out;
}

using Sides = std::array<double, 6>;  // centroid, area, two of the normal's

std::vector<Sides> fingerprints(const std::vector<std::array<Vec3, 3>>& triangles) {
  std::vector<Sides> out;
  for (const auto& v : triangles) {
    const Vec3 middle = (v[0] + v[1] + v[2]) / 3;
    const Vec3 area = 0.5 * (v[1] - v[0]).cross(v[2] - v[0]);
    out.push_back(
        {middle.x(), middle.y(), middle.z(), area.norm(), std::abs(area.x()), std::abs(area.z())});
  }
  return out;
}

}  // namespace

std::vector<Part> room() {
  Part floor{"Floor", "Concrete", {}, {}};
  add_quad(floor, {-2, -2, 0}, {4, -2, 0}, {4, 3, 0}, {-2, 3, 0});
  Part walls{"OuterWalls", "Plaster", {}, {}};
  add_quad(walls, {-2, -2, 0}, {4, -2, 0}, {4, -2, 3}, {-2, -2, 3});
  add_quad(walls, {4, -2, 0}, {4, 3, 0}, {4, 3, 3}, {4, -2, 3});
  add_quad(walls, {4, 3, 0}, {-2, 3, 0}, {-2, 3, 3}, {4, 3, 3});
  add_quad(walls, {-2, 3, 0}, {-2, -2, 0}, {-2, -2, 3}, {-2, 3, 3});
  Part pillar{"Pillar_01", "Steel", {}, {}};
  const double x = 2.5, y = 1.75, h = 0.15;
  add_quad(pillar, {x - h, y - h, 0}, {x + h, y - h, 0}, {x + h, y - h, 2}, {x - h, y - h, 2});
  add_quad(pillar, {x + h, y - h, 0}, {x + h, y + h, 0}, {x + h, y + h, 2}, {x + h, y - h, 2});
  add_quad(pillar, {x + h, y + h, 0}, {x - h, y + h, 0}, {x - h, y + h, 2}, {x + h, y + h, 2});
  add_quad(pillar, {x - h, y + h, 0}, {x - h, y - h, 0}, {x - h, y - h, 2}, {x - h, y + h, 2});
  return {floor, walls, pillar};
}

std::vector<Part> mapped(std::vector<Part> parts, const std::function<Vec3(const Vec3&)>& f) {
  for (Part& part : parts) {
    for (Vec3& v : part.vertices) v = f(v);
  }
  return parts;
}

std::string stl_ascii(const std::vector<Part>& parts) {
  std::string out = "solid room\n";
  for (const Part& part : parts) {
    for (const auto& triangle : part.triangles) {
      out += "facet normal 0 0 0\nouter loop\n";
      for (const std::uint32_t corner : triangle) {
        out += "vertex " + text_of(part.vertices[corner]) + "\n";
      }
      out += "endloop\nendfacet\n";
    }
  }
  return out + "endsolid room\n";
}

std::string stl_binary(const std::vector<Part>& parts) {
  std::string out(80, ' ');
  put(out, static_cast<std::uint32_t>(count_of(parts)));
  for (const Part& part : parts) {
    for (const auto& triangle : part.triangles) {
      for (int i = 0; i < 3; ++i) put(out, 0.0F);
      for (const std::uint32_t corner : triangle) {
        for (Eigen::Index i = 0; i < 3; ++i) put(out, static_cast<float>(part.vertices[corner][i]));
      }
      put(out, std::uint16_t{0});
    }
  }
  return out;
}

std::string obj(const std::vector<Part>& parts) {
  std::string out = "mtllib absent.mtl\n";
  std::uint32_t first = 1;
  for (const Part& part : parts) {
    out += "o " + part.name + "\nusemtl " + part.material + "\n";
    for (const Vec3& v : part.vertices) out += "v " + text_of(v) + "\n";
    // Quads, as most programs write them.
    for (std::uint32_t i = 0; i + 3 < part.vertices.size(); i += 4) {
      out += "f";
      for (std::uint32_t k = 0; k < 4; ++k) out += " " + std::to_string(first + i + k);
      out += "\n";
    }
    first += static_cast<std::uint32_t>(part.vertices.size());
  }
  return out;
}

std::string ply(const std::vector<Part>& parts, PlyKind kind) {
  std::size_t vertices = 0;
  for (const Part& part : parts) vertices += part.vertices.size();
  const char* format = kind == PlyKind::kAscii    ? "ascii"
                       : kind == PlyKind::kLittle ? "binary_little_endian"
                                                  : "binary_big_endian";
  std::string out = std::string("ply\nformat ") + format + " 1.0\ncomment of a test\n";
  out += "element vertex " + std::to_string(vertices) +
         "\nproperty uchar red\nproperty double x\nproperty float y\nproperty float z\n";
  out += "element face " + std::to_string(vertices / 4) +
         "\nproperty list uchar int vertex_indices\nproperty short flags\nend_header\n";
  const bool big = kind == PlyKind::kBig;
  for (const Part& part : parts) {
    for (const Vec3& v : part.vertices) {
      if (kind == PlyKind::kAscii) {
        out += "7 " + text_of(v) + "\n";
        continue;
      }
      put(out, std::uint8_t{7});
      put(out, v.x(), big);
      put(out, static_cast<float>(v.y()), big);
      put(out, static_cast<float>(v.z()), big);
    }
  }
  for (std::int32_t i = 0; i + 3 < static_cast<std::int32_t>(vertices); i += 4) {
    if (kind == PlyKind::kAscii) {
      out += "4";
      for (std::int32_t k = 0; k < 4; ++k) out += " " + std::to_string(i + k);
      out += " -3\n";
      continue;
    }
    put(out, std::uint8_t{4});
    for (std::int32_t k = 0; k < 4; ++k) put(out, i + k, big);
    put(out, std::int16_t{-3}, big);
  }
  return out;
}

std::string collada(const std::vector<Part>& parts, const std::string& up_axis, double unit_m,
                    const Eigen::Matrix4d& node) {
  std::ostringstream out;
  out.precision(12);
  out << "<?xml version=\"1.0\"?>\n<COLLADA "
         "xmlns=\"http://www.collada.org/2005/11/COLLADASchema\" version=\"1.4.1\">\n<asset><unit "
         "name=\"u\" meter=\""
      << unit_m << "\"/><up_axis>" << up_axis << "</up_axis></asset>\n<library_materials>";
  for (const Part& part : parts) {
    out << "<material id=\"" << part.material << "\" name=\"" << part.material << "\"/>";
  }
  out << "</library_materials>\n<library_geometries>\n";
  for (const Part& part : parts) {
    const std::string id = "g" + part.name;
    out << "<geometry id=\"" << id << "\"><mesh><source id=\"" << id << "p\"><float_array id=\""
        << id << "a\" count=\"" << 3 * part.vertices.size() << "\">";
    for (const Vec3& v : part.vertices) out << v.x() << ' ' << v.y() << ' ' << v.z() << ' ';
    out << "</float_array><technique_common><accessor source=\"#" << id << "a\" count=\""
        << part.vertices.size()
        << "\" stride=\"3\"><param name=\"X\" type=\"float\"/><param name=\"Y\" type=\"float\"/>"
           "<param name=\"Z\" type=\"float\"/></accessor></technique_common></source><vertices "
           "id=\""
        << id << "v\"><input semantic=\"POSITION\" source=\"#" << id
        << "p\"/></vertices><triangles count=\"" << part.triangles.size() << "\" material=\""
        << part.material << "\"><input semantic=\"VERTEX\" source=\"#" << id
        << "v\" offset=\"0\"/><p>";
    for (const auto& [a, b, c] : part.triangles) out << a << ' ' << b << ' ' << c << ' ';
    out << "</p></triangles></mesh></geometry>\n";
  }
  out << "</library_geometries><library_visual_scenes><visual_scene id=\"s\">\n";
  for (const Part& part : parts) {
    out << "<node id=\"" << part.name << "\" name=\"" << part.name << "\"><matrix>";
    for (Eigen::Index i = 0; i < 16; ++i) out << node(i / 4, i % 4) << ' ';
    out << "</matrix><instance_geometry url=\"#g" << part.name
        << "\"><bind_material><technique_common><instance_material symbol=\"" << part.material
        << "\" target=\"#" << part.material
        << "\"/></technique_common></bind_material></instance_geometry></node>\n";
  }
  out << "</visual_scene></library_visual_scenes><scene><instance_visual_scene url=\"#s\"/>"
         "</scene></COLLADA>\n";
  return out.str();
}

std::string gltf(const std::vector<Part>& parts, const Eigen::Matrix4d& node) {
  std::string buffer;
  std::ostringstream views, accessors, meshes, nodes, materials, children;
  for (std::size_t i = 0; i < parts.size(); ++i) {
    const Part& part = parts[i];
    const std::string comma = i > 0 ? "," : "";
    const std::size_t begin = buffer.size();
    Vec3 low = part.vertices[0], high = low;
    for (const Vec3& v : part.vertices) {
      for (Eigen::Index k = 0; k < 3; ++k) put(buffer, static_cast<float>(v[k]));
      low = low.cwiseMin(v);
      high = high.cwiseMax(v);
    }
    const std::size_t middle = buffer.size();
    for (const auto& triangle : part.triangles) {
      for (const std::uint32_t corner : triangle) put(buffer, static_cast<std::uint16_t>(corner));
    }
    while (buffer.size() % 4 != 0) buffer += '\0';
    const auto array = [](const Vec3& v) {
      std::ostringstream text;
      text << '[' << v.x() << ',' << v.y() << ',' << v.z() << ']';
      return text.str();
    };
    views << comma << "{\"buffer\":0,\"byteOffset\":" << begin
          << ",\"byteLength\":" << middle - begin << "},{\"buffer\":0,\"byteOffset\":" << middle
          << ",\"byteLength\":" << 6 * part.triangles.size() << "}";
    accessors << comma << "{\"bufferView\":" << 2 * i
              << ",\"componentType\":5126,\"count\":" << part.vertices.size()
              << ",\"type\":\"VEC3\",\"min\":" << array(low) << ",\"max\":" << array(high)
              << "},{\"bufferView\":" << 2 * i + 1
              << ",\"componentType\":5123,\"count\":" << 3 * part.triangles.size()
              << ",\"type\":\"SCALAR\"}";
    meshes << comma << "{\"name\":\"" << part.name << "\",\"primitives\":[{\"attributes\":{"
           << "\"POSITION\":" << 2 * i << "},\"indices\":" << 2 * i + 1 << ",\"material\":" << i
           << "}]}";
    materials << comma << "{\"name\":\"" << part.material << "\"}";
    nodes << ",{\"name\":\"" << part.name << "\",\"mesh\":" << i << "}";
    children << comma << i + 1;
  }
  std::ostringstream out;
  out.precision(12);
  out << "{\"asset\":{\"version\":\"2.0\"},\"scene\":0,\"scenes\":[{\"nodes\":[0]}],\"nodes\":[{"
         "\"matrix\":[";
  for (Eigen::Index i = 0; i < 16; ++i) out << (i > 0 ? "," : "") << node(i % 4, i / 4);
  out << "],\"children\":[" << children.str() << "]}" << nodes.str() << "],\"meshes\":["
      << meshes.str() << "],\"materials\":[" << materials.str() << "],\"accessors\":["
      << accessors.str() << "],\"bufferViews\":[" << views.str()
      << "],\"buffers\":[{\"byteLength\":" << buffer.size()
      << ",\"uri\":\"data:application/octet-stream;base64," << base64(buffer) << "\"}]}";
  return out.str();
}

void write_file(const std::filesystem::path& file, const std::string& bytes) {
  std::filesystem::create_directories(file.parent_path());
  std::ofstream(file, std::ios::binary) << bytes;
}

FileRecipe recipe_of(const std::filesystem::path& file) {
  FileRecipe recipe;
  recipe.path = file.string();
  return recipe;
}

World load(const std::filesystem::path& file) {
  return load_file_world(recipe_of(file), kVehicleRadius).world;
}

std::string refusal(const FileRecipe& recipe) {
  try {
    static_cast<void>(load_file_world(recipe, kVehicleRadius));
  } catch (const ConfigError& error) {
    return error.what();
  }
  return {};
}

void expect_surface(const World& world, const std::vector<Part>& parts, double tolerance_m) {
  std::vector<std::array<Vec3, 3>> expected, found;
  for (const Part& part : parts) {
    for (const auto& [a, b, c] : part.triangles) {
      expected.push_back({part.vertices[a], part.vertices[b], part.vertices[c]});
    }
  }
  for (const auto& [a, b, c] : world.mesh.triangles) {
    found.push_back({world.mesh.vertices[a].cast<double>(), world.mesh.vertices[b].cast<double>(),
                     world.mesh.vertices[c].cast<double>()});
  }
  ASSERT_EQ(found.size(), expected.size());
  const std::vector<Sides> want = fingerprints(expected);
  std::vector<Sides> have = fingerprints(found);
  for (const Sides& w : want) {
    const auto same = std::find_if(have.begin(), have.end(), [&](const Sides& h) {
      for (std::size_t i = 0; i < w.size(); ++i) {
        if (!(std::abs(h[i] - w[i]) < 10 * tolerance_m)) return false;
      }
      return true;
    });
    ASSERT_NE(same, have.end()) << "no triangle at " << w[0] << ", " << w[1] << ", " << w[2];
    have.erase(same);
  }
}

}  // namespace arex::worlds::test
