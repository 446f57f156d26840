#include "worlds/file_world.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <limits>
#include <map>
#include <numbers>
#include <utility>

#include "config/config.h"
#include "config/text.h"
#include "worlds/file_contained.h"
#include "worlds/file_readers.h"
#include "worlds/file_start.h"
#include "worlds/file_voxels.h"
#include "worlds/mesh_builder.h"

namespace arex::worlds {
namespace {

namespace fs = std::filesystem;

constexpr double kLargest = 2000;  // m; a garage of 5 km has other units than were thought
constexpr double kFarthest = 1e5;  // m from the origin: single precision has 8 mm there
constexpr double kMostFileBytes = 2e9;
constexpr std::size_t kMostTriangles = 20'000'000;
constexpr double kHeadroom = 3.0;  // of air above the highest surface, m
constexpr double kLevel = 0.7;     // |n.z| of what may be floor or ceiling
constexpr double kFlat = 0.97;     // |n.z| of a floor that is no ramp: 14 degrees
constexpr int kRound = 32;         // sides of what is round

std::string ending_of(const fs::path& file) {
  std::string ending = file.extension().string();
  if (!ending.empty()) ending.erase(0, 1);
  std::transform(ending.begin(), ending.end(), ending.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return ending;
}

FileScene read_scene(const FileRecipe& recipe, const std::string& ending) {
  const fs::path file = recipe.path;
  if (ending == "ply") return read_ply(file);
  if (ending == "pcd") return read_pcd(file);
  if (ending == "bt" || ending == "ot") return read_octree(file);
  if (ending == "sdf" || ending == "world") {
    return read_sdf(file, {recipe.model_paths.begin(), recipe.model_paths.end()});
  }
  return read_assimp(file);
}

double size_of(const fs::path& file) {
  std::error_code error;
  if (!fs::exists(file, error)) throw ConfigError("there is no such file");
  if (!fs::is_regular_file(file, error)) throw ConfigError("is no file");
  const auto size = static_cast<double>(fs::file_size(file, error));
  if (error) throw ConfigError("cannot be read");
  if (size == 0) throw ConfigError("is empty");
  if (size > kMostFileBytes) throw ConfigError("is larger than 2 GB");
  return size;
}

FileScene read_contained(const FileRecipe& recipe, const std::string& ending) {
  static constexpr std::array<std::string_view, 11> kEndings{
      "ply", "stl", "obj", "dae", "gltf", "glb", "sdf", "world", "bt", "ot", "pcd"};
  if (std::find(kEndings.begin(), kEndings.end(), ending) == kEndings.end()) {
    throw ConfigError(
        "is of no kind that can be read: .ply .stl .obj .dae .gltf .glb .sdf .world "
        ".bt .ot .pcd");
  }
  ContainedLimits limits;
  // libsdformat takes 10 us for a byte.
  const bool sdf = ending == "sdf" || ending == "world";
  limits.cpu_s = 1.5 + size_of(recipe.path) * (sdf ? 6e-5 : 1e-6);
  return FileScene::unpack(
      run_contained([&] { return read_scene(recipe, ending).pack(); }, limits));
}

/// Ends with what is wrong, and with what was left out on the way there.
[[noreturn]] void refuse(std::string what, const FileScene& scene) {
  for (const std::string& note : scene.notes) what += "; " + note;
  throw ConfigError(what);
}

/// From the file's axes to z up.
Mat3 upright(FileUp up) {
  Mat3 R = Mat3::Identity();
  if (up == FileUp::kY) R << 1, 0, 0, 0, 0, -1, 0, 1, 0;
  if (up == FileUp::kX) R << 0, 1, 0, 0, 0, 1, 1, 0, 0;
  return R;
}

/// How much of a scene is level if this axis points up: area, m^2, and height, m.
struct Levelness {
  double area = 0;
  double height = 0;
};

Levelness levelness(const FileScene& scene, Eigen::Index axis) {
  Levelness out;
  double low = std::numeric_limits<double>::infinity(), high = -low;
  for (const auto& [a, b, c] : scene.triangles) {
    const Vec3 &p = scene.vertices[a], &q = scene.vertices[b], &r = scene.vertices[c];
    const Vec3 area = 0.5 * (q - p).cross(r - p);
    if (std::abs(area[axis]) > kLevel * area.norm()) out.area += area.norm();
    low = std::min({low, p[axis], q[axis], r[axis]});
    high = std::max({high, p[axis], q[axis], r[axis]});
  }
  out.height = high - low;
  return out;
}

/// Many a COLLADA or OBJ file has other axes than it says, for Gazebo and others do not ask. Where
/// its surfaces lie level the other way round, and it would stand on its edge, they are believed.
FileUp choose_up(FileUp up, bool primitives, const FileScene& scene, std::string& note) {
  if (primitives || (up != FileUp::kY && up != FileUp::kZ)) return up;
  const Eigen::Index said = up == FileUp::kY ? 1 : 2, other = up == FileUp::kY ? 2 : 1;
  const Levelness as_said = levelness(scene, said), as_other = levelness(scene, other);
  constexpr double kOnEdge = 10;  // as high as that many times what it would be otherwise
  const bool doubtful = as_other.area > as_said.area && as_said.height > kOnEdge * as_other.height;
  if (!doubtful) return up;
  note = fmt::format(
      "{} is taken as up, for along {} it would be {:.0f} m high and hardly level anywhere; "
      "see file.up",
      said == 1 ? 'z' : 'y', said == 1 ? 'y' : 'z', as_said.height);
  return said == 1 ? FileUp::kZ : FileUp::kY;
}

/// Into W. What stands in the file is checked here for the first time.
void place(const FileRecipe& recipe, FileUp up, FileScene& scene) {
  const Mat3 R = upright(up);
  const auto to_W = [&](const Vec3& p) -> Vec3 { return recipe.scale * (R * p) - recipe.offset_m; };
  std::size_t odd = 0;
  for (Vec3& p : scene.vertices) {
    p = to_W(p);
    odd += !p.allFinite();
  }
  for (FilePrimitive& primitive : scene.primitives) {
    primitive.X_FP = {R * primitive.X_FP.R, to_W(primitive.X_FP.p)};
    primitive.size *= recipe.scale;
    odd += !(primitive.X_FP.p.allFinite() && primitive.size.allFinite());
  }
  if (odd > 0) throw ConfigError(std::to_string(odd) + " of its coordinates are no numbers");
}

void check_indices(const FileScene& scene) {
  bool sound = scene.group_of_triangle.size() == scene.triangles.size();
  for (const auto& corners : scene.triangles) {
    for (const std::uint32_t corner : corners) sound &= corner < scene.vertices.size();
  }
  for (const std::uint32_t group : scene.group_of_triangle) sound &= group < scene.groups.size();
  for (const FilePrimitive& p : scene.primitives) {
    sound &= p.group < scene.groups.size();
  }
  if (!sound) throw ConfigError("has faces of vertices that it lacks");
}

/// @return how many shapes had no extent
std::size_t drop_degenerate(std::vector<FilePrimitive>& primitives) {
  return std::erase_if(primitives, [](const FilePrimitive& primitive) {
    if (primitive.size.minCoeff() < 0) throw ConfigError("has a shape of negative size");
    const bool box = primitive.kind == FilePrimitive::Kind::kBox;
    const double least =
        box ? primitive.size.minCoeff() : std::min(primitive.size.x(), primitive.size.y());
    return !(least > 1e-6);
  });
}

/// @return how many triangles had no area
std::size_t drop_slivers(FileScene& scene) {
  std::size_t kept = 0;
  for (std::size_t t = 0; t < scene.triangles.size(); ++t) {
    std::array<Vec3, 3> v;
    for (std::size_t i = 0; i < 3; ++i) {
      // As the world will hold them.
      v[i] = scene.vertices[scene.triangles[t][i]].cast<float>().cast<double>();
    }
    const double longest2 = std::max(
        {(v[1] - v[0]).squaredNorm(), (v[2] - v[1]).squaredNorm(), (v[0] - v[2]).squaredNorm()});
    const double doubled_area = (v[1] - v[0]).cross(v[2] - v[0]).norm();
    if (!(doubled_area > 1e-6 * longest2 && doubled_area > 1e-12)) continue;
    scene.triangles[kept] = scene.triangles[t];
    scene.group_of_triangle[kept++] = scene.group_of_triangle[t];
  }
  const std::size_t dropped = scene.triangles.size() - kept;
  scene.triangles.resize(kept);
  scene.group_of_triangle.resize(kept);
  return dropped;
}

/// Objects of the world for the groups of a file.
class Objects {
 public:
  Objects(const FileRecipe& recipe, const FileScene& scene, MeshBuilder& builder)
      : recipe_(recipe), scene_(scene), builder_(builder) {}

  /// The object of a group's triangles, felt, or of its primitive, which has a shape to be felt.
  std::uint32_t of(std::uint32_t group_id, bool felt) {
    const auto [place, fresh] = known_.try_emplace({group_id, felt}, 0);
    if (!fresh) return place->second;
    const FileGroup& group = scene_.groups[group_id];
    const FileClassRule* rule = rule_for(group, recipe_.classes);
    const std::optional<SurfaceClass> by_name = rule ? rule->surface_class : class_by_name(group);
    const SurfaceClass surface = by_name.value_or(SurfaceClass::kWall);
    double reflectivity = reflectivity_of(surface);
    if (group.reflectivity >= 0 && group.reflectivity <= 1) reflectivity = group.reflectivity;
    if (rule && rule->reflectivity >= 0) reflectivity = rule->reflectivity;
    place->second =
        builder_.add_object(surface, reflectivity, felt && surface != SurfaceClass::kLeaf);
    named_.push_back(by_name.has_value());
    return place->second;
  }

  /// One per object: whether its class is known; otherwise its triangles' form tells.
  [[nodiscard]] const std::vector<bool>& named() const { return named_; }

 private:
  const FileRecipe& recipe_;
  const FileScene& scene_;
  MeshBuilder& builder_;
  std::map<std::pair<std::uint32_t, bool>, std::uint32_t> known_;
  std::vector<bool> named_;
};

/// A capsule's surface: rings from pole to pole.
void draw_capsule(MeshBuilder& builder, std::uint32_t object, const Pose& X, double radius,
                  double half_length) {
  constexpr int kRings = 6;
  std::vector<Vec3> points;
  std::vector<double> radii;
  for (const double end : {-1.0, 1.0}) {
    for (int i = 0; i <= kRings; ++i) {
      const double polar = 0.5 * std::numbers::pi * (end < 0 ? i : kRings - i) / kRings;
      points.push_back(X * Vec3(0, 0, end * (half_length + radius * std::cos(polar))));
      radii.push_back(polar == 0 ? 0 : radius * std::sin(polar));
    }
  }
  builder.add_tube(object, points, radii, kRound);
}

void add_primitive(MeshBuilder& builder, const FilePrimitive& primitive, std::uint32_t object,
                   bool felt) {
  const Pose& X = primitive.X_FP;
  const double radius = primitive.size.x(), half = primitive.size.y();
  switch (primitive.kind) {
    case FilePrimitive::Kind::kBox:
      builder.add_box(object, X, primitive.size);
      if (felt) builder.add_collision_box(object, X, primitive.size);
      return;
    case FilePrimitive::Kind::kCylinder:
      builder.add_cylinder(object, X, radius, half, kRound);
      if (felt) builder.add_collision_cylinder(object, X, radius, half);
      return;
    case FilePrimitive::Kind::kSphere:
    case FilePrimitive::Kind::kCapsule:
      draw_capsule(builder, object, X, radius, half);
      if (felt) {
        builder.add_collision_capsule(object, X * Vec3(0, 0, -half), X * Vec3(0, 0, half), radius);
      }
      return;
  }
}

void expect_fair_extent(const Bounds& bounds) {
  const Vec3 size = bounds.high - bounds.low;
  if (size.maxCoeff() > kLargest) {
    throw ConfigError(
        fmt::format("is {:.4g} x {:.4g} x {:.4g} m large, expected at most {:.0f}: has it other "
                    "units? See file.scale",
                    size.x(), size.y(), size.z(), kLargest));
  }
  if (bounds.low.cwiseAbs().maxCoeff() > kFarthest ||
      bounds.high.cwiseAbs().maxCoeff() > kFarthest) {
    throw ConfigError(fmt::format(
        "lies around ({:.0f}, {:.0f}, {:.0f}) m, expected within {:.0e} m of its "
        "origin: see file.offset_m",
        0.5 * (bounds.low.x() + bounds.high.x()), 0.5 * (bounds.low.y() + bounds.high.y()),
        0.5 * (bounds.low.z() + bounds.high.z()), kFarthest));
  }
}

/// Gives each triangle corners of its own. A mesh that hangs together and is closed is taken for a
/// solid by the depth renderer, which leaves out its far side; a hall is closed and flown in.
void unshare(FileScene& scene) {
  std::vector<Vec3> vertices;
  vertices.reserve(3 * scene.triangles.size());
  for (auto& corners : scene.triangles) {
    for (std::uint32_t& corner : corners) {
      vertices.push_back(scene.vertices[corner]);
      corner = static_cast<std::uint32_t>(vertices.size() - 1);
    }
  }
  scene.vertices = std::move(vertices);
}

/// The world but for its start; `named`: whether an object's class is known.
World build(const FileRecipe& recipe, FileScene& scene, std::vector<bool>& named) {
  MeshBuilder builder;
  Objects objects(recipe, scene, builder);
  std::vector<std::uint32_t> object_of_triangle(scene.triangles.size());
  for (std::size_t t = 0; t < scene.triangles.size(); ++t) {
    object_of_triangle[t] = objects.of(scene.group_of_triangle[t], true);
  }
  unshare(scene);
  builder.add_mesh(scene.vertices, scene.triangles, object_of_triangle);
  for (const FilePrimitive& primitive : scene.primitives) {
    const FileClassRule* rule = rule_for(scene.groups[primitive.group], recipe.classes);
    const auto surface = rule ? rule->surface_class : class_by_name(scene.groups[primitive.group]);
    add_primitive(builder, primitive, objects.of(primitive.group, false),
                  surface != SurfaceClass::kLeaf);
  }
  expect_fair_extent(builder.bounds());
  named = objects.named();
  World world = builder.finish();
  if (!recipe.low_m.empty()) world.bounds.low = Vec3(recipe.low_m.data());
  // Nobody knows what is above the highest cell.
  if (scene.voxel_m == 0) world.bounds.high.z() += kHeadroom;
  if (!recipe.high_m.empty()) world.bounds.high = Vec3(recipe.high_m.data());
  if (!((world.bounds.high - world.bounds.low).minCoeff() > 0)) {
    throw ConfigError("has bounds without room: see file.low_m, file.high_m");
  }
  return world;
}

/// Tells floors, ramps, ceilings and walls apart where no name did: by slope, and by whether the
/// open air is above or below.
class FormClasses {
 public:
  FormClasses(World& world, const Vec3& start) : world_(world) {
    const double volume = (world.bounds.high - world.bounds.low).prod();
    constexpr double kMostProbed = 4e7;
    const double resolution = std::max(0.2, std::cbrt(volume / kMostProbed));
    OccupancyGrid occupancy = voxelize(world, make_grid(world.bounds, resolution),
                                       ClassSet::all().without(SurfaceClass::kLeaf));
    air_.grid = occupancy.grid;
    air_.passable = std::move(occupancy.occupied);
    for (std::uint8_t& cell : air_.passable) cell = !cell;
    air_.reachable.assign(air_.passable.size(), 0);
    for (double rise = 0.5 * resolution; rise < 1.6; rise += 0.5 * resolution) {
      if (flood(air_, air_.grid.cell_of(start + rise * Vec3::UnitZ())) > 0) break;
    }
  }

  void apply(const std::vector<bool>& named) {
    for (std::size_t t = 0; t < world_.mesh.triangles.size(); ++t) {
      std::uint32_t& object = world_.mesh.object_of_triangle[t];
      if (object >= named.size() || named[object]) continue;
      object = sibling(object, form_of(t));
    }
  }

 private:
  [[nodiscard]] SurfaceClass form_of(std::size_t t) const {
    std::array<Vec3, 3> v;
    for (std::size_t i = 0; i < 3; ++i) {
      v[i] = world_.mesh.vertices[world_.mesh.triangles[t][i]].cast<double>();
    }
    const double slope = std::abs((v[1] - v[0]).cross(v[2] - v[0]).normalized().z());
    if (slope < kLevel) return SurfaceClass::kWall;
    const Vec3 middle = (v[0] + v[1] + v[2]) / 3;
    const int up = steps_to_air(middle, 1), down = steps_to_air(middle, -1);
    if (up > down) return SurfaceClass::kCeiling;
    return slope > kFlat ? SurfaceClass::kFloor : SurfaceClass::kRamp;
  }

  /// How many steps away from a level face the air begins that is open to the start; the cells
  /// beside it are its own. Beyond a thin slab there is air as well, but farther.
  [[nodiscard]] int steps_to_air(const Vec3& p, double direction) const {
    constexpr int kMostSteps = 4;
    for (int step = 0; step < kMostSteps; ++step) {
      const double cells = 0.75 + 0.5 * step;
      const Eigen::Vector3i cell =
          air_.grid.cell_of(p + direction * cells * air_.grid.resolution_m * Vec3::UnitZ());
      if (air_.grid.contains(cell) && air_.reachable[air_.grid.index(cell)]) return step;
    }
    return kMostSteps;
  }

  /// An object like this one, of that class.
  std::uint32_t sibling(std::uint32_t object, SurfaceClass surface) {
    const auto [place, fresh] =
        siblings_.try_emplace({object, surface}, static_cast<std::uint32_t>(world_.objects.size()));
    if (fresh) {
      Object like = world_.objects[object];
      if (like.surface_class == surface) {
        place->second = object;
      } else {
        like.surface_class = surface;
        world_.objects.push_back(like);
      }
    }
    return place->second;
  }

  World& world_;
  FreeSpace air_;
  std::map<std::pair<std::uint32_t, SurfaceClass>, std::uint32_t> siblings_;
};

void measure_reach(const FreeSpace& free, FileWorld& out) {
  const GridGeometry& grid = free.grid;
  Eigen::Vector3i low = grid.size, high = Eigen::Vector3i::Constant(-1);
  std::vector<std::uint8_t> seen(
      static_cast<std::size_t>(grid.size.x()) * static_cast<std::size_t>(grid.size.y()), 0);
  std::size_t count = 0, i = 0;
  for (int z = 0; z < grid.size.z(); ++z) {
    std::size_t column = 0;
    for (int y = 0; y < grid.size.y(); ++y) {
      for (int x = 0; x < grid.size.x(); ++x, ++column, ++i) {
        if (!free.reachable[i]) continue;
        ++count;
        seen[column] = 1;
        low = low.cwiseMin(Eigen::Vector3i(x, y, z));
        high = high.cwiseMax(Eigen::Vector3i(x, y, z));
      }
    }
  }
  const double r = grid.resolution_m;
  out.reachable = {grid.origin + r * low.cast<double>(),
                   grid.origin + r * (high.cast<double>() + Vec3::Ones())};
  out.reachable_m3 = static_cast<double>(count) * r * r * r;
  out.reachable_m2 = static_cast<double>(std::count(seen.begin(), seen.end(), 1)) * r * r;
}

FileWorld load(const FileRecipe& recipe, double vehicle_radius_m) {
  FileWorld out;
  out.format = ending_of(recipe.path);
  FileScene scene = read_contained(recipe, out.format);
  mesh_voxels(scene, recipe.voxel_m / recipe.scale, recipe.voxel_points);
  if (scene.triangles.empty() && scene.primitives.empty()) {
    refuse("holds no faces, no shapes and no points", scene);
  }
  if (!(scene.unit_m > 0)) throw ConfigError(fmt::format("names a unit of {:g} m", scene.unit_m));
  if (scene.triangles.size() > kMostTriangles) {
    throw ConfigError("holds " + std::to_string(scene.triangles.size()) +
                      " triangles, expected at most " + std::to_string(kMostTriangles));
  }
  check_indices(scene);
  out.up_assumed = recipe.up == FileUpAxis::kAuto && scene.up == FileUp::kUnknown;
  FileUp up = scene.up == FileUp::kUnknown ? FileUp::kZ : scene.up;
  std::string doubt;
  if (recipe.up != FileUpAxis::kAuto) {
    up = static_cast<FileUp>(static_cast<int>(recipe.up));
  } else if (scene.voxel_m == 0) {
    up = choose_up(up, !scene.primitives.empty(), scene, doubt);
  }
  out.up = enum_names(FileUpAxis{})[static_cast<std::size_t>(up)];
  place(recipe, up, scene);
  out.dropped = drop_slivers(scene);
  const std::size_t without_extent = drop_degenerate(scene.primitives);
  if (scene.triangles.empty() && scene.primitives.empty()) {
    const std::string shapes =
        without_extent > 0 ? fmt::format(" and {} shapes", without_extent) : "";
    refuse(fmt::format("holds {} faces{}, all of them without area", out.dropped, shapes), scene);
  }
  if (without_extent > 0) {
    scene.notes.push_back(fmt::format("{} shapes without extent left out", without_extent));
  }
  out.unit_m = scene.unit_m;
  out.notes = std::exchange(scene.notes, {});
  if (!doubt.empty()) out.notes.push_back(doubt);
  std::vector<bool> named;
  out.world = build(recipe, scene, named);
  scene = {};
  FoundStart start = find_start(out.world, recipe.start, vehicle_radius_m);
  out.world.X_WS = start.X_WS;
  out.start_found = recipe.start.position_m.empty();
  out.start_room_m = start.room_m;
  measure_reach(start.free, out);
  start = {};
  if (std::find(named.begin(), named.end(), false) != named.end()) {
    FormClasses(out.world, out.world.X_WS.p).apply(named);
  }
  for (std::size_t t = 0; t < out.world.mesh.triangles.size(); ++t) {
    ++out.triangles_of_class[static_cast<std::size_t>(out.world.class_of_triangle(t))];
  }
  return out;
}

}  // namespace

FileWorld load_file_world(const FileRecipe& recipe, double vehicle_radius_m) {
  try {
    return load(recipe, vehicle_radius_m);
  } catch (const ConfigError& error) {
    throw ConfigError(shortened(recipe.path, 300) + ": " + error.what());
  }
}

std::string describe(const FileWorld& loaded) {
  const World& world = loaded.world;
  const Vec3 low = world.bounds.low, high = world.bounds.high;
  std::string text =
      fmt::format("{}: {} triangles, {} objects, {} collision shapes; z up from {}{}\n",
                  loaded.format, world.mesh.triangles.size(), world.objects.size(),
                  world.collision_shapes.size(), loaded.up, loaded.up_assumed ? " (assumed)" : "");
  text += fmt::format("extent: {:.2f} x {:.2f} x {:.2f} m, from ({:.2f}, {:.2f}, {:.2f})\n",
                      high.x() - low.x(), high.y() - low.y(), high.z() - low.z(), low.x(), low.y(),
                      low.z());
  text += "classes:";
  for (std::size_t i = 0; i < loaded.triangles_of_class.size(); ++i) {
    if (loaded.triangles_of_class[i] == 0) continue;
    text += " " + std::string(kSurfaceClassNames[i]) + " " +
            std::to_string(loaded.triangles_of_class[i]);
  }
  const Pose& X = world.X_WS;
  text += fmt::format(
      "\nstart: ({:.2f}, {:.2f}, {:.2f}) m, yaw {:.2f} rad, {}, {}{:.2f} m of room\n", X.p.x(),
      X.p.y(), X.p.z(), std::atan2(X.R(1, 0), X.R(0, 0)), loaded.start_found ? "found" : "given",
      loaded.start_room_m >= 2 ? "over " : "", loaded.start_room_m);
  text += fmt::format(
      "reachable: {:.1f} m^2 seen from above, {:.1f} m^3, from ({:.2f}, {:.2f}, {:.2f}) to "
      "({:.2f}, {:.2f}, {:.2f})\n",
      loaded.reachable_m2, loaded.reachable_m3, loaded.reachable.low.x(), loaded.reachable.low.y(),
      loaded.reachable.low.z(), loaded.reachable.high.x(), loaded.reachable.high.y(),
      loaded.reachable.high.z());
  if (loaded.dropped > 0) {
    text += fmt::format("note: {} faces without area left out\n", loaded.dropped);
  }
  for (const std::string& note : loaded.notes) text += "note: " + printable(note) + "\n";
  return text;
}

}  // namespace arex::worlds
