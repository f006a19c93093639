#include "avatar/avatar_check.h"

#include "avatar/avatar_body.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <set>
#include <stdexcept>

namespace avatar {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

/// Collects the first flaw under the name of the part that is being looked at.
class Checker {
 public:
  void enter(const std::string& part) { part_ = part; }

  void require(bool holds, const std::string& field, const std::string& problem) {
    if (!holds && !flaw_) {
      flaw_ = AvatarFlaw{part_ + ": " + field, problem};
    }
  }

  /// A number from `low` (itself excluded when `open`) to `high`.
  void requireRange(const std::string& field, double value, double low, double high, bool open) {
    const bool inside = (open ? value > low : value >= low) && value <= high;
    std::string range = std::string(open ? "more than " : "at least ") + text(low);
    range += std::isfinite(high) ? " and at most " + text(high) : "";
    require(inside && std::isfinite(value), field, text(value) + " found, expected " + range);
  }

  void requireAll(const std::string& field, const std::vector<double>& values, bool positive) {
    for (const double value : values) {
      requireRange(field, value, 0.0, kInfinity, positive);
    }
  }

  bool failed() const { return flaw_.has_value(); }

  std::optional<AvatarFlaw> flaw() const { return flaw_; }

 private:
  static std::string text(double value) {
    std::string digits = std::to_string(value);
    digits.erase(digits.find_last_not_of('0') + 1);
    return digits.back() == '.' ? digits.substr(0, digits.size() - 1) : digits;
  }

  std::string part_;
  std::optional<AvatarFlaw> flaw_;
};

bool isColor(const Eigen::Ref<const Eigen::Matrix3Xd>& color) {
  return (color.array() >= 0.0).all() && (color.array() <= 1.0).all();
}

void checkMesh(Checker& checker, const TriangleMesh& mesh) {
  if (mesh.numVertices() == 0 || mesh.numFaces() == 0) {
    checker.require(false, "mesh", "has no vertices or no faces");
    return;
  }
  checker.require(
      mesh.vertices.allFinite() && mesh.vertices.cwiseAbs().maxCoeff() < 1e3,
      "mesh",
      "a vertex is not finite or more than a kilometre away, expected metres");
  checker.require(
      mesh.faces.minCoeff() >= 0 && mesh.faces.maxCoeff() < mesh.numVertices(),
      "mesh",
      "a face names a vertex beyond the " + std::to_string(mesh.numVertices()));
}

void checkWeights(
    Checker& checker,
    const Eigen::SparseMatrix<double, Eigen::RowMajor>& weights,
    Eigen::Index numVertices,
    std::size_t numJoints) {
  const bool fits =
      weights.rows() == numVertices && weights.cols() == static_cast<Eigen::Index>(numJoints);
  checker.require(fits, "weights", "expected a row per vertex and a column per joint");
  constexpr double kSumTolerance = 1e-5;  // float32 with four entries, renormalised by others
  for (int row = 0; fits && row < weights.rows(); ++row) {
    const Eigen::SparseVector<double> entries = weights.row(row);
    const bool isProper = entries.nonZeros() > 0 && entries.nonZeros() <= 4 &&
                          entries.coeffs().minCoeff() >= 0.0 &&
                          std::abs(entries.sum() - 1.0) <= kSumTolerance;
    checker.require(
        isProper,
        "weights",
        "vertex " + std::to_string(row) +
            " needs one to four weights that are not negative and sum to 1; see limitedWeights()");
  }
}

void checkVertexColors(Checker& checker, const Eigen::Matrix3Xd& colors, Eigen::Index numVertices) {
  checker.require(
      colors.cols() == 0 || (colors.cols() == numVertices && isColor(colors)),
      "vertex colours",
      "expected none or one per vertex with channels within 0 to 1");
}

void checkCapsules(Checker& checker, const AvatarBody& body) {
  for (const BodyCapsule& capsule : body.capsules) {
    checker.require(
        capsule.joint >= 0 && capsule.joint < std::ssize(body.parents),
        "capsules",
        "a joint is not there");
    checker.require(
        capsule.start.allFinite() && capsule.end.allFinite(), "capsules", "an end is not finite");
    checker.requireRange("capsules: radius", capsule.radius, 0.0, kInfinity, true);
  }
}

void checkBody(Checker& checker, const AvatarBody& body) {
  const std::size_t numJoints = body.parents.size();
  checker.enter("body");
  checker.require(numJoints > 0 && numJoints <= 65535, "joints", "expected 1 to 65535 of them");
  for (std::size_t joint = 0; joint < numJoints; ++joint) {
    const int parent = body.parents[joint];
    checker.require(
        joint == 0 ? parent == -1 : parent >= 0 && parent < static_cast<int>(joint),
        "joints",
        "parents must come before their children, joint 0 is the root");
  }
  checker.require(
      body.joints.cols() == static_cast<Eigen::Index>(numJoints) && body.joints.allFinite(),
      "joints",
      "expected one finite position per joint");
  checker.require(body.betas.allFinite(), "betas", "not finite");
  checkMesh(checker, body.mesh);
  checkWeights(checker, body.skinningWeights, body.mesh.numVertices(), numJoints);
  checkCapsules(checker, body);
  checker.require(isColor(body.color), "color", "expected channels within 0 to 1");
  checkVertexColors(checker, body.vertexColors, body.mesh.numVertices());
}

void checkCloth(Checker& checker, const ClothParameters& cloth, Eigen::Index numVertices) {
  checker.requireRange("stretch_k", cloth.stretchStiffness, 0.0, kInfinity, false);
  checker.requireRange("torsion_w", cloth.torsionStiffness, 0.0, kInfinity, false);
  checker.requireRange("vertex_mass_kg", cloth.vertexMass, 0.0, kInfinity, true);
  checker.requireRange("areal_density_kg_m2", cloth.arealDensity, 0.0, kInfinity, true);
  const bool perSubstep = cloth.dampingMode == DampingMode::kPerSubstep;
  checker.requireRange("damping", cloth.damping, 0.0, perSubstep ? 1.0 : kInfinity, false);
  checker.requireRange("friction", cloth.friction, 0.0, kInfinity, false);
  checker.requireRange("thickness_m", cloth.thickness, 0.0, kInfinity, true);
  checker.requireAll("edge_stretch_k", cloth.edgeStretchStiffness, false);
  checker.requireAll("edge_torsion_w", cloth.edgeTorsionStiffness, false);
  checker.requireAll("vertex_masses_kg", cloth.vertexMasses, true);
  checker.require(
      cloth.vertexMasses.empty() || std::ssize(cloth.vertexMasses) == numVertices,
      "vertex_masses_kg",
      "expected none or one per vertex");
}

/// Edges of a mesh and, of them, those between two faces; any faces will do.
struct EdgeCounts {
  std::ptrdiff_t all = 0;
  std::ptrdiff_t inner = 0;
};

EdgeCounts edgeCounts(const TriangleMesh& mesh) {
  std::vector<std::pair<int, int>> edges;
  for (const auto& face : mesh.faces.colwise()) {
    for (int k = 0; k < 3; ++k) {
      edges.emplace_back(std::minmax(face[k], face[(k + 1) % 3]));
    }
  }
  std::sort(edges.begin(), edges.end());
  EdgeCounts counts;
  for (auto edge = edges.begin(); edge != edges.end();) {
    const auto next = std::upper_bound(edge, edges.end(), *edge);
    ++counts.all;
    counts.inner += next - edge == 2 ? 1 : 0;
    edge = next;
  }
  return counts;
}

void checkEdgeArrays(Checker& checker, const Garment& garment) {
  const ClothParameters& cloth = garment.cloth;
  if (checker.failed() ||
      (cloth.edgeStretchStiffness.empty() && cloth.edgeTorsionStiffness.empty())) {
    return;
  }
  const EdgeCounts counts = edgeCounts(garment.mesh);
  checker.require(
      cloth.edgeStretchStiffness.empty() || std::ssize(cloth.edgeStretchStiffness) == counts.all,
      "edge_stretch_k",
      "expected none or one per edge, " + std::to_string(counts.all));
  checker.require(
      cloth.edgeTorsionStiffness.empty() || std::ssize(cloth.edgeTorsionStiffness) == counts.inner,
      "edge_torsion_w",
      "expected none or one per edge between two faces, " + std::to_string(counts.inner));
}

void checkPins(Checker& checker, const std::vector<int>& pins, Eigen::Index numVertices) {
  checker.require(
      std::adjacent_find(pins.begin(), pins.end(), std::greater_equal<>()) == pins.end(),
      "pins",
      "expected different vertices in ascending order");
  checker.require(
      pins.empty() || (pins.front() >= 0 && pins.back() < numVertices),
      "pins",
      "a vertex is not there, expected 0 to " + std::to_string(numVertices - 1));
}

void checkGarment(Checker& checker, const Garment& garment, std::size_t numJoints) {
  checker.enter("garment " + garment.name);
  const BodyPose& pose = garment.bindPose;
  checker.require(
      pose.jointRotations.size() % 3 == 0 && pose.jointRotations.allFinite() &&
          pose.translation.allFinite(),
      "bind_pose",
      "expected finite numbers, three per joint");
  const auto used =
      std::min<Eigen::Index>(pose.jointRotations.size(), 3 * static_cast<Eigen::Index>(numJoints));
  checker.require(
      pose.jointRotations.tail(pose.jointRotations.size() - used).isZero(0.0),
      "bind_pose",
      "turns joints that the body doesn't have");
  checkMesh(checker, garment.mesh);
  checkWeights(checker, garment.skinningWeights, garment.mesh.numVertices(), numJoints);
  checkCloth(checker, garment.cloth, garment.mesh.numVertices());
  checkEdgeArrays(checker, garment);
  checkPins(checker, garment.pins, garment.mesh.numVertices());
  const Eigen::VectorXd& reach = garment.maxDistance;
  checker.require(
      reach.size() == 0 || (reach.size() == garment.mesh.numVertices() && reach.allFinite() &&
                            reach.minCoeff() >= 0.0),
      "max_distance",
      "expected none or one finite distance per vertex, at least 0");
  checker.require(isColor(garment.color), "color", "expected channels within 0 to 1");
  checkVertexColors(checker, garment.vertexColors, garment.mesh.numVertices());
  for (const auto& [engine, values] : garment.hints) {
    for (const auto& [key, value] : values) {
      checker.require(std::isfinite(value), "hints", "a value is not finite");
    }
  }
}

void checkCollisions(Checker& checker, const Garment& garment, const LayeredAvatar& avatar) {
  for (const std::string& other : garment.collideWith) {
    const bool isWorn =
        std::any_of(avatar.garments.begin(), avatar.garments.end(), [&](const Garment& worn) {
          return worn.name == other;
        });
    checker.require(
        other == "body" || isWorn,
        "collide_with",
        "\"" + other + "\" is neither \"body\" nor a garment of this avatar");
  }
}

/// Names are how a file and its users tell the parts apart.
void checkNames(Checker& checker, const LayeredAvatar& avatar) {
  const std::vector<std::string> joints = jointNames(static_cast<int>(avatar.body.parents.size()));
  std::set<std::string> taken(joints.begin(), joints.end());
  taken.insert("body");
  checker.enter("garments");
  for (const Garment& garment : avatar.garments) {
    checker.require(
        !garment.name.empty() && taken.insert(garment.name).second,
        "name",
        "\"" + garment.name + "\" is empty, used twice, or the name of the body or a joint");
  }
}

}  // namespace

std::optional<AvatarFlaw> findFlaw(const LayeredAvatar& avatar) {
  Checker checker;
  checkBody(checker, avatar.body);
  checkNames(checker, avatar);
  for (const Garment& garment : avatar.garments) {
    checkGarment(checker, garment, avatar.body.parents.size());
    checkCollisions(checker, garment, avatar);
  }
  return checker.flaw();
}

void requireValid(const LayeredAvatar& avatar) {
  if (const std::optional<AvatarFlaw> flaw = findFlaw(avatar)) {
    throw std::invalid_argument("LayeredAvatar: " + flaw->field + ": " + flaw->problem);
  }
}

}  // namespace avatar
