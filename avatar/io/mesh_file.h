#pragma once

#include "avatar/geometry/mesh.h"

#include <Eigen/Core>

#include <string>
#include <string_view>
#include <vector>

namespace avatar {

/// The length that a file's numbers count. Mesh files don't say it; metres are the convention.
enum class LengthUnit { kMetre, kCentimetre, kMillimetre };

/// "m", "cm" or "mm". Throws std::invalid_argument for anything else.
LengthUnit parseLengthUnit(std::string_view text);

struct MeshReadOptions {
  LengthUnit unit = LengthUnit::kMetre;
  /// Vertices nearer to each other are one [m], 1e-6 (single precision's rounding) … 0.01. Formats
  /// that store texture coordinates and normals per vertex double the vertices along their seams.
  double weldTolerance = 1e-5;
  /// Refuse meshes that are no surface: edges with more than two faces, one-sided strips. Clothes
  /// must be surfaces; to fit a body to a mesh, or to look at one, it need not be.
  bool requireSurface = true;

  /// Throws std::invalid_argument when a value is out of its range.
  void validate() const;
};

struct MeshFile {
  TriangleMesh mesh;              ///< welded, without degenerate or doubled faces, oriented [m]
  Eigen::Matrix3Xd vertexColors;  ///< 3 × V display values in [0, 1]; empty: the file has none
  /// The vertex that each of the file's became, −1 = dropped. OBJ: of each `v` line; otherwise of
  /// each vertex in the order of the file's meshes, as assimp reports them.
  std::vector<int> vertexOfFile;
  std::vector<std::string> warnings;  ///< what was left out or mended, one sentence each
};

/// True when the name ends in .obj, .ply, .stl, .glb or .gltf, in any case.
bool isMeshFile(const std::string& path);

/// Reads all triangles and polygons of a mesh file into one mesh, with the transforms of its nodes.
/// Vertices keep their order: of the `v` lines of an OBJ (and their full precision), of the first
/// occurrence otherwise. glTF's skins and morphs stay at rest. Throws FileError naming the file,
/// what is wrong and what to do: not readable, another format than its name says, truncated, no
/// triangles, numbers that aren't finite, a size that no garment or body has (below 1 cm or above
/// 10 m: another unit), and, with requireSurface, what is no surface, with the places. Throws
/// std::invalid_argument on invalid options.
///
/// Files are parsed by assimp. Sizes, counts and ranges that a file states are checked beforehand
/// against what it holds, since assimp trusts many of them.
MeshFile readMesh(const std::string& path, const MeshReadOptions& options = {});

/// Writes an OBJ that reads back with equal vertices and faces; colours (3 × V display values, or
/// empty) follow the coordinates, as MeshLab and others read them. Whole or not at all. Throws
/// FileError, and std::invalid_argument on an invalid mesh or another number of colours.
void writeObj(
    const std::string& path, const MeshView& mesh, const Eigen::Matrix3Xd& vertexColors = {});

/// Writes a binary PLY: single precision, colours in 8 bits. Throws as writeObj().
void writePly(
    const std::string& path, const MeshView& mesh, const Eigen::Matrix3Xd& vertexColors = {});

}  // namespace avatar
