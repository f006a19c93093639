#pragma once

#include "avatar/body_pose.h"
#include "avatar/geometry/mesh.h"

#include <Eigen/Core>
#include <Eigen/SparseCore>

#include <map>
#include <string>
#include <vector>

namespace avatar {

/// Who weighs what in a cloth.
enum class MassMode {
  kPerVertex,  ///< every vertex the same, as in the paper
  kAreal       ///< mass per area of fabric, shared among the vertices by their area
};

/// What `damping` means.
enum class DampingMode {
  kPerSecond,  ///< dv/dt = −damping · v [1/s]
  kPerSubstep  ///< v ← (1 − damping) · v in every substep
};

/// Physical parameters of a garment as they travel with it (extras `simulcap_cloth` of its file).
/// The defaults are the paper's middle cloth.
struct ClothParameters {
  double stretchStiffness = 800.0;  ///< k [N/m], ≥ 0; acts on half the length difference
  double torsionStiffness = 0.05;   ///< w [N·m/rad], ≥ 0
  MassMode massMode = MassMode::kPerVertex;
  double vertexMass = 0.001;  ///< of each vertex [kg], > 0, for kPerVertex
  double arealDensity = 0.2;  ///< [kg/m²], > 0, for kAreal
  DampingMode dampingMode = DampingMode::kPerSecond;
  double damping = 0.1;      ///< [1/s], ≥ 0, or per substep, 0 … 1
  double friction = 0.3;     ///< Coulomb coefficient against body and cloth, ≥ 0
  double thickness = 0.004;  ///< distance kept from body and other cloth [m], > 0
  /// What is not uniform; empty: the values above. In the order of Adjacency::edges (k), of the
  /// edges with two faces among them (w), and of the vertices (kg).
  std::vector<double> edgeStretchStiffness = {};
  std::vector<double> edgeTorsionStiffness = {};
  std::vector<double> vertexMasses = {};

  bool operator==(const ClothParameters&) const = default;
};

/// A piece of clothing, ready to be simulated on the body it was made for.
struct Garment {
  std::string name;  ///< unique within the avatar: "tshirt", "upper", …
  int layer = 0;     ///< 0 = next to the skin; upper layers lie over lower ones
  /// The mesh hangs on the body as a camera saw it, else as it was cut: gravity hasn't had its
  /// part.
  bool asWorn = false;
  TriangleMesh mesh;  ///< rest shape on the body in bindPose; open at neck, sleeves and hem
  BodyPose bindPose;  ///< pose that the body had when the mesh was made
  /// V × J, at most four per row, rows sum to 1: how the garment follows the body unsimulated.
  Eigen::SparseMatrix<double, Eigen::RowMajor> skinningWeights;
  ClothParameters cloth;
  std::vector<int> pins;  ///< vertices that stay on the body, ascending
  Eigen::VectorXd
      maxDistance;  ///< V [m]: how far from its skinned place a vertex may get; or empty
  std::vector<std::string> collideWith = {"body"};  ///< "body" or names of garments
  /// Suggested values for engines with units of their own: engine → parameter → value.
  std::map<std::string, std::map<std::string, double>> hints = {};
  Eigen::Vector3d color = {0.45, 0.55, 0.70};  ///< display values in [0, 1]
  Eigen::Matrix3Xd vertexColors;  ///< 3 × V display values, replaces `color`; or empty
};

}  // namespace avatar
