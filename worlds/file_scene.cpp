#include "worlds/file_scene.h"

#include <cstring>
#include <type_traits>

#include "config/config.h"

namespace arex::worlds {
namespace {

class Packer {
 public:
  template <class T>
  void operator()(const T& value) {
    if constexpr (std::is_same_v<T, std::string>) {
      (*this)(value.size());
      bytes_.append(value);
    } else {
      static_assert(std::is_arithmetic_v<T> || std::is_enum_v<T>);
      raw(&value, sizeof(T));
    }
  }
  void operator()(const Pose& X) {
    raw(X.R.data(), 9 * sizeof(double));
    (*this)(X.p);
  }
  void operator()(const Vec3& v) { raw(v.data(), 3 * sizeof(double)); }
  template <class T>
  void plain(const std::vector<T>& values) {
    (*this)(values.size());
    raw(values.data(), values.size() * sizeof(T));
  }
  [[nodiscard]] std::string take() { return std::move(bytes_); }

 private:
  void raw(const void* data, std::size_t size) {
    bytes_.append(static_cast<const char*>(data), size);
  }
  std::string bytes_;
};

class Unpacker {
 public:
  explicit Unpacker(std::string_view bytes) : left_(bytes) {}

  template <class T>
  void operator()(T& value) {
    if constexpr (std::is_same_v<T, std::string>) {
      const std::size_t size = count(1);
      value.assign(left_.substr(0, size));
      left_.remove_prefix(size);
    } else {
      static_assert(std::is_arithmetic_v<T> || std::is_enum_v<T>);
      raw(&value, sizeof(T));
    }
  }
  void operator()(Pose& X) {
    raw(X.R.data(), 9 * sizeof(double));
    (*this)(X.p);
  }
  void operator()(Vec3& v) { raw(v.data(), 3 * sizeof(double)); }
  template <class T>
  void plain(std::vector<T>& values) {
    values.resize(count(sizeof(T)));
    raw(values.data(), values.size() * sizeof(T));
  }
  /// A number of things, each at least so long.
  [[nodiscard]] std::size_t count(std::size_t least_size) {
    std::size_t value = 0;
    raw(&value, sizeof(value));
    if (value > left_.size() / least_size) fail();
    return value;
  }

 private:
  [[noreturn]] static void fail() { throw ConfigError("the reader's answer is broken"); }
  void raw(void* data, std::size_t size) {
    if (size > left_.size()) fail();
    if (size > 0) std::memcpy(data, left_.data(), size);
    left_.remove_prefix(size);
  }
  std::string_view left_;
};

void each_field(auto& archive, auto& group) {
  archive(group.name);
  archive(group.material);
  archive(group.shape);
  archive(group.surface_class);
  archive(group.reflectivity);
}

void each_part(auto& archive, auto& primitive) {
  archive(primitive.kind);
  archive(primitive.X_FP);
  archive(primitive.size);
  archive(primitive.group);
}

}  // namespace

std::string FileScene::pack() const {
  Packer archive;
  archive(up);
  archive(unit_m);
  archive(groups.size());
  for (const FileGroup& group : groups) each_field(archive, group);
  archive.plain(vertices);
  archive.plain(triangles);
  archive.plain(group_of_triangle);
  archive(primitives.size());
  for (const FilePrimitive& primitive : primitives) each_part(archive, primitive);
  archive.plain(points);
  archive(voxel_m);
  archive.plain(voxels);
  archive(notes.size());
  for (const std::string& note : notes) archive(note);
  return archive.take();
}

FileScene FileScene::unpack(std::string_view bytes) {
  FileScene scene;
  Unpacker archive(bytes);
  archive(scene.up);
  archive(scene.unit_m);
  scene.groups.resize(archive.count(1));
  for (FileGroup& group : scene.groups) each_field(archive, group);
  archive.plain(scene.vertices);
  archive.plain(scene.triangles);
  archive.plain(scene.group_of_triangle);
  scene.primitives.resize(archive.count(1));
  for (FilePrimitive& primitive : scene.primitives) each_part(archive, primitive);
  archive.plain(scene.points);
  archive(scene.voxel_m);
  archive.plain(scene.voxels);
  scene.notes.resize(archive.count(1));
  for (std::string& note : scene.notes) archive(note);
  return scene;
}

}  // namespace arex::worlds
