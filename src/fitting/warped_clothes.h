#pragma once

#include "avatar/geometry/camera.h"
#include "avatar/geometry/embedded_deformation.h"
#include "avatar/layered_avatar.h"
#include "src/fitting/depth_targets.h"
#include "src/fitting/layer_view.h"
#include "src/input/depth_cloud.h"

#include <Eigen/Core>
#include <Eigen/SparseCore>

#include <vector>

namespace simulcap {

/// What is warped as one.
enum class WarpedParts {
  kGarments,    ///< each garment by itself, the paper's multi-layer baseline
  kWholePerson  ///< skin and clothes as one surface, as DoubleFusion has it
};

struct WarpOptions {
  avatar::EmbeddedDeformationOptions graph;
  LayerViewOptions view;
  int iterations = 6;  ///< of ICP per frame, with one Gauss-Newton step each, 1 … 100

  /// Throws std::invalid_argument that names the field outside its range.
  void validate() const;
};

/// The tracking that the paper compares itself with (section 5.1): a surface in a canonical pose is
/// deformed by a graph of nodes, then skinned by the body's joints, and non-rigid ICP fits the
/// nodes to depth. What they have found goes on to the next frame; what isn't seen follows the
/// joints and the nodes around.
class WarpedClothes {
 public:
  /// `labels`: one per garment, of their pixels. Keeps a reference to the avatar. Throws
  /// std::invalid_argument for invalid options.
  WarpedClothes(
      const avatar::LayeredAvatar& avatar,
      const avatar::Camera& camera,
      const std::vector<PixelLabel>& labels,
      WarpedParts parts,
      const WarpOptions& options = {});

  /// Takes the surfaces to a pose of the body with what the nodes have found so far.
  void follow(const avatar::BodyPose& pose);

  /// Fits the nodes in the pose that was followed last. `body`: the skin in that pose, in front of
  /// which or behind which clothes are. Returns what each garment is pulled to at the end; of what
  /// the whole person rejects, the first one's has the sum.
  std::vector<GarmentTargets> fit(
      const avatar::MeshView& body, const DepthCloud& cloud, const DepthTargetOptions& options);

  Eigen::Matrix3Xd garment(std::size_t index) const;  ///< 3 × N [m]

  /// Per surface 12 × K: [R t] of its nodes, column by column; to go on from later.
  std::vector<Eigen::MatrixXd> state() const;

  /// Throws std::invalid_argument for a state of other surfaces.
  void restore(const std::vector<Eigen::MatrixXd>& state);

 private:
  /// A surface in the bind pose, and in the one that is followed.
  struct Surface {
    avatar::TriangleMesh bound;
    Eigen::SparseMatrix<double, Eigen::RowMajor> skinningWeights;
    avatar::BodyPose bindPose;
    PixelLabel label = kBackground;
    avatar::EmbeddedDeformation nodes;
    std::vector<Eigen::Affine3d> posedFromBound = {};
    Eigen::Matrix3Xd vertices = {};  // 3 × V [m]

    void pose();
    std::vector<avatar::PlaneTarget> planes(const GarmentTargets& targets) const;
  };

  /// The part of a surface that is a garment's.
  struct Part {
    std::size_t surface = 0;
    Eigen::Index begin = 0, count = 0;
  };

  Surface surfaceOf(const avatar::Garment& garment, PixelLabel label) const;
  Surface wholePerson() const;
  std::vector<GarmentTargets> targets(
      const std::vector<GarmentView>& views,
      const DepthCloud& cloud,
      const DepthTargetOptions& options) const;
  GarmentTargets ofPart(const Part& part, const std::vector<GarmentTargets>& targets) const;

  const avatar::LayeredAvatar& avatar_;
  avatar::Camera camera_;
  WarpedParts parts_;
  WarpOptions options_;
  LayerViewer viewer_;
  std::vector<Surface> surfaces_;
  std::vector<Part> garments_;
};

}  // namespace simulcap
