#include "worlds/file_classes.h"

#include <algorithm>
#include <array>
#include <cctype>

#include "worlds/reflectivity.h"

namespace arex::worlds {
namespace {

char lower(char c) { return static_cast<char>(std::tolower(static_cast<unsigned char>(c))); }

struct Word {
  std::string_view text;
  SurfaceClass surface_class;
};

// The first of them that a name holds decides: a tree's leaves before the tree.
constexpr std::array kWords{
    Word{"leaf", SurfaceClass::kLeaf},      Word{"leaves", SurfaceClass::kLeaf},
    Word{"foliage", SurfaceClass::kLeaf},   Word{"canopy", SurfaceClass::kLeaf},
    Word{"branch", SurfaceClass::kBranch},  Word{"twig", SurfaceClass::kBranch},
    Word{"trunk", SurfaceClass::kTrunk},    Word{"bark", SurfaceClass::kTrunk},
    Word{"stem", SurfaceClass::kTrunk},     Word{"shrub", SurfaceClass::kShrub},
    Word{"bush", SurfaceClass::kShrub},     Word{"tree", SurfaceClass::kTrunk},
    Word{"log", SurfaceClass::kLog},        Word{"ceiling", SurfaceClass::kCeiling},
    Word{"roof", SurfaceClass::kCeiling},   Word{"ramp", SurfaceClass::kRamp},
    Word{"pillar", SurfaceClass::kPillar},  Word{"column", SurfaceClass::kPillar},
    Word{"pole", SurfaceClass::kPillar},    Word{"beam", SurfaceClass::kBeam},
    Word{"pipe", SurfaceClass::kPipe},      Word{"kerb", SurfaceClass::kKerb},
    Word{"curb", SurfaceClass::kKerb},      Word{"door", SurfaceClass::kDoor},
    Word{"car", SurfaceClass::kCar},        Word{"vehicle", SurfaceClass::kCar},
    Word{"truck", SurfaceClass::kCar},      Word{"wall", SurfaceClass::kWall},
    Word{"fence", SurfaceClass::kWall},     Word{"floor", SurfaceClass::kFloor},
    Word{"ground", SurfaceClass::kGround},  Word{"terrain", SurfaceClass::kGround},
    Word{"grass", SurfaceClass::kGround},   Word{"soil", SurfaceClass::kGround},
    Word{"asphalt", SurfaceClass::kGround}, Word{"heightmap", SurfaceClass::kGround}};

/// Whether `text` holds `word` as a word, in the singular or the plural: "cart" is no car.
bool holds(std::string_view text, std::string_view word) {
  const auto is_letter = [&](std::size_t i) {
    return i < text.size() && std::isalpha(static_cast<unsigned char>(text[i])) != 0;
  };
  // In "OakTrunk" a capital begins a word.
  const auto begins = [&](std::size_t i) {
    return i == 0 || !is_letter(i - 1) ||
           (std::isupper(static_cast<unsigned char>(text[i])) != 0 &&
            std::islower(static_cast<unsigned char>(text[i - 1])) != 0);
  };
  const auto ends = [&](std::size_t i) {
    return !is_letter(i) || (std::isupper(static_cast<unsigned char>(text[i])) != 0 &&
                             std::islower(static_cast<unsigned char>(text[i - 1])) != 0);
  };
  for (std::size_t at = 0; at + word.size() <= text.size(); ++at) {
    const bool same =
        std::equal(word.begin(), word.end(), text.begin() + static_cast<std::ptrdiff_t>(at),
                   [](char a, char b) { return a == lower(b); });
    if (!same || !begins(at)) continue;
    const std::size_t end = at + word.size();
    const bool plural = end < text.size() && lower(text[end]) == 's' && ends(end + 1);
    if (ends(end) || plural) return true;
  }
  return false;
}

std::optional<SurfaceClass> class_in(std::string_view text) {
  for (const Word& word : kWords) {
    if (holds(text, word.text)) return word.surface_class;
  }
  return {};
}

constexpr double middle(const ReflectivityBand& band) { return 0.5 * (band.low + band.high); }

}  // namespace

bool fits(std::string_view text, std::string_view pattern) {
  std::size_t t = 0, p = 0, star = std::string_view::npos, resume = 0;
  while (t < text.size()) {
    if (p < pattern.size() && pattern[p] == '*') {
      star = p++;
      resume = t;
    } else if (p < pattern.size() && (pattern[p] == '?' || lower(pattern[p]) == lower(text[t]))) {
      ++p;
      ++t;
    } else if (star != std::string_view::npos) {
      p = star + 1;
      t = ++resume;
    } else {
      return false;
    }
  }
  while (p < pattern.size() && pattern[p] == '*') ++p;
  return p == pattern.size();
}

const FileClassRule* rule_for(const FileGroup& group, const std::vector<FileClassRule>& rules) {
  for (const FileClassRule& rule : rules) {
    if (fits(group.name, rule.match) || fits(group.material, rule.match) ||
        fits(group.shape, rule.match)) {
      return &rule;
    }
  }
  return nullptr;
}

std::optional<SurfaceClass> class_by_name(const FileGroup& group) {
  if (group.surface_class >= 0 &&
      group.surface_class < static_cast<int>(kSurfaceClassNames.size())) {
    return static_cast<SurfaceClass>(group.surface_class);
  }
  // A material says more of its faces than the name of what they belong to.
  if (const auto found = class_in(group.material)) return found;
  if (const auto found = class_in(group.name)) return found;
  if (group.shape == "plane" || group.shape == "heightmap") return SurfaceClass::kGround;
  return {};
}

double reflectivity_of(SurfaceClass surface_class) {
  switch (surface_class) {
    case SurfaceClass::kGround:
      return middle(kForestFloorReflectivity);
    case SurfaceClass::kTrunk:
    case SurfaceClass::kBranch:
      return middle(kBarkReflectivity);
    case SurfaceClass::kLeaf:
      return middle(kLeafReflectivity);
    case SurfaceClass::kShrub:
      return middle(kShrubReflectivity);
    case SurfaceClass::kLog:
      return middle(kDeadWoodReflectivity);
    default:
      return middle(kConcreteReflectivity);
  }
}

}  // namespace arex::worlds
