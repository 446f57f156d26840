#include <gtest/gtest.h>

#include <bit>
#include <cmath>
#include <set>

#include "math/random.h"
#include "room.h"
#include "support/temporary_folder.h"

namespace arex::worlds {
namespace {

using arex::test::TemporaryFolder;

/// Points on the floor and walls of a hall, and one stray point.
std::vector<Vec3f> hall(std::uint64_t seed) {
  RandomStream random(seed, "hall");
  std::vector<Vec3f> points;
  for (int i = 0; i < 60'000; ++i) {
    const double x = random.uniform(-4, 4), y = random.uniform(-3, 3), z = random.uniform(0, 2);
    switch (i % 3) {
      case 0:
        points.push_back(Vec3(x, y, 0.05).cast<float>());
        points.push_back(points.back());
        break;
      case 1:
        points.push_back(Vec3(x > 0 ? 3.95 : -3.95, y, z).cast<float>());
        points.push_back(points.back());
        break;
      default:
        points.push_back(Vec3(x, y > 0 ? 2.95 : -2.95, z).cast<float>());
        points.push_back(points.back());
        break;
    }
  }
  points.emplace_back(1.05F, 1.05F, 1.55F);
  return points;
}

std::string floats(const Vec3f& p) {
  std::string out;
  for (Eigen::Index i = 0; i < 3; ++i) {
    const auto bytes = std::bit_cast<std::array<char, 4>>(p[i]);
    out.append(bytes.data(), 4);
  }
  return out;
}

std::string pcd_header(std::size_t points, const char* data) {
  return "# .PCD v0.7\nVERSION 0.7\nFIELDS x y z intensity\nSIZE 4 4 4 4\nTYPE F F F F\nCOUNT 1 1 "
         "1 "
         "1\nWIDTH " +
         std::to_string(points) + "\nHEIGHT 1\nVIEWPOINT 0 0 0 1 0 0 0\nPOINTS " +
         std::to_string(points) + "\nDATA " + data + "\n";
}

/// LZF of literals only, which is as valid as any other.
std::string lzf(const std::string& raw) {
  std::string out;
  for (std::size_t at = 0; at < raw.size(); at += 32) {
    const std::string piece = raw.substr(at, 32);
    out += static_cast<char>(piece.size() - 1);
    out += piece;
  }
  return out;
}

std::map<std::string, std::string> files_of(const std::vector<Vec3f>& points) {
  std::map<std::string, std::string> files;
  std::string ascii = pcd_header(points.size(), "ascii"),
              binary = pcd_header(points.size(), "binary");
  std::string ply = "ply\nformat binary_little_endian 1.0\nelement vertex " +
                    std::to_string(points.size()) +
                    "\nproperty float x\nproperty float y\nproperty float z\nend_header\n";
  std::array<std::string, 4> by_field;
  for (const Vec3f& p : points) {
    char line[100];
    std::snprintf(line, sizeof(line), "%.9g %.9g %.9g 0.5\n", static_cast<double>(p.x()),
                  static_cast<double>(p.y()), static_cast<double>(p.z()));
    ascii += line;
    binary += floats(p) + std::string(4, '\0');
    ply += floats(p);
    for (std::size_t i = 0; i < 3; ++i) by_field[i] += floats(p).substr(4 * i, 4);
    by_field[3] += std::string(4, '\0');
  }
  const std::string raw = by_field[0] + by_field[1] + by_field[2] + by_field[3];
  const std::string packed = lzf(raw);
  std::string compressed = pcd_header(points.size(), "binary_compressed");
  for (const std::size_t size : {packed.size(), raw.size()}) {
    const auto bytes = std::bit_cast<std::array<char, 4>>(static_cast<std::uint32_t>(size));
    compressed.append(bytes.data(), 4);
  }
  compressed += packed;
  files["ascii.pcd"] = ascii;
  files["binary.pcd"] = binary;
  files["compressed.pcd"] = compressed;
  files["cloud.ply"] = ply;
  return files;
}

/// Faces between the cells that hold points and those that do not, counted one by one.
double boundary_area(const std::vector<Vec3f>& points, double voxel, int least) {
  std::map<std::array<int, 3>, int> cells;
  for (const Vec3f& p : points) {
    std::array<int, 3> c{};
    for (std::size_t i = 0; i < 3; ++i) {
      c[i] = static_cast<int>(
          std::floor(static_cast<double>(p[static_cast<Eigen::Index>(i)]) / voxel));
    }
    ++cells[c];
  }
  std::erase_if(cells, [&](const auto& cell) { return cell.second < least; });
  double area = 0;
  for (const auto& [cell, count] : cells) {
    for (std::size_t axis = 0; axis < 3; ++axis) {
      for (const int step : {-1, 1}) {
        auto next = cell;
        next[axis] += step;
        area += cells.contains(next) ? 0 : voxel * voxel;
      }
    }
  }
  return area;
}

double area_of(const World& world) {
  double area = 0;
  for (const auto& [a, b, c] : world.mesh.triangles) {
    const auto& v = world.mesh.vertices;
    area += 0.5 * static_cast<double>((v[b] - v[a]).cross(v[c] - v[a]).norm());
  }
  return area;
}

TEST(Cloud, EveryFormatGivesTheCellsThatHoldPoints) {
  const TemporaryFolder folder;
  const std::vector<Vec3f> points = hall(1);
  for (const auto& [name, bytes] : files_of(points)) {
    SCOPED_TRACE(name);
    test::write_file(folder / name, bytes);
    FileRecipe recipe = test::recipe_of(folder / name);
    for (const auto& [voxel, least] : {std::pair(0.1, 1), std::pair(0.1, 2), std::pair(0.25, 1)}) {
      recipe.voxel_m = voxel;
      recipe.voxel_points = least;
      const FileWorld loaded = load_file_world(recipe, test::kVehicleRadius);
      const double expected = boundary_area(points, voxel, least);
      EXPECT_NEAR(area_of(loaded.world), expected, 1e-5 * expected);
      EXPECT_NEAR(loaded.world.X_WS.p.z(), voxel, 1e-6) << "on top of the floor's cells";
      EXPECT_GT(loaded.reachable_m2, 25);
    }
  }
}

TEST(Cloud, PointsThatAreNotFiniteAreCountedNotRead) {
  std::vector<Vec3f> points = hall(2);
  for (int i = 0; i < 5; ++i) points.push_back(Vec3f::Constant(std::nanf("")));
  const TemporaryFolder folder;
  test::write_file(folder / "x.pcd", files_of(points).at("binary.pcd"));
  const FileWorld loaded = load_file_world(test::recipe_of(folder / "x.pcd"), test::kVehicleRadius);
  ASSERT_FALSE(loaded.notes.empty());
  EXPECT_NE(loaded.notes[0].find("5 points"), std::string::npos);
}

}  // namespace
}  // namespace arex::worlds
