#pragma once

#include <vector>

#include "math/types.h"
#include "sensors/scene.h"
#include "worlds/world.h"

namespace arex::sim {

/// A strip lamp under a ceiling.
struct Lamp {
  Vec3 centre_W = Vec3::Zero();       ///< of its lower face, m
  std::uint32_t object = Hit::kNone;  ///< what is drawn of it; kNone where the world draws none
  float glow_below_m = 0;             ///< its triangles up to this height in W shine, not its rods
};

/// The lamps of a world: what hangs there in the form of one, and under ceilings that those leave
/// in the dark one every few metres. A world without ceilings has no more than it draws.
std::vector<Lamp> find_lamps(const worlds::World& world, const Scene& scene);

}  // namespace arex::sim
