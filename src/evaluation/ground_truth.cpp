#include "src/evaluation/ground_truth.h"

#include "avatar/default_body/embedded_body.h"
#include "avatar/geometry/closest_point.h"
#include "avatar/io/file_error.h"
#include "avatar/io/motion_file.h"
#include "src/evaluation/camera_file.h"
#include "src/input/intrinsics_file.h"
#include "src/output/image_file.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <stdexcept>

namespace simulcap {
namespace {

namespace fs = std::filesystem;

std::string inFolder(const std::string& folder, const std::string& name) {
  return (fs::path(folder) / name).string();
}

/// SEQ of SEQ/gt, also when the path ends in a slash or is relative.
fs::path sequenceOf(const std::string& folder) {
  fs::path path = fs::absolute(folder).lexically_normal();
  if (path.filename().empty())
    path = path.parent_path();
  return path.parent_path();
}

/// `faces` (F, 3) of a file whose vertices are V.
Eigen::Matrix3Xi readFaces(const std::string& path, std::int64_t numVertices) {
  const avatar::NpzArrays arrays = avatar::readNpz(path, {"faces"});
  const auto faces = arrays.find("faces");
  if (faces == arrays.end() || faces->second.type == avatar::NpyArray::Type::kText ||
      faces->second.shape.size() != 2 || faces->second.shape[0] < 1 || faces->second.shape[1] != 3)
    throw avatar::FileError(path, "faces", "expected (F, 3) vertex indices");
  Eigen::Matrix3Xi result = faces->second.asMatrix().transpose().cast<int>();
  if (result.minCoeff() < 0 || result.maxCoeff() >= numVertices)
    throw avatar::FileError(
        path, "faces", "expected indices of the " + std::to_string(numVertices) + " vertices");
  return result;
}

avatar::NpzRowReader openVertices(const std::string& path) {
  avatar::NpzRowReader rows(path, "vertices");
  const auto& shape = rows.rowShape();
  if (shape.size() != 2 || shape[1] != 3 || shape[0] < 3 || rows.numRows() < 1)
    throw avatar::FileError(path, "vertices", "expected (T, V, 3) with T ≥ 1 and V ≥ 3");
  return rows;
}

/// The <name>s of gt/garment_<name>.npz, ascending.
std::vector<std::string> garmentNames(const std::string& folder) {
  const std::string prefix = "garment_";
  std::vector<std::string> names;
  for (const fs::directory_entry& entry : fs::directory_iterator(folder)) {
    const std::string stem = entry.path().stem().string();
    if (entry.path().extension() == ".npz" && stem.starts_with(prefix))
      names.push_back(stem.substr(prefix.size()));
  }
  std::sort(names.begin(), names.end());
  return names;
}

}  // namespace

std::string trueBodyModelName(const std::string& folder) {
  const std::string path = inFolder(folder, "body.npz");
  if (!fs::exists(path))
    return "";
  const avatar::NpzArrays arrays = avatar::readNpz(path, {"model"});
  const auto model = arrays.find("model");
  const bool isText = model != arrays.end() &&
                      model->second.type == avatar::NpyArray::Type::kText &&
                      model->second.size() == 1;
  return isText ? model->second.asText() : "";
}

bool isTrueBodyModel(const std::string& folder, const std::string& bodyModel) {
  constexpr double kSoftTissue = 0.02;  // [m]
  constexpr double kTooDeep = 0.01;     // under the skin, for cloth [m]
  // Of cloth. Its own body has next to none; a stranger of another build about 0.15.
  constexpr double kShareInside = 0.05;
  GroundTruth truth(folder, bodyModel);
  const TrueFrame frame = truth.frame(0);
  if (truth.bodyModel() == nullptr)
    return false;
  const Eigen::Matrix3Xd skin = truth.modelledBody();
  const avatar::SignedDistance distance({skin, truth.bodyModel()->faces});
  double sum = 0.0;
  if (truth.hasBodyVertices()) {
    for (const auto& vertex : frame.body.colwise())
      sum += std::abs(distance(vertex).distance);
    return sum <= kSoftTissue * static_cast<double>(frame.body.cols());
  }
  double count = 0.0;
  for (const Eigen::Matrix3Xd& garment : frame.garments) {
    for (const auto& vertex : garment.colwise())
      sum += distance(vertex).distance < -kTooDeep ? 1.0 : 0.0;
    count += static_cast<double>(garment.cols());
  }
  return sum <= kShareInside * count;
}

TrueBodyModel trueBodyModel(
    const std::string& folder, const std::string& given, const std::string& ofAvatar) {
  if (!given.empty())
    return {given, ""};
  const std::string named = trueBodyModelName(folder);
  const std::string model = named.empty() ? ofAvatar : named;
  const std::string help = " (evaluate --body MODEL, digitize --truth-body MODEL)";
  try {
    static_cast<void>(avatar::loadBody(model));
  } catch (const avatar::FileError& error) {
    return {"", "the truth's body model can't be had" + help + ": " + error.what()};
  }
  if (isTrueBodyModel(folder, model))
    return {model, ""};
  return {"", "the truth's body is not of the model " + model + ": say which it is of" + help};
}

GroundTruth::GroundTruth(const std::string& folder, const std::string& bodyModel)
    : folder_(folder) {
  if (!fs::is_directory(folder))
    throw avatar::FileError(folder, "", "is no folder; expected the truth of a sequence, SEQ/gt");
  camera_ = readIntrinsics((sequenceOf(folder) / "intrinsics.json").string()).info.camera;
  camera_.cameraFromWorld = readCameraFromWorld(inFolder(folder, "camera.json"));
  for (const std::string& name : garmentNames(folder))
    addGarment(name);
  readBody(bodyModel);
  readBodyVertices();
  if (numFrames_ < 0)
    throw avatar::FileError(folder, "", "holds neither garments nor a body to measure against");
}

void GroundTruth::addGarment(const std::string& name) {
  const std::string path = inFolder(folder_, "garment_" + name + ".npz");
  avatar::NpzRowReader rows = openVertices(path);
  garments_.push_back({name, readFaces(path, rows.rowShape()[0])});
  numFrames_ = numFrames_ < 0 ? rows.numRows() : std::min(numFrames_, rows.numRows());
  garmentRows_.push_back(std::move(rows));
}

void GroundTruth::readBody(const std::string& bodyModel) {
  const std::string path = inFolder(folder_, "body.npz");
  if (!fs::exists(path) || bodyModel.empty())
    return;
  motion_ = avatar::readMotion(path).motion;
  const auto frames = static_cast<std::int64_t>(motion_->frames.size());
  numFrames_ = numFrames_ < 0 ? frames : std::min(numFrames_, frames);
  model_ = std::make_unique<avatar::BodyModel>(avatar::loadBody(bodyModel));
  skinning_ = std::make_unique<avatar::Skinning>(*model_);
  const Eigen::Index known = std::min<Eigen::Index>(motion_->betas.size(), model_->numBetas());
  if (!motion_->betas.tail(motion_->betas.size() - known).isZero())
    throw avatar::FileError(
        path, "betas", "has more shape parameters than " + bodyModel + "; give the truth's model");
  shaped_ = skinning_->shape(motion_->betas.head(known));
  bodyFaces_ = model_->faces;
}

void GroundTruth::readBodyVertices() {
  const std::string path = inFolder(folder_, "body_vertices.npz");
  if (!fs::exists(path))
    return;
  avatar::NpzRowReader rows = openVertices(path);
  const std::int64_t numVertices = rows.rowShape()[0];
  const std::vector<std::string> keys = avatar::npzKeys(path);
  if (std::find(keys.begin(), keys.end(), "faces") != keys.end())
    bodyFaces_ = readFaces(path, numVertices);
  else if (model_ == nullptr || model_->numVertices() != numVertices)
    return;  // vertices without a surface
  numFrames_ = numFrames_ < 0 ? rows.numRows() : std::min(numFrames_, rows.numRows());
  bodyRows_ = std::move(rows);
}

Eigen::Matrix3Xd GroundTruth::row(avatar::NpzRowReader& rows, const std::string& file, int number) {
  if (rows.rowsRead() > number)
    throw std::out_of_range("GroundTruth: frames are read in ascending order");
  while (rows.rowsRead() < number)
    rows.next();
  const Eigen::Matrix3Xd vertices = rows.next().asMatrix().transpose();
  if (!vertices.allFinite())
    throw avatar::FileError(
        inFolder(folder_, file),
        "vertices",
        "frame " + std::to_string(number) + " holds values that are not finite");
  return camera_.cameraFromWorld * vertices;
}

TrueFrame GroundTruth::frame(int number) {
  if (number < 0 || number >= numFrames_)
    throw std::out_of_range("GroundTruth: no frame " + std::to_string(number));
  TrueFrame frame;
  for (std::size_t i = 0; i < garments_.size(); ++i)
    frame.garments.push_back(row(garmentRows_[i], "garment_" + garments_[i].name + ".npz", number));
  if (skinning_ != nullptr) {
    posed_ = skinning_->pose(shaped_, motion_->frames[static_cast<std::size_t>(number)]);
    frame.joints = camera_.cameraFromWorld * posed_.joints;
    frame.body = modelledBody();
  }
  if (bodyRows_)
    frame.body = row(*bodyRows_, "body_vertices.npz", number);
  return frame;
}

Eigen::Matrix3Xd GroundTruth::modelledBody() const {
  if (skinning_ == nullptr)
    return {};
  return camera_.cameraFromWorld * posed_.vertices;
}

std::vector<std::uint8_t> GroundTruth::labels(int number) const {
  char name[32];
  std::snprintf(name, sizeof name, "labels/%06d.png", number);
  const std::string path = inFolder(folder_, name);
  if (!fs::exists(path))
    return {};
  const avatar::ColorImage image = readColorImage(path);
  if (image.width != camera_.width || image.height != camera_.height)
    throw avatar::FileError(path, "", "is no picture of the size in intrinsics.json");
  std::vector<std::uint8_t> labels(
      static_cast<std::size_t>(image.width) * static_cast<std::size_t>(image.height));
  for (std::size_t i = 0; i < labels.size(); ++i)
    labels[i] = image.rgb[3 * i];  // grey: the same in all channels
  return labels;
}

}  // namespace simulcap
