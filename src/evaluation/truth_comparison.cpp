#include "src/evaluation/truth_comparison.h"

#include <nlohmann/json.hpp>

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

namespace simulcap {
namespace {

std::vector<avatar::TriangleMesh> meshes(
    const std::vector<Eigen::Matrix3Xd>& vertices, const std::vector<Eigen::Matrix3Xi>& faces) {
  std::vector<avatar::TriangleMesh> result;
  for (std::size_t i = 0; i < vertices.size(); ++i)
    result.push_back({vertices[i], faces[i]});
  return result;
}

std::vector<Eigen::Matrix3Xd> withBody(
    std::vector<Eigen::Matrix3Xd> garments, const Eigen::Matrix3Xd& body) {
  if (body.cols() > 0)
    garments.push_back(body);
  return garments;
}

/// The part of a person's flags that is a layer's.
std::vector<bool> slice(const std::vector<bool>& flags, Eigen::Index begin, Eigen::Index count) {
  return {flags.begin() + begin, flags.begin() + begin + count};
}

/// Where each layer's vertices begin in the person's.
std::vector<Eigen::Index> offsetsOf(const std::vector<Eigen::Matrix3Xd>& layers) {
  std::vector<Eigen::Index> offsets = {0};
  for (const Eigen::Matrix3Xd& layer : layers)
    offsets.push_back(offsets.back() + layer.cols());
  return offsets;
}

/// Mean over the vertices of one surface of their distances from the other [m].
double meanDistance(const MovingSurface& from, const MovingSurface& to, int threads) {
  double sum = 0.0;
  for (const avatar::ClosestPoint& point : to.nearest(from.mesh().vertices, threads))
    sum += std::sqrt(point.squaredDistance);
  return sum / static_cast<double>(from.mesh().numVertices());
}

double squaredMotion(const Eigen::Matrix3Xd& from, const Eigen::Matrix3Xd& to) {
  return from.cols() == to.cols() ? (to - from).squaredNorm()
                                  : std::numeric_limits<double>::infinity();
}

}  // namespace

nlohmann::json distributionJson(const Distribution& values) {
  return {
      {"mean", values.mean()},
      {"median", values.quantile(0.5)},
      {"p95", values.quantile(0.95)},
      {"max", values.max()}};
}

TruthComparison::TruthComparison(
    GroundTruth& truth, CapturedLayers layers, CommonBody common, int threads)
    : truth_(truth), layers_(std::move(layers)), common_(common), threads_(threads) {}

void TruthComparison::begin(const CapturedFrame& frame, const TrueFrame& truth) {
  std::vector<Eigen::Matrix3Xi> trueFaces, ourFaces;
  for (const GroundTruth::Garment& garment : truth_.garments())
    trueFaces.push_back(garment.faces);
  for (const CapturedLayers::Garment& garment : layers_.garments)
    ourFaces.push_back(garment.faces);
  trueFaces.push_back(truth_.bodyFaces());
  ourFaces.push_back(layers_.bodyFaces);
  truePerson_.emplace(meshes(withBody(truth.garments, truth.body), trueFaces));
  ourPerson_.emplace(meshes(withBody(frame.garments, frame.body), ourFaces));
  if (truth.body.cols() == 0)
    notes_.emplace_back(
        "the truth's body is not known: garments are seen through it, and figures of the body and "
        "of the outer surface are left out; give --body the truth's model");
  else if (!common_.vertices) {
    trueBody_.emplace(avatar::TriangleMesh{truth.body, truth_.bodyFaces()});
    ourBody_.emplace(avatar::TriangleMesh{frame.body, layers_.bodyFaces});
  }
  labels_.assign(layers_.garments.size(), kUpper);
  pairGarments(frame, truth);
  for (std::size_t i = 0; i < labels_.size(); ++i)
    labels_[i] = labelOfGarment(layers_.garments[i].name);
  for (const Pair& pair : pairs_)
    labels_[pair.ours] = labelOfGarment(truth_.garments()[pair.truth].name);
  labels_.push_back(kSkin);
}

void TruthComparison::pairGarments(const CapturedFrame& frame, const TrueFrame& truth) {
  std::vector<std::size_t> trueLeft, oursLeft;
  const auto pairUp = [&](std::size_t t, std::size_t o) {
    pairs_.push_back(
        {t,
         o,
         MovingSurface(avatar::TriangleMesh{truth.garments[t], truth_.garments()[t].faces}),
         MovingSurface(avatar::TriangleMesh{frame.garments[o], layers_.garments[o].faces}),
         MovingSurface(avatar::TriangleMesh{frame.skinned[o], layers_.garments[o].faces})});
  };
  for (std::size_t o = 0; o < layers_.garments.size(); ++o)
    oursLeft.push_back(o);
  for (std::size_t t = 0; t < truth_.garments().size(); ++t) {
    const std::string& name = truth_.garments()[t].name;
    const auto same = std::find_if(oursLeft.begin(), oursLeft.end(), [&](std::size_t o) {
      return layers_.garments[o].name == name;
    });
    if (same == oursLeft.end()) {
      trueLeft.push_back(t);
      continue;
    }
    pairUp(t, *same);
    oursLeft.erase(same);
  }
  const auto nearestOf = [&](std::size_t t) {
    const MovingSurface surface(
        avatar::TriangleMesh{truth.garments[t], truth_.garments()[t].faces});
    const auto apart = [&](std::size_t o) {
      const MovingSurface ours(avatar::TriangleMesh{frame.garments[o], layers_.garments[o].faces});
      return meanDistance(surface, ours, threads_) + meanDistance(ours, surface, threads_);
    };
    std::vector<double> distances;
    distances.reserve(oursLeft.size());
    for (const std::size_t o : oursLeft)
      distances.push_back(apart(o));
    const auto least = std::min_element(distances.begin(), distances.end());
    return oursLeft.begin() + (least - distances.begin());
  };
  for (const std::size_t t : trueLeft) {
    const auto best = nearestOf(t);
    const std::string& name = truth_.garments()[t].name;
    if (best == oursLeft.end()) {
      notes_.push_back("the capture has no garment for the truth's " + name);
      continue;
    }
    notes_.push_back("compared with the truth's " + name + ": " + layers_.garments[*best].name);
    pairUp(t, *best);
    oursLeft.erase(best);
  }
  for (const std::size_t o : oursLeft)
    notes_.push_back("the truth has no garment for " + layers_.garments[o].name);
}

void TruthComparison::move(const CapturedFrame& frame, const TrueFrame& truth) {
  truePerson_->move(withBody(truth.garments, truth.body));
  ourPerson_->move(withBody(frame.garments, frame.body));
  if (trueBody_) {
    trueBody_->move(truth.body);
    ourBody_->move(frame.body);
  }
  for (Pair& pair : pairs_) {
    pair.trueSurface.move(truth.garments[pair.truth]);
    pair.ourSurface.move(frame.garments[pair.ours]);
    pair.skinnedSurface.move(frame.skinned[pair.ours]);
  }
}

CapturedView TruthComparison::add(const CapturedFrame& frame) {
  const TrueFrame truth = truth_.frame(frame.number);
  if (truePerson_)
    move(frame, truth);
  else
    begin(frame, truth);
  const avatar::Camera& camera = truth_.camera();
  const std::vector<bool> trueSeen =
      truePerson_->visible(truePerson_->mesh().vertices, camera, threads_);
  const std::vector<bool> ourSeen =
      ourPerson_->visible(ourPerson_->mesh().vertices, camera, threads_);
  const std::vector<Eigen::Index> trueOffsets = offsetsOf(truth.garments);
  for (const Pair& pair : pairs_) {
    const std::vector<bool> seen =
        slice(trueSeen, trueOffsets[pair.truth], pair.trueSurface.mesh().numVertices());
    const SeenSurface surface{pair.trueSurface, seen};
    addSurfaceErrors(surface, pair.ourSurface, threads_, garmentErrors_);
    addSurfaceErrors(surface, pair.skinnedSurface, threads_, skinnedErrors_);
  }
  if (truth.body.cols() > 0)
    addOuterSurfaceErrors({*truePerson_, trueSeen}, {*ourPerson_, ourSeen}, threads_, outerErrors_);
  addBody(frame, truth);
  addLabels(frame);

  CapturedView view;
  const std::vector<Eigen::Index> offsets = offsetsOf(frame.garments);
  for (std::size_t i = 0; i < frame.garments.size(); ++i)
    view.garmentsVisible.push_back(slice(ourSeen, offsets[i], frame.garments[i].cols()));
  view.still = stoodStill(truth, frame.number);
  return view;
}

void TruthComparison::addBody(const CapturedFrame& frame, const TrueFrame& truth) {
  if (common_.joints && truth.joints.cols() > 0) {
    const Eigen::Index count =
        std::min<Eigen::Index>({avatar::kNumSmplJoints, frame.joints.cols(), truth.joints.cols()});
    for (Eigen::Index joint = 0; joint < count; ++joint)
      jointErrors_.add(1000.0 * (frame.joints.col(joint) - truth.joints.col(joint)).norm());
  }
  if (trueBody_) {
    const std::vector<bool> all(static_cast<std::size_t>(truth.body.cols()), true);
    addSurfaceErrors({*trueBody_, all}, *ourBody_, threads_, bodyErrors_);
  } else if (truth.body.cols() > 0) {
    for (Eigen::Index v = 0; v < truth.body.cols(); ++v)
      bodyErrors_.visible.add(1000.0 * (frame.body.col(v) - truth.body.col(v)).norm());
  }
}

void TruthComparison::addLabels(const CapturedFrame& frame) {
  const std::vector<std::uint8_t> trueLabels = truth_.labels(frame.number);
  if (trueLabels.empty())
    return;
  std::vector<avatar::MeshView> layers;
  for (std::size_t i = 0; i < frame.garments.size(); ++i)
    layers.emplace_back(frame.garments[i], layers_.garments[i].faces);
  layers.emplace_back(frame.body, layers_.bodyFaces);
  labelOverlap_.add(renderedLabels(layers, labels_, truth_.camera()), trueLabels);
}

bool TruthComparison::stoodStill(const TrueFrame& truth, int number) {
  constexpr double kStill = 0.00025;  // root mean square from frame to frame [m]
  double squares = squaredMotion(lastTruth_.body, truth.body);
  Eigen::Index count = truth.body.cols();
  const bool follows =
      number == lastNumber_ + 1 && lastTruth_.garments.size() == truth.garments.size();
  for (std::size_t i = 0; follows && i < truth.garments.size(); ++i) {
    squares += squaredMotion(lastTruth_.garments[i], truth.garments[i]);
    count += truth.garments[i].cols();
  }
  lastTruth_ = truth;
  lastNumber_ = number;
  return follows && squares <= kStill * kStill * static_cast<double>(count);
}

nlohmann::json TruthComparison::figures() const {
  nlohmann::json figures = nlohmann::json::object();
  const auto add = [&](const char* key, const Distribution& values) {
    if (!values.empty())
      figures[key] = distributionJson(values);
  };
  add("joint_mm", jointErrors_);
  add("body_vertex_mm", bodyErrors_.visible);
  add("garment_visible_mm", garmentErrors_.visible);
  add("garment_hidden_mm", garmentErrors_.hidden);
  add("hidden_mm_by_skinning", skinnedErrors_.hidden);
  add("outer_surface_mm", outerErrors_);
  for (const auto& [name, label] : {std::pair{"upper", kUpper}, std::pair{"lower", kLower}})
    if (labelOverlap_.occurs(label))
      figures["segmentation_iou"][name] = labelOverlap_.iou(label);
  return figures;
}

}  // namespace simulcap
