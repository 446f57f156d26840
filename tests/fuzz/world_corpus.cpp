#include <octomap/octomap.h>

#include <sstream>

#include "fuzz/corpus.h"
#include "fuzz/mutation.h"
#include "room.h"
#include "support/temporary_folder.h"
#include "worlds/file_world.h"

namespace arex::test {
namespace {

using worlds::test::PlyKind;

std::string octree(bool binary) {
  octomap::OcTree tree(0.2);
  for (int i = -12; i < 12; ++i) {
    for (int j = -10; j < 10; ++j) {
      for (int k = 0; k < 8; ++k) {
        const bool rim = i == -12 || i == 11 || j == -10 || j == 9 || k == 0;
        tree.updateNode(octomap::point3d(0.2F * static_cast<float>(i) + 0.1F,
                                         0.2F * static_cast<float>(j) + 0.1F,
                                         0.2F * static_cast<float>(k) + 0.1F),
                        rim);
      }
    }
  }
  std::ostringstream out;
  if (binary) {
    tree.writeBinary(out);
  } else {
    tree.write(out);
  }
  return out.str();
}

std::string cloud() {
  std::ostringstream out;
  out << "# .PCD v0.7\nVERSION 0.7\nFIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nCOUNT 1 1 1\nWIDTH 900\n"
         "HEIGHT 1\nVIEWPOINT 0 0 0 1 0 0 0\nPOINTS 900\nDATA ascii\n";
  for (int i = 0; i < 900; ++i) out << 0.1 * (i % 30) << ' ' << 0.1 * (i / 30) << " 0.05\n";
  return out.str();
}

std::string gazebo() {
  return "<?xml version='1.0'?><sdf version='1.6'><world name='w'><model "
         "name='g'><static>1</static>"
         "<link name='l'><visual name='v'><geometry><plane><normal>0 0 1</normal><size>20 20</size>"
         "</plane></geometry></visual></link></model><model name='b'><pose>3 1 0.5 0 0 "
         "1</pose><link "
         "name='l'><collision name='c'><geometry><box><size>1 1 "
         "1</size></box></geometry></collision>"
         "</link></model><include><uri>model://x</uri></include><state world_name='w'><model "
         "name='b'><pose>1 3 0.5 0 0 0</pose></model></state></world></sdf>";
}

const Corpus& world_files() {
  static const Corpus files = [] {
    const auto parts = worlds::test::room();
    const Eigen::Matrix4d X = Eigen::Matrix4d::Identity();
    return Corpus{{"a.stl", worlds::test::stl_ascii(parts)},
                  {"b.stl", worlds::test::stl_binary(parts)},
                  {"c.obj", worlds::test::obj(parts)},
                  {"d.ply", worlds::test::ply(parts, PlyKind::kAscii)},
                  {"e.ply", worlds::test::ply(parts, PlyKind::kLittle)},
                  {"f.ply", worlds::test::ply(parts, PlyKind::kBig)},
                  {"g.dae", worlds::test::collada(parts, "Y_UP", 0.5, X)},
                  {"h.gltf", worlds::test::gltf(parts, X)},
                  {"i.bt", octree(true)},
                  {"j.ot", octree(false)},
                  {"k.pcd", cloud()},
                  {"l.world", gazebo()}};
  }();
  return files;
}

}  // namespace

std::filesystem::path write_damaged_world(const std::filesystem::path& folder,
                                          RandomStream& random) {
  static const std::vector<std::string> others = texts_of(world_files());
  const std::string name = any_name(world_files(), random);
  write_text(folder / name, damage_bytes(world_files().at(name), others, random));
  return folder / name;
}

void read_damaged_world(const std::filesystem::path& folder, RandomStream& random) {
  worlds::FileRecipe recipe;
  recipe.path = write_damaged_world(folder, random).string();
  constexpr double kVehicleRadius = 0.29;  // m
  static_cast<void>(worlds::load_file_world(recipe, kVehicleRadius));
}

}  // namespace arex::test
