#include "avatar/io/mesh_file.h"

#include "avatar/geometry/adjacency.h"
#include "avatar/geometry/measures.h"
#include "avatar/geometry/mesh_cleanup.h"
#include "avatar/io/file_error.h"
#include "avatar/io/mesh_format_check.h"
#include "avatar/io/mesh_scene.h"

#include <algorithm>
#include <array>
#include <cctype>
#include <charconv>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <stdexcept>
#include <utility>

namespace avatar {
namespace {

struct Unit {
  const char* name;
  const char* plural;
  LengthUnit unit;
  double metres;
};

constexpr std::array<Unit, 3> kUnits = {
    {{"m", "metres", LengthUnit::kMetre, 1.0},
     {"cm", "centimetres", LengthUnit::kCentimetre, 0.01},
     {"mm", "millimetres", LengthUnit::kMillimetre, 0.001}}};

double metresOf(LengthUnit unit) {
  return std::find_if(kUnits.begin(), kUnits.end(), [&](const Unit& u) { return u.unit == unit; })
      ->metres;
}

std::string pointText(double value) {
  std::ostringstream stream;
  stream.precision(3);
  stream << value;
  return stream.str();
}

std::string pointText(const Eigen::Vector3d& point) {
  return "(" + pointText(point.x()) + ", " + pointText(point.y()) + ", " + pointText(point.z()) +
         ")";
}

std::string counted(int count, const std::string& singular, const std::string& plural) {
  return std::to_string(count) + " " + (count == 1 ? singular : plural);
}

std::string extensionOf(const std::string& path) {
  std::string extension = std::filesystem::path(path).extension().string();
  std::transform(extension.begin(), extension.end(), extension.begin(), [](unsigned char c) {
    return static_cast<char>(std::tolower(c));
  });
  return extension;
}

std::string readMeshBytes(const std::string& path) {
  constexpr std::uintmax_t kLargest = std::uintmax_t{1} << 29;  // a million vertices take 0.1 GB
  std::error_code error;
  if (!std::filesystem::is_regular_file(path, error)) {
    throw FileError(path, "", "there is no such file; check the name");
  }
  const std::uintmax_t size = std::filesystem::file_size(path, error);
  if (!error && size > kLargest) {
    throw FileError(path, "", "is larger than 512 MiB; reduce the mesh first");
  }
  std::ifstream file(path, std::ios::binary);
  std::string bytes(error ? 0 : static_cast<std::size_t>(size), '\0');
  file.read(bytes.data(), static_cast<std::streamsize>(bytes.size()));
  if (error || !file) {
    throw FileError(path, "", "cannot be read; check its permissions");
  }
  return bytes;
}

/// The next number of a line, behind blanks; false when there is none.
bool takeNumber(std::string_view& line, double& value) {
  line.remove_prefix(std::min(line.find_first_not_of(" \t"), line.size()));
  line.remove_prefix(line.starts_with('+') ? 1 : 0);  // from_chars knows no plus
  const auto [end, error] = std::from_chars(line.data(), line.data() + line.size(), value);
  line.remove_prefix(static_cast<std::size_t>(end - line.data()));
  return error == std::errc();
}

/// The `v` lines of an OBJ, 3 × n, up to the first that has no three numbers.
Eigen::Matrix3Xd objPositions(std::string_view bytes) {
  std::vector<Eigen::Vector3d> positions;
  while (!bytes.empty()) {
    const std::size_t end = std::min(bytes.find_first_of("\r\n"), bytes.size());
    std::string_view line = bytes.substr(0, end);
    bytes.remove_prefix(std::min(end + 1, bytes.size()));
    if (!line.starts_with("v ") && !line.starts_with("v\t")) {
      continue;
    }
    line.remove_prefix(1);
    Eigen::Vector3d position;
    if (!takeNumber(line, position.x()) || !takeNumber(line, position.y()) ||
        !takeNumber(line, position.z())) {
      break;
    }
    positions.push_back(position);
  }
  Eigen::Matrix3Xd result(3, static_cast<Eigen::Index>(positions.size()));
  for (std::size_t i = 0; i < positions.size(); ++i) {
    result.col(static_cast<Eigen::Index>(i)) = positions[i];
  }
  return result;
}

/// Puts the positions of the `v` lines before assimp's copies of them, one per face corner and in
/// single precision. Welding then finds the lines first: their order and digits stay.
void prependPositions(MeshScene& scene, const Eigen::Matrix3Xd& positions) {
  Eigen::Matrix3Xd vertices(3, positions.cols() + scene.vertices.cols());
  vertices << positions, scene.vertices;
  scene.vertices = std::move(vertices);
  scene.faces.array() += static_cast<int>(positions.cols());
}

class MeshReader {
 public:
  MeshReader(const std::string& path, const MeshReadOptions& options)
      : path_(path), options_(options) {}

  MeshFile run() {
    readScene();
    requireTriangles();
    CleanedMesh cleaned = cleanMesh({scene_.vertices, scene_.faces}, options_.weldTolerance);
    requireSize(cleaned.mesh);
    requireSurface(cleaned.mesh);
    MeshFile file;
    file.vertexColors = colorsOf(cleaned);
    file.warnings = warningsOf(cleaned);
    file.mesh = std::move(cleaned.mesh);
    file.vertexOfFile = std::move(cleaned.vertexOfInput);
    file.vertexOfFile.resize(static_cast<std::size_t>(numFileVertices_));
    return file;
  }

 private:
  [[noreturn]] void fail(const std::string& problem) const { throw FileError(path_, "", problem); }

  void readScene() {
    const std::string extension = extensionOf(path_);
    if (!isMeshFile(path_)) {
      fail("is no mesh file by its name; expected .obj, .ply, .stl, .glb or .gltf");
    }
    const std::string bytes = readMeshBytes(path_);
    requireMeshFormat(path_, extension, bytes);
    scene_ = readMeshScene(path_);
    numFileVertices_ = scene_.vertices.cols();
    if (extension == ".obj") {
      const Eigen::Matrix3Xd positions = objPositions(bytes);
      prependPositions(scene_, positions);
      numFileVertices_ = positions.cols();
    }
    scene_.vertices *= metresOf(options_.unit);
  }

  void requireTriangles() const {
    if (scene_.faces.cols() == 0) {
      fail(
          "holds no triangles (" + counted(scene_.points, "point", "points") + ", " +
          counted(scene_.lines, "line", "lines") + "); expected a surface");
    }
    if (!scene_.vertices.allFinite()) {
      fail("holds coordinates that are not finite; export it again");
    }
  }

  void requireSize(const TriangleMesh& mesh) const {
    constexpr double kSmallest = 0.01;  // [m]
    constexpr double kLargest = 10.0;   // [m]
    if (mesh.numFaces() == 0) {
      fail("holds no triangle with an area; expected a surface");
    }
    const double size = boundingBox(mesh).sizes().maxCoeff();
    if (size < kSmallest || size > kLargest) {
      fail(
          "measures " + pointText(size) + " m, expected 0.01 to 10 m; " +
          unitAdvice(size / metresOf(options_.unit)));
    }
  }

  /// The unit in which the size is nearest to that of clothes, a factor of ten to either side.
  static std::string unitAdvice(double sizeInFile) {
    constexpr double kTypical = 0.8;  // [m]
    const auto misfit = [&](const Unit& unit) {
      return std::abs(std::log10(sizeInFile * unit.metres / kTypical));
    };
    const auto* const best =
        std::min_element(kUnits.begin(), kUnits.end(), [&](const Unit& a, const Unit& b) {
          return misfit(a) < misfit(b);
        });
    return misfit(*best) > 1.0
               ? "scale it to metres"
               : std::string("this looks like ") + best->plural + "; use --unit " + best->name;
  }

  void requireSurface(const TriangleMesh& mesh) const {
    if (!options_.requireSurface) {
      return;
    }
    const Adjacency adjacency = buildAdjacency(mesh.faces, mesh.numVertices());
    const std::vector<int> edges = nonManifoldEdges(adjacency);
    if (!edges.empty()) {
      fail(nonManifoldText(mesh, adjacency, edges));
    }
    if (!faceSides(mesh.faces, adjacency).consistent) {
      fail("holds a surface with one side only (a Möbius strip); cut it open");
    }
  }

  static std::string nonManifoldText(
      const TriangleMesh& mesh, const Adjacency& adjacency, const std::vector<int>& edges) {
    constexpr std::size_t kMaxPlaces = 3;
    std::string places;
    for (std::size_t i = 0; i < std::min(kMaxPlaces, edges.size()); ++i) {
      const Eigen::Vector2i ends = adjacency.edges.col(edges[i]);
      places += (i > 0 ? ", " : "") +
                pointText(0.5 * (mesh.vertices.col(ends[0]) + mesh.vertices.col(ends[1])));
    }
    return counted(static_cast<int>(edges.size()), "edge has", "edges have") +
           " more than two faces, at " + places + (edges.size() > kMaxPlaces ? ", …" : "") +
           " m; cloth is one sheet: delete inner faces or cut the sheets apart there";
  }

  /// Of several vertices at one place, the first one's colour.
  Eigen::Matrix3Xd colorsOf(const CleanedMesh& cleaned) const {
    if (scene_.colors.cols() == 0) {
      return {};
    }
    const auto first = static_cast<std::size_t>(scene_.vertices.cols() - scene_.colors.cols());
    Eigen::Matrix3Xd colors(3, cleaned.mesh.numVertices());
    for (std::size_t v = cleaned.vertexOfInput.size(); v-- > first;) {
      const int vertex = cleaned.vertexOfInput[v];
      if (vertex >= 0) {
        colors.col(vertex) = scene_.colors.col(static_cast<Eigen::Index>(v - first));
      }
    }
    return colors.array().isFinite().select(colors.array(), 0.0).cwiseMax(0.0).cwiseMin(1.0);
  }

  std::vector<std::string> warningsOf(const CleanedMesh& cleaned) const {
    std::vector<std::string> warnings;
    const auto warn = [&](int count, const char* singular, const char* plural) {
      if (count > 0) {
        warnings.push_back(counted(count, singular, plural));
      }
    };
    warn(scene_.points, "point left out", "points left out");
    warn(scene_.lines, "line left out", "lines left out");
    warn(cleaned.degenerateFaces, "face without area dropped", "faces without area dropped");
    warn(cleaned.duplicateFaces, "doubled face dropped", "doubled faces dropped");
    warn(cleaned.turnedFaces, "face turned round", "faces turned round");
    return warnings;
  }

  const std::string& path_;
  MeshReadOptions options_;
  MeshScene scene_;
  Eigen::Index numFileVertices_ = 0;
};

}  // namespace

LengthUnit parseLengthUnit(std::string_view text) {
  for (const Unit& unit : kUnits) {
    if (text == unit.name) {
      return unit.unit;
    }
  }
  throw std::invalid_argument(
      "unknown unit of length '" + std::string(text) + "'; expected m, cm or mm");
}

void MeshReadOptions::validate() const {
  if (!(weldTolerance >= 1e-6 && weldTolerance <= 0.01)) {
    throw std::invalid_argument("MeshReadOptions: weldTolerance must be 1e-6 to 0.01 m");
  }
}

bool isMeshFile(const std::string& path) {
  constexpr std::array<std::string_view, 5> kExtensions = {".obj", ".ply", ".stl", ".glb", ".gltf"};
  return std::find(kExtensions.begin(), kExtensions.end(), extensionOf(path)) != kExtensions.end();
}

MeshFile readMesh(const std::string& path, const MeshReadOptions& options) {
  options.validate();
  return MeshReader(path, options).run();
}

}  // namespace avatar
