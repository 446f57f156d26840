#pragma once

#include <array>
#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "math/pose.h"
#include "math/types.h"
#include "worlds/file_world.h"

/// A world that tests write into files of every kind and read back: a room of 6 x 5 x 3 m without a
/// roof, its floor at z = 0, a pillar off its middle. Nothing in it is symmetric, so that no axis
/// can be taken for another.
namespace arex::worlds::test {

constexpr double kVehicleRadius = 0.29;

struct Part {
  std::string name, material;
  std::vector<Vec3> vertices;
  std::vector<std::array<std::uint32_t, 3>> triangles;
};

/// Floor, walls, pillar; in W.
std::vector<Part> room();

/// Every vertex through a function: from W to a file's own axes and units.
std::vector<Part> mapped(std::vector<Part> parts, const std::function<Vec3(const Vec3&)>& f);

std::string stl_ascii(const std::vector<Part>& parts);
std::string stl_binary(const std::vector<Part>& parts);
std::string obj(const std::vector<Part>& parts);
enum class PlyKind { kAscii, kLittle, kBig };
std::string ply(const std::vector<Part>& parts, PlyKind kind);
/// @param node each part's node carries this 4 x 4 matrix
std::string collada(const std::vector<Part>& parts, const std::string& up_axis, double unit_m,
                    const Eigen::Matrix4d& node);
/// With its buffer inside; each part a node below one that carries the matrix.
std::string gltf(const std::vector<Part>& parts, const Eigen::Matrix4d& node);

void write_file(const std::filesystem::path& file, const std::string& bytes);

FileRecipe recipe_of(const std::filesystem::path& file);
World load(const std::filesystem::path& file);
/// What load_file_world() says of it; empty if it loads.
std::string refusal(const FileRecipe& recipe);

/// That the world's triangles are those of the parts, in any order, to within `tolerance_m`.
void expect_surface(const World& world, const std::vector<Part>& parts, double tolerance_m = 1e-5);

}  // namespace arex::worlds::test
