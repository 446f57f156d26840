#include "clouds/pcd_reader.h"
#include "worlds/file_readers.h"

namespace arex::worlds {

FileScene read_pcd(const std::filesystem::path& file) {
  const std::string bytes = read_bytes(file);
  if (!looks_like_pcd(bytes)) throw std::runtime_error("is no PCD file");
  FileScene scene;
  scene.points = arex::read_pcd(parse_pcd_header(bytes, bytes.size()), bytes).points;
  const std::size_t before = scene.points.size();
  std::erase_if(scene.points, [](const Vec3& p) { return !p.allFinite(); });
  if (scene.points.size() < before) {
    scene.notes.push_back(std::to_string(before - scene.points.size()) +
                          " points that are not finite left out");
  }
  scene.groups.push_back({"cloud", "", "voxels"});
  return scene;
}

}  // namespace arex::worlds
