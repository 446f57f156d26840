#include <octomap/octomap.h>

#include <cmath>
#include <fstream>
#include <memory>
#include <stdexcept>

#include "worlds/file_readers.h"

namespace arex::worlds {
namespace {

std::unique_ptr<octomap::OcTree> load(const std::filesystem::path& file) {
  std::ifstream stream(file, std::ios::binary);
  if (!stream) throw std::runtime_error("cannot be opened");
  if (file.extension() == ".bt") {
    auto tree = std::make_unique<octomap::OcTree>(0.1);
    if (!tree->readBinary(stream)) throw std::runtime_error("is no binary octree of OctoMap");
    return tree;
  }
  std::unique_ptr<octomap::AbstractOcTree> any(octomap::AbstractOcTree::read(stream));
  auto* tree = dynamic_cast<octomap::OcTree*>(any.get());
  if (tree == nullptr) throw std::runtime_error("is no OcTree of OctoMap");
  static_cast<void>(any.release());
  return std::unique_ptr<octomap::OcTree>(tree);
}

}  // namespace

FileScene read_octree(const std::filesystem::path& file) {
  const std::unique_ptr<octomap::OcTree> tree = load(file);
  FileScene scene;
  scene.up = FileUp::kZ;
  scene.voxel_m = tree->getResolution();
  if (!(scene.voxel_m >= 1e-3 && scene.voxel_m <= 10)) {
    throw std::runtime_error("has cells of " + std::to_string(scene.voxel_m) +
                             " m, expected 0.001 to 10");
  }
  std::size_t free = 0;
  for (auto leaf = tree->begin_leafs(), end = tree->end_leafs(); leaf != end; ++leaf) {
    if (!tree->isNodeOccupied(*leaf)) {
      ++free;
      continue;
    }
    const int side = 1 << (tree->getTreeDepth() - leaf.getDepth());
    const octomap::OcTreeKey key = leaf.getIndexKey();
    constexpr int kZero = 1 << 15;
    scene.voxels.push_back({key[0] - kZero, key[1] - kZero, key[2] - kZero, side});
  }
  scene.groups.push_back({"octree", "", "voxels"});
  scene.notes.push_back(std::to_string(scene.voxels.size()) + " occupied and " +
                        std::to_string(free) + " free leaves; what is unknown counts as free");
  return scene;
}

}  // namespace arex::worlds
