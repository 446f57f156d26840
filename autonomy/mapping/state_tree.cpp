#include "mapping/state_tree.h"

#include <octomap/OcTree.h>

#include <algorithm>
#include <deque>
#include <sstream>
#include <vector>

#include "files/files.h"
#include "mapping/bits.h"

namespace arex {
namespace {

constexpr unsigned kBrickDepth = 13;  ///< of OctoMap's 16 levels: nodes of 8^3 voxels
constexpr int kBrickOffset = 1 << (kBrickDepth - 1);  ///< key of brick 0

struct Keyed {
  std::uint64_t key;  ///< Morton order of the tree
  const BrickChange* change;
};

std::uint64_t key_of(const Cell& brick) {
  const auto at = [&](int axis, std::uint64_t mask) {
    return scatter_bits(static_cast<std::uint64_t>(brick[axis] + kBrickOffset), mask);
  };
  return at(0, 0x9249249249249249) | at(1, 0x2492492492492492) | at(2, 0x4924924924924924);
}

using Children = std::array<octomap::AbstractOcTreeNode*, 8>;

/// A node whose children's pointers are kept by its owner.
struct Node : octomap::OcTreeNode {
  Node() = default;
  ~Node() { children = nullptr; }
  Node(const Node&) = delete;
  Node& operator=(const Node&) = delete;
  void adopt(Children& below) { children = below.data(); }
};

/// What a cube of voxels amounts to in the tree.
struct Subtree {
  Node* node = nullptr;  ///< null: nothing known
  bool occupied = false;
  std::uint32_t nodes = 0;
};

/// A node with its eight children.
struct Cube {
  Node node;
  Children below{};
  std::array<std::uint32_t, 8> nodes{};  ///< of each child's subtree
  std::uint8_t occupied = 0;             ///< children that are

  Cube() { node.adopt(below); }
  void set(unsigned child, const Subtree& subtree) {
    below[child] = subtree.node;
    nodes[child] = subtree.nodes;
    const unsigned bit = 1U << child;
    occupied = static_cast<std::uint8_t>(subtree.occupied ? occupied | bit : occupied & ~bit);
  }
};

}  // namespace

/// OcTree that owns its nodes. Cubes of 2^3 voxels are shared: there are but 3^8 of them. Larger
/// ones stay allocated once made; where a cube is uniform, its parent points to one of two leaves
/// instead, which is what OctoMap calls pruned.
class StateTree::Tree : public octomap::OcTree {
 public:
  Tree(double resolution_m, double min_probability, double max_probability) : OcTree(resolution_m) {
    setClampingThresMin(min_probability);
    setClampingThresMax(max_probability);
    leaves_[0].setLogOdds(clamping_thres_min);
    leaves_[1].setLogOdds(clamping_thres_max);
    make_bytes();
  }
  ~Tree() override {
    root = nullptr;
    tree_size = 0;
  }
  Tree(const Tree&) = delete;
  Tree& operator=(const Tree&) = delete;

  void apply(std::span<const Keyed> changes) {
    if (changes.empty()) return;
    const Subtree all = apply(top_, 0, changes);
    root = all.node;
    tree_size = all.nodes;
    size_changed = true;
  }

 private:
  /// 2^3 voxels in one of their states.
  struct Byte : Cube {
    Subtree subtree;
  };
  /// 8^3 voxels and their eight cubes of 4^3.
  struct Brick : Cube {
    std::array<Cube, 8> words;
  };
  /// A node above the bricks.
  struct Branch : Cube {
    std::array<Branch*, 8> branches{};
    std::array<Brick*, 8> bricks{};
  };

  [[nodiscard]] Subtree leaf(bool occupied) { return {&leaves_[occupied ? 1 : 0], occupied, 1}; }

  /// The cube as its parent sees it.
  Subtree close(Cube& cube) {
    for (const bool occupied : {false, true}) {
      const octomap::AbstractOcTreeNode* const same = &leaves_[occupied ? 1 : 0];
      if (std::all_of(cube.below.begin(), cube.below.end(),
                      [same](const auto* child) { return child == same; })) {
        return leaf(occupied);
      }
    }
    const bool occupied = cube.occupied != 0;
    cube.node.setLogOdds(occupied ? clamping_thres_max : clamping_thres_min);
    std::uint32_t nodes = 1;
    for (const std::uint32_t n : cube.nodes) nodes += n;
    return {&cube.node, occupied, nodes};
  }

  Subtree apply(Branch& branch, unsigned depth, std::span<const Keyed> changes) {
    const unsigned shift = 3 * (kBrickDepth - 1 - depth);
    while (!changes.empty()) {
      const std::uint64_t prefix = changes.front().key >> shift;
      std::size_t count = 1;
      while (count < changes.size() && changes[count].key >> shift == prefix) ++count;
      const auto child = static_cast<unsigned>(prefix & 7U);
      if (depth + 1 == kBrickDepth) {
        branch.set(child, apply(made(branch.bricks[child], bricks_), *changes.front().change));
      } else {
        branch.set(child,
                   apply(made(branch.branches[child], branches_), depth + 1, changes.first(count)));
      }
      changes = changes.subspan(count);
    }
    return close(branch);
  }

  Subtree apply(Brick& brick, const BrickChange& change) {
    for (unsigned w = 0; w < 8; ++w) {
      std::uint64_t changed = change.changed[w];
      if (changed == 0) continue;
      std::uint64_t known = (*change.known)[w], occupied = (*change.occupied)[w];
      for (unsigned b = 0; b < 8; ++b, known >>= 8, occupied >>= 8, changed >>= 8) {
        if ((changed & 0xff) == 0) continue;
        brick.words[w].set(b, bytes_[state_of_byte(known & 0xff, occupied & 0xff)].subtree);
      }
      brick.set(w, close(brick.words[w]));
    }
    return close(brick);
  }

  template <class T>
  static T& made(T*& pointer, std::deque<T>& all) {
    if (pointer == nullptr) pointer = &all.emplace_back();
    return *pointer;
  }

  /// The digits of the eight voxels' states to base 3: unknown 0, free 1, occupied 2.
  [[nodiscard]] std::size_t state_of_byte(std::uint64_t known, std::uint64_t occupied) const {
    return base3_[known] + base3_[occupied];
  }
  void make_bytes() {
    for (std::size_t bits = 0; bits < base3_.size(); ++bits) {
      for (std::size_t i = 0, power = 1; i < 8; ++i, power *= 3) {
        if ((bits >> i & 1U) != 0) base3_[bits] = static_cast<std::uint16_t>(base3_[bits] + power);
      }
    }
    for (std::size_t state = 0; state < bytes_.size(); ++state) {
      Byte& byte = bytes_[state];
      for (std::size_t i = 0, rest = state; i < 8; ++i, rest /= 3) {
        if (rest % 3 != 0) byte.set(static_cast<unsigned>(i), leaf(rest % 3 == 2));
      }
      if (state != 0) byte.subtree = close(byte);
    }
  }

  std::array<Node, 2> leaves_;  ///< free, occupied
  std::array<std::uint16_t, 256> base3_{};
  std::vector<Byte> bytes_ = std::vector<Byte>(6561);  ///< 3^8
  Branch top_;
  std::deque<Branch> branches_;
  std::deque<Brick> bricks_;
};

StateTree::StateTree(double resolution_m, double min_probability, double max_probability)
    : tree_(std::make_unique<Tree>(resolution_m, min_probability, max_probability)) {}
StateTree::~StateTree() = default;
StateTree::StateTree(StateTree&&) noexcept = default;

void StateTree::apply(std::span<BrickChange> changes) {
  std::vector<Keyed> keyed;
  keyed.reserve(changes.size());
  for (const BrickChange& change : changes) {
    keyed.push_back({key_of(change.brick), &change});
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

void StateTree::write(const std::filesystem::path& file) const {
  // The header as OctoMap writes it, whose own function talks to the terminal.
  std::ostringstream bytes;
  bytes << "# Octomap OcTree binary file\nid " << tree_->getTreeType() << "\nsize " << tree_->size()
        << "\nres " << tree_->getResolution() << "\ndata\n";
  tree_->writeBinaryData(bytes);
  write_atomically(file, bytes.view());
}

}  // namespace arex
