#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "worlds/file_scene.h"

/// One reader for each kind of file. All throw an exception whose what() says what is wrong with
/// the file, without its name. They are run by run_contained(): two of the libraries behind them
/// crash on damaged files.
namespace arex::worlds {

/// COLLADA, glTF, OBJ, STL by Assimp, in the file's own axes. The scene graph is flattened; the
/// nodes' names stay.
FileScene read_assimp(const std::filesystem::path& file);

/// ASCII or binary PLY of either byte order: faces if it has any, otherwise a cloud. The properties
/// class, object and reflectivity of the faces that `arex world` writes are understood.
FileScene read_ply(const std::filesystem::path& file);

/// PCD: ascii, binary, binary_compressed. Points that are not finite are left out and counted.
FileScene read_pcd(const std::filesystem::path& file);

/// OctoMap's .bt and .ot: the occupied cells.
FileScene read_octree(const std::filesystem::path& file);

/// A Gazebo world or model by libsdformat. What is seen is what is felt: the visuals; a link
/// without visuals stands for its collisions. The poses of a saved `<state>` hold.
/// @param model_paths where model:// is looked for, after the file's own folder and its parents
FileScene read_sdf(const std::filesystem::path& file,
                   const std::vector<std::filesystem::path>& model_paths);

/// A grey image as terrain, centred on the origin: the brightest sample is size.z above the darkest
/// possible. PNG, 8 or 16 bit.
void append_heightmap(const std::filesystem::path& image, const Vec3& size, const Pose& X_FP,
                      std::uint32_t group, FileScene& scene);

/// The whole file as bytes. @throws std::runtime_error if it cannot be read or is empty.
std::string read_bytes(const std::filesystem::path& file);

}  // namespace arex::worlds
