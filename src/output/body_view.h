#pragma once

#include "avatar/body_model.h"
#include "avatar/geometry/mesh.h"
#include "avatar/geometry/shading.h"
#include "avatar/layered_avatar.h"

#include <Eigen/Geometry>
#include <Eigen/SparseCore>

#include <optional>
#include <string>
#include <vector>

namespace simulcap {

/// A named way to look at a body that stands in the world (Y up, facing +Z).
struct BodyView {
  std::string name;
  Eigen::Vector3d direction;  ///< from the camera to the body
  Eigen::Vector3d up = {0.0, 1.0, 0.0};
  std::vector<int> joints = {};  ///< the parts shown, as SMPL joints; none: the whole body
};

/// front, back, side, right-side, three-quarter, three-quarter-back, top, face, face-side, neck,
/// armpit, hips, hand, foot.
const std::vector<BodyView>& bodyViews();

/// Throws std::invalid_argument for an unknown name.
const BodyView& bodyView(const std::string& name);

/// Who is pictured: what its bodies have in common. Valid as long as the matrices are.
struct PicturedPerson {
  const Eigen::Matrix3Xi& faces;                                        ///< of the body, 3 × F
  const Eigen::SparseMatrix<double, Eigen::RowMajor>& skinningWeights;  ///< V × J
  const Eigen::Matrix3Xd* vertexColors = nullptr;  ///< 3 × V display values; none: one colour

  explicit PicturedPerson(const avatar::BodyModel& model)
      : faces(model.faces), skinningWeights(model.skinningWeights) {}

  explicit PicturedPerson(const avatar::AvatarBody& body)
      : faces(body.mesh.faces),
        skinningWeights(body.skinningWeights),
        vertexColors(body.vertexColors.cols() > 0 ? &body.vertexColors : nullptr) {}

  /// For things without a person.
  static PicturedPerson nobody();
};

/// A garment or another thing as it is at one moment.
struct PicturedMesh {
  avatar::TriangleMesh mesh;
  Eigen::Vector3d color;               ///< display values in [0, 1]
  Eigen::Matrix3Xd vertexColors = {};  ///< 3 × V, shown instead on the outside; or empty
};

/// A person as it is at one moment.
struct PicturedBody {
  std::string label;                        ///< for the caption
  Eigen::Matrix3Xd vertices;                ///< 3 × V [m]; 3 × 0: nobody, only things
  std::vector<PicturedMesh> garments = {};  ///< what it wears
  std::vector<PicturedMesh> props = {};  ///< what is around it, seen as far as it is in the picture
};

/// The vertices whose strongest skinning weight is on one of the joints (all for an empty list).
std::vector<int> verticesOfJoints(
    const Eigen::SparseMatrix<double, Eigen::RowMajor>& skinningWeights,
    const std::vector<int>& joints);

/// What a view shows of each body: boxes of one size around the vertices (and the garments, when
/// these are all), so that all are pictured at one scale, each centred on its body. `commonFloor`:
/// all at the height where they are (a jump stays visible) instead of standing on the lower edge.
/// Without a person, the picture stands still, around the garments or else the props of all.
std::vector<Eigen::AlignedBox3d> framingBoxes(
    const std::vector<PicturedBody>& bodies, const std::vector<int>& vertices, bool commonFloor);

struct PictureOptions {
  int width = 480;                       ///< [px], 16 … 8192
  int height = 640;                      ///< [px], 16 … 8192
  int supersampling = 2;                 ///< samples per pixel and side, 1 … 4
  std::optional<Eigen::Vector3d> color;  ///< of the skin, display values; unset: its own
  bool wireframe = false;                ///< draw the edges of the faces

  /// Throws std::invalid_argument when a value is out of its range.
  void validate() const;
};

/// Things seen by a long lens so that the box fills the picture. Their insides are darker.
avatar::ColorImage picture(
    const std::vector<PicturedMesh>& meshes,
    const BodyView& view,
    const Eigen::AlignedBox3d& box,
    const PictureOptions& options);

/// A person seen by a long lens so that the box fills the picture.
avatar::ColorImage picture(
    const PicturedPerson& person,
    const PicturedBody& body,
    const BodyView& view,
    const Eigen::AlignedBox3d& box,
    const PictureOptions& options);

}  // namespace simulcap
