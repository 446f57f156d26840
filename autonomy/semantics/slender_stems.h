#pragma once

#include <vector>

#include "semantics/semantic_config.h"
#include "semantics/stem_fit.h"
#include "semantics/working_cloud.h"

namespace arex {

/// Stems no thicker than the map's voxels, with crowns that reach down to them, as in an orchard.
///
/// A cone (stem_detector.h) needs a girth that stands free. Of a stem of a hand's width a map shows
/// a line of points, bare for half a metre above the ground and wrapped in twigs and leaves from
/// there on. So a line is looked for: in a raster from above, columns with points in nearly all
/// layers near the ground; through them, by iteratively reweighted least squares, the line that has
/// most company. It is a stem if its core is filled layer by layer to above breast height, which
/// leaves hardly ever do by chance, and if it stands bare over some of them. Its thickness is then
/// that of the cone that fits its core best, less what the ranges' noise makes of a circle that
/// small.
/// @param heights of the points above the ground, m
std::vector<StemEvidence> find_slender_stems(const WorkingCloud& cloud, const ColumnIndex& index,
                                             const std::vector<float>& heights,
                                             const StemConfig& config);

/// Adds the slender stems to those that were found by their girth: where both see one, a cone much
/// thicker than the line in it was fitted through leaves, and the line is taken.
void add_slender_stems(const std::vector<StemEvidence>& slender, std::vector<StemEvidence>& stems);

/// Takes the posts, of a trellis or a fence, out of slender stems and those found by their girth:
/// plumb, straight, as thick at their top as at their foot, and bare above it. Trees lean, taper
/// and go on. Before the two are brought together: a cone through a post may hide the tree beside
/// it.
std::vector<StemEvidence> take_posts(std::vector<StemEvidence>& slender,
                                     std::vector<StemEvidence>& stems, const WorkingCloud& cloud,
                                     const ColumnIndex& index, const std::vector<float>& heights);

}  // namespace arex
