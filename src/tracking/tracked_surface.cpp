#include "src/tracking/tracked_surface.h"

#include "avatar/axis_angle.h"
#include "avatar/geometry/measures.h"
#include "avatar/motion.h"
#include "src/tracking/cloth_shapes.h"

#include <Eigen/Geometry>

#include <algorithm>
#include <array>
#include <cmath>
#include <stdexcept>

namespace simulcap {
namespace {

using avatar::BodyModel;
using SkinningWeights = Eigen::SparseMatrix<double, Eigen::RowMajor>;

/// More betas than these change the surface by less than depth noise.
constexpr int kMaxBetas = 10;

/// How much denser than the trunk a joint's skin is sampled, and how likely it is bare.
struct JointSampling {
  double density;
  double bareness;
};

JointSampling samplingOf(int joint) {
  using enum avatar::SmplJoint;
  switch (joint) {
    case kHead:
      return {1.4, 1.0};
    case kNeck:
      return {1.2, 0.7};
    case kLeftWrist:
    case kRightWrist:
      return {2.5, 1.0};
    case kLeftElbow:
    case kRightElbow:
      return {1.8, 0.4};
    case kLeftShoulder:
    case kRightShoulder:
      return {1.5, 0.1};
    case kLeftAnkle:
    case kRightAnkle:
      return {1.6, 0.4};
    case kLeftFoot:
    case kRightFoot:
      return {1.6, 0.9};
    case kLeftKnee:
    case kRightKnee:
      return {1.2, 0.1};
    default:
      return {1.0, 0.1};
  }
}

void requireSmplFamily(const BodyModel& model) {
  avatar::requireValid(model);
  if (model.numJoints() < avatar::kNumSmplJoints || model.numJoints() >= kMostModelJoints ||
      !std::equal(
          avatar::kSmplParents.begin(),
          avatar::kSmplParents.begin() + kNumTrackedJoints,
          model.parents.begin())) {
    throw std::invalid_argument(
        "TrackedSurface: the body's first 22 of 24 to 63 joints must be SMPL's");
  }
}

BodyModel truncated(BodyModel model) {
  if (model.numBetas() > kMaxBetas) {
    model.shapeDirections = model.shapeDirections.leftCols(kMaxBetas).eval();
  }
  return model;
}

/// J + 1 rows of a regressor for more vertices: the pelvis once more.
SkinningWeights withHips(const SkinningWeights& regressor, Eigen::Index numVertices) {
  std::vector<Eigen::Triplet<double>> entries;
  for (Eigen::Index joint = 0; joint <= regressor.rows(); ++joint)
    for (SkinningWeights::InnerIterator it(regressor, joint % regressor.rows()); it; ++it)
      entries.emplace_back(static_cast<int>(joint), static_cast<int>(it.col()), it.value());
  SkinningWeights result(regressor.rows() + 1, numVertices);
  result.setFromTriplets(entries.begin(), entries.end());
  return result;
}

ClothUnknown unknownOf(const OuterLayer& layer) {
  return layer.faces.cols() > 0 ? layer.unknown : ClothUnknown::kNothing;
}

/// Directions behind the betas that move the layer alone, the last vertices: 3V × n.
void addClothShapes(const Eigen::MatrixXd& shapes, BodyModel& model) {
  model.shapeDirections.conservativeResize(
      Eigen::NoChange, model.shapeDirections.cols() + shapes.cols());
  model.shapeDirections.rightCols(shapes.cols()).setZero();
  model.shapeDirections.bottomRightCorner(shapes.rows(), shapes.cols()) = shapes;
}

/// The body with the layer's vertices behind its own, which neither betas nor pose blend shapes
/// move, and with one joint more at the pelvis, which carries what hangs from there.
BodyModel withLayer(const BodyModel& body, const OuterLayer& layer) {
  const Eigen::Index numBody = body.numVertices();
  const Eigen::Index numAll = numBody + layer.restVertices.cols();
  if (layer.skinningWeights.rows() != layer.restVertices.cols() ||
      layer.skinningWeights.cols() != body.numJoints() + 1) {
    throw std::invalid_argument("TrackedSurface: the outer layer has another body's joints");
  }
  if (layer.looseness.size() != layer.restVertices.cols())
    throw std::invalid_argument("TrackedSurface: expected the looseness of each vertex of cloth");
  BodyModel model = body;
  model.templateVertices.conservativeResize(3, numAll);
  model.templateVertices.rightCols(numAll - numBody) = layer.restVertices;
  model.faces.conservativeResize(3, body.numFaces() + layer.faces.cols());
  model.faces.rightCols(layer.faces.cols()) = layer.faces.array() + static_cast<int>(numBody);
  model.shapeDirections.conservativeResizeLike(Eigen::MatrixXd::Zero(3 * numAll, body.numBetas()));
  for (Eigen::MatrixXf& block : model.poseDirections) {
    if (block.size() > 0) {
      block.conservativeResizeLike(Eigen::MatrixXf::Zero(3 * numAll, 9));
    }
  }
  model.parents.push_back(avatar::kPelvis);
  model.poseDirections.emplace_back();
  model.jointRegressor = withHips(body.jointRegressor, numAll);
  const ClothUnknown unknown = unknownOf(layer);
  if (unknown == ClothUnknown::kWidths)
    addClothShapes(widthShapes(layer), model);
  if (unknown == ClothUnknown::kPlaces)
    addClothShapes(shiftShapes(layer), model);
  std::vector<Eigen::Triplet<double>> weights;
  const auto append = [&](const SkinningWeights& from, Eigen::Index first) {
    for (Eigen::Index v = 0; v < from.rows(); ++v)
      for (SkinningWeights::InnerIterator it(from, v); it; ++it)
        weights.emplace_back(static_cast<int>(first + v), static_cast<int>(it.col()), it.value());
  };
  append(body.skinningWeights, 0);
  append(layer.skinningWeights, numBody);
  model.skinningWeights.resize(numAll, model.numJoints());
  model.skinningWeights.setFromTriplets(weights.begin(), weights.end());
  model.skinningWeights.makeCompressed();
  return model;
}

/// The tracked joint that carries most of a vertex; hands belong to the wrists.
int carryingJoint(const BodyModel& model, int vertex) {
  int best = 0;
  double largest = -1.0;
  for (SkinningWeights::InnerIterator it(model.skinningWeights, vertex); it; ++it) {
    if (it.value() > largest) {
      largest = it.value();
      best = static_cast<int>(it.col());
    }
  }
  while (best >= kNumTrackedJoints) {
    best = model.parents[static_cast<std::size_t>(best)];
  }
  return best;
}

/// Farthest-point sampling of vertices [first, first + count), distances stretched by density.
std::vector<int> spreadVertices(const BodyModel& model, int first, int count, int wanted) {
  std::vector<int> chosen;
  if (count <= 0 || wanted <= 0) {
    return chosen;
  }
  Eigen::VectorXd density(count);
  for (int v = 0; v < count; ++v) {
    density[v] = samplingOf(carryingJoint(model, first + v)).density;
  }
  const auto points = model.templateVertices.middleCols(first, count);
  Eigen::VectorXd distance = Eigen::VectorXd::Constant(count, 1e9);
  Eigen::Index next = 0;
  while (static_cast<int>(chosen.size()) < std::min(wanted, count)) {
    chosen.push_back(first + static_cast<int>(next));
    const Eigen::Vector3d point = points.col(next);
    for (int v = 0; v < count; ++v) {
      distance[v] = std::min(distance[v], density[v] * (points.col(v) - point).squaredNorm());
    }
    distance.maxCoeff(&next);
  }
  std::sort(chosen.begin(), chosen.end());
  return chosen;
}

BodyModel sampledModel(const BodyModel& whole, const std::vector<TrackedSurface::Sample>& samples) {
  const auto count = static_cast<Eigen::Index>(samples.size());
  BodyModel model;
  model.name = whole.name;
  model.parents = whole.parents;
  model.templateVertices.resize(3, count);
  model.shapeDirections.resize(3 * count, whole.numBetas());
  model.jointRegressor.resize(whole.numJoints(), count);
  model.poseDirections.resize(whole.poseDirections.size());
  std::vector<Eigen::Triplet<double>> weights;
  for (Eigen::Index i = 0; i < count; ++i) {
    const int vertex = samples[static_cast<std::size_t>(i)].vertex;
    model.templateVertices.col(i) = whole.templateVertices.col(vertex);
    model.shapeDirections.middleRows<3>(3 * i) = whole.shapeDirections.middleRows<3>(3 * vertex);
    for (SkinningWeights::InnerIterator it(whole.skinningWeights, vertex); it; ++it) {
      weights.emplace_back(static_cast<int>(i), static_cast<int>(it.col()), it.value());
    }
  }
  model.skinningWeights.resize(count, whole.numJoints());
  model.skinningWeights.setFromTriplets(weights.begin(), weights.end());
  model.skinningWeights.makeCompressed();
  for (std::size_t b = 0; b < whole.poseDirections.size(); ++b) {
    const Eigen::MatrixXf& block = whole.poseDirections[b];
    if (block.size() == 0) {
      continue;
    }
    Eigen::MatrixXf& part = model.poseDirections[b];
    part.resize(3 * count, 9);
    for (Eigen::Index i = 0; i < count; ++i) {
      part.middleRows<3>(3 * i) =
          block.middleRows<3>(3 * samples[static_cast<std::size_t>(i)].vertex);
    }
  }
  return model;
}

/// How likely skin is bare when nobody labelled the cloth: as the clothes lie when they are known,
/// as people dress otherwise.
std::vector<TrackedSurface::Sample> chosenSamples(
    const BodyModel& model, int numBodyVertices, const OuterLayer* layer, int wanted) {
  std::vector<TrackedSurface::Sample> samples;
  const bool isKnown = layer && layer->bareness.size() == numBodyVertices;
  const auto append = [&](const std::vector<int>& vertices, bool cloth) {
    for (const int vertex : vertices) {
      const int joint = carryingJoint(model, vertex);
      double bareness = samplingOf(joint).bareness;
      if (isKnown)
        bareness = cloth ? 0.0 : layer->bareness[vertex];
      const double hanging =
          cloth ? model.skinningWeights.coeff(vertex, model.numJoints() - 1) : 0.0;
      const double looseness = cloth ? layer->looseness[vertex - numBodyVertices] : 0.0;
      samples.push_back({vertex, joint, cloth, bareness, hanging, looseness});
    }
  };
  const int numCloth = static_cast<int>(model.numVertices()) - numBodyVertices;
  append(spreadVertices(model, 0, numBodyVertices, wanted), false);
  // Clothes cover about half of the body; the same spacing.
  append(spreadVertices(model, numBodyVertices, numCloth, wanted / 2), true);
  return samples;
}

std::vector<Eigen::Matrix3Xd> jointShapeDerivatives(const BodyModel& model) {
  std::vector<Eigen::Matrix3Xd> derivatives;
  for (int joint = 0; joint < model.numJoints(); ++joint) {
    Eigen::Matrix3Xd derivative = Eigen::Matrix3Xd::Zero(3, model.numBetas());
    for (SkinningWeights::InnerIterator it(model.jointRegressor, joint); it; ++it) {
      derivative += it.value() * model.shapeDirections.middleRows<3>(3 * it.col());
    }
    derivatives.push_back(derivative);
  }
  return derivatives;
}

Eigen::Matrix3Xd blendedNormals(
    const BodyModel& model,
    const Eigen::Matrix3Xd& restNormals,
    const std::vector<Eigen::Isometry3d>& worldFromJoint) {
  Eigen::Matrix3Xd normals(3, restNormals.cols());
  for (Eigen::Index v = 0; v < normals.cols(); ++v) {
    Eigen::Matrix3d rotation = Eigen::Matrix3d::Zero();
    for (SkinningWeights::InnerIterator it(model.skinningWeights, v); it; ++it) {
      rotation += it.value() * worldFromJoint[static_cast<std::size_t>(it.col())].linear();
    }
    normals.col(v) = (rotation * restNormals.col(v)).stableNormalized();
  }
  return normals;
}

/// ∂g_k/∂β: each bone's change with shape, turned with its parent, added up the chain.
std::vector<Eigen::Matrix3Xd> posedJointShapeDerivatives(
    const std::vector<Eigen::Matrix3Xd>& atRest,
    const std::vector<int>& parents,
    const std::vector<Eigen::Isometry3d>& worldFromJoint) {
  std::vector<Eigen::Matrix3Xd> derivatives = atRest;
  for (std::size_t joint = 1; joint < parents.size(); ++joint) {
    const auto parent = static_cast<std::size_t>(parents[joint]);
    derivatives[joint] =
        derivatives[parent] + worldFromJoint[parent].linear() * (atRest[joint] - atRest[parent]);
  }
  return derivatives;
}

}  // namespace

TrackedSurface::TrackedSurface(const BodyModel& body, int numSamples, const OuterLayer* layer)
    : whole_(
          (requireSmplFamily(body), layer ? withLayer(truncated(body), *layer) : truncated(body))),
      numBodyVertices_(static_cast<int>(body.numVertices())),
      numBodyFaces_(static_cast<int>(body.numFaces())),
      numBetas_(whole_.numBetas()),
      numBodyBetas_(std::min(kMaxBetas, body.numBetas())),
      clothUnknown_(layer ? unknownOf(*layer) : ClothUnknown::kNothing),
      samples_(chosenSamples(whole_, numBodyVertices_, layer, numSamples)),
      restJointShapeDerivatives_(jointShapeDerivatives(whole_)),
      wholeSkinning_(whole_),
      sampledSkinning_((sampled_ = simulcap::sampledModel(whole_, samples_), sampled_)) {
  layerSamples_ = sampled_.templateVertices;
  const Eigen::Matrix3Xd normals = avatar::vertexNormals({whole_.templateVertices, whole_.faces});
  restNormals_.resize(3, static_cast<Eigen::Index>(samples_.size()));
  for (std::size_t i = 0; i < samples_.size(); ++i) {
    restNormals_.col(static_cast<Eigen::Index>(i)) = normals.col(samples_[i].vertex);
  }
  normalShapes_.resize(restNormals_.cols(), numBetas_);
  for (Eigen::Index i = 0; i < restNormals_.cols(); ++i)
    normalShapes_.row(i) =
        restNormals_.col(i).transpose() * sampled_.shapeDirections.middleRows<3>(3 * i);
  templateJoints_ = (whole_.jointRegressor * whole_.templateVertices.transpose()).transpose();
  // The hem of a long shirt hangs as well.
  constexpr double kFree = 0.9;
  constexpr double kSkirt = 0.05;  // of the cloth; a short skirt alone has more
  const auto count = [&](const auto& isCounted) {
    return static_cast<double>(std::count_if(samples_.begin(), samples_.end(), isCounted));
  };
  coversLegs_ = count([](const Sample& s) { return s.hanging > kFree; }) >
                kSkirt * count([](const Sample& s) { return s.cloth; });
}

int TrackedSurface::numBodySamples() const {
  return static_cast<int>(std::count_if(
      samples_.begin(), samples_.end(), [](const Sample& sample) { return !sample.cloth; }));
}

void TrackedSurface::setBareness(const Eigen::VectorXd& logOdds) {
  if (logOdds.size() != numBodySamples())
    throw std::invalid_argument("TrackedSurface: expected the bareness of each sample of the body");
  for (Eigen::Index s = 0; s < logOdds.size(); ++s)
    samples_[static_cast<std::size_t>(s)].bareness = 1.0 / (1.0 + std::exp(-logOdds[s]));
}

void TrackedSurface::setClothOffsets(const Eigen::VectorXd& offsets) {
  if (offsets.size() != layerSamples_.cols())
    throw std::invalid_argument("TrackedSurface: expected the offset of each sample");
  sampled_.templateVertices = layerSamples_ + restNormals_ * offsets.asDiagonal();
}

/// Of whole_ or sampled_, whose first `numBody` vertices are skin. Betas don't move cloth, and what
/// is unknown of the clothes doesn't move skin.
avatar::ShapedBody TrackedSurface::shaped(
    const BodyModel& model, Eigen::Index numBody, const Eigen::VectorXd& betas) const {
  if (betas.size() > numBetas_ || !betas.allFinite())
    throw std::invalid_argument(
        "TrackedSurface: expected at most " + std::to_string(numBetas_) + " finite numbers");
  const Eigen::Index numOfBody = std::min<Eigen::Index>(betas.size(), numBodyBetas_);
  const Eigen::Index numOfCloth = betas.size() - numOfBody;
  avatar::ShapedBody shaped{model.templateVertices, templateJoints_};
  auto values = shaped.vertices.reshaped();
  values.head(3 * numBody) +=
      model.shapeDirections.topLeftCorner(3 * numBody, numOfBody) * betas.head(numOfBody);
  const Eigen::Index clothRows = values.size() - 3 * numBody;
  values.tail(clothRows) +=
      model.shapeDirections.block(3 * numBody, numBodyBetas_, clothRows, numOfCloth) *
      betas.tail(numOfCloth);
  for (int joint = 0; joint < model.numJoints(); ++joint)
    shaped.joints.col(joint) +=
        restJointShapeDerivatives_[static_cast<std::size_t>(joint)].leftCols(numOfBody) *
        betas.head(numOfBody);
  return shaped;
}

avatar::BodyPose TrackedSurface::withPlumb(const avatar::BodyPose& pose) const {
  if (!knowsClothes())
    return pose;
  avatar::BodyPose whole = pose;
  const Eigen::Index plumb = 3 * plumbJoint();
  whole.jointRotations.setZero(plumb + 3);
  const Eigen::Index given = std::min(pose.jointRotations.size(), plumb);
  whole.jointRotations.head(given) = pose.jointRotations.head(given);
  const Eigen::Quaterniond upright(
      Eigen::AngleAxisd(avatar::heading(pose), Eigen::Vector3d::UnitY()));
  whole.jointRotations.tail<3>() = avatar::axisAngleFromQuaternion(
      avatar::quaternionFromAxisAngle(pose.jointRotations.head<3>()).conjugate() * upright);
  return whole;
}

PosedSamples TrackedSurface::pose(
    const BodyParameters& parameters, bool withShapeDerivatives) const {
  const avatar::ShapedBody shaped = this->shaped(sampled_, numBodySamples(), parameters.betas);
  avatar::SkinnedBody body = sampledSkinning_.pose(shaped, withPlumb(parameters.pose));
  PosedSamples posed;
  posed.normals = blendedNormals(sampled_, restNormals_, body.worldFromJoint);
  posed.positions = std::move(body.vertices);
  posed.rest = std::move(body.restVertices);
  posed.restJoints = shaped.joints;
  posed.worldFromJoint = std::move(body.worldFromJoint);
  for (std::size_t joint = 0; joint < kNumTrackedJoints; ++joint) {
    const int parent = whole_.parents[joint];
    const Eigen::Vector3d axisAngle =
        parameters.pose.jointRotations.segment<3>(3 * static_cast<Eigen::Index>(joint));
    const Eigen::Matrix3d jacobian = avatar::leftJacobian(axisAngle);
    posed.angularVelocities.push_back(
        parent < 0 ? jacobian
                   : posed.worldFromJoint[static_cast<std::size_t>(parent)].linear() * jacobian);
  }
  if (withShapeDerivatives) {
    posed.jointShapeDerivatives = posedJointShapeDerivatives(
        restJointShapeDerivatives_, whole_.parents, posed.worldFromJoint);
  }
  return posed;
}

Eigen::Matrix3Xd TrackedSurface::posedVertices(const BodyParameters& parameters) const {
  return wholeSkinning_
      .pose(shaped(whole_, numBodyVertices_, parameters.betas), withPlumb(parameters.pose))
      .vertices;
}

}  // namespace simulcap
