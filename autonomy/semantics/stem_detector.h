#pragma once

#include <vector>

#include "semantics/semantic_config.h"
#include "semantics/stem_fit.h"
#include "semantics/working_cloud.h"

namespace arex {

/// Stems in a cloud whose ground is known.
///
/// In a raster from above, a stem is a column with points in many layers on top of each other: each
/// cell holds the set of 0.1 m layers that have points, and the longest run of layers in the 3 x 3
/// cells around (a stem leans) makes it a candidate. Candidates are fitted from the most
/// complete down; what a stem has taken, the next ones don't use.
/// @param heights of the points above the ground, m
std::vector<StemEvidence> find_stems(const WorkingCloud& cloud, const ColumnIndex& index,
                                     const std::vector<float>& heights, const StemConfig& config);

}  // namespace arex
