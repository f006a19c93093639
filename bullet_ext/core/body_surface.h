#pragma once

#include "bullet_ext/core/moving_box_tree.h"
#include "bullet_ext/core/triangle_point.h"
#include "bullet_ext/core/wide_cloth.h"

#include <Eigen/Core>

#include <cstdint>
#include <optional>
#include <vector>

namespace bullet_ext {

/// Where something is on the surface, and how far.
struct SurfacePoint {
  int face = -1;                ///< −1: nothing within the asked distance
  Eigen::Vector3f barycentric;  ///< of the face's corners
  float signedDistance = 0.0F;  ///< [m], negative inside
};

/// A triangle mesh of fixed topology that moves: V vertices, F faces, counter-clockwise from
/// outside. Within a frame every vertex moves on a straight line at constant speed,
/// p(t) = p + t w, 0 ≤ t ≤ duration. Float, like the cloth.
///
/// Inside and outside follow the sign of (x − c) · n, c the closest point and n the pseudo-normal
/// there: the face's, the sum of both faces' on an edge, the angle-weighted sum at a corner
/// (Bærentzen and Aanæs, Signed Distance Computation Using the Angle Weighted Pseudonormal, 2005).
/// The surface may be open; what is "inside" next to a border follows the same rule.
class BodySurface {
 public:
  /// Floats per face in triangles(): p of the three corners, w of the three corners, each with a
  /// fourth, unused float.
  static constexpr int kTriangleStride = 24;

  /// Faces 3 × F. Throws std::invalid_argument without faces, for an index outside
  /// [0, numVertices) and for a corner named twice in a face.
  BodySurface(const Eigen::Matrix3Xi& faces, Eigen::Index numVertices);

  /// The motion of the coming frame: positions 3 × V at its start and end [m], duration [s]
  /// within [1e-7, 1e3]. Throws std::invalid_argument for another size, or a coordinate that isn't
  /// finite or is beyond 1e4 m; the frame before stays then. Triangles without area are welcome and
  /// push nobody.
  void setFrame(const Eigen::Matrix3Xd& start, const Eigen::Matrix3Xd& end, double duration);

  /// 0 before the first one.
  int numFrames() const { return numFrames_; }

  /// Whether the frame starts where the one before ended, to 1e-5 m.
  bool continuesLastFrame() const { return continuesLastFrame_; }

  /// Whether the surface stands still as it did in the frame before, at the same place: whatever
  /// was known about it then still holds.
  bool stillStands() const { return stillStands_; }

  /// Whether the surface stands still exactly where the frame before ended.
  bool stops() const { return stops_; }

  float duration() const { return duration_; }  ///< [s]

  const Eigen::Matrix3Xi& faces() const { return faces_; }

  Eigen::Index numFaces() const { return faces_.cols(); }

  Eigen::Index numVertices() const { return start_.cols(); }

  const Eigen::Matrix3Xf& start() const { return start_; }  ///< 3 × V [m]

  const Eigen::Matrix3Xf& velocities() const { return velocities_; }  ///< 3 × V [m/s]

  /// Of all faces, kTriangleStride floats each.
  const float* triangles() const { return triangles_.data(); }

  const MovingBoxTree& tree() const { return *tree_; }

  /// Without area, at the start and at the end of the frame.
  bool isDegenerate(int face) const { return (traits_[static_cast<std::size_t>(face)] & 1) != 0; }

  /// Whether the sign needs the pseudo-normal. Beside an edge or corner the closest point's offset
  /// x − c is a combination of the adjacent faces' normals with weights ≥ 0; if these are less
  /// than 90° apart, its product with each of them is positive and any face's own normal will do.
  bool isSharp(int face) const { return (traits_[static_cast<std::size_t>(face)] & 2) != 0; }

  Eigen::Matrix3f corners(int face, float time) const;  ///< in columns [m]
  Eigen::Matrix3f cornerVelocities(int face) const;     ///< in columns [m/s]

  /// Unit normal; 0 without area.
  Eigen::Vector3f faceNormal(int face, float time) const;

  /// Unit pseudo-normal at corner 0 … 2 of a face; 0 if all faces there are without area.
  Eigen::Vector3f cornerNormal(int face, int corner, float time) const;

  /// The face's point closest to x, with the sign of the pseudo-normal there.
  SurfacePoint pointOnFace(int face, const Eigen::Vector3f& x, float time) const;

  /// The surface's point closest to x nearer than maxDistance [m]; of equally near faces always the
  /// same one. If `facing` is not 0, only faces whose normal makes an acute angle with it count.
  SurfacePoint closestPoint(
      const Eigen::Vector3f& x,
      float time,
      float maxDistance,
      const Eigen::Vector3f& facing = Eigen::Vector3f::Zero()) const;

 private:
  /// What is known of a surface in one pose.
  struct PoseTraits {
    std::vector<std::uint8_t> vertexIsSharp, faceHasArea;
  };

  Eigen::Vector3f normal(int face, TriangleFeature feature, float time) const;
  void packTriangles();
  bool isSharpVertex(int vertex, const Eigen::Matrix3Xf& normals) const;
  PoseTraits traitsOf(const Eigen::Matrix3Xf& vertices) const;
  void findTraits(bool startKnown);
  void updateTree();

  Eigen::Matrix3Xi faces_;
  std::vector<int> facesOfVertex_, firstFaceOfVertex_;  ///< compressed rows
  Eigen::Matrix3Xf start_, velocities_, end_;
  float duration_ = 0.0F;
  int numFrames_ = 0;
  bool continuesLastFrame_ = false;
  bool stillStands_ = false;
  bool stops_ = false;
  CacheLineVector<float> triangles_;
  PoseTraits endTraits_;
  std::vector<std::uint8_t> traits_;
  std::vector<MovingBox> boxes_;
  std::optional<MovingBoxTree> tree_;
};

}  // namespace bullet_ext
