#include "avatar/io/performance_check.h"

#include "avatar/avatar_body.h"
#include "avatar/avatar_check.h"
#include "avatar/avatar_pose.h"

#include <algorithm>
#include <cmath>
#include <set>
#include <stdexcept>

namespace avatar {
namespace {

constexpr double kFarthest = 1e5;  // [m]; there float32 still tells 8 mm apart

void require(bool holds, const std::string& problem) {
  if (!holds) {
    throw std::invalid_argument("writePerformanceGlb: " + problem);
  }
}

bool isNear(const Eigen::Ref<const Eigen::Matrix3Xd>& points) {
  return points.allFinite() && points.cwiseAbs().maxCoeff() <= kFarthest;
}

bool isColor(const Eigen::Ref<const Eigen::Matrix3Xd>& colors) {
  return colors.allFinite() && colors.minCoeff() >= 0.0 && colors.maxCoeff() <= 1.0;
}

bool areProperFaces(const Eigen::Matrix3Xi& faces, Eigen::Index numVertices) {
  return faces.cols() > 0 && faces.minCoeff() >= 0 && faces.maxCoeff() < numVertices;
}

bool isRigid(const Eigen::Isometry3d& pose) {
  constexpr double kTolerance = 1e-6;  // rotations integrated for long, or once in float32
  const Eigen::Matrix3d turn = pose.linear();
  return isNear(pose.translation()) && (turn * turn.transpose()).isIdentity(kTolerance) &&
         turn.determinant() > 0.0;
}

void requireFrames(const Performance& performance) {
  const std::size_t numFrames = performance.numFrames;
  require(
      numFrames >= 1 && numFrames <= kMaxPerformanceFrames,
      "expected 1 to " + std::to_string(kMaxPerformanceFrames) + " frames, found " +
          std::to_string(numFrames) + "; take every n-th or write several files");
  require(
      performance.framesPerSecond > 0.0 && std::isfinite(performance.framesPerSecond),
      "the frame rate must be positive");
  std::uint64_t bytes = 0;
  for (const PerformanceCloth& cloth : performance.cloths) {
    bytes += morphBytes(static_cast<std::uint64_t>(std::max(cloth.numVertices, 0)), numFrames);
  }
  require(
      bytes <= kMaxMorphBytes,
      "the cloths' frames would fill " + std::to_string(bytes >> 20) + " MiB, more than the " +
          std::to_string(kMaxMorphBytes >> 20) +
          " that viewers open; take every n-th frame or write several files");
}

void requireNames(const Performance& performance) {
  std::set<std::string> taken;
  if (performance.body) {
    const auto numJoints = static_cast<int>(performance.body->body.parents.size());
    const std::vector<std::string> joints = jointNames(numJoints);
    taken.insert(joints.begin(), joints.end());
    taken.insert("body");
  }
  const auto take = [&](const std::string& name) {
    require(
        !name.empty() && taken.insert(name).second,
        "the name \"" + name + "\" is empty, used twice, or that of the body or a joint");
  };
  for (const PerformanceCloth& cloth : performance.cloths) {
    take(cloth.name);
  }
  for (const PerformanceProp& prop : performance.props) {
    take(prop.name);
  }
}

void requireBody(const Performance& performance, const PerformanceBody& performer) {
  requireValid(LayeredAvatar{.body = performer.body, .garments = {}});
  const Motion& motion = performer.motion;
  require(
      motion.frames.size() == performance.numFrames &&
          motion.framesPerSecond == performance.framesPerSecond,
      "the body's motion must have the performance's frames and rate; see resampled()");
  for (const BodyPose& pose : motion.frames) {
    worldFromJoints(performer.body, pose);  // throws for a pose that isn't the body's
  }
}

void requireCloth(const PerformanceCloth& cloth) {
  const std::string part = "cloth " + cloth.name + ": ";
  require(areProperFaces(cloth.faces, cloth.numVertices), part + "expected faces of its vertices");
  require(cloth.frames != nullptr, part + "expected a function that gives its frames");
  require(isColor(cloth.color), part + "expected colour channels within 0 to 1");
  const Eigen::Matrix3Xd& colors = cloth.vertexColors;
  require(
      colors.cols() == 0 || (colors.cols() == cloth.numVertices && isColor(colors)),
      part + "expected no vertex colours, or one per vertex with channels within 0 to 1");
}

void requireProp(const PerformanceProp& prop, std::size_t numFrames) {
  const std::string part = "prop " + prop.name + ": ";
  require(
      areProperFaces(prop.mesh.faces, prop.mesh.numVertices()) && isNear(prop.mesh.vertices),
      part + "expected finite vertices and faces of them");
  require(isColor(prop.color), part + "expected colour channels within 0 to 1");
  require(
      prop.worldFromProp.size() == 1 || prop.worldFromProp.size() == numFrames,
      part + "expected one pose, or one per frame");
  require(
      std::all_of(prop.worldFromProp.begin(), prop.worldFromProp.end(), &isRigid),
      part + "expected poses that turn and move and nothing else");
}

}  // namespace

void requirePlayable(const Performance& performance) {
  require(
      performance.body || !performance.cloths.empty(),
      "a performance needs a body or a cloth to show");
  requireFrames(performance);
  if (performance.body) {
    requireBody(performance, *performance.body);
  }
  requireNames(performance);
  for (const PerformanceCloth& cloth : performance.cloths) {
    requireCloth(cloth);
  }
  for (const PerformanceProp& prop : performance.props) {
    requireProp(prop, performance.numFrames);
  }
}

void requireClothFrame(
    const PerformanceCloth& cloth, std::size_t frame, const Eigen::Matrix3Xd& vertices) {
  require(
      vertices.cols() == cloth.numVertices && isNear(vertices),
      "cloth " + cloth.name + ", frame " + std::to_string(frame) +
          ": expected a finite position near the origin for each of the " +
          std::to_string(cloth.numVertices) + " vertices");
}

}  // namespace avatar
