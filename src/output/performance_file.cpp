#include "src/output/performance_file.h"

#include "avatar/io/atomic_file.h"
#include "avatar/io/file_error.h"
#include "avatar/io/npy.h"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <limits>
#include <set>
#include <sstream>
#include <stdexcept>
#include <utility>

namespace simulcap {
namespace {

namespace fs = std::filesystem;
using Type = avatar::NpyArray::Type;

constexpr int kPoseSize = 3 * avatar::kNumSmplJoints;

/// The last part that begin() makes, the constants being sorted by key: a folder that holds it
/// holds all the others.
constexpr const char* kLastPart = "up_axis";

bool hasProperFaces(const PerformanceLayout::Garment& garment) {
  return garment.faces.cols() > 0 && garment.faces.minCoeff() >= 0 &&
         garment.faces.maxCoeff() < garment.numVertices;
}

void requireValid(const PerformanceLayout& layout) {
  const auto allowed = [](char c) {
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '_' ||
           c == '-';
  };
  std::set<std::string> names;
  for (const PerformanceLayout::Garment& garment : layout.garments) {
    const std::string& name = garment.name;
    if (name.empty() || !std::all_of(name.begin(), name.end(), allowed) ||
        !names.insert(name).second || !hasProperFaces(garment))
      throw std::invalid_argument(
          "PerformanceWriter: garment '" + name +
          "' needs a name of its own (letters, digits, _, -) and faces of its vertices");
  }
  if (!(layout.framesPerSecond > 0.0) || !std::isfinite(layout.framesPerSecond) ||
      !layout.betas.allFinite())
    throw std::invalid_argument("PerformanceWriter: the rate must be positive, betas finite");
}

avatar::NpyArray vectorArray(const Eigen::VectorXd& values) {
  avatar::NpyArray array = avatar::NpyArray::fromMatrix(values);
  array.shape = {values.size()};
  return array;
}

/// (F, 3).
avatar::NpyArray facesArray(const Eigen::Matrix3Xi& faces) {
  return avatar::NpyArray::fromMatrix(faces.transpose().cast<double>(), Type::kInt32);
}

std::string_view textOf(const std::vector<std::uint8_t>& bytes) {
  return {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
}

std::string fileText(const std::string& path) {
  std::ostringstream text;
  text << std::ifstream(path, std::ios::binary).rdbuf();
  return text.str();
}

}  // namespace

PerformanceWriter::PerformanceWriter(
    std::string path, PerformanceLayout layout, PerformanceStart start)
    : path_(std::move(path)), folder_(path_ + ".parts"), layout_(std::move(layout)) {
  requireValid(layout_);
  if (start == PerformanceStart::kNew || !resume(std::numeric_limits<std::int64_t>::max()))
    begin();
}

PerformanceWriter::PerformanceWriter(
    std::string path, PerformanceLayout layout, std::int64_t numFrames)
    : path_(std::move(path)), folder_(path_ + ".parts"), layout_(std::move(layout)) {
  requireValid(layout_);
  if (!resume(numFrames) || numFrames_ < numFrames)
    throw avatar::FileError(
        folder_,
        "",
        "holds " + std::to_string(numFrames_) + " of the " + std::to_string(numFrames) +
            " frames that were captured; start anew");
}

std::vector<PerformanceWriter::Part> PerformanceWriter::parts() const {
  std::vector<Part> parts = {
      {"poses", {Type::kFloat64, {kPoseSize}}},
      {"trans", {Type::kFloat64, {3}}},
      {"frame_index", {Type::kInt32, {}}}};
  if (layout_.jointDeviations)
    parts.push_back({"joint_deviation", {Type::kFloat32, {avatar::kNumSmplJoints}}});
  for (const PerformanceLayout::Garment& garment : layout_.garments) {
    parts.push_back({"garment_" + garment.name, {Type::kFloat32, {garment.numVertices, 3}}});
    parts.push_back({"provenance_" + garment.name, {Type::kUint8, {garment.numVertices}}});
  }
  return parts;
}

avatar::NpzArrays PerformanceWriter::constants() const {
  avatar::NpyArray rate = vectorArray(Eigen::VectorXd::Constant(1, layout_.framesPerSecond));
  rate.shape = {};
  avatar::NpzArrays arrays = {
      {"betas", vectorArray(layout_.betas)},
      {"mocap_framerate", std::move(rate)},
      {kLastPart, avatar::NpyArray::fromText("y")}};
  for (const PerformanceLayout::Garment& garment : layout_.garments)
    arrays["faces_" + garment.name] = facesArray(garment.faces);
  return arrays;
}

std::string PerformanceWriter::partPath(const std::string& key) const {
  return (fs::path(folder_) / (key + ".npy")).string();
}

void PerformanceWriter::begin() {
  std::error_code error;
  fs::remove_all(folder_, error);
  fs::create_directories(folder_, error);
  if (error)
    throw avatar::FileError(
        folder_, "", "cannot be made (" + error.message() + "); choose a folder you may write to");
  for (const Part& part : parts())
    files_.emplace_back(partPath(part.key), part.rows);
  // After the parts that grow: see kLastPart.
  for (const auto& [key, array] : constants())
    avatar::writeFileAtomically(partPath(key), textOf(avatar::formatNpy(array)));
}

bool PerformanceWriter::resume(std::int64_t mostFrames) {
  if (!fs::exists(partPath(kLastPart)))
    return false;
  requireSameLayout();
  // A run may have ended between two parts of a frame: only whole frames count.
  const std::vector<Part> all = parts();
  numFrames_ = mostFrames;
  for (const Part& part : all)
    numFrames_ = std::min(numFrames_, avatar::countNpyRows(partPath(part.key), part.rows));
  for (const Part& part : all)
    files_.emplace_back(partPath(part.key), part.rows, numFrames_);
  return true;
}

void PerformanceWriter::requireSameLayout() const {
  const avatar::NpzArrays fixed = constants();
  const std::vector<Part> all = parts();
  const auto numFiles = std::distance(fs::directory_iterator(folder_), fs::directory_iterator());
  bool same = static_cast<std::size_t>(numFiles) == fixed.size() + all.size();
  for (const auto& [key, array] : fixed)
    same = same && fileText(partPath(key)) == textOf(avatar::formatNpy(array));
  for (const Part& part : all)
    same = same && avatar::countNpyRows(partPath(part.key), part.rows) >= 0;
  if (!same)
    throw avatar::FileError(
        folder_,
        "",
        "was left by a run with another body, rate or garments; start anew, or remove it");
}

void PerformanceWriter::requireFits(const PerformanceFrame& frame) const {
  bool fits = frame.garments.size() == layout_.garments.size() &&
              frame.pose.jointRotations.size() == kPoseSize &&
              frame.pose.jointRotations.allFinite() && frame.pose.translation.allFinite();
  for (std::size_t i = 0; fits && i < frame.garments.size(); ++i) {
    const PerformanceFrame::Garment& garment = frame.garments[i];
    const auto numVertices = static_cast<std::size_t>(layout_.garments[i].numVertices);
    fits = garment.vertices.cols() == layout_.garments[i].numVertices &&
           garment.provenance.size() == numVertices && garment.vertices.allFinite();
  }
  if (!fits)
    throw std::invalid_argument(
        "PerformanceWriter: frame " + std::to_string(numFrames_) +
        " doesn't fit the layout or isn't finite");
}

void PerformanceWriter::append(const PerformanceFrame& frame) {
  requireFits(frame);
  // Column by column is C order of (V, 3).
  const auto index =
      static_cast<std::int32_t>(frame.recordingIndex >= 0 ? frame.recordingIndex : numFrames_);
  std::vector<const void*> rows = {
      frame.pose.jointRotations.data(), frame.pose.translation.data(), &index};
  if (layout_.jointDeviations)
    rows.push_back(frame.jointDeviations.data());
  for (const PerformanceFrame::Garment& garment : frame.garments) {
    rows.push_back(garment.vertices.data());
    rows.push_back(garment.provenance.data());
  }
  for (std::size_t i = 0; i < rows.size(); ++i)
    files_[i].append(rows[i]);
  ++numFrames_;
}

void PerformanceWriter::finish() {
  if (numFrames_ == 0)
    throw std::invalid_argument("PerformanceWriter: no frame has been appended");
  std::map<std::string, avatar::NpyFile> entries;
  for (avatar::NpyFileWriter& file : files_)
    file.close();
  for (const Part& part : parts())
    entries[part.key] = {partPath(part.key), part.rows.type == Type::kUint8};
  for (const auto& [key, array] : constants())
    entries[key] = {partPath(key), true};
  avatar::writeNpzFromFiles(path_, entries);
  std::error_code ignored;
  fs::remove_all(folder_, ignored);
}

}  // namespace simulcap
