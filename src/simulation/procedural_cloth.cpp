#include "src/simulation/procedural_cloth.h"

#include <Eigen/Geometry>

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>
#include <set>
#include <stdexcept>
#include <string>

namespace simulcap {
namespace {

/// Whole pieces of about `length` in `extent`, at least `least`.
int pieces(double extent, double length, int least) {
  return std::max(least, static_cast<int>(std::lround(extent / length)));
}

/// Height of an equilateral triangle over its edge.
constexpr double kRowHeight = 0.5 * std::numbers::sqrt3;

/// Collects vertices by their coordinates and faces by their corners.
class ClothBuilder {
 public:
  int addVertex(double u, double v) {
    coordinates_.emplace_back(u, v);
    return static_cast<int>(coordinates_.size()) - 1;
  }

  void addFace(int a, int b, int c) { faces_.emplace_back(a, b, c); }

  /// With places found from the coordinates.
  template <typename Place>
  ProceduralCloth cloth(const Place& place) const {
    ProceduralCloth result;
    const auto numVertices = static_cast<Eigen::Index>(coordinates_.size());
    result.coordinates.resize(2, numVertices);
    result.mesh.vertices.resize(3, numVertices);
    for (Eigen::Index v = 0; v < numVertices; ++v) {
      const Eigen::Vector2d& at = coordinates_[static_cast<std::size_t>(v)];
      result.coordinates.col(v) = at;
      result.mesh.vertices.col(v) = place(at.x(), at.y());
    }
    result.mesh.faces.resize(3, static_cast<Eigen::Index>(faces_.size()));
    for (std::size_t face = 0; face < faces_.size(); ++face)
      result.mesh.faces.col(static_cast<Eigen::Index>(face)) = faces_[face];
    return result;
  }

 private:
  std::vector<Eigen::Vector2d> coordinates_;
  std::vector<Eigen::Vector3i> faces_;
};

/// Joins two rows of vertices, each ascending in u, by a strip of triangles: the row that is behind
/// advances; of two that are level, the one with the shorter way to go.
void addStrip(
    ClothBuilder& builder,
    const std::vector<int>& lower,
    const std::vector<int>& upper,
    const std::vector<double>& lowerU,
    const std::vector<double>& upperU) {
  std::size_t i = 0;
  std::size_t j = 0;
  const auto lowerAdvances = [&] {
    if (i + 1 == lower.size() || j + 1 == upper.size())
      return j + 1 == upper.size();
    return lowerU[i] != upperU[j] ? lowerU[i] < upperU[j] : lowerU[i + 1] < upperU[j + 1];
  };
  while (i + 1 < lower.size() || j + 1 < upper.size()) {
    if (lowerAdvances()) {
      builder.addFace(lower[i], lower[i + 1], upper[j]);
      ++i;
    } else {
      builder.addFace(lower[i], upper[j + 1], upper[j]);
      ++j;
    }
  }
}

/// u of a row: even rows divide the width evenly, odd ones are shifted by half an edge.
std::vector<double> rowCoordinates(int columns, bool isOdd) {
  std::vector<double> u;
  for (int i = 0; i <= columns; ++i)
    u.push_back(static_cast<double>(i) / columns);
  if (isOdd) {
    for (int i = columns; i >= 1; --i)
      u[static_cast<std::size_t>(i)] -= 0.5 / columns;
    u.push_back(1.0);
  }
  return u;
}

bool isAt(double coordinate, double value) {
  constexpr double kRounding = 1e-9;
  return std::abs(coordinate - value) < kRounding;
}

/// Is the vertex on every edge that the name is made of?
bool isOn(const std::string& name, const Eigen::Vector2d& at) {
  const auto names = [&name](const char* edge) { return name.find(edge) != std::string::npos; };
  return (!names("top") || isAt(at.y(), 1.0)) && (!names("bottom") || isAt(at.y(), 0.0)) &&
         (!names("left") || isAt(at.x(), 0.0)) && (!names("right") || isAt(at.x(), 1.0));
}

}  // namespace

ProceduralCloth makeSheet(const ClothSheet& sheet) {
  const int columns = pieces(sheet.width, sheet.edgeLength, 1);
  // An even number of rows, so that top and bottom are alike.
  const int rows = 2 * pieces(sheet.height, 2.0 * kRowHeight * sheet.edgeLength, 1);
  ClothBuilder builder;
  std::vector<int> below;
  std::vector<double> belowU;
  for (int row = 0; row <= rows; ++row) {
    const std::vector<double> u = rowCoordinates(columns, row % 2 == 1);
    std::vector<int> vertices;
    vertices.reserve(u.size());
    for (const double x : u)
      vertices.push_back(builder.addVertex(x, static_cast<double>(row) / rows));
    if (row > 0)
      addStrip(builder, below, vertices, belowU, u);
    below = vertices;
    belowU = u;
  }
  return builder.cloth([&sheet](double u, double v) {
    return Eigen::Vector3d((u - 0.5) * sheet.width, (v - 0.5) * sheet.height, 0.0);
  });
}

ProceduralCloth makeTube(const ClothTube& tube) {
  const int columns = pieces(2.0 * std::numbers::pi * tube.radius, tube.edgeLength, 3);
  const int rows = pieces(tube.height, kRowHeight * tube.edgeLength, 1);
  ClothBuilder builder;
  for (int row = 0; row <= rows; ++row) {
    for (int i = 0; i < columns; ++i)
      builder.addVertex((i + 0.5 * (row % 2)) / columns, static_cast<double>(row) / rows);
  }
  const auto vertex = [columns](int row, int i) { return row * columns + (i + columns) % columns; };
  for (int row = 0; row < rows; ++row) {
    // Odd rows are half an edge ahead.
    const int aheadBelow = row % 2;
    for (int i = 0; i < columns; ++i) {
      builder.addFace(vertex(row, i), vertex(row, i + 1), vertex(row + 1, i + aheadBelow));
      builder.addFace(vertex(row, i + 1 - aheadBelow), vertex(row + 1, i + 1), vertex(row + 1, i));
    }
  }
  return builder.cloth([&tube](double u, double v) {
    const double angle = 2.0 * std::numbers::pi * u;  // from +z towards +x
    return Eigen::Vector3d(
        tube.radius * std::sin(angle), (v - 0.5) * tube.height, tube.radius * std::cos(angle));
  });
}

Eigen::Matrix3Xd twisted(const ProceduralCloth& cloth, double turns) {
  Eigen::Matrix3Xd result = cloth.mesh.vertices;
  for (Eigen::Index v = 0; v < result.cols(); ++v) {
    const double angle = 2.0 * std::numbers::pi * turns * (1.0 - cloth.coordinates(1, v));
    result.col(v) = Eigen::AngleAxisd(angle, Eigen::Vector3d::UnitY()) * result.col(v);
  }
  return result;
}

std::vector<int> pinnedVertices(const ProceduralCloth& cloth, const std::vector<Pin>& pins) {
  static const std::set<std::string> kNames = {
      "top", "bottom", "left", "right", "top_left", "top_right", "bottom_left", "bottom_right"};
  std::set<int> vertices;
  for (const Pin& pin : pins) {
    if (const int* index = std::get_if<int>(&pin)) {
      if (*index < 0 || *index >= cloth.mesh.numVertices())
        throw std::invalid_argument(
            "pin " + std::to_string(*index) + ": the cloth has the vertices 0 to " +
            std::to_string(cloth.mesh.numVertices() - 1));
      vertices.insert(*index);
      continue;
    }
    const std::string& name = std::get<std::string>(pin);
    if (kNames.count(name) == 0)
      throw std::invalid_argument("pin " + name + ": there is no such edge or corner");
    for (int v = 0; v < static_cast<int>(cloth.mesh.numVertices()); ++v) {
      if (isOn(name, cloth.coordinates.col(v)))
        vertices.insert(v);
    }
  }
  return {vertices.begin(), vertices.end()};
}

}  // namespace simulcap
