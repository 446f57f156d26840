#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "worlds/file_scene.h"
#include "worlds/world.h"

namespace arex::worlds {

/// What the things of a file are whose name, material or shape fits.
struct FileClassRule {
  std::string match;  ///< * for any text, ? for any character; capitals mean nothing
  SurfaceClass surface_class = SurfaceClass::kWall;
  double reflectivity = -1;

  void fields(auto& f) {
    f("match", match, "name, material or shape (box, cylinder, plane, mesh, ...), with * and ?");
    f("class", surface_class, "what it is");
    f("reflectivity", reflectivity, "diffuse, at 905 nm; negative: that of its class");
    f.check(!match.empty(), "match that names something");
    f.check(reflectivity <= 1, "reflectivity <= 1");
  }
};

/// Whether a text fits a pattern with * and ?, capitals or not.
bool fits(std::string_view text, std::string_view pattern);

/// The first rule that fits a group; nullptr: none.
const FileClassRule* rule_for(const FileGroup& group, const std::vector<FileClassRule>& rules);

/// What the words in a group's name or material say: `Oak_Trunk.003` is a trunk. Nothing where they
/// say nothing; a plane or a height map is ground.
std::optional<SurfaceClass> class_by_name(const FileGroup& group);

/// Diffuse reflectivity at 905 nm of a class of which nothing else is known: the middle of the band
/// that recipes draw from.
double reflectivity_of(SurfaceClass surface_class);

}  // namespace arex::worlds
