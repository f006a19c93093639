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
  /// Elements in C order, little endian (Fortran order and big endian are converted on reading).
  /// Text: every element as UTF-8, closed by a zero byte.
  std::vector<std::uint8_t> bytes;

  std::int64_t size() const;      ///< product of the shape; 1 for a scalar
  std::string shapeText() const;  ///< "(6890, 3)"
  /// Element i in C order, converted. Throws std::out_of_range; std::invalid_argument for text.
  double at(std::int64_t i) const;

  /// shape[0] × product of the other axes (a vector: size × 1; a scalar: 1 × 1). Throws
  /// std::invalid_argument for text.
  Eigen::MatrixXd asMatrix() const;
  /// The one element of a text array. Throws std::invalid_argument when it is something else.
  std::string asText() const;

  /// 2D array of the matrix's shape. Integer types round to nearest and saturate.
  static NpyArray fromMatrix(const Eigen::MatrixXd& matrix, Type type = Type::kFloat64);
  static NpyArray fromText(const std::string& text);
};

using NpzArrays = std::map<std::string, NpyArray>;

/// Reads every array, or only those of `keys` that are there (the rest isn't even parsed; use it
/// for files that carry Python objects beside the wanted arrays). Throws FileError naming the file
/// and the key: missing, not a zip, truncated, unknown dtype (Python objects are refused), shape
/// that doesn't match the data.
NpzArrays readNpz(const std::string& path, const std::vector<std::string>& keys = {});
NpzArrays readNpzFromMemory(
    const void* data,
    std::size_t numBytes,
    const std::string& nameForErrors,
    const std::vector<std::string>& keys = {});

/// The arrays' names, ascending, without reading any of them. Throws FileError as readNpz().
std::vector<std::string> npzKeys(const std::string& path);

/// Writes a deflated .npz under a temporary name, then renames. Same arrays, same bytes (fixed
/// dates, sorted keys). Throws FileError when the folder can't be written, std::invalid_argument
/// when an array's bytes don't fit its shape or there is no array.
void writeNpz(const std::string& path, const NpzArrays& arrays);

/// A .npy file that becomes an array of an .npz.
struct NpyFile {
  std::string path;
  bool deflate = true;  ///< false: stored as it is, for floats whose digits are noise anyway
};

/// writeNpz() for arrays that are .npy files already (NpyFileWriter), key → file: in constant
/// memory, however large they are. Throws as writeNpz().
void writeNpzFromFiles(const std::string& path, const std::map<std::string, NpyFile>& files);

}  // namespace avatar
