#include "avatar/body_capsules.h"

#include "avatar/geometry/closest_point.h"
#include "avatar/geometry/measures.h"

#include <Eigen/Cholesky>

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>
#include <limits>
#include <optional>
#include <stdexcept>

namespace avatar {
namespace {

using Eigen::Vector3d;

/// A capsule in the frame of the rest pose.
struct Capsule {
  int joint = 0;
  Vector3d start = Vector3d::Zero();
  Vector3d end = Vector3d::Zero();
  double radius = 0.0;
};

double distanceTo(const Capsule& capsule, const Vector3d& point) {
  return signedDistance(point, capsule.start, capsule.end, capsule.radius);
}

/// A set of vertices, one bit each.
class VertexSet {
 public:
  explicit VertexSet(Eigen::Index numVertices)
      : words_(static_cast<std::size_t>(numVertices + 63) / 64) {}

  void insert(int vertex) { words_[word(vertex)] |= bit(vertex); }

  bool contains(int vertex) const { return (words_[word(vertex)] & bit(vertex)) != 0; }

  void add(const VertexSet& other) {
    for (std::size_t i = 0; i < words_.size(); ++i) {
      words_[i] |= other.words_[i];
    }
  }

  int numMissingIn(const VertexSet& other) const {
    int count = 0;
    for (std::size_t i = 0; i < words_.size(); ++i) {
      count += std::popcount(words_[i] & ~other.words_[i]);
    }
    return count;
  }

 private:
  static std::size_t word(int vertex) { return static_cast<std::size_t>(vertex) / 64; }

  static std::uint64_t bit(int vertex) { return std::uint64_t{1} << (vertex % 64); }

  std::vector<std::uint64_t> words_;
};

using SkinningWeights = Eigen::SparseMatrix<double, Eigen::RowMajor>;

double largestWeight(const SkinningWeights& weights, int row) {
  double largest = 0.0;
  for (SkinningWeights::InnerIterator it(weights, row); it; ++it) {
    largest = std::max(largest, it.value());
  }
  return largest;
}

/// The vertices that each joint's capsules stand for.
std::vector<std::vector<int>> followers(const SkinningWeights& weights, double minimumWeight) {
  std::vector<std::vector<int>> rows(static_cast<std::size_t>(weights.cols()));
  for (int v = 0; v < weights.rows(); ++v) {
    const double enough = std::min(minimumWeight, largestWeight(weights, v));
    for (SkinningWeights::InnerIterator it(weights, v); it; ++it) {
      std::vector<int>& row = rows[static_cast<std::size_t>(it.col())];
      row.insert(row.end(), it.value() >= enough ? 1 : 0, v);
    }
  }
  return rows;
}

/// `count` of the vertices, far apart: each next one is the farthest from those before.
std::vector<int> spreadSample(
    const Eigen::Matrix3Xd& points, const std::vector<int>& vertices, int count) {
  std::vector<int> sample;
  std::vector<double> distances(vertices.size(), std::numeric_limits<double>::infinity());
  std::size_t next = 0;
  while (std::ssize(sample) < count && distances[next] > 0.0) {
    sample.push_back(vertices[next]);
    const Vector3d chosen = points.col(vertices[next]);
    for (std::size_t i = 0; i < vertices.size(); ++i) {
      distances[i] = std::min(distances[i], (points.col(vertices[i]) - chosen).squaredNorm());
    }
    next = static_cast<std::size_t>(
        std::max_element(distances.begin(), distances.end()) - distances.begin());
  }
  return sample;
}

/// What is asked of capsules, and the search for those that do it.
class CapsuleFit {
 public:
  CapsuleFit(const AvatarBody& body, const BodyCapsuleOptions& options)
      : body_(body),
        options_(options),
        followers_(followers(body.skinningWeights, options.minimumWeight)),
        normals_(vertexNormals(body.mesh)),
        surface_(body.mesh),
        covered_(body.mesh.numVertices()) {}

  std::vector<Capsule> operator()() {
    makeCandidates();
    chooseCapsules();
    dropSpareCapsules();
    for (int round = 0; round < kRefinements; ++round) {
      refineCapsules();
    }
    std::vector<Capsule> capsules;
    capsules.reserve(chosen_.size());
    for (const Candidate& candidate : chosen_) {
      capsules.push_back(candidate.capsule);
    }
    return capsules;
  }

 private:
  struct Candidate {
    Capsule capsule;
    VertexSet covered;
  };

  static constexpr double kSampleSpacing = 0.015;  // of points along a capsule's axis [m]
  static constexpr double kMargin =
      0.98;  // of the tolerance: the axis is only looked at in samples
  static constexpr int kRefinements = 6;

  double tolerance() const { return kMargin * options_.tolerance; }

  /// How deep a point lies inside of the body [m].
  double depth(const Vector3d& point) const { return -surface_(point).distance; }

  /// Centre of the largest ball inside of the body that touches it at the vertex: shrinks a ball
  /// through the vertex until nothing of the surface is inside of it.
  Vector3d medialPoint(int vertex) const {
    const Vector3d point = body_.mesh.vertices.col(vertex);
    const Vector3d inward = -normals_.col(vertex);
    double radius = 0.5 * boundingBox(body_.mesh).sizes().maxCoeff();
    constexpr int kMaxShrinkings = 30;
    for (int i = 0; i < kMaxShrinkings; ++i) {
      const Vector3d centre = point + radius * inward;
      const Vector3d nearest = surface_.bvh().closestPoint(centre).point;
      const Vector3d chord = nearest - point;
      const double along = chord.dot(inward);
      // The ball through both points with its centre on the normal: |chord|² = 2 r · along.
      const double smaller = along > 1e-9 ? 0.5 * chord.squaredNorm() / along : radius;
      if ((centre - nearest).norm() > 0.98 * radius || smaller >= radius) {
        break;
      }
      radius = smaller;
    }
    const Vector3d centre = point + radius * inward;
    return depth(centre) > 0.0 ? centre : point;
  }

  /// The thickest capsule around a line that bulges out no more than allowed: a ball of radius
  /// depth + tolerance around any point stays within the tolerance of the body.
  std::optional<Capsule> thickest(int joint, const Vector3d& start, const Vector3d& end) const {
    const double radius = shallowest(start, end) + tolerance();
    if (!(radius > 0.0)) {
      return std::nullopt;
    }
    return Capsule{joint, start, end, radius};
  }

  double shallowest(const Vector3d& start, const Vector3d& end) const {
    const int pieces = 1 + static_cast<int>((end - start).norm() / kSampleSpacing);
    double least = std::numeric_limits<double>::infinity();
    for (int i = 0; i <= pieces && least > -tolerance(); ++i) {
      least = std::min(least, depth(start + i / double(pieces) * (end - start)));
    }
    return least;
  }

  void addCandidate(int joint, const Vector3d& start, const Vector3d& end) {
    const std::optional<Capsule> capsule = thickest(joint, start, end);
    if (!capsule) {
      return;
    }
    Candidate candidate{*capsule, VertexSet(body_.mesh.numVertices())};
    for (const int v : followers_[static_cast<std::size_t>(joint)]) {
      if (distanceTo(*capsule, body_.mesh.vertices.col(v)) <= tolerance()) {
        candidate.covered.insert(v);
      }
    }
    candidates_.push_back(std::move(candidate));
  }

  void makeCandidates() {
    medialPoints_.resize(followers_.size());
    for (std::size_t joint = 0; joint < followers_.size(); ++joint) {
      if (followers_[joint].empty()) {
        continue;
      }
      for (const int v :
           spreadSample(body_.mesh.vertices, followers_[joint], options_.ballsPerJoint)) {
        addBall(static_cast<int>(joint), medialPoint(v));
      }
    }
  }

  void addBall(int joint, const Vector3d& centre) {
    std::vector<Vector3d>& centres = medialPoints_[static_cast<std::size_t>(joint)];
    addCandidate(joint, centre, centre);
    for (const Vector3d& other : centres) {
      addCandidate(joint, other, centre);
    }
    centres.push_back(centre);
  }

  const Candidate* bestCandidate() const {
    const Candidate* best = nullptr;
    int most = 0;
    for (const Candidate& candidate : candidates_) {
      const int gain = candidate.covered.numMissingIn(covered_);
      if (gain > most) {
        most = gain;
        best = &candidate;
      }
    }
    return best;
  }

  void chooseCapsules() {
    for (std::size_t joint = 0; joint < followers_.size(); ++joint) {
      for (const int v : followers_[joint]) {
        coverVertex(static_cast<int>(joint), v);
      }
    }
  }

  /// Takes capsules, always the one that reaches most, until one of them reaches the vertex.
  void coverVertex(int joint, int vertex) {
    while (!covered_.contains(vertex)) {
      const Candidate* best = bestCandidate();
      if (best == nullptr) {
        // No ball reaches this vertex. One centred on it does, whatever the surface looks like.
        addBall(joint, medialPoint(vertex));
        addBall(joint, body_.mesh.vertices.col(vertex));
        best = bestCandidate();
      }
      covered_.add(best->covered);
      chosen_.push_back(*best);
    }
  }

  bool isSpare(std::size_t index) const {
    VertexSet others(body_.mesh.numVertices());
    for (std::size_t k = 0; k < chosen_.size(); ++k) {
      others.add(k == index ? VertexSet(body_.mesh.numVertices()) : chosen_[k].covered);
    }
    return chosen_[index].covered.numMissingIn(others) == 0;
  }

  /// Capsules whose vertices others cover as well; the earliest reached most, so they stay.
  void dropSpareCapsules() {
    for (std::size_t i = chosen_.size(); i-- > 0;) {
      if (isSpare(i)) {
        chosen_.erase(chosen_.begin() + static_cast<std::ptrdiff_t>(i));
      }
    }
    std::stable_sort(chosen_.begin(), chosen_.end(), [](const auto& a, const auto& b) {
      return a.capsule.joint < b.capsule.joint;
    });
  }

  /// Each vertex belongs to the capsule that it lies deepest in or nearest to.
  std::vector<std::vector<int>> assignedVertices() const {
    struct Owner {
      double distance = std::numeric_limits<double>::infinity();
      std::size_t capsule = 0;
    };

    std::vector<Owner> owners(static_cast<std::size_t>(body_.mesh.numVertices()));
    for (std::size_t i = 0; i < chosen_.size(); ++i) {
      const Capsule& capsule = chosen_[i].capsule;
      for (const int v : followers_[static_cast<std::size_t>(capsule.joint)]) {
        Owner& owner = owners[static_cast<std::size_t>(v)];
        const double distance = distanceTo(capsule, body_.mesh.vertices.col(v));
        owner = distance < owner.distance ? Owner{distance, i} : owner;
      }
    }
    std::vector<std::vector<int>> assigned(chosen_.size());
    for (std::size_t v = 0; v < owners.size(); ++v) {
      assigned[owners[v].capsule].push_back(static_cast<int>(v));
    }
    return assigned;
  }

  void refineCapsules() {
    const std::vector<std::vector<int>> assigned = assignedVertices();
    for (std::size_t i = 0; i < chosen_.size(); ++i) {
      if (!assigned[i].empty()) {
        chosen_[i].capsule = refined(chosen_[i].capsule, assigned[i]);
      }
    }
  }

  double squaredError(const Capsule& capsule, const std::vector<int>& vertices) const {
    double sum = 0.0;
    for (const int v : vertices) {
      const double d = distanceTo(capsule, body_.mesh.vertices.col(v));
      sum += d * d;
    }
    return sum;
  }

  bool holds(const Capsule& capsule, const std::vector<int>& vertices) const {
    const bool reachesAll = std::all_of(vertices.begin(), vertices.end(), [&](int v) {
      return distanceTo(capsule, body_.mesh.vertices.col(v)) <= tolerance();
    });
    return capsule.radius > 0.0 && reachesAll &&
           capsule.radius <= shallowest(capsule.start, capsule.end) + tolerance();
  }

  using Step = Eigen::Matrix<double, 7, 1>;  // of start, end and radius

  /// Gauss-Newton on the distances, damped for capsules that some direction means nothing to (a
  /// ball's two ends): the derivative by the ends is the direction to the axis, shared out by
  /// where on the axis the vertex is.
  Step gaussNewtonStep(const Capsule& capsule, const std::vector<int>& vertices) const {
    constexpr double kDamping = 1e-3;  // relative to one vertex's share
    const Vector3d axis = capsule.end - capsule.start;
    Eigen::Matrix<double, 7, 7> hessian = Eigen::Matrix<double, 7, 7>::Identity();
    hessian *= kDamping * static_cast<double>(vertices.size());
    Step gradient = Step::Zero();
    for (const int v : vertices) {
      const Vector3d offset = body_.mesh.vertices.col(v) - capsule.start;
      const double t = std::clamp(offset.dot(axis) / std::max(axis.squaredNorm(), 1e-12), 0.0, 1.0);
      const Vector3d away = (offset - t * axis).stableNormalized();
      Step row;
      row << -(1.0 - t) * away, -t * away, -1.0;
      hessian += row * row.transpose();
      gradient += row * distanceTo(capsule, body_.mesh.vertices.col(v));
    }
    return -hessian.ldlt().solve(gradient);
  }

  Capsule refined(const Capsule& capsule, const std::vector<int>& vertices) const {
    const Step step = gaussNewtonStep(capsule, vertices);
    const double before = squaredError(capsule, vertices);
    constexpr int kHalvings = 5;
    for (int halving = 0; halving <= kHalvings; ++halving) {
      const Step part = std::ldexp(1.0, -halving) * step;
      Capsule moved{
          capsule.joint,
          capsule.start + part.head<3>(),
          capsule.end + part.segment<3>(3),
          capsule.radius + part[6]};
      if (squaredError(moved, vertices) < before && holds(moved, vertices)) {
        return moved;
      }
    }
    return capsule;
  }

  const AvatarBody& body_;
  const BodyCapsuleOptions& options_;
  std::vector<std::vector<int>> followers_;
  Eigen::Matrix3Xd normals_;
  SignedDistance surface_;
  VertexSet covered_;
  std::vector<std::vector<Vector3d>> medialPoints_;
  std::vector<Candidate> candidates_;
  std::vector<Candidate> chosen_;
};

void requireConsistent(const AvatarBody& body) {
  const auto numJoints = static_cast<Eigen::Index>(body.parents.size());
  if (body.mesh.numVertices() == 0 || body.joints.cols() != numJoints ||
      body.skinningWeights.rows() != body.mesh.numVertices() ||
      body.skinningWeights.cols() != numJoints) {
    throw std::invalid_argument(
        "fitBodyCapsules: mesh, joints, parents and weights don't belong together");
  }
}

}  // namespace

void BodyCapsuleOptions::validate() const {
  const auto require = [](bool isValid, const char* what) {
    if (!isValid) {
      throw std::invalid_argument(std::string("BodyCapsuleOptions: ") + what);
    }
  };
  require(tolerance >= 0.005 && tolerance <= 0.1, "tolerance must be 0.005 to 0.1 m");
  require(minimumWeight > 0.0 && minimumWeight <= 1.0, "minimumWeight must be within (0, 1]");
  require(ballsPerJoint >= 4 && ballsPerJoint <= 100, "ballsPerJoint must be 4 to 100");
}

double signedDistance(
    const Vector3d& point, const Vector3d& start, const Vector3d& end, double radius) {
  const Vector3d axis = end - start;
  const double length2 = axis.squaredNorm();
  const double t = length2 > 0.0 ? std::clamp((point - start).dot(axis) / length2, 0.0, 1.0) : 0.0;
  return (point - start - t * axis).norm() - radius;
}

std::vector<BodyCapsule> fitBodyCapsules(
    const AvatarBody& body, const BodyCapsuleOptions& options) {
  options.validate();
  requireConsistent(body);
  std::vector<BodyCapsule> capsules;
  for (const Capsule& capsule : CapsuleFit(body, options)()) {
    const Vector3d joint = body.joints.col(capsule.joint);
    capsules.push_back({capsule.joint, capsule.start - joint, capsule.end - joint, capsule.radius});
  }
  return capsules;
}

}  // namespace avatar
