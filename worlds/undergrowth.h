#pragma once

#include "worlds/mesh_builder.h"
#include "worlds/tree.h"

namespace arex::worlds {

/// A shrub of about this height: stems, each with a collision capsule, and leaves around them, so
/// many of a full one.
void add_shrub(MeshBuilder& builder, const Vec3& root, double height, int leaves,
               RandomStream random, Detail detail = Detail::kFull);

/// A fern: arching fronds of about this length, without collision shapes.
void add_fern(MeshBuilder& builder, const Vec3& root, double length, RandomStream random);

inline constexpr double kMaxStubLength = 0.8;  ///< of the branches left on a log, m (estimate)

/// A fallen log along `heading` (rad) that rests on the terrain under its ends; stubs of branches.
void add_log(MeshBuilder& builder, const HeightField& terrain, const Vec2& middle, double heading,
             double length, double radius, RandomStream random);

}  // namespace arex::worlds
