#pragma once

#include <Eigen/Core>

#include <cstdint>
#include <map>
#include <string>
#include <vector>

namespace avatar {

/// One array of an .npz file, C order, kept in its own scalar type.
struct NpyArray {
  enum class Type {
    kFloat32,
    kFloat64,
    kInt8,
    kInt16,
    kInt32,
    kInt64,
    kUint8,
    kUint16,
    kUint32,
    kUint64,
    kBool,
    kText
  };

  Type type = Type::kFloat64;
  std::vector<std::int64_t> shape;  ///< empty: a scalar
  std::vector<std::uint8_t>
      bytes;  ///< little endian, C order (Fortran order is converted on reading)

  std::int64_t size() const;        ///< product of the shape; 1 for a scalar
  std::string shapeText() const;    ///< "(6890, 3)"
  double at(std::int64_t i) const;  ///< element i in C order, converted; throws std::out_of_range

  /// 2D (or higher: trailing axes flattened) as an Eigen matrix, shape[0] × rest.
  Eigen::MatrixXd asMatrix() const;
  std::string asText() const;  ///< numpy unicode or bytes scalar

  static NpyArray fromMatrix(const Eigen::MatrixXd& matrix, Type type = Type::kFloat64);
  static NpyArray fromText(const std::string& text);
};

using NpzArrays = std::map<std::string, NpyArray>;

/// Reads every array. Throws FileError naming the file and the key: not a zip, truncated, unknown
/// dtype (objects are refused), shape that doesn't match the data.
NpzArrays readNpz(const std::string& path);
NpzArrays readNpzFromMemory(
    const void* data, std::size_t numBytes, const std::string& nameForErrors);

/// Writes a deflated .npz under a temporary name, then renames. Same arrays, same bytes (fixed
/// dates, sorted keys). Throws FileError when the folder can't be written.
void writeNpz(const std::string& path, const NpzArrays& arrays);

}  // namespace avatar
