#include "src/synthesis/sequence_writer.h"

#include "avatar/io/atomic_file.h"
#include "avatar/io/avatar_file.h"
#include "avatar/io/file_error.h"
#include "avatar/io/npy.h"
#include "src/output/image_file.h"

#include <nlohmann/json.hpp>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <set>
#include <utility>

namespace simulcap {
namespace {

namespace fs = std::filesystem;
using Type = avatar::NpyArray::Type;

std::string pictureName(int frame, const char* extension) {
  char name[32];
  std::snprintf(name, sizeof name, "%06d.%s", frame, extension);
  return name;
}

std::vector<std::uint16_t> rawDepth(const std::vector<float>& depth, double scale) {
  std::vector<std::uint16_t> raw(depth.size());
  std::transform(depth.begin(), depth.end(), raw.begin(), [&](float z) {
    const double value = std::round(scale * static_cast<double>(z));
    return static_cast<std::uint16_t>(value > 0.0 && value < 65536.0 ? value : 0.0);
  });
  return raw;
}

nlohmann::json rowMajor(const Eigen::Isometry3d& transform) {
  nlohmann::json rows = nlohmann::json::array();
  for (int r = 0; r < 4; ++r) {
    const Eigen::RowVector4d row = transform.matrix().row(r);
    rows.push_back({row[0], row[1], row[2], row[3]});
  }
  return rows;
}

void writeArray(const fs::path& path, const avatar::NpyArray& array) {
  const std::vector<std::uint8_t> bytes = avatar::formatNpy(array);
  avatar::writeFileAtomically(
      path.string(), {reinterpret_cast<const char*>(bytes.data()), bytes.size()});
}

}  // namespace

void requireReplaceable(const fs::path& path) {
  if (!fs::exists(path))
    return;
  const std::set<std::string> ours = {
      "depth", "color", "gt", "intrinsics.json", "timestamps.txt", "avatar.glb"};
  for (const fs::directory_entry& entry : fs::directory_iterator(path)) {
    if (ours.count(entry.path().filename().string()) == 0)
      throw avatar::FileError(
          path.string(),
          entry.path().filename().string(),
          "doesn't belong to a sequence, which would replace it; choose another folder");
  }
}

SequenceWriter::SequenceWriter(fs::path path, SequenceLayout layout)
    : path_(std::move(path)), parts_(path_), layout_(std::move(layout)) {
  if (!path_.has_filename())  // "SEQ/"
    path_ = path_.parent_path();
  parts_ = path_;
  parts_ += ".parts";
  requireReplaceable(path_);
  std::error_code error;
  fs::remove_all(parts_, error);
  for (const char* folder : {"depth", "color", "gt/labels", "gt/depth_back", "rows"}) {
    fs::create_directories(parts_ / folder, error);
    if (error)
      throw avatar::FileError(
          parts_.string(),
          "",
          "cannot be made (" + error.message() + "); choose a folder you may write to");
  }
  const auto addRows = [&](const std::string& name, avatar::NpyRows rows) {
    rows_.emplace(name, avatar::NpyFileWriter(rowsPath(name).string(), std::move(rows)));
  };
  addRows("poses", {Type::kFloat64, {3 * avatar::kNumSmplJoints}});
  addRows("trans", {Type::kFloat64, {3}});
  for (const TruthMesh& mesh : layout_.meshes)
    addRows(mesh.name, {Type::kFloat32, {mesh.numVertices, 3}});
  writeDescription();
}

fs::path SequenceWriter::rowsPath(const std::string& name) const {
  return parts_ / "rows" / (name + ".npy");
}

void SequenceWriter::writeDescription() const {
  const avatar::Camera& camera = layout_.camera;
  nlohmann::json intrinsics = {
      {"width", camera.width},
      {"height", camera.height},
      {"fx", camera.fx},
      {"fy", camera.fy},
      {"cx", camera.cx},
      {"cy", camera.cy},
      {"depth_scale", layout_.depthScale},
      {"fps", layout_.framesPerSecond}};
  if (layout_.turnaroundFrames)
    intrinsics["turnaround_frames"] = *layout_.turnaroundFrames;
  avatar::writeFileAtomically((parts_ / "intrinsics.json").string(), intrinsics.dump(1) + "\n");
  const nlohmann::json truth = {
      {"camera_from_world", rowMajor(camera.cameraFromWorld)},
      {"back_camera_from_world", rowMajor(layout_.backCamera.cameraFromWorld)}};
  avatar::writeFileAtomically((parts_ / "gt/camera.json").string(), truth.dump(1) + "\n");
}

void SequenceWriter::writePictures(int frame, const SequencePictures& pictures) const {
  const int width = layout_.camera.width;
  const int height = layout_.camera.height;
  const auto write = [&](const char* folder, const char* extension, const std::string& bytes) {
    avatar::writeFileAtomically((parts_ / folder / pictureName(frame, extension)).string(), bytes);
  };
  write("depth", "png", pngBytes(width, height, rawDepth(pictures.depth, layout_.depthScale)));
  write("color", "jpg", jpegBytes(pictures.color));
  write("gt/labels", "png", pngBytes(width, height, pictures.labels));
  if (!pictures.backDepth.empty())
    write(
        "gt/depth_back",
        "png",
        pngBytes(width, height, rawDepth(pictures.backDepth, layout_.depthScale)));
}

void SequenceWriter::appendTruth(
    const avatar::BodyPose& pose, const std::vector<Eigen::Matrix3Xd>& vertices) {
  rows_.at("poses").append(pose.jointRotations.data());
  rows_.at("trans").append(pose.translation.data());
  for (std::size_t i = 0; i < layout_.meshes.size(); ++i) {
    const Eigen::Matrix3Xf row = vertices[i].cast<float>();
    rows_.at(layout_.meshes[i].name).append(row.data());
  }
  ++numFrames_;
}

void SequenceWriter::writeTruth() {
  for (auto& [name, rows] : rows_)
    rows.close();
  avatar::NpyArray betas = avatar::NpyArray::fromMatrix(layout_.betas);
  betas.shape = {layout_.betas.size()};
  avatar::NpyArray rate =
      avatar::NpyArray::fromMatrix(Eigen::MatrixXd::Constant(1, 1, layout_.framesPerSecond));
  rate.shape = {};
  writeArray(rowsPath("betas"), betas);
  writeArray(rowsPath("mocap_framerate"), rate);
  writeArray(rowsPath("up_axis"), avatar::NpyArray::fromText("y"));
  writeArray(rowsPath("model"), avatar::NpyArray::fromText(layout_.bodyModel));
  std::map<std::string, avatar::NpyFile> body;
  for (const char* key : {"poses", "trans", "betas", "mocap_framerate", "up_axis", "model"})
    body[key] = {rowsPath(key).string()};
  avatar::writeNpzFromFiles((parts_ / "gt/body.npz").string(), body);
  for (const TruthMesh& mesh : layout_.meshes) {
    const fs::path faces = rowsPath("faces");
    writeArray(
        faces, avatar::NpyArray::fromMatrix(mesh.faces.transpose().cast<double>(), Type::kInt32));
    avatar::writeNpzFromFiles(
        (parts_ / "gt" / (mesh.name + ".npz")).string(),
        {{"vertices", {rowsPath(mesh.name).string(), false}}, {"faces", {faces.string()}}});
  }
}

void SequenceWriter::finish(const avatar::LayeredAvatar& avatar) {
  writeTruth();
  std::string stamps;
  for (int frame = 0; frame < numFrames_; ++frame) {
    char line[32];
    std::snprintf(line, sizeof line, "%.6f\n", frame / layout_.framesPerSecond);
    stamps += line;
  }
  avatar::writeFileAtomically((parts_ / "timestamps.txt").string(), stamps);
  avatar::writeAvatar((parts_ / "avatar.glb").string(), avatar);
  std::error_code error;
  fs::remove_all(parts_ / "rows", error);
  fs::remove_all(path_, error);
  fs::rename(parts_, path_, error);
  if (error)
    throw avatar::FileError(
        path_.string(),
        "",
        "cannot be written (" + error.message() + "); it is in " + parts_.string());
}

}  // namespace simulcap
