#pragma once

#include <Eigen/Core>

#include <cstddef>

namespace bullet_ext {

/// Eigen counts with signs, std::vector without.
inline std::size_t at(Eigen::Index i) {
  return static_cast<std::size_t>(i);
}

}  // namespace bullet_ext
