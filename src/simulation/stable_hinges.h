#pragma once

#include "avatar/garment.h"

#include <vector>

namespace simulcap {

/// w of every edge with two faces [N·m/rad], in the order of Adjacency::edges: the garment's own,
/// or less where the hinge of a sliver would be too stiff for substeps of this duration [s].
///
/// A hinge's stiffness is w Σ|∇_i α|², which grows with the inverse square of the triangles'
/// altitudes; on a regular mesh the largest eigenvalue of all hinges together is 6.7 times that of
/// one. Scanned and imported meshes have a few needles that would otherwise set the substep of the
/// whole garment. What regular 2 cm cloth of the paper needs at its substep is left alone.
std::vector<double> stableHinges(const avatar::Garment& garment, double substep);

}  // namespace simulcap
