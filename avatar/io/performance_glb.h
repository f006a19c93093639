#pragma once

#include "avatar/geometry/mesh.h"
#include "avatar/layered_avatar.h"
#include "avatar/motion.h"

#include <Eigen/Core>
#include <Eigen/Geometry>

#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <vector>

namespace avatar {

/// Frames beyond this make files that viewers choke on, because each is a morph target of its own.
inline constexpr std::size_t kMaxPerformanceFrames = 300;

/// Bytes of all morph targets together; browsers hold a file in one array of at most 2 GiB.
inline constexpr std::uint64_t kMaxMorphBytes = std::uint64_t{1} << 30;

/// Bytes of a cloth's morph targets: two float32 vectors (position, normal) per vertex and frame.
constexpr std::uint64_t morphBytes(std::uint64_t numVertices, std::uint64_t numFrames) {
  return 24 * numVertices * numFrames;
}

/// A person under the clothes, or without any.
struct PerformanceBody {
  AvatarBody body;
  Motion motion;  ///< as many frames as the performance, at its rate
};

/// A deforming mesh.
struct PerformanceCloth {
  std::string name;
  int numVertices = 0;
  Eigen::Matrix3Xi faces;  ///< 3 × F, F > 0, vertex indices
  /// The vertices in a frame, 3 × numVertices [m], in the world. Called once per frame, ascending,
  /// one cloth after the other.
  std::function<Eigen::Matrix3Xd(std::size_t frame)> frames;
  Eigen::Vector3d color = {0.45, 0.55, 0.70};  ///< display values in [0, 1]
  Eigen::Matrix3Xd vertexColors =
      {};                ///< 3 × numVertices display values, replaces `color`; or empty
  bool twoSided = true;  ///< the inner side can be seen as well
};

/// A rigid thing: a ball, a floor.
struct PerformanceProp {
  std::string name;
  TriangleMesh mesh;  ///< [m]; edges sharper than 60° are shown sharp
  /// One pose per frame, or a single one for what stands still. Between frames a prop turns the
  /// short way, so one that spins by more than half a turn per frame seems to turn back.
  std::vector<Eigen::Isometry3d> worldFromProp = {Eigen::Isometry3d::Identity()};
  Eigen::Vector3d color = {0.62, 0.62, 0.65};  ///< display values in [0, 1]
};

/// A captured or simulated course of events, with or without a person in it.
struct Performance {
  double framesPerSecond = 30.0;  ///< > 0
  std::size_t numFrames = 0;      ///< 1 to kMaxPerformanceFrames
  std::optional<PerformanceBody> body;
  std::vector<PerformanceCloth> cloths;
  std::vector<PerformanceProp> props;
};

/// The vertices of a garment (its place in LayeredAvatar::garments) in a frame, 3 × V [m], in the
/// world of the motion.
using GarmentFrames = std::function<Eigen::Matrix3Xd(std::size_t garment, std::size_t frame)>;

/// A dressed person who moves: the body with the motion and every garment as a cloth in its own
/// colours. `garmentFrames` is called as PerformanceCloth::frames are, garment by garment. Throws
/// std::invalid_argument for a flawed avatar.
Performance dressedPerformance(
    const LayeredAvatar& avatar, const Motion& motion, const GarmentFrames& garmentFrames);

/// Writes a performance as binary glTF 2.0 (.glb) that plays in any viewer, as one clip
/// "performance", linear between the frames. The body ("body") is skinned and moved by its joints.
/// A cloth is a mesh in its first frame with one morph target per frame (differences of positions
/// and normals) and weights over time. A prop is a mesh on a node that moves and turns. It is no
/// avatar: readAvatar() refuses it.
///
/// Size: morphBytes() per cloth, 36 MB for 5000 vertices and 300 frames; 4 bytes × frames² for the
/// weights, once; and all meshes once. Writing needs about three times as much memory.
///
/// Written whole or not at all. Throws std::invalid_argument when there is neither body nor cloth;
/// for a name that is empty or given twice ("body" and the joints' names are taken where there is a
/// body); for another number of frames, or cloths of more than kMaxMorphBytes together (take every
/// n-th frame or write several files); for a flawed body or a motion that doesn't fit it, and for
/// faces, colours, poses or vertices of another size, out of range or not finite (rigid, for poses;
/// within 100 km of the origin, for vertices). FileError when the file can't be written.
void writePerformanceGlb(const std::string& path, const Performance& performance);

}  // namespace avatar
