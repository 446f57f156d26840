#include "mapping/state_tree.h"

#include <octomap/OcTree.h>

#include <algorithm>
#include <bit>
#include <fstream>
#include <vector>

namespace arex {
namespace {

constexpr unsigned kBrickDepth = 13;  ///< of OctoMap's 16 levels: nodes of 8^3 voxels
constexpr int kBrickOffset = 1 << (kBrickDepth - 1);  ///< key of brick 0

struct Keyed {
  std::uint64_t key;  ///< Morton order of the tree
  const BrickChange* change;
};

}  // namespace

/// OcTree with access to its root.
class StateTree::Tree : public octomap::OcTree {
 public:
  using octomap::OcTree::OcTree;

  void apply(std::span<const Keyed> changes) {
    if (changes.empty()) return;
    if (root == nullptr) {
      root = new octomap::OcTreeNode();
      ++tree_size;
      root_is_new_ = true;
    }
    apply(root, root_is_new_, 0, changes);
    root_is_new_ = false;
  }

 private:
  using Node = octomap::OcTreeNode;

  /// The child, made if it is not there. A node without children that is not new is pruned: its
  /// voxels all have its state.
  Node* child_of(Node* node, bool& is_new, unsigned child) {
    if (!nodeHasChildren(node) && !is_new) expandNode(node);
    is_new = !nodeChildExists(node, child);
    return is_new ? createNodeChild(node, child) : getNodeChild(node, child);
  }
  void refresh(Node* node) {
    if (!pruneNode(node)) node->updateOccupancyChildren();
  }
  /// refresh() of a node whose voxels are at hand: no look at the children unless they merge.
  void settle(Node* node, bool all_known, bool any_occupied, bool all_occupied) {
    if (all_known && any_occupied == all_occupied && pruneNode(node)) return;
    node->setLogOdds(value(any_occupied));
  }
  [[nodiscard]] float value(bool occupied) const {
    return occupied ? clamping_thres_max : clamping_thres_min;
  }

  /// Levels above the bricks.
  void apply(Node* node, bool is_new, unsigned depth, std::span<const Keyed> changes) {
    if (depth == kBrickDepth) {
      apply_brick(node, is_new, *changes.front().change);
      return;
    }
    const unsigned shift = 3 * (kBrickDepth - 1 - depth);
    while (!changes.empty()) {
      const std::uint64_t child = changes.front().key >> shift;
      std::size_t count = 1;
      while (count < changes.size() && changes[count].key >> shift == child) ++count;
      bool child_is_new = is_new;
      Node* const next = child_of(node, child_is_new, static_cast<unsigned>(child & 7U));
      is_new = false;
      apply(next, child_is_new, depth + 1, changes.first(count));
      changes = changes.subspan(count);
    }
    refresh(node);
  }

  void apply_brick(Node* node, bool is_new, const BrickChange& change) {
    for (unsigned w = 0; w < 8; ++w) {
      if (change.changed[w] == 0) continue;
      bool child_is_new = is_new;
      Node* const child = child_of(node, child_is_new, w);
      is_new = false;
      apply_word(child, child_is_new, (*change.known)[w], (*change.occupied)[w], change.changed[w]);
    }
    refresh(node);
  }

  /// A cube of 4^3 voxels: a node whose children are bytes.
  void apply_word(Node* node, bool is_new, std::uint64_t known, std::uint64_t occupied,
                  std::uint64_t changed) {
    const bool all_known = ~known == 0, any_occupied = occupied != 0, all_occupied = ~occupied == 0;
    for (unsigned b = 0; b < 8; ++b, known >>= 8, occupied >>= 8, changed >>= 8) {
      if ((changed & 0xff) == 0) continue;
      bool child_is_new = is_new;
      Node* const child = child_of(node, child_is_new, b);
      is_new = false;
      apply_byte(child, child_is_new, static_cast<unsigned>(known & 0xff),
                 static_cast<unsigned>(occupied & 0xff), static_cast<unsigned>(changed & 0xff));
    }
    settle(node, all_known, any_occupied, all_occupied);
  }

  /// A cube of 2^3 voxels: a node whose children are leaves.
  void apply_byte(Node* node, bool is_new, unsigned known, unsigned occupied, unsigned changed) {
    const bool uniform = known == 0xff && (occupied == 0 || occupied == 0xff);
    if (uniform && !nodeHasChildren(node)) {
      node->setLogOdds(value(occupied != 0));
      return;
    }
    for (unsigned v = 0; v < 8; ++v) {
      if ((changed >> v & 1U) == 0) continue;
      bool leaf_is_new = is_new;
      child_of(node, leaf_is_new, v)->setLogOdds(value((occupied >> v & 1U) != 0));
      is_new = false;
    }
    settle(node, known == 0xff, occupied != 0, occupied == 0xff);
  }

  bool root_is_new_ = false;
};

StateTree::StateTree(double resolution_m, double min_probability, double max_probability)
    : tree_(std::make_unique<Tree>(resolution_m)) {
  tree_->setClampingThresMin(min_probability);
  tree_->setClampingThresMax(max_probability);
}
StateTree::~StateTree() = default;
StateTree::StateTree(StateTree&&) noexcept = default;

void StateTree::apply(std::span<BrickChange> changes) {
  std::vector<Keyed> keyed;
  keyed.reserve(changes.size());
  for (const BrickChange& change : changes) {
    const auto at = [&](int axis) {
      return static_cast<std::uint64_t>(change.brick[axis] + kBrickOffset);
    };
    keyed.push_back({morton(at(0), at(1), at(2)), &change});
  }
  std::sort(keyed.begin(), keyed.end(),
            [](const Keyed& a, const Keyed& b) { return a.key < b.key; });
  tree_->apply(keyed);
}

int StateTree::state(const Vec3& p) const {
  const octomap::OcTreeNode* node = tree_->search(p.x(), p.y(), p.z());
  return node == nullptr ? -1 : (tree_->isNodeOccupied(node) ? 1 : 0);
}

std::size_t StateTree::nodes() const { return tree_->size(); }

bool StateTree::write(const std::filesystem::path& file) const {
  std::ofstream stream(file, std::ios::binary);
  return stream && tree_->writeBinaryConst(stream) && stream.flush();
}

}  // namespace arex
