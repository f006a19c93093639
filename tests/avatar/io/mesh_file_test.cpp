#include "avatar/io/mesh_file.h"

#include "avatar/geometry/adjacency.h"
#include "avatar/geometry/measures.h"
#include "avatar/io/file_error.h"
#include "tests/support/primitive_meshes.h"
#include "tests/support/temporary_folder.h"

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include <array>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <stdexcept>

namespace avatar {
namespace {

using test::TemporaryFolder;

void write(const std::string& path, const std::string& bytes) {
  std::ofstream(path, std::ios::binary) << bytes;
}

std::string bytesOf(const std::string& path) {
  std::ostringstream bytes;
  bytes << std::ifstream(path, std::ios::binary).rdbuf();
  return bytes.str();
}

/// A sleeve of 0.1 m radius and 0.3 m length.
TriangleMesh sleeve() {
  return test::cylinder(0.1, 0.3, 12, 6);
}

Eigen::Matrix3Xd rainbow(Eigen::Index count) {
  Eigen::Matrix3Xd colors(3, count);
  for (Eigen::Index v = 0; v < count; ++v) {
    colors.col(v) << static_cast<double>(v % 5) / 4.0, 0.25, static_cast<double>(v % 3) / 2.0;
  }
  return colors;
}

/// The message of the FileError that reading must raise; it begins with the file's name.
std::string errorOf(const std::string& path, const MeshReadOptions& options = {}) {
  try {
    readMesh(path, options);
  } catch (const FileError& error) {
    EXPECT_EQ(std::string(error.what()).rfind(path + ": ", 0), 0U) << error.what();
    return error.what();
  }
  ADD_FAILURE() << path << ": no FileError";
  return "";
}

bool contains(const std::string& text, const std::string& part) {
  return text.find(part) != std::string::npos;
}

template <typename T>
void appendRaw(std::string& bytes, T value) {
  std::array<char, sizeof(T)> raw{};
  std::memcpy(raw.data(), &value, sizeof value);
  bytes.append(raw.data(), raw.size());
}

/// A binary glTF of a sleeve under two nodes, the inner one mirrored along x.
std::string mirroredSleeveGlb() {
  const TriangleMesh mesh = sleeve();
  std::string buffer;
  for (const double value : mesh.vertices.reshaped()) {
    appendRaw(buffer, static_cast<float>(value));
  }
  const std::size_t positionBytes = buffer.size();
  for (const int value : mesh.faces.reshaped()) {
    appendRaw(buffer, static_cast<std::uint16_t>(value));
  }
  const nlohmann::json gltf = {
      {"asset", {{"version", "2.0"}}},
      {"scene", 0},
      {"scenes", {{{"nodes", {0}}}}},
      {"nodes",
       {{{"children", {1}}, {"translation", {0.0, 1.0, 0.0}}},
        {{"mesh", 0}, {"scale", {-1.0, 1.0, 1.0}}}}},
      {"meshes", {{{"primitives", {{{"attributes", {{"POSITION", 0}}}, {"indices", 1}}}}}}},
      {"accessors",
       {{{"bufferView", 0},
         {"componentType", 5126},
         {"count", mesh.numVertices()},
         {"type", "VEC3"}},
        {{"bufferView", 1},
         {"componentType", 5123},
         {"count", 3 * mesh.numFaces()},
         {"type", "SCALAR"}}}},
      {"bufferViews",
       {{{"buffer", 0}, {"byteOffset", 0}, {"byteLength", positionBytes}},
        {{"buffer", 0},
         {"byteOffset", positionBytes},
         {"byteLength", buffer.size() - positionBytes}}}},
      {"buffers", {{{"byteLength", buffer.size()}}}}};
  std::string json = gltf.dump();
  json.append((4 - json.size() % 4) % 4, ' ');
  std::string bytes = "glTF";
  appendRaw(bytes, std::uint32_t{2});
  appendRaw(bytes, static_cast<std::uint32_t>(28 + json.size() + buffer.size()));
  appendRaw(bytes, static_cast<std::uint32_t>(json.size()));
  bytes += "JSON" + json;
  appendRaw(bytes, static_cast<std::uint32_t>(buffer.size()));
  bytes.append("BIN\0", 4);
  return bytes + buffer;
}

std::string binaryStl(const TriangleMesh& mesh) {
  std::string bytes(80, '\0');
  appendRaw(bytes, static_cast<std::uint32_t>(mesh.numFaces()));
  for (Eigen::Index face = 0; face < mesh.numFaces(); ++face) {
    bytes.append(12, '\0');  // the normal
    for (const int corner : mesh.faces.col(face)) {
      for (const double coordinate : mesh.vertices.col(corner)) {
        appendRaw(bytes, static_cast<float>(coordinate));
      }
    }
    bytes.append(2, '\0');
  }
  return bytes;
}

TEST(ReadMesh, AWrittenObjReadsBackEqual) {
  const TemporaryFolder folder;
  const std::string path = folder.path("sleeve.obj");
  const TriangleMesh mesh = sleeve();
  writeObj(path, mesh, rainbow(mesh.numVertices()));
  const MeshFile file = readMesh(path);
  EXPECT_EQ(file.mesh.vertices, mesh.vertices);
  EXPECT_EQ(file.mesh.faces, mesh.faces);
  // Colours pass through assimp's single precision.
  EXPECT_LT((file.vertexColors - rainbow(mesh.numVertices())).cwiseAbs().maxCoeff(), 1e-6);
  EXPECT_TRUE(file.warnings.empty());
}

TEST(ReadMesh, AWrittenPlyReadsBackInSinglePrecision) {
  const TemporaryFolder folder;
  const std::string path = folder.path("sleeve.PLY");
  const TriangleMesh mesh = sleeve();
  writePly(path, mesh, rainbow(mesh.numVertices()));
  const MeshFile file = readMesh(path);
  EXPECT_EQ(file.mesh.vertices, mesh.vertices.cast<float>().cast<double>());
  EXPECT_EQ(file.mesh.faces, mesh.faces);
  // Half a level of 8 bits.
  EXPECT_LT(
      (file.vertexColors - rainbow(mesh.numVertices())).cwiseAbs().maxCoeff(), 0.5 / 255.0 + 1e-6);
}

TEST(ReadMesh, KeepsTheOrderOfAnObjsVLines) {
  const TemporaryFolder folder;
  const std::string path = folder.path("patch.obj");
  // The faces use the vertices backwards; line 2 is unused, line 5 a texture seam's double of 3.
  // Quads, negative and slashed indices, a group, a comment, a tab, a plus sign.
  write(
      path,
      "# patch\no cloth\nv 0 0 0\nv 9 9 9\nv 0.1 0 0\nv\t0.1 +0.1 0\nv 0.1 0 0\nvt 0 0\n"
      "v 0 1e-1 0\nv 0.2 0 0\nv 0.2 0.1 0\ng a\nf 8 4 5 7\nusemtl b\nf -3/1 -8/1 3/1 -5/1\n");
  const MeshFile file = readMesh(path);
  EXPECT_EQ(file.vertexOfFile, (std::vector<int>{0, -1, 1, 2, 1, 3, 4, 5}));
  Eigen::Matrix3Xd expected(3, 6);
  expected << 0, 0.1, 0.1, 0, 0.2, 0.2, 0, 0, 0.1, 0.1, 0, 0.1, 0, 0, 0, 0, 0, 0;
  EXPECT_EQ(file.mesh.vertices, expected);
  EXPECT_EQ(file.mesh.numFaces(), 4);
  EXPECT_NEAR(totalArea(file.mesh), 0.02, 1e-15);
}

TEST(ReadMesh, TriangulatesAConcavePolygonInsideIt) {
  const TemporaryFolder folder;
  const std::string path = folder.path("arrow.obj");
  write(path, "v 0 0 0\nv 1 0 0\nv 0.2 0.2 0\nv 0 1 0\nf 1 2 3 4\n");
  // The shoelace formula; a fan from the first corner gives it too, one from the second doesn't.
  EXPECT_NEAR(totalArea(readMesh(path).mesh), 0.2, 1e-15);
}

TEST(ReadMesh, AppliesTheTransformsOfNodes) {
  const TemporaryFolder folder;
  const std::string path = folder.path("sleeve.glb");
  write(path, mirroredSleeveGlb());
  TriangleMesh expected = sleeve();
  expected.vertices = expected.vertices.cast<float>().cast<double>();
  expected.vertices.row(0) *= -1.0;
  expected.vertices.row(1).array() += 1.0;
  const TriangleMesh mesh = readMesh(path).mesh;
  // One addition of single precision.
  EXPECT_LT((mesh.vertices - expected.vertices).cwiseAbs().maxCoeff(), 1e-7);
  // Mirrored, yet facing outwards as before.
  for (Eigen::Index face = 0; face < mesh.numFaces(); ++face) {
    Eigen::Vector3d centre = mesh.vertices(Eigen::all, mesh.faces.col(face)).rowwise().mean();
    centre -= Eigen::Vector3d(0.0, 1.0, centre.z());
    EXPECT_GT(doubleAreaVector(mesh, face).dot(centre), 0.0);
  }
}

TEST(ReadMesh, WeldsTheTrianglesOfAnStl) {
  const TemporaryFolder folder;
  const std::string path = folder.path("sleeve.stl");
  write(path, binaryStl(sleeve()));
  const MeshFile file = readMesh(path);
  EXPECT_EQ(file.mesh.numVertices(), sleeve().numVertices());
  EXPECT_EQ(topology(file.mesh.faces, file.mesh.numVertices()).boundaryLoops, 2);
}

TEST(ReadMesh, SaysWhichUnitASizeLooksLike) {
  const TemporaryFolder folder;
  const std::string path = folder.path("shirt.obj");
  TriangleMesh mesh = sleeve();
  const auto scaled = [&](double scale) {
    writeObj(path, {Eigen::Matrix3Xd(scale * mesh.vertices), mesh.faces});
  };
  scaled(1000.0);
  EXPECT_TRUE(contains(errorOf(path), "looks like millimetres; use --unit mm"));
  const MeshReadOptions millimetres{.unit = LengthUnit::kMillimetre};
  EXPECT_LT((readMesh(path, millimetres).mesh.vertices - mesh.vertices).norm(), 1e-14);
  scaled(100.0);
  EXPECT_TRUE(contains(errorOf(path), "looks like centimetres; use --unit cm"));
  scaled(1.0);
  EXPECT_TRUE(contains(errorOf(path, millimetres), "looks like metres; use --unit m"));
  scaled(1e6);
  EXPECT_TRUE(contains(errorOf(path), "scale it to metres"));
}

TEST(ReadMesh, RefusesEdgesOfThreeFacesAndSaysWhere) {
  const TemporaryFolder folder;
  const std::string path = folder.path("fin.obj");
  write(path, "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 -1 0\nv 0 0 1\nf 1 2 3\nf 2 1 4\nf 1 2 5\n");
  const std::string error = errorOf(path);
  EXPECT_TRUE(contains(error, "1 edge has more than two faces, at (0.5, 0, 0) m")) << error;
  EXPECT_EQ(readMesh(path, {.requireSurface = false}).mesh.numFaces(), 3);
}

TEST(ReadMesh, CountsWhatItLeavesOut) {
  const TemporaryFolder folder;
  const std::string path = folder.path("mixed.obj");
  write(path, "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 1 1 0\nf 1 2 3\nf 3 2 1\nf 4 3 2\nl 1 2 3\np 4\n");
  EXPECT_EQ(
      readMesh(path).warnings,
      (std::vector<std::string>{"1 point left out", "2 lines left out", "1 doubled face dropped"}));
}

TEST(ReadMesh, RefusesWhatIsNoMesh) {
  const TemporaryFolder folder;
  EXPECT_TRUE(contains(errorOf(folder.path("none.obj")), "no such file"));
  EXPECT_TRUE(contains(errorOf(folder.path("shirt.docx")), "expected .obj"));
  const std::string path = folder.path("a.obj");
  for (const char* bytes : {"", "hello\n", "v 0 0 0\nv 1 0 0\nv 0 1 0\n", "v 1 2 3\nf 1 1 1\n"}) {
    write(path, bytes);
    EXPECT_FALSE(errorOf(path).empty()) << bytes;
  }
  write(path, "v 0 0 0\nv nan 0 0\nv 0 1 0\nf 1 2 3\n");
  EXPECT_FALSE(errorOf(path).empty());
  write(folder.path("folder.obj/x"), "");
  std::filesystem::create_directory(folder.path("folder.ply"));
  EXPECT_FALSE(errorOf(folder.path("folder.ply")).empty());
}

/// Cuts and changed bytes: an error or a mesh, and whatever is read is a proper mesh.
void expectNoCrash(const std::string& path, const std::string& bytes, std::uint64_t seed) {
  constexpr int kFiles = 120;
  test::Noise noise(seed);
  const auto position = [&](std::size_t size) {
    return static_cast<std::size_t>(0.4999 * (noise.next() + 1.0) * static_cast<double>(size));
  };
  int refused = 0;
  for (int i = 0; i < kFiles; ++i) {
    std::string garbled = bytes;
    if (i % 2 == 0) {
      garbled.resize(position(bytes.size()));
    } else {
      garbled[position(bytes.size())] = static_cast<char>(position(256));
    }
    write(path, garbled);
    try {
      const MeshFile file = readMesh(path);
      EXPECT_GT(file.mesh.numFaces(), 0);
      EXPECT_NO_THROW(requireValid(file.mesh, "test"));
    } catch (const FileError&) {
      ++refused;
    }
  }
  EXPECT_GT(refused, 0);
}

TEST(ReadMesh, DamagedFilesNeverCrash) {
  const TemporaryFolder folder;
  const TriangleMesh mesh = sleeve();
  writeObj(folder.path("good.obj"), mesh);
  expectNoCrash(folder.path("bad.obj"), bytesOf(folder.path("good.obj")), 1);
  writePly(folder.path("good.ply"), mesh);
  expectNoCrash(folder.path("bad.ply"), bytesOf(folder.path("good.ply")), 2);
  expectNoCrash(folder.path("bad.glb"), mirroredSleeveGlb(), 3);
  expectNoCrash(folder.path("bad.stl"), binaryStl(mesh), 4);
}

TEST(ReadMesh, APlyCannotAnnounceMoreThanItHolds) {
  const TemporaryFolder folder;
  const std::string path = folder.path("huge.ply");
  const std::string header = "ply\nformat ascii 1.0\nelement vertex ";
  write(path, header + "2000000000\nproperty float x\nend_header\n0 0 0\n");
  EXPECT_TRUE(contains(errorOf(path), "truncated"));
  write(path, header + "1\nproperty list int float x\nend_header\n2000000000 0\n");
  EXPECT_TRUE(contains(errorOf(path), "truncated"));
}

TEST(WriteMesh, LeavesNothingBehindWhenItFails) {
  const TemporaryFolder folder;
  EXPECT_THROW(writeObj(folder.path(), sleeve()), FileError);
  EXPECT_THROW(writePly(folder.path(), sleeve()), FileError);
  EXPECT_THROW(writeObj(folder.path("a.obj"), sleeve(), rainbow(3)), std::invalid_argument);
  EXPECT_TRUE(std::filesystem::is_empty(folder.path()));
}

TEST(LengthUnit, IsNamedInTheProgramsOptions) {
  EXPECT_EQ(parseLengthUnit("cm"), LengthUnit::kCentimetre);
  EXPECT_THROW(parseLengthUnit("inch"), std::invalid_argument);
  EXPECT_THROW(readMesh("a.obj", {.weldTolerance = 0.0}), std::invalid_argument);
}

}  // namespace
}  // namespace avatar
