#include "worlds/export.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstring>
#include <iterator>
#include <string>
#include <string_view>

#include "files/files.h"

namespace arex::worlds {
namespace {

static_assert(std::endian::native == std::endian::little, "the formats are little-endian");

/// A file written at once when it is complete.
class OutputFile {
 public:
  explicit OutputFile(std::filesystem::path file) : file_(std::move(file)) {}

  OutputFile& operator<<(std::string_view text) {
    bytes_ += text;
    return *this;
  }
  OutputFile& operator<<(double value) {
    fmt::format_to(std::back_inserter(bytes_), "{:.9g}", value);
    return *this;
  }
  OutputFile& operator<<(std::size_t value) {
    return *this << std::string_view(std::to_string(value));
  }
  OutputFile& operator<<(const Vec3& v) { return *this << v.x() << " " << v.y() << " " << v.z(); }
  template <class T>
  void raw(const T& value) {
    static_assert(std::is_trivially_copyable_v<T>);
    std::array<char, sizeof(T)> bytes;
    std::memcpy(bytes.data(), &value, sizeof(T));
    bytes_.append(bytes.data(), bytes.size());
  }
  void reserve(std::size_t bytes) { bytes_.reserve(bytes); }

  void close() { write_atomically(file_, bytes_); }

 private:
  std::filesystem::path file_;
  std::string bytes_;
};

/// OctoMap's tree of depth 16, written depth first: two bits for each of a node's eight children.
class OctreeWriter {
 public:
  OctreeWriter(const OccupancyGrid& occupancy, const FreeSpace& free)
      : occupancy_(occupancy), free_(free) {
    constexpr int kKeyOfZero = 1 << (kDepth - 1);
    const GridGeometry& grid = occupancy.grid;
    key_of_first_ = (grid.origin / grid.resolution_m).array().round().cast<int>() + kKeyOfZero;
    write_children({0, 0, 0}, 1 << kDepth);
  }
  [[nodiscard]] const std::string& data() const { return data_; }
  [[nodiscard]] std::size_t nodes() const { return nodes_; }

 private:
  static constexpr int kDepth = 16;
  enum Child : unsigned { kUnknown = 0, kFree = 1, kOccupied = 2, kInner = 3 };

  [[nodiscard]] Child cell(std::size_t index) const {
    if (occupancy_.occupied[index]) return kOccupied;
    return free_.reachable[index] ? kFree : kUnknown;
  }

  /// What a cube of keys holds: one state throughout, or several.
  [[nodiscard]] Child content(const Eigen::Vector3i& key, int side) const {
    const GridGeometry& grid = occupancy_.grid;
    const Eigen::Vector3i wanted = key - key_of_first_;
    const Eigen::Vector3i low = wanted.cwiseMax(0);
    const Eigen::Vector3i high = (wanted.array() + side).min(grid.size.array());
    if ((low.array() >= high.array()).any()) return kUnknown;
    const bool inside = low == wanted && (high.array() == wanted.array() + side).all();
    const Child first = inside ? cell(grid.index(low)) : kUnknown;
    for (int k = low.z(); k < high.z(); ++k) {
      for (int j = low.y(); j < high.y(); ++j) {
        const std::size_t row = grid.index({low.x(), j, k});
        for (std::size_t i = 0; i < static_cast<std::size_t>(high.x() - low.x()); ++i) {
          if (cell(row + i) != first) return kInner;
        }
      }
    }
    return first;
  }

  void write_children(const Eigen::Vector3i& key, int side) {
    ++nodes_;
    const int half = side / 2;
    std::array<Child, 8> children{};
    unsigned bits = 0;
    for (unsigned c = 0; c < 8; ++c) {
      children[c] = content(child_key(key, half, c), half);
      bits |= static_cast<unsigned>(children[c]) << (2 * c);
    }
    data_ += static_cast<char>(bits & 0xFF);
    data_ += static_cast<char>(bits >> 8);
    for (unsigned c = 0; c < 8; ++c) {
      if (children[c] == kInner) write_children(child_key(key, half, c), half);
      if (children[c] == kFree || children[c] == kOccupied) ++nodes_;
    }
  }

  static Eigen::Vector3i child_key(const Eigen::Vector3i& key, int half, unsigned child) {
    return key + half * Eigen::Vector3i(static_cast<int>(child & 1),
                                        static_cast<int>(child >> 1 & 1),
                                        static_cast<int>(child >> 2));
  }

  const OccupancyGrid& occupancy_;
  const FreeSpace& free_;
  Eigen::Vector3i key_of_first_;
  std::string data_;
  std::size_t nodes_ = 0;
};

constexpr std::string_view kTerrainFile = "terrain.hf";

/// MuJoCo's own binary height field, normalised by its compiler to the given elevation.
void write_terrain(const HeightField& terrain, const std::filesystem::path& file) {
  OutputFile out(file);
  out.raw(std::int32_t{terrain.rows});
  out.raw(std::int32_t{terrain.columns});
  for (const float height : terrain.height_m) out.raw(height);
  out.close();
}

}  // namespace

void write_ply(const World& world, const std::filesystem::path& file) {
  const Mesh& mesh = world.mesh;
  OutputFile out(file);
  constexpr std::size_t kFaceBytes = 1 + 3 * 4 + 1 + 4 + 4;
  out.reserve(2048 + 12 * mesh.vertices.size() + kFaceBytes * mesh.triangles.size());
  out << "ply\nformat binary_little_endian 1.0\n";
  for (std::size_t i = 0; i < kSurfaceClassNames.size(); ++i) {
    out << "comment class " << i << " " << kSurfaceClassNames[i] << "\n";
  }
  out << "element vertex " << mesh.vertices.size()
      << "\nproperty float x\nproperty float y\nproperty float z\nelement face "
      << mesh.triangles.size()
      << "\nproperty list uchar uint vertex_indices\nproperty uchar class\nproperty uint object\n"
         "property float reflectivity\nend_header\n";
  for (const Vec3f& v : mesh.vertices) {
    for (Eigen::Index i = 0; i < 3; ++i) out.raw(v[i]);
  }
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    const std::uint32_t object = mesh.object_of_triangle[t];
    out.raw(std::uint8_t{3});
    out.raw(mesh.triangles[t]);
    out.raw(static_cast<std::uint8_t>(world.objects[object].surface_class));
    out.raw(object);
    out.raw(world.objects[object].reflectivity);
  }
  out.close();
}

void write_mjcf(const World& world, const std::filesystem::path& file) {
  OutputFile out(file);
  out << "<mujoco model=\"world\">\n";
  const HeightField& terrain = world.terrain;
  const bool has_terrain = terrain.columns > 0;
  const auto [low, high] =
      has_terrain ? std::minmax_element(terrain.height_m.begin(), terrain.height_m.end())
                  : std::pair(terrain.height_m.begin(), terrain.height_m.begin());
  const Vec2 half = 0.5 * terrain.spacing_m * Vec2(terrain.columns - 1.0, terrain.rows - 1.0);
  if (has_terrain) {
    // MuJoCo asks for a positive elevation and a base below; level ground has neither of itself.
    constexpr double kBase = 1.0;
    constexpr double kLeastElevation = 1e-3;
    out << "  <asset>\n    <hfield name=\"terrain\" file=\"" << kTerrainFile << "\" size=\""
        << half.x() << " " << half.y() << " "
        << std::max(static_cast<double>(*high - *low), kLeastElevation) << " " << kBase
        << "\"/>\n  </asset>\n";
    write_terrain(terrain, file.parent_path() / kTerrainFile);
  }
  out << "  <worldbody>\n";
  if (has_terrain) {
    const Vec2 middle = terrain.origin + half;
    out << "    <geom type=\"hfield\" hfield=\"terrain\" pos=\""
        << Vec3(middle.x(), middle.y(), static_cast<double>(*low)) << "\"/>\n";
  }
  constexpr std::array<std::string_view, 3> kTypes{"box", "capsule", "cylinder"};
  for (const CollisionShape& shape : world.collision_shapes) {
    const Quat q = shape.X_WS.quaternion();
    const bool is_box = shape.kind == CollisionShape::Kind::kBox;
    out << "    <geom type=\"" << kTypes[static_cast<std::size_t>(shape.kind)] << "\" pos=\""
        << shape.X_WS.p << "\" quat=\"" << q.w() << " " << Vec3(q.vec()) << "\" size=\""
        << shape.size.x() << " " << shape.size.y();
    if (is_box) out << " " << shape.size.z();
    out << "\"/>\n";
  }
  out << "  </worldbody>\n</mujoco>\n";
  out.close();
}

void write_octomap(const OccupancyGrid& occupancy, const FreeSpace& free,
                   const std::filesystem::path& file) {
  const OctreeWriter tree(occupancy, free);
  OutputFile out(file);
  out << "# Octomap OcTree binary file\nid OcTree\nsize " << tree.nodes() << "\nres "
      << occupancy.grid.resolution_m << "\ndata\n"
      << tree.data();
  out.close();
}

void write_map2d(const World& world, const ExportConfig& config, const FreeSpace& free,
                 const std::filesystem::path& directory) {
  const GridGeometry& grid = free.grid;
  const OccupancyGrid obstacles = voxelize(world, grid,
                                           ClassSet::all()
                                               .without(SurfaceClass::kGround)
                                               .without(SurfaceClass::kFloor)
                                               .without(SurfaceClass::kRamp)
                                               .without(SurfaceClass::kCeiling));
  constexpr char kOccupied = 0;
  constexpr char kFree = static_cast<char>(254);
  constexpr char kUnknown = static_cast<char>(205);
  const int columns = grid.size.x();
  const int rows = grid.size.y();
  OutputFile image(directory / "map2d.pgm");
  image << "P5\n"
        << static_cast<std::size_t>(columns) << " " << static_cast<std::size_t>(rows) << "\n255\n";
  for (int j = rows - 1; j >= 0; --j) {  // the image's first row is the greatest y
    for (int i = 0; i < columns; ++i) {
      const Vec3 p = grid.centre({i, j, 0});
      const double ground =
          world.terrain.columns > 0 ? world.terrain.at(p.x(), p.y()) : world.X_WS.p.z();
      char value = kUnknown;
      for (int k = 0; k < grid.size.z() && value != kOccupied; ++k) {
        const double height = grid.centre({i, j, k}).z() - ground;
        if (height < config.band_low_m || height > config.band_high_m) continue;
        if (obstacles.at({i, j, k})) value = kOccupied;
        if (value == kUnknown && free.reachable[grid.index({i, j, k})]) value = kFree;
      }
      image.raw(value);
    }
  }
  image.close();
  OutputFile yaml(directory / "map2d.yaml");
  yaml << "image: map2d.pgm\nresolution: " << grid.resolution_m << "\norigin: [" << grid.origin.x()
       << ", " << grid.origin.y()
       << ", 0.0]\nnegate: 0\noccupied_thresh: 0.65\nfree_thresh: 0.196\n";
  yaml.close();
}

void export_world(const World& world, const ExportConfig& config,
                  const std::filesystem::path& directory) {
  std::filesystem::create_directories(directory);
  std::error_code none;
  if (world.terrain.columns == 0) std::filesystem::remove(directory / kTerrainFile, none);
  write_ply(world, directory / "mesh.ply");
  write_mjcf(world, directory / "world.xml");
  const OccupancyGrid occupancy =
      voxelize(world, make_grid(world.bounds, config.resolution_m), ClassSet::all());
  constexpr double kAbovePad = 1.0;  // the air that the vehicle takes off into, m
  const FreeSpace free = flood_free_space(occupancy, world.X_WS.p + kAbovePad * Vec3::UnitZ(), 0);
  write_octomap(occupancy, free, directory / "map.bt");
  write_map2d(world, config, free, directory);
}

}  // namespace arex::worlds
