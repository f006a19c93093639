#pragma once

#include "avatar/io/performance_glb.h"

namespace avatar {

/// What writePerformanceGlb() demands, the vertices of cloths aside. Throws std::invalid_argument
/// with the part, what was found and what to do.
void requirePlayable(const Performance& performance);

/// One finite position per vertex. Throws std::invalid_argument.
void requireClothFrame(
    const PerformanceCloth& cloth, std::size_t frame, const Eigen::Matrix3Xd& vertices);

}  // namespace avatar
