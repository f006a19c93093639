#pragma once

#include "bullet_ext/core/cloth_mesh.h"

#include <Eigen/Core>

#include <span>
#include <vector>

namespace bullet_ext {

/// How one garment touches.
struct ContactGarment {
  const ClothMesh* mesh = nullptr;
  int layer = 0;           ///< 0 = next to the skin; a higher layer is worn over a lower one
  double thickness = 0.0;  ///< distance kept [m], 1e-6 … 0.1
  double friction = 0.0;   ///< Coulomb coefficient, 0 … 10
};

/// Some neighbouring vertices of a garment with the edges and triangles whose first vertex they
/// are. Elements of a patch move together, so that one bound serves them all.
struct ContactPatch {
  int garment = 0;
  std::vector<int> vertices;
  std::vector<int> edges;
  std::vector<int> faces;
  std::vector<int> corners;  ///< all vertices of these elements, ascending
};

/// All garments in one numbering, one after the other, each in its mesh's solver order.
struct ContactElements {
  std::vector<int> firstVertices;    ///< G + 1: garment g has the vertices firstVertices[g] …
  std::vector<int> firstFaces;       ///< G + 1
  std::vector<int> garments;         ///< N: of each vertex
  std::vector<int> layers;           ///< G
  Eigen::MatrixXf thickness;         ///< G × G [m]: kept between garments, the mean of the two
  Eigen::MatrixXf friction;          ///< G × G: likewise
  std::vector<double> masses;        ///< N [kg]
  std::vector<float> inverseMasses;  ///< N [1/kg], 0 at pins
  Eigen::Matrix4Xf restPositions;    ///< 4 × N [m], row 3 is 0
  Eigen::Matrix2Xi edges;
  Eigen::Matrix3Xi faces;
  std::vector<ContactPatch> patches;

  Eigen::Index numVertices() const { return restPositions.cols(); }
};

/// Throws std::invalid_argument when a garment has no mesh or a value is outside its range.
ContactElements buildContactElements(std::span<const ContactGarment> garments);

}  // namespace bullet_ext
