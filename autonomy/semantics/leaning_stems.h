#pragma once

#include <vector>

#include "semantics/raster.h"
#include "semantics/stem_fit.h"
#include "semantics/working_cloud.h"

namespace arex {

/// Where a stem's axis comes out of the ground.
Vec3 foot_of_stem(const Stem& stem, const Raster& ground);

/// Whether a stem leans so far that its crown is not above it.
inline bool leans_away(const Stem& stem) { return stem.lean.norm() > 0.2; }

/// Stems that lean by more than 11 degrees, up to 50. Each is fitted in a frame that leans with it,
/// since across its axis it is round and level it is not; heights are above its foot. Found in
/// columns that lean in many ways. It stands on the ground, is longer than what an upright one must
/// show, and is no branch of one.
/// @param stems the upright ones; of those that lean, the ones that are better seen so are taken
/// out
std::vector<StemEvidence> take_leaning_stems(std::vector<StemEvidence>& stems,
                                             const WorkingCloud& cloud, const ColumnIndex& index,
                                             const std::vector<float>& heights,
                                             const Raster& ground, const StemConfig& config);

}  // namespace arex
