#pragma once

#include "bullet_ext/core/contact_elements.h"
#include "bullet_ext/core/contact_response.h"

#include <array>
#include <vector>

namespace bullet_ext {

/// Groups of vertices that move together.
class VertexZones {
 public:
  explicit VertexZones(Eigen::Index numVertices);

  /// Puts four vertices, with all that are in zones with them, into one zone. Returns false if they
  /// are in one already.
  bool join(const std::array<int, 4>& vertices);

  /// Gives all vertices of a zone of at least two the mean displacement of the zone, weighted by
  /// mass, so that momentum is kept; with pins, which keep their own, that of its pins. Returns the
  /// number of such zones.
  int translate(const ContactElements& elements, SubstepMotion& motion);

 private:
  int root(int vertex);

  std::vector<int> parents_;  ///< union–find; a root is the smallest vertex of its zone
};

}  // namespace bullet_ext
