#include "avatar/io/body_file.h"

#include "avatar/io/file_error.h"
#include "tests/support/synthetic_body.h"
#include "tests/support/temporary_folder.h"

#include <gtest/gtest.h>

#include <functional>
#include <limits>

namespace avatar {
namespace {

using Type = NpyArray::Type;

NpyArray shaped(const Eigen::MatrixXd& matrix, std::vector<std::int64_t> shape, Type type) {
  NpyArray array = NpyArray::fromMatrix(matrix, type);
  array.shape = std::move(shape);
  return array;
}

/// Changes one array of a valid model as a matrix shape[0] × rest, keeping its shape.
void edit(
    NpzArrays& arrays,
    const std::string& key,
    const std::function<void(Eigen::MatrixXd&)>& change) {
  NpyArray& array = arrays.at(key);
  Eigen::MatrixXd matrix = array.asMatrix();
  change(matrix);
  array = shaped(matrix, array.shape, array.type);
}

/// The message of the FileError that these arrays must raise; it names the file and the key.
std::string errorOf(const NpzArrays& arrays, const std::string& key) {
  try {
    bodyModelFromNpz(arrays, "some/body.npz");
  } catch (const FileError& error) {
    EXPECT_EQ(std::string(error.what()).rfind("some/body.npz: " + key + ": ", 0), 0U)
        << error.what();
    return error.what();
  }
  ADD_FAILURE() << key << ": no FileError";
  return "";
}

std::string errorAfter(
    const std::string& key, const std::function<void(Eigen::MatrixXd&)>& change) {
  NpzArrays arrays = bodyModelToNpz(test::randomBody(1));
  edit(arrays, key, change);
  return errorOf(arrays, key);
}

void expectSame(const BodyModel& a, const BodyModel& b) {
  EXPECT_EQ(a.templateVertices, b.templateVertices);
  EXPECT_EQ(a.faces, b.faces);
  EXPECT_EQ(a.shapeDirections, b.shapeDirections);
  EXPECT_EQ(Eigen::MatrixXd(a.jointRegressor), Eigen::MatrixXd(b.jointRegressor));
  EXPECT_EQ(Eigen::MatrixXd(a.skinningWeights), Eigen::MatrixXd(b.skinningWeights));
  EXPECT_EQ(a.parents, b.parents);
  ASSERT_EQ(a.poseDirections.size(), b.poseDirections.size());
  for (std::size_t j = 0; j < a.poseDirections.size(); ++j) {
    EXPECT_EQ(a.poseDirections[j].cols(), b.poseDirections[j].cols()) << j;
    EXPECT_EQ(a.poseDirections[j], b.poseDirections[j]) << j;
  }
}

TEST(BodyFile, AModelWrittenAndReadBackIsEqual) {
  const test::TemporaryFolder folder;
  const std::string path = folder.path("body.npz");
  const BodyModel model = test::randomBody(1);
  writeBodyModel(path, model);
  const BodyModel read = readBodyModel(path);
  EXPECT_EQ(read.name, path);
  expectSame(read, model);
}

TEST(BodyFile, ReadsTheLayoutOfRealFiles) {
  // Floats, unsigned tree with 2³²−1, no pose blend shapes, other keys of any kind.
  const BodyModel model = test::randomBody(2, {.vertices = 80, .joints = 52, .betas = 16});
  NpzArrays arrays = bodyModelToNpz(model);
  arrays.erase("posedirs");
  arrays["v_template"] = NpyArray::fromMatrix(model.templateVertices.transpose(), Type::kFloat32);
  arrays["weights"] = NpyArray::fromMatrix(model.skinningWeights, Type::kFloat32);
  Eigen::MatrixXd tree = arrays["kintree_table"].asMatrix();
  tree(0, 0) = 4294967295.0;
  arrays["kintree_table"] = NpyArray::fromMatrix(tree, Type::kUint32);
  arrays["gender"] = NpyArray::fromText("neutral");
  const BodyModel read = bodyModelFromNpz(arrays, "body");
  EXPECT_EQ(read.parents, model.parents);
  EXPECT_EQ(read.numBetas(), 16);
  for (const Eigen::MatrixXf& block : read.poseDirections) {
    EXPECT_EQ(block.size(), 0);
  }
  // Rows of float weights sum to 1 only to 1e-7; the model's do so to rounding of doubles.
  for (int vertex = 0; vertex < 80; ++vertex) {
    EXPECT_NEAR(read.skinningWeights.row(vertex).sum(), 1.0, 1e-15);
  }
}

TEST(BodyFile, CompressedColumnsGiveTheSameRegressor) {
  const BodyModel model = test::randomBody(3);
  const Eigen::SparseMatrix<double> columns = model.jointRegressor;
  NpzArrays arrays = bodyModelToNpz(model);
  arrays.erase("J_regressor");
  const std::int64_t count = columns.nonZeros();
  const std::int64_t numStarts = columns.cols() + 1;
  using Ints = Eigen::Map<const Eigen::VectorXi>;
  arrays["J_regressor_data"] =
      shaped(Eigen::Map<const Eigen::VectorXd>(columns.valuePtr(), count), {count}, Type::kFloat64);
  arrays["J_regressor_indices"] =
      shaped(Ints(columns.innerIndexPtr(), count).cast<double>(), {count}, Type::kInt32);
  arrays["J_regressor_indptr"] =
      shaped(Ints(columns.outerIndexPtr(), numStarts).cast<double>(), {numStarts}, Type::kInt32);
  arrays["J_regressor_shape"] = shaped(
      Eigen::Vector2d(static_cast<double>(columns.rows()), static_cast<double>(columns.cols())),
      {2},
      Type::kInt64);
  expectSame(bodyModelFromNpz(arrays, "body"), model);

  const auto broken = [&](const std::string& key, double value) {
    NpzArrays wrong = arrays;
    edit(wrong, key, [&](Eigen::MatrixXd& values) { values(values.size() / 2) = value; });
    return errorOf(wrong, key);
  };
  EXPECT_FALSE(broken("J_regressor_indices", 24.0).empty());
  EXPECT_FALSE(broken("J_regressor_indices", -1.0).empty());
  EXPECT_FALSE(broken("J_regressor_indptr", 100000.0).empty());
  EXPECT_FALSE(broken("J_regressor_indptr", -1.0).empty());
  EXPECT_FALSE(broken("J_regressor_shape", 7.0).empty());
  EXPECT_FALSE(broken("J_regressor_data", std::nan("")).empty());
}

TEST(BodyFile, EveryNeededKeyIsMissedByName) {
  for (const char* key :
       {"v_template", "shapedirs", "J_regressor", "weights", "kintree_table", "f"}) {
    NpzArrays arrays = bodyModelToNpz(test::randomBody(1));
    arrays.erase(key);
    EXPECT_NE(errorOf(arrays, key).find("missing"), std::string::npos);
  }
}

TEST(BodyFile, WrongShapesSayWhatWasExpectedAndFound) {
  for (const char* key :
       {"v_template", "shapedirs", "posedirs", "J_regressor", "weights", "kintree_table", "f"}) {
    NpzArrays arrays = bodyModelToNpz(test::randomBody(1));
    arrays[key] = NpyArray::fromMatrix(Eigen::MatrixXd::Zero(7, 5));
    const std::string message = errorOf(arrays, key);
    EXPECT_NE(message.find("(7, 5)"), std::string::npos) << message;
    EXPECT_NE(message.find("expected ("), std::string::npos) << message;
    arrays[key] = NpyArray::fromText("hello");
    errorOf(arrays, key);
  }
}

std::string errorEndingWith(const std::string& key, double last) {
  return errorAfter(key, [=](Eigen::MatrixXd& values) { values(values.size() - 1) = last; });
}

TEST(BodyFile, ValuesThatAreNotFiniteAreRefused) {
  for (const char* key : {"v_template", "shapedirs", "posedirs", "J_regressor", "weights"}) {
    EXPECT_NE(errorEndingWith(key, std::nan("")).find("finite"), std::string::npos) << key;
    const double infinity = std::numeric_limits<double>::infinity();
    EXPECT_NE(errorEndingWith(key, infinity).find("finite"), std::string::npos);
  }
}

TEST(BodyFile, WeightsMustBePositiveAndSumToOne) {
  EXPECT_NE(
      errorAfter("weights", [](Eigen::MatrixXd& w) { w.row(5) *= 1.01; }).find("vertex 5"),
      std::string::npos);
  EXPECT_NE(
      errorAfter("weights", [](Eigen::MatrixXd& w) { w.row(5).setZero(); }).find("sum to 0"),
      std::string::npos);
  EXPECT_NE(
      errorAfter(
          "weights",
          [](Eigen::MatrixXd& w) {
            w.row(7).setZero();
            w(7, 0) = 1.5;
            w(7, 1) = -0.5;
          })
          .find("negative"),
      std::string::npos);
}

TEST(BodyFile, FacesMustNameVertices) {
  NpzArrays arrays = bodyModelToNpz(test::randomBody(1));
  for (const double bad : {-1.0, 60.0, 1e9}) {
    Eigen::MatrixXd faces = test::randomBody(1).faces.transpose().cast<double>();
    faces(3, 1) = bad;
    arrays["f"] = NpyArray::fromMatrix(faces, Type::kInt64);
    EXPECT_NE(errorOf(arrays, "f").find("face 3"), std::string::npos);
  }
  EXPECT_NE(
      errorAfter("f", [](Eigen::MatrixXd& f) { f(4, 0) = f(4, 1); }).find("twice"),
      std::string::npos);
}

TEST(BodyFile, TheKinematicTreeMustBeOne) {
  const auto withParent = [](int joint, double parent) {
    return errorAfter("kintree_table", [&](Eigen::MatrixXd& t) { t(0, joint) = parent; });
  };
  EXPECT_NE(withParent(5, -1.0).find("second root"), std::string::npos);
  EXPECT_NE(withParent(0, 3.0).find("root"), std::string::npos);
  EXPECT_NE(withParent(5, 5.0).find("cyclic"), std::string::npos);
  EXPECT_NE(withParent(5, 9.0).find("before its child"), std::string::npos);
  EXPECT_NE(withParent(5, 1000.0).find("joint 5"), std::string::npos);
  EXPECT_NE(
      errorAfter("kintree_table", [](Eigen::MatrixXd& t) { t(1, 3) = 4.0; }).find("joint 3"),
      std::string::npos);
}

TEST(BodyFile, OtherUnitsThanMetresAreNamed) {
  const auto scaled = [](double factor) {
    return errorAfter("v_template", [&](Eigen::MatrixXd& v) { v *= factor; });
  };
  // The random body measures about 2 m.
  EXPECT_NE(scaled(100.0).find("centimetres"), std::string::npos);
  EXPECT_NE(scaled(1000.0).find("millimetres"), std::string::npos);
  EXPECT_NE(scaled(0.001).find("kilometres"), std::string::npos);
  EXPECT_NE(scaled(5.0).find("unit"), std::string::npos);
}

TEST(BodyFile, ARegressorThatDoesNotFollowTheBodyIsRefused) {
  EXPECT_NE(
      errorAfter("J_regressor", [](Eigen::MatrixXd& r) { r.row(4) *= 0.9; }).find("row 4"),
      std::string::npos);
}

}  // namespace
}  // namespace avatar
