#include "src/output/body_view.h"

#include "avatar/body_pose.h"
#include "avatar/geometry/measures.h"

#include <algorithm>
#include <numeric>
#include <stdexcept>

namespace simulcap {

const std::vector<BodyView>& bodyViews() {
  using avatar::SmplJoint;
  static const std::vector<BodyView> kViews = {
      {"front", {0.0, 0.0, -1.0}},
      {"back", {0.0, 0.0, 1.0}},
      {"side", {-1.0, 0.0, 0.0}},
      {"right-side", {1.0, 0.0, 0.0}},
      {"three-quarter", {-0.7, -0.2, -0.7}},
      {"three-quarter-back", {0.7, -0.2, 0.7}},
      {"top", {0.0, -1.0, 0.0}, {0.0, 0.0, -1.0}},
      {"face", {0.0, 0.0, -1.0}, {0.0, 1.0, 0.0}, {SmplJoint::kHead}},
      {"face-side", {-0.9, 0.0, -0.45}, {0.0, 1.0, 0.0}, {SmplJoint::kHead}},
      {"neck",
       {-0.4, -0.7, -1.0},
       {0.0, 1.0, 0.0},
       {SmplJoint::kNeck, SmplJoint::kLeftCollar, SmplJoint::kRightCollar}},
      {"armpit",
       {-0.7, 0.3, -0.8},
       {0.0, 1.0, 0.0},
       {SmplJoint::kLeftShoulder, SmplJoint::kLeftCollar}},
      {"hips",
       {0.0, 0.45, -1.0},
       {0.0, 1.0, 0.0},
       {SmplJoint::kPelvis, SmplJoint::kLeftHip, SmplJoint::kRightHip}},
      {"hand", {0.0, -0.9, -0.45}, {0.0, 1.0, 0.0}, {SmplJoint::kLeftWrist, SmplJoint::kLeftHand}},
      {"foot", {-0.7, -0.4, -0.5}, {0.0, 1.0, 0.0}, {SmplJoint::kLeftAnkle, SmplJoint::kLeftFoot}},
  };
  return kViews;
}

const BodyView& bodyView(const std::string& name) {
  const std::vector<BodyView>& views = bodyViews();
  const auto found = std::find_if(
      views.begin(), views.end(), [&](const BodyView& view) { return view.name == name; });
  if (found == views.end())
    throw std::invalid_argument("bodyView: no view is called " + name);
  return *found;
}

namespace {

using Weights = Eigen::SparseMatrix<double, Eigen::RowMajor>;

int strongestJoint(const Weights& weights, int vertex) {
  int strongest = 0;
  double weight = 0.0;
  for (Weights::InnerIterator it(weights, vertex); it; ++it) {
    if (it.value() > weight) {
      weight = it.value();
      strongest = static_cast<int>(it.col());
    }
  }
  return strongest;
}

}  // namespace

std::vector<int> verticesOfJoints(const Weights& weights, const std::vector<int>& joints) {
  std::vector<int> vertices;
  for (int v = 0; v < weights.rows(); ++v) {
    const int joint = strongestJoint(weights, v);
    if (joints.empty() || std::find(joints.begin(), joints.end(), joint) != joints.end())
      vertices.push_back(v);
  }
  return vertices;
}

PicturedPerson PicturedPerson::nobody() {
  static const avatar::AvatarBody kNobody;
  return PicturedPerson(kNobody);
}

namespace {

/// Around all things of all bodies.
Eigen::AlignedBox3d boxOfThings(const std::vector<PicturedBody>& bodies) {
  Eigen::AlignedBox3d garments;
  Eigen::AlignedBox3d props;
  for (const PicturedBody& body : bodies) {
    for (const PicturedMesh& garment : body.garments)
      garments.extend(avatar::boundingBox(garment.mesh));
    for (const PicturedMesh& prop : body.props)
      props.extend(avatar::boundingBox(prop.mesh));
  }
  return garments.isEmpty() ? props : garments;
}

}  // namespace

std::vector<Eigen::AlignedBox3d> framingBoxes(
    const std::vector<PicturedBody>& bodies, const std::vector<int>& vertices, bool commonFloor) {
  if (vertices.empty())
    return {bodies.size(), boxOfThings(bodies)};
  std::vector<Eigen::AlignedBox3d> boxes(bodies.size());
  Eigen::Vector3d largest = Eigen::Vector3d::Zero();
  Eigen::AlignedBox3d all;
  for (std::size_t i = 0; i < bodies.size(); ++i) {
    for (const int v : vertices)
      boxes[i].extend(Eigen::Vector3d(bodies[i].vertices.col(v)));
    if (static_cast<Eigen::Index>(vertices.size()) == bodies[i].vertices.cols()) {
      for (const PicturedMesh& garment : bodies[i].garments)
        boxes[i].extend(avatar::boundingBox(garment.mesh));
    }
    largest = largest.cwiseMax(boxes[i].sizes());
    all.extend(boxes[i]);
  }
  for (Eigen::AlignedBox3d& box : boxes) {
    const Eigen::Vector3d centre = box.center();
    const double floor = commonFloor ? all.min().y() : box.min().y();
    const double top = commonFloor ? all.max().y() : floor + largest.y();
    box.min() = Eigen::Vector3d(centre.x() - largest.x() / 2, floor, centre.z() - largest.z() / 2);
    box.max() = Eigen::Vector3d(centre.x() + largest.x() / 2, top, centre.z() + largest.z() / 2);
  }
  return boxes;
}

void PictureOptions::validate() const {
  const auto require = [](bool holds, const char* what) {
    if (!holds)
      throw std::invalid_argument(std::string("PictureOptions: ") + what);
  };
  require(width >= 16 && width <= 8192, "width must be 16 to 8192 px");
  require(height >= 16 && height <= 8192, "height must be 16 to 8192 px");
  require(supersampling >= 1 && supersampling <= 4, "supersampling must be 1 to 4");
  require(
      !color || (color->minCoeff() >= 0.0 && color->maxCoeff() <= 1.0),
      "colour channels must be within 0 to 1");
}

namespace {

/// As from about six metres: the proportions that a person is used to see.
avatar::Camera longLens(
    const BodyView& view, const Eigen::AlignedBox3d& box, const PictureOptions& options) {
  const double focalLength = 3.0 * std::max(options.width, options.height);
  const avatar::Camera lens{
      .width = options.width,
      .height = options.height,
      .fx = focalLength,
      .fy = focalLength,
      .cx = 0.5 * (options.width - 1),
      .cy = 0.5 * (options.height - 1)};
  return avatar::frameBox(
      lens, box, {.viewDirection = view.direction.normalized(), .up = view.up, .margin = 0.04});
}

const Eigen::Vector3d kSkinColor(0.95, 0.80, 0.71);  // of a body without a colour of its own

void addShaded(
    const std::vector<PicturedMesh>& pictured,
    const PictureOptions& options,
    std::vector<avatar::ShadedMesh>& meshes) {
  constexpr double kInside = 0.6;  // the inside of fabric is darker
  for (const PicturedMesh& thing : pictured)
    meshes.push_back(
        {.mesh = thing.mesh,
         .color = thing.color,
         .vertexColors = thing.vertexColors.cols() > 0 ? &thing.vertexColors : nullptr,
         .backColor = Eigen::Vector3d(kInside * thing.color),
         .wireframe = options.wireframe});
}

}  // namespace

avatar::ColorImage picture(
    const std::vector<PicturedMesh>& pictured,
    const BodyView& view,
    const Eigen::AlignedBox3d& box,
    const PictureOptions& options) {
  options.validate();
  std::vector<avatar::ShadedMesh> meshes;
  addShaded(pictured, options, meshes);
  return avatar::shade(
      meshes, longLens(view, box, options), {.supersampling = options.supersampling});
}

avatar::ColorImage picture(
    const PicturedPerson& person,
    const PicturedBody& pictured,
    const BodyView& view,
    const Eigen::AlignedBox3d& box,
    const PictureOptions& options) {
  options.validate();
  std::vector<avatar::ShadedMesh> meshes;
  meshes.push_back(
      {.mesh = {pictured.vertices, person.faces},
       .color = options.color.value_or(kSkinColor),
       .vertexColors = options.color ? nullptr : person.vertexColors,
       .wireframe = options.wireframe});
  addShaded(pictured.garments, options, meshes);
  addShaded(pictured.props, options, meshes);
  return avatar::shade(
      meshes, longLens(view, box, options), {.supersampling = options.supersampling});
}

}  // namespace simulcap
