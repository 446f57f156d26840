#include <png.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <fstream>
#include <iterator>
#include <map>
#include <numbers>
#include <sdf/sdf.hh>
#include <set>
#include <sstream>
#include <stdexcept>

#include "config/text.h"
#include "worlds/file_readers.h"

namespace arex::worlds {
namespace {

namespace fs = std::filesystem;

Vec3 vector_of(const ignition::math::Vector3d& v) { return {v.X(), v.Y(), v.Z()}; }

Pose pose_of(const ignition::math::Pose3d& X) {
  const auto& q = X.Rot();
  return {Quat(q.W(), q.X(), q.Y(), q.Z()).normalized().toRotationMatrix(), vector_of(X.Pos())};
}

/// Where the names of other files lead.
class Resolver {
 public:
  Resolver(const fs::path& file, const std::vector<fs::path>& model_paths) {
    for (fs::path folder = fs::absolute(file).parent_path();; folder = folder.parent_path()) {
      folders_.push_back(folder);
      if (folder == folder.parent_path() || folders_.size() >= kAncestors) break;
    }
    folders_.insert(folders_.end(), model_paths.begin(), model_paths.end());
  }

  /// Empty if there is no such file. @param beside the file that names it
  [[nodiscard]] fs::path find(std::string uri, const fs::path& beside) const {
    for (const char* scheme : {"model://", "file://", "package://"}) {
      if (uri.starts_with(scheme)) uri.erase(0, std::strlen(scheme));
    }
    std::error_code none;
    if (const fs::path path = uri; path.is_absolute()) {
      return fs::exists(path, none) ? path : fs::path();
    }
    if (const fs::path path = beside.parent_path() / uri; fs::exists(path, none)) return path;
    for (const fs::path& folder : folders_) {
      for (const char* place : {"", "models"}) {
        if (const fs::path path = folder / place / uri; fs::exists(path, none)) return path;
      }
    }
    return {};
  }

 private:
  static constexpr std::size_t kAncestors = 3;
  std::vector<fs::path> folders_;
};

std::string text_of(const fs::path& file) {
  std::ifstream in(file, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}

/// What stands between an opening tag, whose attributes may be any, and its closing one, each time.
std::vector<std::string_view> elements(std::string_view text, const std::string& name) {
  std::vector<std::string_view> found;
  const std::string opening = "<" + name, closing = "</" + name + ">";
  for (std::size_t at = 0; (at = text.find(opening, at)) != std::string_view::npos;) {
    const std::size_t begin = text.find('>', at);
    const std::size_t end = text.find(closing, at);
    if (begin == std::string_view::npos || end == std::string_view::npos || end < begin) break;
    found.push_back(text.substr(begin + 1, end - begin - 1));
    at = end;
  }
  return found;
}

/// The models that a file includes, as it names them.
std::vector<std::string> includes_of(const fs::path& file) {
  std::string text = text_of(file);
  for (std::size_t begin = 0; (begin = text.find("<!--", begin)) != std::string::npos;) {
    const std::size_t end = text.find("-->", begin);
    text.erase(begin, end == std::string::npos ? end : end + 3 - begin);
  }
  std::vector<std::string> uris;
  for (const std::string_view include : elements(text, "include")) {
    for (const std::string_view uri : elements(include, "uri")) {
      const std::size_t first = uri.find_first_not_of(" \t\r\n");
      if (first == std::string_view::npos) continue;
      uris.emplace_back(uri.substr(first, uri.find_last_not_of(" \t\r\n") + 1 - first));
    }
  }
  return uris;
}

/// libsdformat follows includes for ever where they lead in a circle.
class IncludeCheck {
 public:
  IncludeCheck(const Resolver& resolver, fs::path beside)
      : resolver_(resolver), beside_(std::move(beside)) {}

  /// @param name of the file, as who includes it has it
  void expect_no_circle(const fs::path& file, const std::string& name) {
    std::error_code none;
    const std::string key = fs::weakly_canonical(file, none).string();
    const auto same = [&](const Step& step) { return step.key == key; };
    if (const auto begin = std::find_if(way_.begin(), way_.end(), same); begin != way_.end()) {
      std::string circle;
      for (auto step = begin; step != way_.end(); ++step) {
        circle += shortened(step->name, 100) + " includes ";
      }
      throw std::runtime_error("never ends: " + circle + shortened(begin->name, 100));
    }
    if (way_.size() > kDeepest) throw std::runtime_error("nests its includes too deeply");
    if (!sound_.insert(key).second) return;
    way_.push_back({key, name});
    for (const std::string& uri : includes_of(file)) {
      fs::path included = resolver_.find(uri, beside_);
      if (fs::is_directory(included, none)) included = sdf::getModelFilePath(included.string());
      if (fs::is_regular_file(included, none)) expect_no_circle(included, uri);
    }
    way_.pop_back();
  }

 private:
  struct Step {
    std::string key, name;
  };
  static constexpr std::size_t kDeepest = 50;
  const Resolver& resolver_;
  fs::path beside_;
  std::vector<Step> way_;        ///< from the first file to the one being read
  std::set<std::string> sound_;  ///< and those of the way; they need no second look
};

class SdfReader {
 public:
  SdfReader(fs::path file, const std::vector<fs::path>& model_paths)
      : file_(std::move(file)), resolver_(file_, model_paths) {}

  FileScene read() {
    sdf::Console::Instance()->SetQuiet(true);
    IncludeCheck(resolver_, file_).expect_no_circle(file_, file_.filename().string());
    const auto find = [this](const std::string& uri) {
      std::string path = resolver_.find(uri, file_).string();
      if (path.empty()) unfound_.insert(uri);
      return path;
    };
    sdf::ParserConfig config;
    config.SetFindCallback(find);
    // libsdformat 12 asks this one for what an included model includes.
    sdf::setFindCallback(find);
    sdf::Root root;
    note_errors(root.Load(file_.string(), config));
    sdf::setFindCallback([](const std::string&) { return std::string(); });
    scene_.up = FileUp::kZ;
    if (root.WorldCount() > 0) {
      const sdf::World& world = *root.WorldByIndex(0);
      read_state(world.Element());
      for (std::uint64_t i = 0; i < world.ModelCount(); ++i) {
        const sdf::Model& model = *world.ModelByIndex(i);
        const auto moved = moved_to_.find(model.Name());
        add(model, moved == moved_to_.end() ? pose_in_parent(model) : moved->second, "", 0);
      }
      if (root.WorldCount() > 1)
        scene_.notes.emplace_back("holds several worlds, the first is read");
    } else if (root.Model() != nullptr) {
      add(*root.Model(), pose_in_parent(*root.Model()), "", 0);
    } else {
      // Of a file that is no XML, or without <sdf>, libsdformat says that it cannot be read.
      const bool is_other =
          complaints_.empty() || complaints_.front().starts_with("Unable to read file");
      throw std::runtime_error(is_other ? "holds neither a world nor a model, or is no sound SDF"
                                        : complaints_.front());
    }
    note_missing();
    return std::move(scene_);
  }

 private:
  /// As in Gazebo, what cannot be found or understood is left out, and said.
  void note_errors(const sdf::Errors& errors) {
    for (const sdf::Error& error : errors) {
      const std::string text = error.Message();
      const bool lookup =
          error.Code() == sdf::ErrorCode::URI_LOOKUP || error.Code() == sdf::ErrorCode::URI_INVALID;
      const bool told = std::any_of(unfound_.begin(), unfound_.end(), [&](const std::string& uri) {
        return text.find(uri) != std::string::npos;
      });
      if (!lookup) {
        complaints_.push_back(text);
      } else if (!told) {
        missing_.insert(text);
      }
    }
    for (const std::string& uri : unfound_) {
      if (uri == "model://ground_plane") {
        add_default_ground();
      } else if (uri != "model://sun") {
        missing_.insert(uri);
      }
    }
  }

  /// Gazebo brings this model along, and nearly every world names it.
  void add_default_ground() {
    const std::uint32_t group = add_group("ground_plane", "", "plane");
    add_plane({}, Vec3::UnitZ(), {100, 100}, group);
    scene_.notes.emplace_back(
        "model://ground_plane not found: 100 x 100 m of level ground instead");
  }

  template <class T>
  static Pose resolved(const T& thing, const char* what) {
    ignition::math::Pose3d pose;
    const sdf::Errors errors = thing.SemanticPose().Resolve(pose);
    if (!errors.empty()) {
      throw std::runtime_error(std::string("places a ") + what +
                               " by an unknown frame: " + errors.front().Message());
    }
    return pose_of(pose);
  }
  static Pose pose_in_parent(const sdf::Model& model) {
    if (model.PlacementFrameName().empty() && model.PoseRelativeTo().empty()) {
      return pose_of(model.RawPose());
    }
    return resolved(model, "model");
  }

  /// What a saved world says of where its models had got to.
  void read_state(const sdf::ElementPtr& world) {
    if (!world || !world->HasElement("state")) return;
    const sdf::ElementPtr state = world->GetElement("state");
    if (!state->HasElement("model")) return;
    for (sdf::ElementPtr model = state->GetElement("model"); model;
         model = model->GetNextElement("model")) {
      if (!model->HasElement("pose")) continue;
      moved_to_[model->Get<std::string>("name")] =
          pose_of(model->Get<ignition::math::Pose3d>("pose"));
    }
  }

  void add(const sdf::Model& model, const Pose& X_FM, const std::string& parent, int depth) {
    constexpr int kDeepest = 50;
    if (depth > kDeepest) throw std::runtime_error("nests its models too deeply");
    const std::string name = parent.empty() ? model.Name() : parent + "::" + model.Name();
    for (std::uint64_t i = 0; i < model.LinkCount(); ++i) {
      const sdf::Link& link = *model.LinkByIndex(i);
      const Pose X_FL = X_FM * resolved(link, "link");
      for (std::uint64_t k = 0; k < link.VisualCount(); ++k) {
        const sdf::Visual& visual = *link.VisualByIndex(k);
        if (visual.Geom() == nullptr) continue;
        add(*visual.Geom(), X_FL * resolved(visual, "visual"), name, material_of(visual));
      }
      for (std::uint64_t k = 0; link.VisualCount() == 0 && k < link.CollisionCount(); ++k) {
        const sdf::Collision& collision = *link.CollisionByIndex(k);
        if (collision.Geom() == nullptr) continue;
        add(*collision.Geom(), X_FL * resolved(collision, "collision"), name, "");
      }
    }
    for (std::uint64_t i = 0; i < model.ModelCount(); ++i) {
      const sdf::Model& nested = *model.ModelByIndex(i);
      add(nested, X_FM * resolved(nested, "model"), name, depth + 1);
    }
  }

  static std::string material_of(const sdf::Visual& visual) {
    return visual.Material() == nullptr ? "" : visual.Material()->ScriptName();
  }

  std::uint32_t add_group(const std::string& name, const std::string& material,
                          const std::string& shape) {
    scene_.groups.push_back({name, material, shape});
    return static_cast<std::uint32_t>(scene_.groups.size() - 1);
  }

  void add(const sdf::Geometry& geometry, const Pose& X_FP, const std::string& name,
           const std::string& material) {
    using Kind = FilePrimitive::Kind;
    const auto primitive = [&](const char* shape, Kind kind, const Vec3& size) {
      scene_.primitives.push_back({kind, X_FP, size, add_group(name, material, shape)});
    };
    switch (geometry.Type()) {
      case sdf::GeometryType::BOX:
        return primitive("box", Kind::kBox, 0.5 * vector_of(geometry.BoxShape()->Size()));
      case sdf::GeometryType::CYLINDER:
        return primitive(
            "cylinder", Kind::kCylinder,
            {geometry.CylinderShape()->Radius(), 0.5 * geometry.CylinderShape()->Length(), 0});
      case sdf::GeometryType::CAPSULE:
        return primitive(
            "capsule", Kind::kCapsule,
            {geometry.CapsuleShape()->Radius(), 0.5 * geometry.CapsuleShape()->Length(), 0});
      case sdf::GeometryType::SPHERE:
        return add_ball(Vec3::Constant(geometry.SphereShape()->Radius()), X_FP,
                        add_group(name, material, "sphere"));
      case sdf::GeometryType::ELLIPSOID:
        return add_ball(vector_of(geometry.EllipsoidShape()->Radii()), X_FP,
                        add_group(name, material, "ellipsoid"));
      case sdf::GeometryType::PLANE: {
        const auto& size = geometry.PlaneShape()->Size();
        return add_plane(X_FP, vector_of(geometry.PlaneShape()->Normal()), {size.X(), size.Y()},
                         add_group(name, material, "plane"));
      }
      case sdf::GeometryType::MESH:
        return add_mesh(*geometry.MeshShape(), X_FP, name, material);
      case sdf::GeometryType::HEIGHTMAP:
        return add_terrain(*geometry.HeightmapShape(), X_FP, name);
      case sdf::GeometryType::EMPTY:
        break;
    }
    if (!geometry.Element() || geometry.Element()->HasElement("empty")) return;
    ++unknown_shapes_;
  }

  void add_face(std::uint32_t group, std::uint32_t a, std::uint32_t b, std::uint32_t c) {
    scene_.triangles.push_back({a, b, c});
    scene_.group_of_triangle.push_back(group);
  }

  void add_plane(const Pose& X_FP, const Vec3& normal, const Vec2& size, std::uint32_t group) {
    const Quat turn = Quat::FromTwoVectors(Vec3::UnitZ(), normal);
    constexpr double kMost = 500;  // a plane has no end; this is as much as anybody flies over
    if (size.maxCoeff() > kMost) {
      scene_.notes.push_back("a plane cut to " + std::to_string(static_cast<int>(kMost)) + " m");
    }
    const auto first = static_cast<std::uint32_t>(scene_.vertices.size());
    for (const Vec2& corner : {Vec2(-1, -1), Vec2(1, -1), Vec2(1, 1), Vec2(-1, 1)}) {
      const Vec2 p = 0.5 * size.cwiseMin(kMost).cwiseProduct(corner);
      scene_.vertices.push_back(X_FP * (turn * Vec3(p.x(), p.y(), 0)));
    }
    add_face(group, first, first + 1, first + 2);
    add_face(group, first, first + 2, first + 3);
  }

  /// Meridians and parallels.
  void add_ball(const Vec3& radii, const Pose& X_FP, std::uint32_t group) {
    constexpr std::uint32_t kRound = 32, kRings = 16;
    const auto first = static_cast<std::uint32_t>(scene_.vertices.size());
    for (std::uint32_t ring = 0; ring <= kRings; ++ring) {
      const double polar = std::numbers::pi * ring / kRings;
      for (std::uint32_t k = 0; k < kRound; ++k) {
        const double angle = 2 * std::numbers::pi * k / kRound;
        const Vec3 p(std::sin(polar) * std::cos(angle), std::sin(polar) * std::sin(angle),
                     std::cos(polar));
        scene_.vertices.push_back(X_FP * radii.cwiseProduct(p));
      }
    }
    for (std::uint32_t ring = 0; ring < kRings; ++ring) {
      for (std::uint32_t k = 0; k < kRound; ++k) {
        const std::uint32_t a = first + ring * kRound + k,
                            b = first + ring * kRound + (k + 1) % kRound;
        if (ring > 0) add_face(group, a, a + kRound, b);
        if (ring + 1 < kRings) add_face(group, b, a + kRound, b + kRound);
      }
    }
  }

  /// The file that names another one: an included model's, or the world's.
  [[nodiscard]] fs::path named_in(const auto& shape) const {
    return shape.FilePath().empty() ? file_ : fs::path(shape.FilePath());
  }

  void add_mesh(const sdf::Mesh& mesh, const Pose& X_FP, const std::string& name,
                const std::string& material) {
    const fs::path file = resolver_.find(mesh.Uri(), named_in(mesh));
    if (file.empty()) {
      missing_.insert(mesh.Uri());
      return;
    }
    const FileScene& part = mesh_of(file);
    const Vec3 scale = vector_of(mesh.Scale());
    // A link's z is the mesh's up axis.
    Mat3 R_zup = Mat3::Identity();
    if (part.up == FileUp::kY) R_zup << 1, 0, 0, 0, 0, -1, 0, 1, 0;
    if (part.up == FileUp::kX) R_zup << 0, 1, 0, 0, 0, 1, 1, 0, 0;
    const auto first = static_cast<std::uint32_t>(scene_.vertices.size());
    const auto first_group = static_cast<std::uint32_t>(scene_.groups.size());
    for (const Vec3& v : part.vertices) {
      scene_.vertices.push_back(X_FP * scale.cwiseProduct(R_zup * v));
    }
    for (const FileGroup& group : part.groups) {
      add_group(name, group.material.empty() ? material : group.material, "mesh");
    }
    for (std::size_t i = 0; i < part.triangles.size(); ++i) {
      const auto& [a, b, c] = part.triangles[i];
      add_face(first_group + part.group_of_triangle[i], first + a, first + b, first + c);
    }
  }

  const FileScene& mesh_of(const fs::path& file) {
    const auto [place, fresh] = meshes_.try_emplace(file.string());
    if (!fresh) return place->second;
    std::string ending = file.extension().string();
    std::transform(ending.begin(), ending.end(), ending.begin(),
                   [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
    try {
      place->second = ending == ".ply" ? read_ply(file) : read_assimp(file);
    } catch (const std::exception& error) {
      throw std::runtime_error("names the mesh " + file.string() + ", which " + error.what());
    }
    for (const auto& corners : place->second.triangles) {
      for (const std::uint32_t corner : corners) {
        if (corner >= place->second.vertices.size())
          throw std::runtime_error("names a broken mesh");
      }
    }
    return place->second;
  }

  void add_terrain(const sdf::Heightmap& map, const Pose& X_FP, const std::string& name) {
    const fs::path file = resolver_.find(map.Uri(), named_in(map));
    if (file.empty()) {
      missing_.insert(map.Uri());
      return;
    }
    const Pose X_FH = X_FP * Pose{Mat3::Identity(), vector_of(map.Position())};
    append_heightmap(file, vector_of(map.Size()), X_FH, add_group(name, "", "heightmap"), scene_);
  }

  void note_missing() {
    if (!missing_.empty()) {
      scene_.notes.push_back(std::to_string(missing_.size()) + " files not found and left out (" +
                             shortened(*missing_.begin(), 100) + "); see world.file.model_paths");
    }
    if (!complaints_.empty()) {
      scene_.notes.push_back(
          std::to_string(complaints_.size()) +
          " things that are not understood, first: " + shortened(complaints_.front(), 200));
    }
    if (unknown_shapes_ > 0) {
      scene_.notes.push_back(std::to_string(unknown_shapes_) +
                             " shapes of a kind that is not read left out");
    }
  }

  fs::path file_;
  Resolver resolver_;
  FileScene scene_;
  std::map<std::string, Pose> moved_to_;
  std::map<std::string, FileScene> meshes_;
  std::set<std::string> unfound_;  ///< of the included models
  std::set<std::string> missing_;
  std::vector<std::string> complaints_;
  std::size_t unknown_shapes_ = 0;
};

}  // namespace

FileScene read_sdf(const fs::path& file, const std::vector<fs::path>& model_paths) {
  return SdfReader(file, model_paths).read();
}

void append_heightmap(const fs::path& file, const Vec3& size, const Pose& X_FP, std::uint32_t group,
                      FileScene& scene) {
  png_image image{};
  image.version = PNG_IMAGE_VERSION;
  if (png_image_begin_read_from_file(&image, file.c_str()) == 0) {
    throw std::runtime_error("names the height map " + file.string() + ", which is no PNG");
  }
  // Heights are the samples as they stand: nothing is to correct them for a screen.
  const bool deep = (image.format & PNG_FORMAT_FLAG_LINEAR) != 0;
  image.format = deep ? PNG_FORMAT_LINEAR_Y : PNG_FORMAT_GRAY;
  const std::uint32_t columns = image.width, rows = image.height;
  constexpr std::uint32_t kMost = 5000;
  if (columns < 2 || rows < 2 || columns > kMost || rows > kMost) {
    png_image_free(&image);
    throw std::runtime_error("names a height map of absurd size");
  }
  std::vector<std::uint16_t> level(std::size_t{columns} * rows);
  std::vector<std::uint8_t> shallow(deep ? 0 : level.size());
  void* samples = deep ? static_cast<void*>(level.data()) : shallow.data();
  if (png_image_finish_read(&image, nullptr, samples, 0, nullptr) == 0) {
    throw std::runtime_error("names the height map " + file.string() + ", which is damaged");
  }
  std::copy(shallow.begin(), shallow.end(), level.begin());
  // Gazebo: the brightest sample of the image stands for the whole height; row 0 is the far side.
  const double most = std::max<double>(1, *std::max_element(level.begin(), level.end()));
  const auto first = static_cast<std::uint32_t>(scene.vertices.size());
  for (std::uint32_t row = 0; row < rows; ++row) {
    for (std::uint32_t column = 0; column < columns; ++column) {
      const Vec3 p(size.x() * (column / (columns - 1.0) - 0.5),
                   size.y() * (0.5 - row / (rows - 1.0)),
                   size.z() * level[std::size_t{row} * columns + column] / most);
      scene.vertices.push_back(X_FP * p);
    }
  }
  for (std::uint32_t row = 0; row + 1 < rows; ++row) {
    for (std::uint32_t column = 0; column + 1 < columns; ++column) {
      const std::uint32_t a = first + row * columns + column, b = a + columns;
      scene.triangles.push_back({a, b, b + 1});
      scene.triangles.push_back({a, b + 1, a + 1});
      scene.group_of_triangle.insert(scene.group_of_triangle.end(), 2, group);
    }
  }
}

}  // namespace arex::worlds
