#pragma once

#include "avatar/geometry/shading.h"

#include <string>
#include <vector>

namespace simulcap {

/// Pictures in rows and columns with their captions. All panels have the same size.
struct ContactSheet {
  std::vector<std::string> rowLabels;      ///< one per row, may be empty texts
  std::vector<std::string> columnLabels;   ///< one per column
  std::vector<avatar::ColorImage> panels;  ///< row by row
};

/// The sheet as one picture. Throws std::invalid_argument unless there are rows × columns panels of
/// one size.
avatar::ColorImage composed(const ContactSheet& sheet);

}  // namespace simulcap
