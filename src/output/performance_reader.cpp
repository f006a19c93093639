#include "src/output/performance_reader.h"

#include "avatar/io/file_error.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <string_view>
#include <utility>

namespace simulcap {
namespace {

using avatar::NpyArray;

constexpr std::int64_t kNumPoseValues = 3 * avatar::kNumSmplJoints;
constexpr std::string_view kGarmentPrefix = "garment_";

bool contains(const std::vector<std::string>& keys, const std::string& key) {
  return std::find(keys.begin(), keys.end(), key) != keys.end();
}

Eigen::VectorXd vectorOf(const NpyArray& row) {
  return row.asMatrix().reshaped<Eigen::RowMajor>();
}

}  // namespace

PerformanceReader::PerformanceReader(std::string path)
    : path_(std::move(path)), poses_(path_, "poses"), translations_(path_, "trans") {
  const std::vector<std::string> keys = avatar::npzKeys(path_);
  requireRows(poses_, "poses", {kNumPoseValues});
  requireRows(translations_, "trans", {3});
  if (contains(keys, "frame_index")) {
    indices_.emplace(path_, "frame_index");
    requireRows(*indices_, "frame_index", {});
  }
  readConstants();
  for (const std::string& key : keys)
    if (key.starts_with(kGarmentPrefix))
      addGarment(key.substr(kGarmentPrefix.size()), keys);
}

void PerformanceReader::fail(const std::string& key, const std::string& problem) const {
  throw avatar::FileError(path_, key, problem);
}

void PerformanceReader::requireRows(
    const avatar::NpzRowReader& rows,
    const std::string& key,
    const std::vector<std::int64_t>& rowShape) const {
  if (rows.numRows() < 1 || rows.numRows() != poses_.numRows() || rows.rowShape() != rowShape)
    fail(
        key,
        "expected one row per frame of `poses`, at least one, each of " +
            NpyArray{.shape = rowShape}.shapeText() + ", found " + std::to_string(rows.numRows()) +
            " rows of " + NpyArray{.shape = rows.rowShape()}.shapeText());
}

void PerformanceReader::readConstants() {
  const avatar::NpzArrays arrays = avatar::readNpz(path_, {"betas", "mocap_framerate", "up_axis"});
  const auto up = arrays.find("up_axis");
  if (up != arrays.end() && (up->second.type != NpyArray::Type::kText || up->second.size() != 1 ||
                             up->second.asText() != "y"))
    fail("up_axis", "expected \"y\"; this is no performance that simulcap wrote");
  const auto rate = arrays.find("mocap_framerate");
  if (rate == arrays.end() || rate->second.type == NpyArray::Type::kText ||
      rate->second.size() != 1 || !(rate->second.at(0) > 0.0))
    fail("mocap_framerate", "expected one positive number [frames/s]");
  layout_.framesPerSecond = rate->second.at(0);
  const auto betas = arrays.find("betas");
  if (betas == arrays.end())
    return;
  if (betas->second.type == NpyArray::Type::kText)
    fail("betas", "expected numbers, found text");
  layout_.betas = vectorOf(betas->second);
  if (!layout_.betas.allFinite())
    fail("betas", "expected finite numbers");
}

void PerformanceReader::addGarment(const std::string& name, const std::vector<std::string>& keys) {
  const std::string key = std::string(kGarmentPrefix) + name;
  avatar::NpzRowReader vertices(path_, key);
  const std::vector<std::int64_t> shape = vertices.rowShape();
  if (shape.size() != 2 || shape[1] != 3 || shape[0] < 3 || shape[0] > 10'000'000)
    fail(key, "expected (T, V, 3) with V from 3 to 10 million");
  requireRows(vertices, key, shape);
  const std::string facesKey = "faces_" + name;
  const avatar::NpzArrays arrays = avatar::readNpz(path_, {facesKey});
  const auto faces = arrays.find(facesKey);
  if (faces == arrays.end() || faces->second.type == NpyArray::Type::kText ||
      faces->second.shape.size() != 2 || faces->second.shape[0] < 1 || faces->second.shape[1] != 3)
    fail(facesKey, "expected (F, 3) with the faces of " + key);
  PerformanceLayout::Garment garment;
  garment.name = name;
  garment.numVertices = static_cast<int>(shape[0]);
  garment.faces = faces->second.asMatrix().transpose().cast<int>();
  if (garment.faces.minCoeff() < 0 || garment.faces.maxCoeff() >= garment.numVertices)
    fail(facesKey, "expected indices of the " + std::to_string(shape[0]) + " vertices");
  layout_.garments.push_back(std::move(garment));
  GarmentRows rows{std::move(vertices), std::nullopt};
  const std::string provenanceKey = "provenance_" + name;
  if (contains(keys, provenanceKey)) {
    rows.provenance.emplace(path_, provenanceKey);
    requireRows(*rows.provenance, provenanceKey, {shape[0]});
  }
  garments_.push_back(std::move(rows));
}

PerformanceFrame::Garment PerformanceReader::readGarment(std::size_t garment) {
  GarmentRows& rows = garments_[garment];
  PerformanceFrame::Garment result;
  result.vertices = rows.vertices.next().asMatrix().transpose().cast<float>();
  if (!result.vertices.allFinite())
    fail(
        std::string(kGarmentPrefix) + layout_.garments[garment].name,
        "frame " + std::to_string(rows.vertices.rowsRead() - 1) +
            " holds values that are not finite; capture again");
  result.provenance.assign(static_cast<std::size_t>(result.vertices.cols()), 0);
  if (rows.provenance) {
    const Eigen::VectorXd values = vectorOf(rows.provenance->next());
    std::transform(values.begin(), values.end(), result.provenance.begin(), [](double value) {
      return static_cast<std::uint8_t>(std::clamp(value, 0.0, 255.0));
    });
  }
  return result;
}

std::optional<PerformanceFrame> PerformanceReader::next() {
  if (poses_.rowsRead() == poses_.numRows())
    return std::nullopt;
  PerformanceFrame frame;
  frame.pose.jointRotations = vectorOf(poses_.next());
  frame.pose.translation = vectorOf(translations_.next());
  const std::string number = std::to_string(poses_.rowsRead() - 1);
  if (!frame.pose.jointRotations.allFinite() || !frame.pose.translation.allFinite())
    fail("poses", "frame " + number + " is not finite; capture again");
  const double index =
      indices_ ? indices_->next().at(0) : static_cast<double>(poses_.rowsRead() - 1);
  if (!(index > lastIndex_ && index <= std::numeric_limits<int>::max()))
    fail("frame_index", "frame " + number + " has no larger number than the one before");
  lastIndex_ = frame.recordingIndex = static_cast<int>(index);
  for (std::size_t i = 0; i < garments_.size(); ++i)
    frame.garments.push_back(readGarment(i));
  return frame;
}

}  // namespace simulcap
