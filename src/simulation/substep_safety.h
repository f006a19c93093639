#pragma once

namespace simulcap {

// Parts of the limit 2/√λ (bullet_ext/core/stability.h) that pre-flight takes for stable. The limit
// holds about the rest shape; what is compressed or folded sharply is stiffer.

inline constexpr double kChosenSafety = 0.5;  ///< of a number of substeps that the program chooses
inline constexpr double kAskedSafety = 0.9;   ///< up to which one that is asked for is taken

}  // namespace simulcap
