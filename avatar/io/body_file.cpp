#include "avatar/io/body_file.h"

#include "avatar/io/file_error.h"

#include <cmath>
#include <cstddef>
#include <sstream>

namespace avatar {
namespace {

using SparseRows = Eigen::SparseMatrix<double, Eigen::RowMajor>;
using Triplets = std::vector<Eigen::Triplet<double>>;

const std::vector<std::string> kKeys = {
    "v_template",
    "shapedirs",
    "posedirs",
    "J_regressor",
    "J_regressor_data",
    "J_regressor_indices",
    "J_regressor_indptr",
    "J_regressor_shape",
    "weights",
    "kintree_table",
    "f"};

std::string numberText(double value) {
  std::ostringstream stream;
  stream << value;
  return stream.str();
}

/// Arrays by key with checked shapes; −1 in an expected shape accepts any extent.
class CheckedArrays {
 public:
  CheckedArrays(const NpzArrays& arrays, std::string file)
      : arrays_(arrays), file_(std::move(file)) {}

  bool has(const std::string& key) const { return arrays_.contains(key); }

  [[noreturn]] void fail(const std::string& key, const std::string& problem) const {
    throw FileError(file_, key, problem);
  }

  const NpyArray& array(const std::string& key, const std::vector<std::int64_t>& shape) const {
    const auto found = arrays_.find(key);
    if (found == arrays_.end()) {
      fail(key, "is missing; expected a body model with SMPL's keys");
    }
    const NpyArray& result = found->second;
    bool fits = result.shape.size() == shape.size() && result.type != NpyArray::Type::kText;
    for (std::size_t axis = 0; fits && axis < shape.size(); ++axis) {
      fits = shape[axis] < 0 ? result.shape[axis] >= 0 : result.shape[axis] == shape[axis];
    }
    if (!fits) {
      fail(key, "has shape " + result.shapeText() + ", expected " + expectedText(shape));
    }
    return result;
  }

  /// As array(), flattened to shape[0] × rest, all finite.
  Eigen::MatrixXd matrix(const std::string& key, const std::vector<std::int64_t>& shape) const {
    Eigen::MatrixXd result = array(key, shape).asMatrix();
    if (!result.allFinite()) {
      fail(key, "holds values that are not finite");
    }
    return result;
  }

 private:
  static std::string expectedText(const std::vector<std::int64_t>& shape) {
    std::string result = "(";
    for (std::size_t axis = 0; axis < shape.size(); ++axis) {
      result += (axis > 0 ? ", " : "") + (shape[axis] < 0 ? "any" : std::to_string(shape[axis]));
    }
    return result + (shape.size() == 1 ? ",)" : ")");
  }

  const NpzArrays& arrays_;
  std::string file_;
};

Eigen::Matrix3Xd readTemplate(const CheckedArrays& arrays) {
  Eigen::Matrix3Xd vertices = arrays.matrix("v_template", {-1, 3}).transpose();
  if (vertices.cols() == 0) {
    arrays.fail("v_template", "holds no vertices");
  }
  const double size = (vertices.rowwise().maxCoeff() - vertices.rowwise().minCoeff()).maxCoeff();
  // From a newborn to the tallest person on record (2.72 m), with room for stylised characters.
  constexpr double kSmallest = 0.3;
  constexpr double kLargest = 3.5;
  if (size < kSmallest || size > kLargest) {
    const std::string unit = size > 1000.0   ? "; this looks like millimetres, divide by 1000"
                             : size > 100.0  ? "; this looks like centimetres, divide by 100"
                             : size < 0.0035 ? "; this looks like kilometres, multiply by 1000"
                                             : "; check the unit";
    arrays.fail(
        "v_template", "the body measures " + numberText(size) + " m, expected 0.3 to 3.5 m" + unit);
  }
  return vertices;
}

Eigen::Matrix3Xi readFaces(const CheckedArrays& arrays, Eigen::Index numVertices) {
  const Eigen::Matrix3Xd faces = arrays.matrix("f", {-1, 3}).transpose();
  for (Eigen::Index face = 0; face < faces.cols(); ++face) {
    const Eigen::Vector3d corners = faces.col(face);
    if (corners.minCoeff() < 0.0 || corners.maxCoeff() >= static_cast<double>(numVertices)) {
      std::ostringstream message;
      message << "face " << face << " is (" << corners.transpose() << "), expected vertices 0 to "
              << numVertices - 1;
      arrays.fail("f", message.str());
    }
    if (corners[0] == corners[1] || corners[1] == corners[2] || corners[2] == corners[0]) {
      arrays.fail("f", "face " + std::to_string(face) + " names a vertex twice");
    }
  }
  return faces.cast<int>();
}

std::vector<int> readParents(const CheckedArrays& arrays) {
  const Eigen::MatrixXd table = arrays.matrix("kintree_table", {2, -1});
  if (table.cols() < 1) {
    arrays.fail("kintree_table", "holds no joints");
  }
  // Unsigned files store the root's −1 as 2³²−1 or 2⁶⁴−1; nothing between J and those is meant.
  const auto isRoot = [](double parent) { return parent < 0.0 || parent >= 4294967295.0; };
  std::vector<int> parents(static_cast<std::size_t>(table.cols()), -1);
  for (Eigen::Index joint = 0; joint < table.cols(); ++joint) {
    const double parent = table(0, joint);
    const std::string name = "joint " + std::to_string(joint);
    if (isRoot(parent) != (joint == 0)) {
      arrays.fail(
          "kintree_table",
          joint == 0
              ? "joint 0 has parent " + numberText(parent) + ", expected it to be the root (-1)"
              : name + " is a second root, expected one tree under joint 0");
    }
    if (joint > 0 && parent >= static_cast<double>(joint)) {
      arrays.fail(
          "kintree_table",
          name + " has parent " + numberText(parent) +
              ", expected a parent before its child (the tree is cyclic or badly ordered)");
    }
    if (table(1, joint) != static_cast<double>(joint)) {
      arrays.fail(
          "kintree_table",
          name + " is called " + numberText(table(1, joint)) + ", expected its column");
    }
    parents[static_cast<std::size_t>(joint)] = joint == 0 ? -1 : static_cast<int>(parent);
  }
  return parents;
}

Eigen::MatrixXd readShapeDirections(const CheckedArrays& arrays, Eigen::Index numVertices) {
  const Eigen::MatrixXd flat = arrays.matrix("shapedirs", {numVertices, 3, -1});
  const Eigen::Index numBetas = flat.cols() / 3;
  Eigen::MatrixXd directions(3 * numVertices, numBetas);
  for (Eigen::Index row = 0; row < directions.rows(); ++row) {
    directions.row(row) = flat.row(row / 3).segment(row % 3 * numBetas, numBetas);
  }
  return directions;
}

std::vector<Eigen::MatrixXf> readPoseDirections(
    const CheckedArrays& arrays, Eigen::Index numVertices, std::size_t numJoints) {
  std::vector<Eigen::MatrixXf> blocks(numJoints - 1);
  if (!arrays.has("posedirs")) {
    return blocks;
  }
  const auto numColumns = 9 * static_cast<Eigen::Index>(blocks.size());
  const Eigen::MatrixXd flat = arrays.matrix("posedirs", {numVertices, 3, numColumns});
  for (std::size_t j = 0; j < blocks.size(); ++j) {
    Eigen::MatrixXf block(3 * numVertices, 9);
    for (Eigen::Index c = 0; c < 3 * 9; ++c) {
      const Eigen::Index axis = c / 9;
      const Eigen::Index from = axis * numColumns + 9 * static_cast<Eigen::Index>(j) + c % 9;
      block(Eigen::seqN(axis, numVertices, 3), c % 9) = flat.col(from).cast<float>();
    }
    if (!block.isZero(0.0F)) {
      blocks[j] = std::move(block);
    }
  }
  return blocks;
}

SparseRows sparseFrom(const Eigen::MatrixXd& dense) {
  SparseRows sparse = dense.sparseView(1.0, 0.0);
  sparse.makeCompressed();
  return sparse;
}

/// scipy.sparse.csc_matrix: column c holds the entries indptr[c] … indptr[c+1]−1.
SparseRows readCompressedColumns(
    const CheckedArrays& arrays, std::int64_t numJoints, std::int64_t numVertices) {
  const std::string name = "J_regressor";
  const Eigen::MatrixXd shape = arrays.matrix(name + "_shape", {2});
  if (shape(0) != static_cast<double>(numJoints) || shape(1) != static_cast<double>(numVertices)) {
    arrays.fail(
        name + "_shape",
        "is (" + numberText(shape(0)) + ", " + numberText(shape(1)) + "), expected (" +
            std::to_string(numJoints) + ", " + std::to_string(numVertices) + ")");
  }
  const Eigen::MatrixXd data = arrays.matrix(name + "_data", {-1});
  const Eigen::MatrixXd rows = arrays.matrix(name + "_indices", {data.size()});
  const Eigen::MatrixXd starts = arrays.matrix(name + "_indptr", {numVertices + 1});
  if (rows.size() > 0 &&
      (rows.minCoeff() < 0.0 || rows.maxCoeff() >= static_cast<double>(numJoints))) {
    arrays.fail(name + "_indices", "rows out of range, expected 0 to J - 1");
  }
  const Eigen::MatrixXd steps = starts.bottomRows(numVertices) - starts.topRows(numVertices);
  if (starts(0) != 0.0 || steps.minCoeff() < 0.0 ||
      starts(numVertices) != static_cast<double>(data.size())) {
    arrays.fail(name + "_indptr", "expected to rise from 0 to the number of entries");
  }
  Triplets triplets;
  triplets.reserve(static_cast<std::size_t>(data.size()));
  int column = 0;
  for (Eigen::Index entry = 0; entry < data.size(); ++entry) {
    while (static_cast<double>(entry) >= starts(column + 1)) {
      ++column;
    }
    triplets.emplace_back(static_cast<int>(rows(entry)), column, data(entry));
  }
  SparseRows regressor(numJoints, numVertices);
  regressor.setFromTriplets(triplets.begin(), triplets.end());
  return regressor;
}

SparseRows readJointRegressor(
    const CheckedArrays& arrays, std::int64_t numJoints, std::int64_t numVertices) {
  const bool inParts = !arrays.has("J_regressor") && arrays.has("J_regressor_data");
  SparseRows regressor = inParts
                             ? readCompressedColumns(arrays, numJoints, numVertices)
                             : sparseFrom(arrays.matrix("J_regressor", {numJoints, numVertices}));
  const Eigen::VectorXd sums = regressor * Eigen::VectorXd::Ones(numVertices);
  // Otherwise a joint wouldn't move along when the body is moved. SMPL's own sum to 1 within 1e-4.
  constexpr double kTolerance = 0.01;
  for (Eigen::Index joint = 0; joint < sums.size(); ++joint) {
    if (std::abs(sums[joint] - 1.0) > kTolerance) {
      arrays.fail(
          "J_regressor",
          "row " + std::to_string(joint) + " sums to " + numberText(sums[joint]) + ", expected 1");
    }
  }
  return regressor;
}

SparseRows readWeights(
    const CheckedArrays& arrays, std::int64_t numVertices, std::int64_t numJoints) {
  Eigen::MatrixXd weights = arrays.matrix("weights", {numVertices, numJoints});
  constexpr double kTolerance = 1e-3;  // files with weights rounded to four digits pass
  constexpr double kExact = 1e-12;     // rounding of a sum of doubles: leave those alone
  for (Eigen::Index vertex = 0; vertex < weights.rows(); ++vertex) {
    const std::string name = "vertex " + std::to_string(vertex);
    const double sum = weights.row(vertex).sum();
    if (weights.row(vertex).minCoeff() < 0.0) {
      arrays.fail("weights", name + " has a negative weight, expected 0 to 1");
    }
    if (!(std::abs(sum - 1.0) <= kTolerance)) {
      arrays.fail(
          "weights",
          "those of " + name + " sum to " + numberText(sum) + ", expected 1 within 0.001");
    }
    if (std::abs(sum - 1.0) > kExact) {
      weights.row(vertex) /= sum;
    }
  }
  return sparseFrom(weights);
}

}  // namespace

BodyModel bodyModelFromNpz(const NpzArrays& arrays, const std::string& nameForErrors) {
  const CheckedArrays checked(arrays, nameForErrors);
  BodyModel model;
  model.name = nameForErrors;
  model.templateVertices = readTemplate(checked);
  const Eigen::Index numVertices = model.numVertices();
  model.faces = readFaces(checked, numVertices);
  model.parents = readParents(checked);
  model.shapeDirections = readShapeDirections(checked, numVertices);
  model.poseDirections = readPoseDirections(checked, numVertices, model.parents.size());
  model.jointRegressor = readJointRegressor(checked, model.numJoints(), numVertices);
  model.skinningWeights = readWeights(checked, numVertices, model.numJoints());
  return model;
}

BodyModel readBodyModel(const std::string& path) {
  return bodyModelFromNpz(readNpz(path, kKeys), path);
}

namespace {

NpyArray withShape(NpyArray array, std::vector<std::int64_t> shape) {
  array.shape = std::move(shape);
  return array;
}

NpyArray shapeDirectionsArray(const BodyModel& model) {
  const Eigen::Index numBetas = model.numBetas();
  return withShape(NpyArray::fromMatrix(model.shapeDirections), {model.numVertices(), 3, numBetas});
}

NpyArray poseDirectionsArray(const BodyModel& model) {
  const Eigen::Index numBlocks = model.numJoints() - 1;
  Eigen::MatrixXd flat = Eigen::MatrixXd::Zero(3 * model.numVertices(), 9 * numBlocks);
  for (Eigen::Index j = 0; j < numBlocks; ++j) {
    const Eigen::MatrixXf& block = model.poseDirections[static_cast<std::size_t>(j)];
    if (block.size() > 0) {
      flat.middleCols<9>(9 * j) = block.cast<double>();
    }
  }
  return withShape(
      NpyArray::fromMatrix(flat, NpyArray::Type::kFloat32),
      {model.numVertices(), 3, 9 * numBlocks});
}

}  // namespace

NpzArrays bodyModelToNpz(const BodyModel& model) {
  Eigen::MatrixXd tree(2, model.numJoints());
  for (int joint = 0; joint < model.numJoints(); ++joint) {
    tree.col(joint) << model.parents[static_cast<std::size_t>(joint)], joint;
  }
  return {
      {"v_template", NpyArray::fromMatrix(model.templateVertices.transpose())},
      {"shapedirs", shapeDirectionsArray(model)},
      {"posedirs", poseDirectionsArray(model)},
      {"J_regressor", NpyArray::fromMatrix(model.jointRegressor)},
      {"weights", NpyArray::fromMatrix(model.skinningWeights)},
      {"kintree_table", NpyArray::fromMatrix(tree, NpyArray::Type::kInt64)},
      {"f", NpyArray::fromMatrix(model.faces.transpose().cast<double>(), NpyArray::Type::kUint32)}};
}

void writeBodyModel(const std::string& path, const BodyModel& model) {
  writeNpz(path, bodyModelToNpz(model));
}

}  // namespace avatar
