#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <span>

#include "mapping/brick.h"

namespace arex {

/// The map as an octomap::OcTree: its maximum-likelihood form, as OctoMap's binary file stores it
/// (every known leaf at the upper or the lower clamp), pruned, inner nodes consistent at all times.
/// Changes come brick by brick in the tree's own order, so that each inner node is refreshed once.
class StateTree {
 public:
  StateTree(double resolution_m, double min_probability, double max_probability);
  ~StateTree();
  StateTree(StateTree&&) noexcept;

  /// @pre each brick occurs once; changed voxels are known.
  void apply(std::span<BrickChange> changes);

  /// -1 unknown, 0 free, 1 occupied; asked of the tree.
  [[nodiscard]] int state(const Vec3& p) const;
  [[nodiscard]] std::size_t nodes() const;
  /// OctoMap's binary format (.bt). @throws DiskError.
  void write(const std::filesystem::path& file) const;

 private:
  class Tree;
  std::unique_ptr<Tree> tree_;
};

}  // namespace arex
