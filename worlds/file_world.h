#pragma once

#include <array>
#include <string>
#include <vector>

#include "worlds/file_classes.h"
#include "worlds/world.h"

namespace arex::worlds {

/// Which axis of the file points up.
enum class FileUpAxis { kAuto, kX, kY, kZ };
constexpr std::array<std::string_view, 4> enum_names(FileUpAxis) { return {"auto", "x", "y", "z"}; }

/// Where the vehicle stands at first, in the world's frame.
struct FileStart {
  std::vector<double> position_m;
  double yaw_rad = 0;

  void fields(auto& f) {
    f("position_m", position_m,
      "x, y and, where there are several floors, z of the start; [] finds a free place");
    f("yaw_rad", yaw_rad, "heading");
    f.check(position_m.empty() || position_m.size() == 2 || position_m.size() == 3,
            "position_m of 0, 2 or 3 numbers");
  }
};

/// A world that somebody else has made: a mesh, a Gazebo world or model, an octree, a cloud.
struct FileRecipe {
  std::string path;  ///< absolute once the scenario is read
  double scale = 1;
  FileUpAxis up = FileUpAxis::kAuto;
  Vec3 offset_m = Vec3::Zero();
  double voxel_m = 0.1;
  int voxel_points = 1;
  std::vector<FileClassRule> classes;
  std::vector<std::string> model_paths;
  FileStart start;
  std::vector<double> low_m, high_m;

  void fields(auto& f) {
    f("path", path,
      ".ply .stl .obj .dae .gltf .glb .sdf .world .bt .ot .pcd; relative to the file that says so");
    f("scale", scale, "of its lengths, beyond the units that the file itself names");
    f("up", up, "which of its axes points up; auto: as its format has it, or else z");
    f("offset_m", offset_m, "taken off its coordinates after scale and up");
    f("voxel_m", voxel_m, "cells of a cloud");
    f("voxel_points", voxel_points, "cells of a cloud with fewer points are noise");
    f("classes", classes, "what is what: the first rule that fits holds, before the file's names");
    f("model_paths", model_paths, "folders where model:// is looked for");
    f("start", start, "where the vehicle stands at first");
    f("low_m", low_m, "lower corner of the world's bounds; [] as far as the file reaches");
    f("high_m", high_m, "upper corner of the world's bounds");
    f.check(scale > 0 && scale <= 1e6, "0 < scale <= 1e6");
    f.check(voxel_m >= 0.02 && voxel_m <= 2, "0.02 <= voxel_m <= 2");
    f.check(voxel_points >= 1 && voxel_points <= 200, "1 <= voxel_points <= 200");
    f.check(classes.size() <= 1000, "at most 1000 classes");
    f.check(model_paths.size() <= 100, "at most 100 model_paths");
    f.check((low_m.empty() || low_m.size() == 3) && (high_m.empty() || high_m.size() == 3),
            "low_m, high_m of 0 or 3 numbers");
    f.check(!holds_both() || (low_m[0] < high_m[0] && low_m[1] < high_m[1] && low_m[2] < high_m[2]),
            "low_m < high_m");
  }

 private:
  [[nodiscard]] bool holds_both() const { return low_m.size() == 3 && high_m.size() == 3; }
};

/// A file as it was understood.
struct FileWorld {
  World world;

  std::string format;        ///< by its ending: dae, world, ...
  double unit_m = 1;         ///< that the file names
  std::string up;            ///< axis of the file
  bool up_assumed = false;   ///< nothing said so
  std::size_t dropped = 0;   ///< triangles without area
  bool start_found = false;  ///< not given
  double start_room_m = 0;   ///< from the standing vehicle's middle to what is not ground
  Bounds reachable;          ///< what a vehicle's centre can get to from the start, its extent
  double reachable_m3 = 0;
  double reachable_m2 = 0;  ///< seen from above
  std::array<std::size_t, kSurfaceClassNames.size()> triangles_of_class{};
  std::vector<std::string> notes;
};

/// Reads and builds the world; a pure function of the files and its arguments.
/// @throws ConfigError (without FILE:LINE) if the file cannot be read, or makes no world to fly in
FileWorld load_file_world(const FileRecipe& recipe, double vehicle_radius_m);

/// The same for people, several lines.
std::string describe(const FileWorld& loaded);

}  // namespace arex::worlds
