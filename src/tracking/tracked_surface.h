#pragma once

#include "avatar/skinning.h"
#include "src/tracking/outer_layer.h"

#include <Eigen/Core>

#include <vector>

namespace simulcap {

/// Joints that are tracked: SMPL's without the two hands, which depth doesn't show, and which other
/// models of the family have elsewhere.
inline constexpr int kNumTrackedJoints = 22;

/// More joints than any model of the family has (SMPL-X: 55), and one for what hangs.
inline constexpr int kMostModelJoints = 64;

/// What is looked for in depth: pose and the first betas.
struct BodyParameters {
  avatar::BodyPose pose;  ///< 24 joints
  /// B; behind them what is unknown of the outer layer: the weights of widthShapes() [cm] or of
  /// shiftShapes().
  Eigen::VectorXd betas;
};

/// Where the parameters stand in the solver's vector: 66 of the tracked joints (axis-angle), 3 of
/// the translation, B betas.
struct TrackingLayout {
  static constexpr int kTranslation = 3 * kNumTrackedJoints;
  static constexpr int kBetas = kTranslation + 3;
};

/// The samples of the surface in one pose.
struct PosedSamples {
  Eigen::Matrix3Xd positions;   ///< 3 × N [m], world
  Eigen::Matrix3Xd normals;     ///< 3 × N, unit, outward
  Eigen::Matrix3Xd rest;        ///< 3 × N [m]: shaped, with pose blend shapes, not skinned
  Eigen::Matrix3Xd restJoints;  ///< 3 × J [m]
  std::vector<Eigen::Isometry3d> worldFromJoint;  ///< J
  /// 22 entries: column c is the world's angular velocity of the joint's subtree per unit of θ_c.
  std::vector<Eigen::Matrix3d> angularVelocities;
  std::vector<Eigen::Matrix3Xd> jointShapeDerivatives;  ///< J entries: ∂g_k/∂β, 3 × B; or empty
};

/// The surface that depth is compared with: the body and, when known, the clothes that move with
/// it. A subset of its vertices, spread evenly, stands for it.
class TrackedSurface {
 public:
  struct Sample {
    int vertex = 0;      ///< of model()
    int joint = 0;       ///< that carries most of it, a tracked one
    bool cloth = false;  ///< on the outer layer
    /// How likely the skin is bare here when nobody labelled the cloth, in [0, 1].
    double bareness = 0.0;
    double hanging = 0.0;    ///< how much of the cloth hangs plumb from the hips, in [0, 1]
    double looseness = 0.0;  ///< of cloth [m], see clothLooseness()
  };

  /// Throws std::invalid_argument unless the body is of SMPL's family and the layer has its joints.
  TrackedSurface(const avatar::BodyModel& body, int numSamples, const OuterLayer* layer = nullptr);
  TrackedSurface(const TrackedSurface&) = delete;
  TrackedSurface& operator=(const TrackedSurface&) = delete;
  TrackedSurface(TrackedSurface&&) = delete;
  TrackedSurface& operator=(TrackedSurface&&) = delete;
  ~TrackedSurface() = default;

  /// Body and clothes as one model: the body's vertices first.
  const avatar::BodyModel& model() const { return whole_; }

  int numBodyVertices() const { return numBodyVertices_; }

  int numBodyFaces() const { return numBodyFaces_; }

  /// Whether there is an outer layer.
  bool knowsClothes() const { return numBodyFaces_ < whole_.numFaces(); }

  /// The joint of model() that carries what hangs plumb from the hips; −1 without an outer layer.
  /// It follows the pelvis, upright, and is not looked for itself.
  int plumbJoint() const { return knowsClothes() ? whole_.numJoints() - 1 : -1; }

  /// What is looked for of the clothes.
  ClothUnknown clothUnknown() const { return clothUnknown_; }

  /// Does cloth hang about the legs that isn't carried by them?
  bool coversLegs() const { return coversLegs_; }

  /// Of BodyParameters.
  int numBetas() const { return numBetas_; }

  /// Those of them that shape the body.
  int numBodyBetas() const { return numBodyBetas_; }

  /// Those of the body first.
  const std::vector<Sample>& samples() const { return samples_; }

  int numBodySamples() const;

  /// What was learned of the body's samples: log odds of being bare, one each
  /// (std::invalid_argument).
  void setBareness(const Eigen::VectorXd& logOdds);

  /// What was learned of the cloth's samples: how far outside of the layer they are [m], along its
  /// normals at rest; one per sample, 0 for the body's (std::invalid_argument).
  void setClothOffsets(const Eigen::VectorXd& offsets);

  /// 3 × N [m]: the samples at rest, of the mean shape, without these offsets.
  const Eigen::Matrix3Xd& layerSamples() const { return layerSamples_; }

  /// The part of model() that is sampled; one vertex per sample.
  const avatar::BodyModel& sampledModel() const { return sampled_; }

  /// N × B: how far each sample moves along its normal at rest with each beta [m].
  const Eigen::MatrixXd& normalShapes() const { return normalShapes_; }

  /// ∂J_k/∂β at rest, J entries, 3 × B.
  const std::vector<Eigen::Matrix3Xd>& restJointShapeDerivatives() const {
    return restJointShapeDerivatives_;
  }

  PosedSamples pose(const BodyParameters& parameters, bool withShapeDerivatives) const;

  /// All vertices of model() [m].
  Eigen::Matrix3Xd posedVertices(const BodyParameters& parameters) const;

 private:
  avatar::BodyPose withPlumb(const avatar::BodyPose& pose) const;
  avatar::ShapedBody shaped(
      const avatar::BodyModel& model, Eigen::Index numBody, const Eigen::VectorXd& betas) const;

  avatar::BodyModel whole_, sampled_;
  int numBodyVertices_ = 0, numBodyFaces_ = 0, numBetas_ = 0, numBodyBetas_ = 0;
  bool coversLegs_ = false;
  ClothUnknown clothUnknown_ = ClothUnknown::kNothing;
  std::vector<Sample> samples_;
  Eigen::Matrix3Xd layerSamples_;    // 3 × N, of sampled_ without offsets
  Eigen::Matrix3Xd restNormals_;     // 3 × N, of the mean shape
  Eigen::Matrix3Xd templateJoints_;  // 3 × J
  Eigen::MatrixXd normalShapes_;     // N × B
  std::vector<Eigen::Matrix3Xd> restJointShapeDerivatives_;
  avatar::Skinning wholeSkinning_, sampledSkinning_;
};

}  // namespace simulcap
