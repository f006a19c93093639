#include "avatar/digitization/body_enhancement.h"

#include "avatar/avatar_body.h"
#include "avatar/digitization/body_parts.h"
#include "avatar/digitization/seen_skin.h"
#include "avatar/digitization/skinning_field.h"
#include "avatar/geometry/adjacency.h"
#include "avatar/geometry/measures.h"

#include <Eigen/Cholesky>
#include <Eigen/Geometry>
#include <Eigen/LU>
#include <Eigen/SparseCholesky>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <queue>
#include <stdexcept>
#include <string>
#include <utility>

namespace avatar {
namespace {

/// V shares of a joint and all that hangs on it in the skinning weights.
Eigen::VectorXd weightsBelow(const BodyModel& model, int joint) {
  std::vector<bool> belongs(model.parents.size(), false);
  for (std::size_t k = 0; k < belongs.size(); ++k) {
    const int parent = model.parents[k];
    belongs[k] =
        static_cast<int>(k) == joint || (parent >= 0 && belongs[static_cast<std::size_t>(parent)]);
  }
  Eigen::VectorXd weights = Eigen::VectorXd::Zero(model.numVertices());
  for (int v = 0; v < weights.size(); ++v) {
    using Weights = Eigen::SparseMatrix<double, Eigen::RowMajor>;
    for (Weights::InnerIterator it(model.skinningWeights, v); it; ++it)
      weights[v] += belongs[static_cast<std::size_t>(it.col())] ? it.value() : 0.0;
  }
  return weights;
}

/// The offsets of the head's vertices in the pose.
class HeadFit {
 public:
  HeadFit(
      Eigen::Matrix3Xd posed,
      const Eigen::Matrix3Xi& faces,
      const Eigen::VectorXd& headWeights,
      const EnhancementOptions& options)
      : posed_(std::move(posed)),
        original_(posed_),
        faces_(faces),
        headWeights_(headWeights),
        options_(options),
        edges_(buildAdjacency(faces, posed_.cols()).edges),
        unknown_(static_cast<std::size_t>(posed_.cols()), -1),
        offsets_(Eigen::Matrix3Xd::Zero(3, posed_.cols())) {
    constexpr double kFaded = 0.02;  // less of the head than this stays as it is
    for (std::size_t v = 0; v < unknown_.size(); ++v) {
      if (headWeights[static_cast<Eigen::Index>(v)] > kFaded)
        unknown_[v] = numUnknowns_++;
    }
  }

  void fit(const SeenSkin& skin, BodyEnhancement& result) {
    matches_.resize(unknown_.size());
    findMatches(skin);
    result.distanceBefore = meanDistance();
    for (int round = 0; round < options_.rounds; ++round) {
      moveRigidly();
      findMatches(skin);
    }
    fitOffsets(skin);
    constexpr int kAttempts = 4;
    for (int attempt = 1; attempt < kAttempts && isFolded(); ++attempt) {
      smoothness_ *= 8.0;
      fitOffsets(skin);
    }
    if (isFolded())
      offsets_.setZero();
    findMatches(skin);
    result.distanceAfter = meanDistance();
    result.headSeen = seenShare();
  }

  /// From the posed body.
  Eigen::Matrix3Xd offsets() const {
    Eigen::Matrix3Xd result = posed_ + offsets_ - original_;
    for (auto offset : result.colwise())
      offset *= std::min(1.0, options_.maxOffset / std::max(offset.norm(), 1e-12));
    return result;
  }

 private:
  void fitOffsets(const SeenSkin& skin) {
    offsets_.setZero();
    // From hair's thickness to the surface's noise, so that what the smooth head can't follow loses
    // its say step by step.
    constexpr double kWidest = 0.04;     // [m]
    constexpr double kNarrowest = 0.01;  // [m]
    for (int round = 0; round < options_.rounds && numUnknowns_ > 0; ++round) {
      findMatches(skin);
      const double progress = static_cast<double>(round + 1) / options_.rounds;
      solve(kWidest * std::pow(kNarrowest / kWidest, progress));
    }
  }

  /// The head as a whole may be tilted in the tracked pose: one Gauss–Newton step of its rotation ω
  /// and translation t that bring it to the matched planes, Σ w² (n·(x + ω × (x − c) + t − q))²,
  /// faded out in the neck with the weights w.
  void moveRigidly() {
    Eigen::Vector3d centre = Eigen::Vector3d::Zero();
    double weightSum = 0.0;
    forEachMatch([&](Eigen::Index v, const SeenSkin::Match&) {
      centre += headWeights_[v] * posed_.col(v);
      weightSum += headWeights_[v];
    });
    constexpr double kEnough = 50.0;  // vertices, to know six numbers by
    if (weightSum < kEnough)
      return;
    centre /= weightSum;
    Eigen::Matrix<double, 6, 6> normal = Eigen::Matrix<double, 6, 6>::Zero();
    Eigen::Matrix<double, 6, 1> right = Eigen::Matrix<double, 6, 1>::Zero();
    forEachMatch([&](Eigen::Index v, const SeenSkin::Match& match) {
      Eigen::Matrix<double, 6, 1> row;
      row << (posed_.col(v) - centre).cross(match.normal), match.normal;
      const double weight = headWeights_[v] * headWeights_[v] * match.evidence;
      normal += weight * row * row.transpose();
      right += weight * match.normal.dot(match.point - posed_.col(v)) * row;
    });
    // A sphere may turn as it likes: what the surface doesn't say stays (0.05 m is a head's
    // radius).
    normal.topLeftCorner<3, 3>().diagonal().array() += 1e-2 * weightSum * 0.05 * 0.05;
    const Eigen::Matrix<double, 6, 1> step = normal.ldlt().solve(right);
    for (Eigen::Index v = 0; v < posed_.cols(); ++v) {
      const Eigen::Vector3d turned = step.head<3>().cross(posed_.col(v) - centre);
      posed_.col(v) += headWeights_[v] * (turned + step.tail<3>());
    }
  }

  template <typename Visit>
  void forEachMatch(const Visit& visit) const {
    for (std::size_t v = 0; v < matches_.size(); ++v) {
      if (unknown_[v] >= 0 && matches_[v].found)
        visit(static_cast<Eigen::Index>(v), matches_[v]);
    }
  }

  /// Whether a face of the head turned over, or nearly.
  bool isFolded() const {
    constexpr double kTurned = 0.3;  // cosine
    const Eigen::Matrix3Xd moved = posed_ + offsets_;
    for (Eigen::Index f = 0; f < faces_.cols(); ++f) {
      if (unknown_[static_cast<std::size_t>(faces_(0, f))] < 0)
        continue;
      const Eigen::Vector3d before = doubleAreaVector(MeshView(posed_, faces_), f);
      const Eigen::Vector3d after = doubleAreaVector(MeshView(moved, faces_), f);
      if (before.dot(after) < kTurned * before.norm() * after.norm())
        return true;
    }
    return false;
  }

  void findMatches(const SeenSkin& skin) {
    const Eigen::Matrix3Xd places = posed_ + offsets_;
    const Eigen::Matrix3Xd normals = vertexNormals(MeshView(places, faces_));
    for (std::size_t v = 0; v < matches_.size(); ++v) {
      const auto column = static_cast<Eigen::Index>(v);
      if (unknown_[v] >= 0)
        matches_[v] = skin.nearest(
            places.col(column), normals.col(column), options_.reach, options_.minCosine);
    }
  }

  bool isHead(std::size_t v) const { return headWeights_[static_cast<Eigen::Index>(v)] > 0.5; }

  double seenShare() const {
    int head = 0;
    int seen = 0;
    for (std::size_t v = 0; v < matches_.size(); ++v) {
      head += isHead(v) ? 1 : 0;
      seen += isHead(v) && matches_[v].found ? 1 : 0;
    }
    return head > 0 ? static_cast<double>(seen) / head : 0.0;
  }

  double meanDistance() const {
    double sum = 0.0;
    int seen = 0;
    for (std::size_t v = 0; v < matches_.size(); ++v) {
      if (!isHead(v) || !matches_[v].found)
        continue;
      const auto column = static_cast<Eigen::Index>(v);
      sum += (posed_.col(column) + offsets_.col(column) - matches_[v].point).norm();
      ++seen;
    }
    return seen > 0 ? sum / seen : 0.0;
  }

  /// The least of the energy in the header: linear equations in all offsets at once. `scale` [m]:
  /// of the Geman–McClure weights.
  void solve(double scale) {
    std::vector<Eigen::Triplet<double>> entries;
    Eigen::VectorXd right = Eigen::VectorXd::Zero(3L * numUnknowns_);
    addSmoothness(entries);
    addData(scale, entries, right);
    Eigen::SparseMatrix<double> matrix(3L * numUnknowns_, 3L * numUnknowns_);
    matrix.setFromTriplets(entries.begin(), entries.end());
    const Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>> factors(matrix);
    if (factors.info() != Eigen::Success)
      return;  // a part of the mesh that neither data nor the neck holds: stays as it is
    const Eigen::VectorXd found = factors.solve(right);
    for (std::size_t v = 0; v < unknown_.size(); ++v) {
      if (unknown_[v] < 0)
        continue;
      const Eigen::Vector3d offset = found.segment<3>(3L * unknown_[v]);
      const double shrink = std::min(1.0, options_.maxOffset / std::max(offset.norm(), 1e-12));
      offsets_.col(static_cast<Eigen::Index>(v)) = shrink * offset;
    }
  }

  void addSmoothness(std::vector<Eigen::Triplet<double>>& entries) const {
    constexpr double kHold = 1e-6;  // keeps the equations solvable without data
    for (int i = 0; i < 3 * numUnknowns_; ++i)
      entries.emplace_back(i, i, kHold);
    for (Eigen::Index e = 0; e < edges_.cols(); ++e) {
      const int a = unknown_[static_cast<std::size_t>(edges_(0, e))];
      const int b = unknown_[static_cast<std::size_t>(edges_(1, e))];
      for (int axis = 0; axis < 3; ++axis) {
        if (a >= 0)
          entries.emplace_back(3 * a + axis, 3 * a + axis, smoothness_);
        if (b >= 0)
          entries.emplace_back(3 * b + axis, 3 * b + axis, smoothness_);
        if (a < 0 || b < 0)
          continue;
        entries.emplace_back(3 * a + axis, 3 * b + axis, -smoothness_);
        entries.emplace_back(3 * b + axis, 3 * a + axis, -smoothness_);
      }
    }
  }

  void addData(
      double scale, std::vector<Eigen::Triplet<double>>& entries, Eigen::VectorXd& right) const {
    for (std::size_t v = 0; v < matches_.size(); ++v) {
      if (unknown_[v] < 0 || !matches_[v].found)
        continue;
      const auto column = static_cast<Eigen::Index>(v);
      const Eigen::Vector3d& n = matches_[v].normal;
      const double gap = n.dot(matches_[v].point - posed_.col(column));
      const double left = (gap - n.dot(offsets_.col(column))) / scale;
      const double robust = 1.0 / std::pow(1.0 + left * left, 2);
      const double weight =
          headWeights_[column] * headWeights_[column] * matches_[v].evidence * robust;
      right.segment<3>(3L * unknown_[v]) += weight * gap * n;
      for (int row = 0; row < 3; ++row) {
        for (int col = 0; col < 3; ++col)
          entries.emplace_back(
              3 * unknown_[v] + row, 3 * unknown_[v] + col, weight * n[row] * n[col]);
      }
    }
  }

  Eigen::Matrix3Xd posed_;     // the head moved rigidly [m]
  Eigen::Matrix3Xd original_;  // as the pose has it
  const Eigen::Matrix3Xi& faces_;
  const Eigen::VectorXd& headWeights_;
  const EnhancementOptions& options_;
  double smoothness_ = options_.smoothness;
  Eigen::Matrix2Xi edges_;
  std::vector<int> unknown_;  // of each vertex; −1: stays
  int numUnknowns_ = 0;
  std::vector<SeenSkin::Match> matches_;
  Eigen::Matrix3Xd offsets_;  // [m]
};

/// Offsets in the pose as offsets of the rest shape.
Eigen::Matrix3Xd atRest(
    const Eigen::Matrix3Xd& offsets,
    const BodyModel& model,
    const std::vector<Eigen::Affine3d>& posedFromRest) {
  using Weights = Eigen::SparseMatrix<double, Eigen::RowMajor>;
  Eigen::Matrix3Xd result = Eigen::Matrix3Xd::Zero(3, offsets.cols());
  for (int v = 0; v < offsets.cols(); ++v) {
    if (offsets.col(v).isZero(0.0))
      continue;
    Eigen::Matrix3d linear = Eigen::Matrix3d::Zero();
    for (Weights::InnerIterator it(model.skinningWeights, v); it; ++it)
      linear += it.value() * posedFromRest[static_cast<std::size_t>(it.col())].linear();
    result.col(v) = linear.inverse() * offsets.col(v);
  }
  return result;
}

/// Of skin as the light falls on it: shadows, and hair and cloth beside it, only make it darker. So
/// above the median, but below highlights; channel by channel.
Eigen::Vector3d litColor(const Eigen::Matrix3Xd& colors, const std::vector<int>& of) {
  constexpr double kQuantile = 0.7;
  Eigen::Vector3d result;
  for (int channel = 0; channel < 3; ++channel) {
    Eigen::VectorXd values = colors(channel, of);
    const auto place = static_cast<std::ptrdiff_t>(kQuantile * static_cast<double>(of.size()));
    std::nth_element(values.begin(), values.begin() + place, values.end());
    result[channel] = values[place];
  }
  return result;
}

/// Vertices without a colour go over from those of their neighbours to the skin's, from the nearest
/// ones on; on the head, where hair may be, they only take over.
void spreadToUnseen(
    BodyEnhancement& result,
    const std::vector<bool>& seen,
    const Eigen::VectorXd& headWeights,
    const IndexRows& neighbours) {
  Eigen::Matrix3Xd& colors = result.vertexColors;
  std::vector<bool> reached = seen;
  std::queue<int> front;
  for (std::size_t v = 0; v < seen.size(); ++v) {
    if (seen[v])
      front.push(static_cast<int>(v));
  }
  std::vector<int> filled;
  while (!front.empty()) {
    const int v = front.front();
    front.pop();
    for (const int next : neighbours[v]) {
      if (reached[static_cast<std::size_t>(next)])
        continue;
      reached[static_cast<std::size_t>(next)] = true;
      colors.col(next) = headWeights[next] > 0.5 ? colors.col(v).eval() : result.skinColor;
      front.push(next);
      filled.push_back(next);
    }
  }
  // Laplace's equation with a pull p: c fades out like exp(−√(p/4) · edges), here within 4 of 2 cm.
  constexpr double kPull = 0.25;
  constexpr int kRounds = 100;
  for (int round = 0; round < kRounds; ++round) {
    for (const int v : filled) {
      const auto ring = neighbours[v];
      const double pull = kPull * (1.0 - headWeights[v]);
      Eigen::Vector3d sum = pull * result.skinColor;
      for (const int next : ring)
        sum += colors.col(next);
      colors.col(v) = sum / (pull + static_cast<double>(ring.size()));
    }
  }
}

void addColors(
    const MeshView& body,
    const SeenSkin& skin,
    const Eigen::VectorXd& headWeights,
    const std::vector<BodyPart>& parts,
    BodyEnhancement& result) {
  constexpr double kReach = 0.03;  // [m]: skin of limbs is nearer, or another limb's
  const double minCosine = EnhancementOptions{}.minCosine;
  const Eigen::Matrix3Xd normals = vertexNormals(body);
  std::vector<bool> seen(static_cast<std::size_t>(body.numVertices()), false);
  std::vector<int> limbs;
  std::vector<int> face;
  for (int v = 0; v < body.numVertices(); ++v) {
    const SeenSkin::Match match =
        skin.nearest(body.vertices.col(v), normals.col(v), kReach, minCosine);
    if (!match.found || !match.isPure)
      continue;
    const auto vertex = static_cast<std::size_t>(v);
    seen[vertex] = true;
    result.vertexColors.col(v) = match.color;
    if (headWeights[v] <= 0.5)  // hair and lips are no skin
      limbs.push_back(v);
    else if (parts[vertex] == BodyPart::kFace)
      face.push_back(v);
  }
  constexpr std::size_t kEnough = 20;  // vertices, to know a colour by
  const std::vector<int>& known = limbs.size() >= kEnough ? limbs : face;
  if (known.size() >= kEnough)
    result.skinColor = litColor(result.vertexColors, known).cwiseMax(0.0).cwiseMin(1.0);
  const IndexRows neighbours = buildAdjacency(body.faces, body.numVertices()).vertexVertices;
  spreadToUnseen(result, seen, headWeights, neighbours);
  result.vertexColors = result.vertexColors.cwiseMax(0.0).cwiseMin(1.0);
}

}  // namespace

void EnhancementOptions::validate() const {
  const auto demand = [](bool holds, const char* what) {
    if (!holds)
      throw std::invalid_argument(std::string("EnhancementOptions: ") + what);
  };
  demand(reach > 0.0, "reach is expected above 0 m");
  demand(maxOffset >= 0.0 && maxOffset <= 0.2, "maxOffset is expected in 0 … 0.2 m");
  demand(smoothness > 0.0, "smoothness is expected above 0");
  demand(minCosine >= -1.0 && minCosine < 1.0, "minCosine is expected in [-1, 1)");
  demand(rounds >= 1 && rounds <= 100, "rounds is expected in 1 … 100");
}

BodyEnhancement enhanceBody(
    const OuterSurface& surface,
    const std::vector<std::uint8_t>& labels,
    const UndressedBody& body,
    const EnhancementOptions& options) {
  options.validate();
  const auto numSurface = static_cast<std::size_t>(surface.mesh.numVertices());
  if (labels.size() != numSurface || surface.seen.size() != numSurface ||
      surface.labels.size() != numSurface || surface.colors.cols() != surface.mesh.numVertices())
    throw std::invalid_argument("enhanceBody: expected labels, colours, seen for every vertex");
  const BodyModel& model = body.skinning.model();
  const ShapedBody shaped = body.skinning.shape(body.betas);
  const SkinnedBody posed = body.skinning.pose(shaped, body.pose);
  const Eigen::VectorXd headWeights = weightsBelow(model, kHead);
  const SeenSkin skin(surface, labels);
  BodyEnhancement result;
  result.skinColor = AvatarBody{}.color;
  result.vertexColors = result.skinColor.replicate(1, model.numVertices());
  HeadFit head(posed.vertices, model.faces, headWeights, options);
  head.fit(skin, result);
  const Eigen::Matrix3Xd offsets = head.offsets();
  result.offsets = atRest(offsets, model, posedFromRest(shaped, posed));
  const Eigen::Matrix3Xd enhanced = posed.vertices + offsets;
  addColors(MeshView(enhanced, model.faces), skin, headWeights, bodyParts(model, shaped), result);
  return result;
}

void applyEnhancement(const BodyEnhancement& enhancement, AvatarBody& body) {
  if (enhancement.offsets.cols() != body.mesh.numVertices() ||
      enhancement.vertexColors.cols() != body.mesh.numVertices())
    throw std::invalid_argument("applyEnhancement: made for another body");
  body.mesh.vertices = roundedToFloat(body.mesh.vertices + enhancement.offsets);
  body.color = enhancement.skinColor;
  body.vertexColors = enhancement.vertexColors;
}

}  // namespace avatar
