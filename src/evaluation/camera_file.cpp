#include "src/evaluation/camera_file.h"

#include "avatar/io/atomic_file.h"
#include "avatar/io/file_error.h"

#include <nlohmann/json.hpp>

#include <fstream>
#include <utility>

namespace simulcap {
namespace {

nlohmann::json readJson(const std::string& path, const std::string& expected) {
  std::ifstream file(path, std::ios::binary);
  if (!file)
    throw avatar::FileError(path, "", "can't be opened; expected " + expected);
  nlohmann::json document = nlohmann::json::parse(file, nullptr, false);
  if (!document.is_object())
    throw avatar::FileError(path, "", "is no JSON object; expected " + expected);
  return document;
}

bool isMatrix(const nlohmann::json& rows) {
  if (!rows.is_array() || rows.size() != 4)
    return false;
  for (const nlohmann::json& row : rows) {
    if (!row.is_array() || row.size() != 4)
      return false;
    for (const nlohmann::json& value : row)
      if (!value.is_number())
        return false;
  }
  return true;
}

bool isRigid(const Eigen::Matrix4d& matrix) {
  constexpr double kRounding = 1e-4;  // digits that a file may have lost
  const Eigen::Matrix3d rotation = matrix.topLeftCorner<3, 3>();
  return matrix.allFinite() && matrix.row(3) == Eigen::RowVector4d(0.0, 0.0, 0.0, 1.0) &&
         (rotation * rotation.transpose()).isIdentity(kRounding) && rotation.determinant() > 0.0;
}

}  // namespace

Eigen::Isometry3d readCameraFromWorld(const std::string& path, const std::string& key) {
  const nlohmann::json document = readJson(path, "a camera with \"" + key + "\"");
  const auto rows = document.find(key);
  if (rows == document.end() || !isMatrix(*rows))
    throw avatar::FileError(path, key, "expected four rows of four numbers");
  Eigen::Isometry3d camera;
  for (std::size_t row = 0; row < 4; ++row)
    for (std::size_t column = 0; column < 4; ++column)
      camera.matrix()(static_cast<int>(row), static_cast<int>(column)) =
          (*rows)[row][column].get<double>();
  if (!isRigid(camera.matrix()))
    throw avatar::FileError(
        path, key, "expected a rotation and a translation [m] in rows, 0 0 0 1 in the last");
  return camera;
}

void writeCameraFromWorld(const std::string& path, const Eigen::Isometry3d& cameraFromWorld) {
  nlohmann::json rows = nlohmann::json::array();
  for (int row = 0; row < 4; ++row) {
    nlohmann::json numbers = nlohmann::json::array();
    for (int column = 0; column < 4; ++column)
      numbers.push_back(cameraFromWorld.matrix()(row, column));
    rows.push_back(std::move(numbers));
  }
  avatar::writeFileAtomically(
      path, nlohmann::json{{"camera_from_world", std::move(rows)}}.dump(1) + "\n");
}

}  // namespace simulcap
