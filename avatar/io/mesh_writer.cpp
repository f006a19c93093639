#include "avatar/io/atomic_file.h"
#include "avatar/io/mesh_file.h"

#include <algorithm>
#include <array>
#include <bit>
#include <charconv>
#include <cmath>
#include <cstdint>
#include <stdexcept>
#include <string>

namespace avatar {
namespace {

void requireWritable(const MeshView& mesh, const Eigen::Matrix3Xd& colors, const char* who) {
  requireValid(mesh, who);
  if (colors.cols() != 0 && colors.cols() != mesh.numVertices()) {
    throw std::invalid_argument(
        std::string(who) + ": as many colours as vertices are needed, or none");
  }
}

/// The shortest text that reads back as the same double.
void appendNumber(std::string& bytes, double value) {
  std::array<char, 32> digits{};
  const auto [end, error] = std::to_chars(digits.data(), digits.data() + digits.size(), value);
  bytes += ' ';
  bytes.append(digits.data(), end);
}

void appendLittleEndian(std::string& bytes, std::uint32_t value) {
  for (int shift = 0; shift < 32; shift += 8) {
    bytes += static_cast<char>(static_cast<unsigned char>(value >> shift));
  }
}

void appendColor(std::string& bytes, const Eigen::Vector3d& color) {
  for (const double channel : color) {
    const double level = std::round(255.0 * std::clamp(channel, 0.0, 1.0));
    bytes += static_cast<char>(static_cast<unsigned char>(level));
  }
}

std::string plyHeader(const MeshView& mesh, bool withColors) {
  std::string header = "ply\nformat binary_little_endian 1.0\nelement vertex " +
                       std::to_string(mesh.numVertices()) +
                       "\nproperty float x\nproperty float y\nproperty float z\n";
  if (withColors) {
    header += "property uchar red\nproperty uchar green\nproperty uchar blue\n";
  }
  return header + "element face " + std::to_string(mesh.numFaces()) +
         "\nproperty list uchar int vertex_indices\nend_header\n";
}

}  // namespace

void writeObj(const std::string& path, const MeshView& mesh, const Eigen::Matrix3Xd& vertexColors) {
  requireWritable(mesh, vertexColors, "writeObj");
  std::string bytes;
  for (Eigen::Index v = 0; v < mesh.numVertices(); ++v) {
    bytes += 'v';
    for (const double coordinate : mesh.vertices.col(v)) {
      appendNumber(bytes, coordinate);
    }
    for (int axis = 0; axis < 3 && vertexColors.cols() > 0; ++axis) {
      appendNumber(bytes, vertexColors(axis, v));
    }
    bytes += '\n';
  }
  for (Eigen::Index face = 0; face < mesh.numFaces(); ++face) {
    bytes += 'f';
    for (const int corner : mesh.faces.col(face)) {
      bytes += ' ' + std::to_string(corner + 1);
    }
    bytes += '\n';
  }
  writeFileAtomically(path, bytes);
}

void writePly(const std::string& path, const MeshView& mesh, const Eigen::Matrix3Xd& vertexColors) {
  requireWritable(mesh, vertexColors, "writePly");
  std::string bytes = plyHeader(mesh, vertexColors.cols() > 0);
  for (Eigen::Index v = 0; v < mesh.numVertices(); ++v) {
    for (const double coordinate : mesh.vertices.col(v)) {
      appendLittleEndian(bytes, std::bit_cast<std::uint32_t>(static_cast<float>(coordinate)));
    }
    if (vertexColors.cols() > 0) {
      appendColor(bytes, vertexColors.col(v));
    }
  }
  for (Eigen::Index face = 0; face < mesh.numFaces(); ++face) {
    bytes += '\3';
    for (const int corner : mesh.faces.col(face)) {
      appendLittleEndian(bytes, static_cast<std::uint32_t>(corner));
    }
  }
  writeFileAtomically(path, bytes);
}

}  // namespace avatar
