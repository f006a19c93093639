#include "bullet_ext/core/body_surface.h"

#include "bullet_ext/core/element_index.h"

#include <Eigen/Geometry>

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <string>
#include <utility>

namespace bullet_ext {
namespace {

constexpr std::uint8_t kDegenerate = 1;
constexpr std::uint8_t kSharp = 2;

void requireFaces(const Eigen::Matrix3Xi& faces, Eigen::Index numVertices) {
  if (faces.cols() == 0) {
    throw std::invalid_argument("body surface: no faces");
  }
  for (Eigen::Index f = 0; f < faces.cols(); ++f) {
    const Eigen::Vector3i face = faces.col(f);
    if (face.minCoeff() < 0 || face.maxCoeff() >= numVertices) {
      throw std::invalid_argument(
          "body surface: face " + std::to_string(f) + " has a vertex that doesn't exist");
    }
    if (face[0] == face[1] || face[1] == face[2] || face[2] == face[0]) {
      throw std::invalid_argument(
          "body surface: face " + std::to_string(f) + " names a vertex twice");
    }
  }
}

void requirePositions(const Eigen::Matrix3Xd& positions, Eigen::Index count, const char* which) {
  if (positions.cols() != count) {
    throw std::invalid_argument(
        std::string("body surface: ") + std::to_string(count) +
        " positions needed at the frame's " + which);
  }
  // Negated, so that NaN fails.
  if (!(positions.array().abs() <= 1e4).all()) {
    throw std::invalid_argument(
        std::string("body surface: a coordinate at the frame's ") + which +
        " is not finite or beyond 1e4 m");
  }
}

/// Unit normals 3 × F; 0 where the altitude over the longest edge is below 1e-4 of that edge.
Eigen::Matrix3Xf unitNormals(const Eigen::Matrix3Xi& faces, const Eigen::Matrix3Xf& vertices) {
  Eigen::Matrix3Xf normals(3, faces.cols());
  for (Eigen::Index f = 0; f < faces.cols(); ++f) {
    const Eigen::Vector3f a = vertices.col(faces(0, f));
    const Eigen::Vector3f ab = vertices.col(faces(1, f)) - a;
    const Eigen::Vector3f ac = vertices.col(faces(2, f)) - a;
    const Eigen::Vector3f area = ab.cross(ac);
    const float longest = std::max({ab.squaredNorm(), ac.squaredNorm(), (ac - ab).squaredNorm()});
    const float norm = area.norm();
    const bool flat = norm > 1e-4F * longest && longest > 1e-14F;
    normals.col(f) = flat ? Eigen::Vector3f(area / norm) : Eigen::Vector3f(Eigen::Vector3f::Zero());
  }
  return normals;
}

}  // namespace

BodySurface::BodySurface(const Eigen::Matrix3Xi& faces, Eigen::Index numVertices)
    : faces_(faces), firstFaceOfVertex_(at(numVertices) + 1, 0) {
  requireFaces(faces, numVertices);
  start_.setZero(3, numVertices);
  end_.setZero(3, numVertices);
  velocities_.setZero(3, numVertices);
  traits_.resize(at(faces.cols()));
  for (Eigen::Index i = 0; i < faces_.size(); ++i) {
    ++firstFaceOfVertex_[at(faces_(i)) + 1];
  }
  for (std::size_t v = 1; v < firstFaceOfVertex_.size(); ++v) {
    firstFaceOfVertex_[v] += firstFaceOfVertex_[v - 1];
  }
  facesOfVertex_.resize(at(faces_.size()));
  std::vector<int> next = firstFaceOfVertex_;
  for (Eigen::Index i = 0; i < faces_.size(); ++i) {
    facesOfVertex_[at(next[at(faces_(i))]++)] = static_cast<int>(i / 3);
  }
}

void BodySurface::setFrame(
    const Eigen::Matrix3Xd& start, const Eigen::Matrix3Xd& end, double duration) {
  requirePositions(start, numVertices(), "start");
  requirePositions(end, numVertices(), "end");
  if (!(duration >= 1e-7 && duration <= 1e3)) {
    throw std::invalid_argument("body surface: a frame's duration must be within [1e-7, 1e3] s");
  }
  const bool stood = numFrames_ > 0 && velocities_.isZero(0.0F);
  stillStands_ = stood && start == end && start.cast<float>() == start_;
  duration_ = static_cast<float>(duration);
  if (stillStands_) {
    continuesLastFrame_ = true;
    ++numFrames_;
    return;
  }
  start_ = start.cast<float>();
  const bool startKnown = numFrames_ > 0 && start_ == end_;
  stops_ = startKnown && start == end;
  continuesLastFrame_ = numFrames_ > 0 && (start_ - end_).cwiseAbs().maxCoeff() <= 1e-5F;
  end_ = end.cast<float>();
  velocities_ = ((end - start) / duration).cast<float>();
  ++numFrames_;
  packTriangles();
  findTraits(startKnown);
  updateTree();
}

void BodySurface::packTriangles() {
  triangles_.resize(at(kTriangleStride * numFaces()), 0.0F);
  for (Eigen::Index f = 0; f < numFaces(); ++f) {
    Eigen::Map<Eigen::Matrix<float, 4, 6>> triangle(triangles_.data() + kTriangleStride * f);
    for (int k = 0; k < 3; ++k) {
      triangle.col(k).head<3>() = start_.col(faces_(k, f));
      triangle.col(3 + k).head<3>() = velocities_.col(faces_(k, f));
    }
  }
}

/// All normals at a vertex within 36° of their mean: less than 72° apart, and by what they turn
/// until the frame's other end still below 90°.
bool BodySurface::isSharpVertex(int vertex, const Eigen::Matrix3Xf& normals) const {
  constexpr float kCosine = 0.81F;
  const int* begin = facesOfVertex_.data() + firstFaceOfVertex_[at(vertex)];
  const int* end = facesOfVertex_.data() + firstFaceOfVertex_[at(vertex) + 1];
  Eigen::Vector3f mean = Eigen::Vector3f::Zero();
  for (const int* face = begin; face != end; ++face) {
    mean += normals.col(*face);
  }
  const float least = kCosine * mean.norm();
  return std::any_of(begin, end, [&](int f) { return !(normals.col(f).dot(mean) > least); });
}

BodySurface::PoseTraits BodySurface::traitsOf(const Eigen::Matrix3Xf& vertices) const {
  const Eigen::Matrix3Xf normals = unitNormals(faces_, vertices);
  PoseTraits traits;
  for (int v = 0; v < numVertices(); ++v) {
    traits.vertexIsSharp.push_back(static_cast<std::uint8_t>(isSharpVertex(v, normals)));
  }
  for (int f = 0; f < numFaces(); ++f) {
    traits.faceHasArea.push_back(static_cast<std::uint8_t>(!normals.col(f).isZero()));
  }
  return traits;
}

/// Of the frame, from those of its ends; that of the last frame may be this one's start.
void BodySurface::findTraits(bool startKnown) {
  const PoseTraits start = startKnown ? std::move(endTraits_) : traitsOf(start_);
  endTraits_ = start_ == end_ ? start : traitsOf(end_);
  for (Eigen::Index f = 0; f < numFaces(); ++f) {
    const bool hasArea = start.faceHasArea[at(f)] != 0 || endTraits_.faceHasArea[at(f)] != 0;
    traits_[at(f)] = hasArea ? std::uint8_t{0} : kDegenerate;
  }
  for (Eigen::Index i = 0; i < faces_.size(); ++i) {
    const std::size_t v = at(faces_(i));
    const bool sharp = start.vertexIsSharp[v] != 0 || endTraits_.vertexIsSharp[v] != 0;
    traits_[at(i / 3)] |= sharp ? kSharp : std::uint8_t{0};
  }
}

void BodySurface::updateTree() {
  const auto at4 = [](const Eigen::Matrix3Xf& vertices, int v) {
    return Eigen::Array4f(vertices(0, v), vertices(1, v), vertices(2, v), 0.0F);
  };
  boxes_.resize(at(numFaces()));
  for (Eigen::Index f = 0; f < numFaces(); ++f) {
    MovingBox& box = boxes_[at(f)];
    const Eigen::Vector3i face = faces_.col(f);
    const auto s0 = at4(start_, face[0]);
    const auto s1 = at4(start_, face[1]);
    const auto s2 = at4(start_, face[2]);
    const auto e0 = at4(end_, face[0]);
    const auto e1 = at4(end_, face[1]);
    const auto e2 = at4(end_, face[2]);
    box = {s0.min(s1).min(s2), s0.max(s1).max(s2), e0.min(e1).min(e2), e0.max(e1).max(e2)};
  }
  if (tree_) {
    tree_->refit(boxes_);
  } else {
    tree_.emplace(boxes_);
  }
}

Eigen::Matrix3f BodySurface::corners(int face, float time) const {
  const Eigen::Map<const Eigen::Matrix<float, 4, 6>> triangle(
      triangles_.data() + kTriangleStride * face);
  return triangle.block<3, 3>(0, 0) + time * triangle.block<3, 3>(0, 3);
}

Eigen::Matrix3f BodySurface::cornerVelocities(int face) const {
  const Eigen::Map<const Eigen::Matrix<float, 4, 6>> triangle(
      triangles_.data() + kTriangleStride * face);
  return triangle.block<3, 3>(0, 3);
}

Eigen::Vector3f BodySurface::faceNormal(int face, float time) const {
  const Eigen::Matrix3f p = corners(face, time);
  const Eigen::Vector3f area = (p.col(1) - p.col(0)).cross(p.col(2) - p.col(0));
  const float norm = area.norm();
  return norm > 1e-14F ? Eigen::Vector3f(area / norm) : Eigen::Vector3f(Eigen::Vector3f::Zero());
}

Eigen::Vector3f BodySurface::normal(int face, TriangleFeature feature, float time) const {
  if (feature == TriangleFeature::kFace) {
    return faceNormal(face, time);
  }
  const bool onEdge = feature < TriangleFeature::kCorner0;
  const int k = static_cast<int>(feature) -
                static_cast<int>(onEdge ? TriangleFeature::kEdge0 : TriangleFeature::kCorner0);
  const int vertex = faces_(k, face);
  const int second = faces_((k + 1) % 3, face);
  Eigen::Vector3f sum = Eigen::Vector3f::Zero();
  for (int i = firstFaceOfVertex_[at(vertex)]; i < firstFaceOfVertex_[at(vertex) + 1]; ++i) {
    const int f = facesOfVertex_[at(i)];
    if (onEdge) {
      sum += (faces_.col(f).array() == second).any() ? faceNormal(f, time)
                                                     : Eigen::Vector3f(Eigen::Vector3f::Zero());
      continue;
    }
    const int own = faces_(0, f) == vertex ? 0 : (faces_(1, f) == vertex ? 1 : 2);
    const Eigen::Matrix3f p = corners(f, time);
    const Eigen::Vector3f one = p.col((own + 1) % 3) - p.col(own);
    const Eigen::Vector3f other = p.col((own + 2) % 3) - p.col(own);
    sum += std::atan2(one.cross(other).norm(), one.dot(other)) * faceNormal(f, time);
  }
  return sum;
}

Eigen::Vector3f BodySurface::cornerNormal(int face, int corner, float time) const {
  const int feature = static_cast<int>(TriangleFeature::kCorner0) + corner;
  return normal(face, static_cast<TriangleFeature>(feature), time).normalized();
}

SurfacePoint BodySurface::pointOnFace(int face, const Eigen::Vector3f& x, float time) const {
  const Eigen::Matrix3f p = corners(face, time);
  const TrianglePoint<float> closest = closestTrianglePoint<float>(x, p);
  const Eigen::Vector3f offset = x - p * closest.barycentric;
  const Eigen::Vector3f n =
      isSharp(face) ? normal(face, closest.feature, time) : faceNormal(face, time);
  const float distance = offset.norm();
  return {face, closest.barycentric, offset.dot(n) < 0.0F ? -distance : distance};
}

SurfacePoint BodySurface::closestPoint(
    const Eigen::Vector3f& x, float time, float maxDistance, const Eigen::Vector3f& facing) const {
  const bool filtered = !facing.isZero();
  int best = -1;
  const auto visit = [&](int face, float bound) {
    if (isDegenerate(face) || (filtered && !(faceNormal(face, time).dot(facing) > 0.0F))) {
      return bound;
    }
    const Eigen::Matrix3f p = corners(face, time);
    const TrianglePoint<float> closest = closestTrianglePoint<float>(x, p);
    const float distance = (x - p * closest.barycentric).norm();
    if (!(distance < bound)) {
      return bound;
    }
    best = face;
    return distance;
  };
  tree_->visitNear(x, std::min(1.0F, time / duration_), maxDistance, visit);
  return best < 0 ? SurfacePoint{} : pointOnFace(best, x, time);
}

}  // namespace bullet_ext
