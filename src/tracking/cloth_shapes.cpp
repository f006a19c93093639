#include "src/tracking/cloth_shapes.h"

#include "avatar/geometry/closest_point.h"
#include "avatar/geometry/measures.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <vector>

namespace simulcap {
namespace {

using SkinningWeights = Eigen::SparseMatrix<double, Eigen::RowMajor>;
using enum avatar::SmplJoint;

int clothRegion(int joint) {
  switch (joint) {
    case kPelvis:
    case kLeftHip:
    case kRightHip:
      return 0;
    case kLeftKnee:
    case kRightKnee:
    case kLeftAnkle:
    case kRightAnkle:
    case kLeftFoot:
    case kRightFoot:
      return 1;
    case kSpine1:
    case kSpine2:
    case kSpine3:
    case kNeck:
    case kLeftCollar:
    case kRightCollar:
    case kHead:
      return 2;
    default:
      return 3;
  }
}

/// A part of the body that clothes hang about. At rest it is along one axis.
struct BodyPart {
  std::array<int, 4> joints;  // that carry its clothes; −1: none
  int along;
};

constexpr std::array<BodyPart, kNumClothShifts / 2> kBodyParts = {{
    {{kPelvis, kSpine1, kSpine2, kSpine3}, 1},
    {{kLeftHip, -1, -1, -1}, 1},
    {{kRightHip, -1, -1, -1}, 1},
    {{kLeftKnee, kLeftAnkle, -1, -1}, 1},
    {{kRightKnee, kRightAnkle, -1, -1}, 1},
    {{kLeftShoulder, -1, -1, -1}, 0},
    {{kRightShoulder, -1, -1, -1}, 0},
    {{kLeftElbow, kLeftWrist, -1, -1}, 0},
    {{kRightElbow, kRightWrist, -1, -1}, 0},
}};

bool carries(const BodyPart& part, int joint) {
  return std::find(part.joints.begin(), part.joints.end(), joint) != part.joints.end();
}

/// The share of a vertex that a part carries, in [0, 1].
double carriedBy(const BodyPart& part, const SkinningWeights& weights, Eigen::Index vertex) {
  double share = 0.0;
  for (SkinningWeights::InnerIterator it(weights, vertex); it; ++it)
    if (carries(part, static_cast<int>(it.col())))
      share += it.value();
  return share;
}

int heaviestJoint(const SkinningWeights& weights, Eigen::Index vertex) {
  int heaviest = -1;
  double most = 0.0;
  for (SkinningWeights::InnerIterator it(weights, vertex); it; ++it) {
    if (it.value() > most) {
      most = it.value();
      heaviest = static_cast<int>(it.col());
    }
  }
  return heaviest;
}

/// Values along a part of the body, gathered per centimetre.
class Profile {
 public:
  void add(double place, double value) {
    Bin& bin = bins_[static_cast<int>(std::lround(place / kStep))];
    bin.sum += value;
    ++bin.count;
  }

  /// About a place, over some folds.
  double meanAt(double place) const {
    constexpr double kFolds = 0.06;  // [m]
    double sum = 0.0;
    double all = 0.0;
    for (const auto& [number, bin] : bins_) {
      const double off = (number * kStep - place) / kFolds;
      const double weight = std::exp(-0.5 * off * off);
      sum += weight * bin.sum;
      all += weight * bin.count;
    }
    return sum / all;
  }

 private:
  static constexpr double kStep = 0.01;  // [m]

  struct Bin {
    double sum = 0.0;
    int count = 0;
  };

  std::map<int, Bin> bins_;
};

}  // namespace

Eigen::MatrixXd widthShapes(const OuterLayer& layer) {
  constexpr double kUnit = 0.01;  // [m]
  const Eigen::Matrix3Xd normals = avatar::vertexNormals({layer.restVertices, layer.faces});
  const Eigen::Index plumb = layer.skinningWeights.cols() - 1;
  Eigen::MatrixXd shapes = Eigen::MatrixXd::Zero(3 * normals.cols(), kNumClothRegions);
  for (Eigen::Index v = 0; v < normals.cols(); ++v) {
    for (SkinningWeights::InnerIterator it(layer.skinningWeights, v); it; ++it) {
      const int region =
          it.col() == plumb ? kNumClothRegions - 1 : clothRegion(static_cast<int>(it.col()));
      shapes.col(region).segment<3>(3 * v) += it.value() * kUnit * normals.col(v);
    }
  }
  return shapes;
}

OuterLayer widened(OuterLayer layer, const Eigen::VectorXd& widths) {
  if (layer.restVertices.cols() > 0)
    layer.restVertices.reshaped() += widthShapes(layer) * widths;
  layer.unknown = ClothUnknown::kNothing;
  return layer;
}

Eigen::VectorXd clothLooseness(
    const Eigen::Matrix3Xd& restVertices,
    const SkinningWeights& weights,
    const avatar::TriangleMesh& skin) {
  const Eigen::Index count = restVertices.cols();
  const avatar::TriangleBvh bvh(skin);
  Eigen::VectorXd distances(count);
  std::vector<int> joints;
  for (Eigen::Index v = 0; v < count; ++v) {
    const Eigen::Vector3d vertex = restVertices.col(v);
    distances[v] = (bvh.closestPoint(vertex).point - vertex).norm();
    joints.push_back(heaviestJoint(weights, v));
  }
  Eigen::VectorXd looseness = Eigen::VectorXd::Zero(count);
  for (const BodyPart& part : kBodyParts) {
    const auto along = restVertices.row(part.along);
    const auto isOfPart = [&](Eigen::Index v) {
      return carries(part, joints[static_cast<std::size_t>(v)]);
    };
    Profile profile;
    for (Eigen::Index v = 0; v < count; ++v)
      if (isOfPart(v))
        profile.add(along[v], distances[v]);
    for (Eigen::Index v = 0; v < count; ++v)
      if (isOfPart(v))
        looseness[v] = profile.meanAt(along[v]);
  }
  return looseness;
}

Eigen::MatrixXd shiftShapes(const OuterLayer& layer) {
  const Eigen::Index count = layer.restVertices.cols();
  Eigen::MatrixXd shapes = Eigen::MatrixXd::Zero(3 * count, kNumClothShifts);
  Eigen::Index shift = 0;
  for (const BodyPart& part : kBodyParts) {
    const int across = part.along == 0 ? 1 : 0;  // and z
    for (Eigen::Index v = 0; v < count; ++v) {
      const double reach = carriedBy(part, layer.skinningWeights, v) * layer.looseness[v];
      shapes(3 * v + across, shift) = reach;
      shapes(3 * v + 2, shift + 1) = reach;
    }
    shift += 2;
  }
  return shapes;
}

}  // namespace simulcap
