#include <octomap/octomap.h>

#include <cmath>
#include <fstream>
#include <iterator>
#include <memory>
#include <stdexcept>
#include <string>
#include <string_view>

#include "worlds/file_readers.h"

namespace arex::worlds {
namespace {

constexpr int kDeepest = 16;  // levels of OctoMap's trees

/// Walks over a node and all below it. OctoMap's own readers go on beyond a file's end, for ever
/// where its bits are damaged.
/// @param at of the node's bytes; afterwards of what follows. @return whether all of it is there
bool walk(std::string_view data, std::size_t& at, int depth, bool binary) {
  const std::size_t size = binary ? 2 : sizeof(float) + 1;
  if (at + size > data.size()) return false;
  unsigned inner = 0;
  if (binary) {
    for (unsigned child = 0; child < 8; ++child) {  // two bits each; both: it has children
      const auto byte = static_cast<unsigned char>(data[at + child / 4]);
      if ((byte >> (2 * (child % 4)) & 3U) == 3U) inner |= 1U << child;
    }
  } else {
    inner = static_cast<unsigned char>(data[at + sizeof(float)]);
  }
  at += size;
  for (unsigned child = 0; child < 8; ++child) {
    if ((inner >> child & 1U) == 0) continue;
    if (depth == kDeepest || !walk(data, at, depth + 1, binary)) return false;
  }
  return true;
}

void expect_whole(const std::filesystem::path& file) {
  std::ifstream stream(file, std::ios::binary);
  if (!stream) throw std::runtime_error("cannot be opened");
  std::string text(std::istreambuf_iterator<char>(stream), {});
  constexpr std::string_view kData = "\ndata\n";
  const std::size_t header = text.find(kData);
  if (header == std::string::npos) throw std::runtime_error("has no nodes");
  const std::string_view data = std::string_view(text).substr(header + kData.size());
  std::size_t at = 0;
  // Trees with colours and the like have other nodes, and are refused by what they call themselves.
  if (!data.empty() && !walk(data, at, 0, file.extension() == ".bt")) {
    throw std::runtime_error("its nodes are damaged or cut short");
  }
}

std::unique_ptr<octomap::OcTree> load_tree(const std::filesystem::path& file) {
  expect_whole(file);
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
  const std::unique_ptr<octomap::OcTree> tree = load_tree(file);
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
